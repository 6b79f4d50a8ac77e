"""The fifth family's rig: its equations put together."""

from typing import Final

from hil.reference.bundle.disturbance import HEALTHY
from hil.reference.bundle.integrate import integrate
from hil.reference.bundle.physics import draw_session, draw_unit
from hil.reference.bundle.sensing import readings
from hil.reference.bundle.timing import lost, set_points, stamped
from hil.reference.plant import Build, Seeds

BUILD: Final = Build(
    name="bundle",
    seeds=Seeds(unit=7307, day=2861, noise=8513),
    healthy=HEALTHY,
    step_s=0.0005,  # halving it moves the angle by less than 0.15 degrees
    settle_s=3.0,
    travel="+-68 degrees",
    draw_unit=draw_unit,
    draw_session=draw_session,
    set_points=set_points,
    integrate=integrate,
    stamped=stamped,
    readings=readings,
    lost=lost,
)

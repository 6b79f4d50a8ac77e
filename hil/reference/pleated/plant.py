"""The third family's rig: its equations put together."""

from typing import Final

from hil.reference.plant import Build, Seeds
from hil.reference.pleated.disturbance import HEALTHY
from hil.reference.pleated.integrate import integrate
from hil.reference.pleated.physics import draw_session, draw_unit
from hil.reference.pleated.sensing import readings
from hil.reference.pleated.timing import lost, set_points, stamped

BUILD: Final = Build(
    name="pleated",
    seeds=Seeds(unit=3571, day=8209, noise=5303),
    healthy=HEALTHY,
    step_s=0.0005,  # halving it moves the angle by less than 0.15 degrees
    settle_s=3.0,
    travel="+-75 degrees",
    draw_unit=draw_unit,
    draw_session=draw_session,
    set_points=set_points,
    integrate=integrate,
    stamped=stamped,
    readings=readings,
    lost=lost,
)

"""The ninth family's rig: its equations put together."""

from typing import Final

from hil.reference.plant import Build, Seeds
from hil.reference.pouch.disturbance import HEALTHY
from hil.reference.pouch.integrate import integrate
from hil.reference.pouch.physics import draw_session, draw_unit
from hil.reference.pouch.sensing import readings
from hil.reference.pouch.timing import lost, set_points, stamped

BUILD: Final = Build(
    name="pouch",
    seeds=Seeds(unit=7019, day=2861, noise=5503),
    healthy=HEALTHY,
    step_s=0.0005,  # halving it moves the angle by less than 0.15 degrees
    settle_s=2.5,
    travel="+-60 degrees",
    draw_unit=draw_unit,
    draw_session=draw_session,
    set_points=set_points,
    integrate=integrate,
    stamped=stamped,
    readings=readings,
    lost=lost,
)

"""The fourth family's rig: its equations put together."""

from typing import Final

from hil.reference.bellows.disturbance import HEALTHY
from hil.reference.bellows.integrate import integrate
from hil.reference.bellows.physics import draw_session, draw_unit
from hil.reference.bellows.sensing import readings
from hil.reference.bellows.timing import lost, set_points, stamped
from hil.reference.plant import Build, Seeds

BUILD: Final = Build(
    name="bellows",
    seeds=Seeds(unit=6121, day=9337, noise=4903),
    healthy=HEALTHY,
    step_s=0.0005,  # halving it moves the angle by less than 0.15 degrees
    settle_s=3.0,
    travel="+-80 degrees",
    draw_unit=draw_unit,
    draw_session=draw_session,
    set_points=set_points,
    integrate=integrate,
    stamped=stamped,
    readings=readings,
    lost=lost,
)

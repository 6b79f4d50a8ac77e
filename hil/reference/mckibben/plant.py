"""The first family's rig: its equations put together."""

from typing import Final

from hil.reference.mckibben.disturbance import HEALTHY
from hil.reference.mckibben.integrate import integrate
from hil.reference.mckibben.physics import draw_session, draw_unit
from hil.reference.mckibben.sensing import readings
from hil.reference.mckibben.timing import lost, set_points, stamped
from hil.reference.plant import Build, Seeds

BUILD: Final = Build(
    name="mckibben",
    seeds=Seeds(unit=1913, day=4021, noise=7741),
    healthy=HEALTHY,
    step_s=0.0005,  # halving it moves the angle by less than 0.1 degrees
    settle_s=2.0,
    travel="+-170 degrees",
    draw_unit=draw_unit,
    draw_session=draw_session,
    set_points=set_points,
    integrate=integrate,
    stamped=stamped,
    readings=readings,
    lost=lost,
)

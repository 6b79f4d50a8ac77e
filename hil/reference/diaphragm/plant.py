"""The eighth family's rig: its equations put together."""

from typing import Final

from hil.reference.diaphragm.disturbance import HEALTHY
from hil.reference.diaphragm.integrate import integrate
from hil.reference.diaphragm.physics import draw_session, draw_unit
from hil.reference.diaphragm.sensing import readings
from hil.reference.diaphragm.timing import lost, set_points, stamped
from hil.reference.plant import Build, Seeds

BUILD: Final = Build(
    name="diaphragm",
    seeds=Seeds(unit=6007, day=1723, noise=9811),
    healthy=HEALTHY,
    step_s=0.0005,  # halving it moves the angle by less than 0.15 degrees
    settle_s=2.5,
    travel="+-63 degrees",
    draw_unit=draw_unit,
    draw_session=draw_session,
    set_points=set_points,
    integrate=integrate,
    stamped=stamped,
    readings=readings,
    lost=lost,
)

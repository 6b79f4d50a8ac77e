"""The sixth family's rig: its equations put together."""

from typing import Final

from hil.reference.plant import Build, Seeds
from hil.reference.sleeve.disturbance import HEALTHY
from hil.reference.sleeve.integrate import integrate
from hil.reference.sleeve.physics import draw_session, draw_unit
from hil.reference.sleeve.sensing import readings
from hil.reference.sleeve.timing import lost, set_points, stamped

BUILD: Final = Build(
    name="sleeve",
    seeds=Seeds(unit=8273, day=2917, noise=6659),
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

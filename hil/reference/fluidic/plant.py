"""The second family's rig: its equations put together."""

from typing import Final

from hil.reference.fluidic.disturbance import HEALTHY
from hil.reference.fluidic.integrate import CONTROL_STEPS, integrate
from hil.reference.fluidic.physics import draw_session, draw_unit
from hil.reference.fluidic.sensing import readings
from hil.reference.fluidic.timing import lost, set_points, stamped
from hil.reference.plant import Build, Seeds

BUILD: Final = Build(
    name="fluidic",
    seeds=Seeds(unit=2719, day=6203, noise=9907),
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
    even=CONTROL_STEPS,
)

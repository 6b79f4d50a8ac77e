"""The seventh family's rig: its equations put together."""

from typing import Final

from hil.reference.airbeam.disturbance import HEALTHY
from hil.reference.airbeam.integrate import integrate
from hil.reference.airbeam.physics import draw_session, draw_unit
from hil.reference.airbeam.sensing import readings
from hil.reference.airbeam.timing import lost, set_points, stamped
from hil.reference.plant import Build, Seeds

BUILD: Final = Build(
    name="airbeam",
    seeds=Seeds(unit=4937, day=8513, noise=3259),
    healthy=HEALTHY,
    step_s=0.0005,  # halving it moves the angle by less than 0.15 degrees
    settle_s=3.0,
    travel="+-74 degrees",
    draw_unit=draw_unit,
    draw_session=draw_session,
    set_points=set_points,
    integrate=integrate,
    stamped=stamped,
    readings=readings,
    lost=lost,
)

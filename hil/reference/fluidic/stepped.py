"""The second family's rig one period at a time: the same equations and instruments, for a controller in the loop."""

from typing import Any, cast

import numpy as np

from hil.reference.compiling import Array, State, compiled
from hil.reference.fluidic.disturbance import RigLaw
from hil.reference.fluidic.integrate import CONTROL_STEPS, rest, settle, step
from hil.reference.fluidic.mechanics import ANGLE
from hil.reference.fluidic.physics import ATMOSPHERE_MPA, Physics
from hil.reference.fluidic.pneumatics import PRESSURE, VALVE_STATES
from hil.reference.fluidic.sensing import COUNT_DEG, bent, monitor_reading, noise_deg
from hil.reference.stepping import REST_MPA, SteppedPlant


@compiled
def advance(set_1_mpa: Array, set_2_mpa: Array, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """The rig under set-points on the internal grid, shape (n,) with n a multiple of CONTROL_STEPS."""
    for i in range(len(set_1_mpa)):
        step(set_1_mpa[i], set_2_mpa[i], i % CONTROL_STEPS == 0, s, physics, rig, dt_s)


class Stepped(SteppedPlant):
    """See hil.reference.stepping."""

    timing = ("delay_s",)
    reading = ("gain", "gain_uneven", "bend_deg", "bend_even", "ripple_deg", "ripple_per_deg", "offset_deg")
    most_rad = 1.4
    pressures = (PRESSURE, VALVE_STATES + PRESSURE)
    angle = ANGLE

    def settled(self, steps: int) -> State:
        """See hil.reference.stepping."""
        day = self._session
        state = cast(Any, rest(REST_MPA, REST_MPA, day.warm))
        settle(REST_MPA, REST_MPA, steps, state, day.physics, self._disturbance.rig, self._step_s)
        return cast(State, state)

    def advance(self, set_1_mpa: Array, set_2_mpa: Array, time_s: float, state: State) -> None:
        """See hil.reference.stepping."""
        advance(set_1_mpa, set_2_mpa, state, self._session.physics, self._disturbance.rig, self._step_s)

    def noise_deg(self, n: int) -> Array:
        """See hil.reference.stepping."""
        return noise_deg(n, self._period_s, self._random)

    def monitored(self, valve: int, pressure_mpa: Array) -> float:
        """See hil.reference.stepping."""
        day = self._session
        bias_mpa, gain = ((day.monitor_bias_1_mpa, day.monitor_gain_1), (day.monitor_bias_2_mpa, day.monitor_gain_2))[
            valve
        ]
        return float(monitor_reading(pressure_mpa - ATMOSPHERE_MPA, bias_mpa, gain, self._period_s, self._random)[0])

    def read_deg(self, angle_deg: Array) -> float:
        """See hil.reference.stepping."""
        law = self._disturbance.reading
        reading = bent(angle_deg, law, self._session) + self._session.angle_offset_deg + law.offset_deg
        return float(np.floor((reading[0] + self._noise.next()) / COUNT_DEG + 0.5) * COUNT_DEG)

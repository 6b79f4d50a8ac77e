"""The first family's rig one period at a time: the same equations and instruments, for a controller in the loop."""

from typing import Any

from hil.reference.compiling import Array, State, compiled
from hil.reference.mckibben.disturbance import RigLaw
from hil.reference.mckibben.integrate import rest, step
from hil.reference.mckibben.mechanics import ANGLE, RELAX, SLIP
from hil.reference.mckibben.physics import ATMOSPHERE_MPA, Physics
from hil.reference.mckibben.pneumatics import PRESSURE, VALVE_STATES
from hil.reference.mckibben.sensing import bent, converted, monitor_reading, noise_deg
from hil.reference.stepping import REST_MPA, SteppedPlant


@compiled
def settled(mpa: float, steps: int, dt_s: float, warm: float, physics: Physics, rig: RigLaw) -> Any:
    """The state after so many internal steps with both set-points there; slow springs are put at ease half-way."""
    s: Any = rest(mpa, mpa, physics)
    for i in range(steps):
        step(mpa, mpa, -1.0, warm, s, physics, rig, dt_s)
        if i == steps // 2:
            s[RELAX : RELAX + 4] = s[ANGLE]
            s[SLIP : SLIP + 4] = s[ANGLE]
    return s


@compiled
def advance(
    set_1_mpa: Array, set_2_mpa: Array, time_s: float, warm: float, s: State, physics: Physics, rig: RigLaw, dt_s: float
) -> None:
    """The rig under set-points on the internal grid, shape (n,), from `time_s` on."""
    for i in range(len(set_1_mpa)):
        step(set_1_mpa[i], set_2_mpa[i], time_s + i * dt_s, warm, s, physics, rig, dt_s)


class Stepped(SteppedPlant):
    """See hil.reference.stepping."""

    timing = ("delay_s", "delay_spread")
    reading = ("gain", "gain_bend", "bend_deg", "bend_rad", "offset_deg", "step_deg", "step_uneven")
    most_rad = 3.0
    pressures = (PRESSURE, VALVE_STATES + PRESSURE)
    angle = ANGLE

    def settled(self, steps: int) -> State:
        """See hil.reference.stepping."""
        day = self._session
        state: State = settled(REST_MPA, steps, self._step_s, day.warm, day.physics, self._disturbance.rig)
        return state

    def advance(self, set_1_mpa: Array, set_2_mpa: Array, time_s: float, state: State) -> None:
        """See hil.reference.stepping."""
        day = self._session
        advance(set_1_mpa, set_2_mpa, time_s, day.warm, state, day.physics, self._disturbance.rig, self._step_s)

    def noise_deg(self, n: int) -> Array:
        """See hil.reference.stepping."""
        return noise_deg(n, self._period_s, self._random)

    def monitored(self, valve: int, pressure_mpa: Array) -> float:
        """See hil.reference.stepping."""
        bias_mpa = (self._session.monitor_bias_1_mpa, self._session.monitor_bias_2_mpa)[valve]
        return float(monitor_reading(pressure_mpa - ATMOSPHERE_MPA, bias_mpa, self._period_s, self._random)[0])

    def read_deg(self, angle_deg: Array) -> float:
        """See hil.reference.stepping."""
        law = self._disturbance.reading
        reading = bent(angle_deg, law, self._session) + self._session.angle_offset_deg + law.offset_deg
        return float(converted(reading + self._noise.next(), law)[0])

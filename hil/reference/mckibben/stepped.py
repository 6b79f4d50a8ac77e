"""The first family's rig one period at a time: the same equations and instruments, for a controller in the loop."""

import math
from typing import Any, Final

import numpy as np

from hil.reference.compiling import Array, State, compiled
from hil.reference.disturbance import Disturbance
from hil.reference.mckibben.disturbance import RigLaw
from hil.reference.mckibben.integrate import rest, step
from hil.reference.mckibben.mechanics import ANGLE, RELAX, SLIP
from hil.reference.mckibben.physics import ATMOSPHERE_MPA, Physics, Session
from hil.reference.mckibben.pneumatics import PRESSURE, VALVE_STATES
from hil.reference.mckibben.sensing import bent, converted, monitor_reading, noise_deg
from hil.reference.plant import Plant
from hil.reference.stepping import REST_MPA, Blocks, LateSetPoints, require_without_memory
from rig.errors import RigError

_MOST_RAD: Final = 3.0
_TIMING: Final = ("delay_s", "delay_spread")
_SENSOR: Final = ("gain", "gain_bend", "bend_deg", "bend_rad", "offset_deg", "step_deg", "step_uneven")


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


class Stepped:
    """See hil.reference.families.Stepped."""

    def __init__(
        self, plant: Plant, session: Session, disturbance: Disturbance, period_s: float, noise_seed: int
    ) -> None:
        require_without_memory(disturbance.timing, _TIMING, "the timing")
        require_without_memory(disturbance.reading, _SENSOR, "the reading")
        self._session, self._disturbance, self._period_s, self._zero_rad = (
            session,
            disturbance,
            period_s,
            plant.zero_rad,
        )
        substeps = plant.build.substeps(period_s)
        settling = round(plant.build.settle_s / plant.build.step_s)
        self._step_s = period_s / substeps
        self._random = np.random.default_rng(np.random.SeedSequence((7741, session.seed, noise_seed)))
        self._noise = Blocks(lambda n: noise_deg(n, period_s, self._random))
        self._set_points = LateSetPoints(disturbance.timing.delay_s, self._step_s, substeps)
        self._state = settled(REST_MPA, settling, self._step_s, session.warm, session.physics, disturbance.rig)
        self._ticks = 0

    def step(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> tuple[float, float, float]:
        """p1, p2 (MPa) and angle (deg) as read one period later."""
        session, state = self._session, self._state
        due = self._set_points.sent(p1_cmd_mpa, p2_cmd_mpa)
        advance(
            *due, self._ticks * self._period_s, session.warm, state, session.physics, self._disturbance.rig,
            self._step_s
        )  # fmt: skip
        self._ticks += 1
        if not abs(state[ANGLE]) < _MOST_RAD:
            raise RigError(f"physics plant: the joint left +-170 degrees at {self._ticks * self._period_s:.2f} s")
        return self._monitor(0, session.monitor_bias_1_mpa), self._monitor(1, session.monitor_bias_2_mpa), self._angle()

    def _monitor(self, valve: int, bias_mpa: float) -> float:
        pressure = np.array([self._state[valve * VALVE_STATES + PRESSURE] - ATMOSPHERE_MPA])
        return float(monitor_reading(pressure, bias_mpa, self._period_s, self._random)[0])

    def _angle(self) -> float:
        law = self._disturbance.reading
        angle = np.array([math.degrees(self._state[ANGLE] - self._zero_rad)])
        reading = bent(angle, law, self._session) + self._session.angle_offset_deg + law.offset_deg
        return float(converted(reading + self._noise.next(), law)[0])

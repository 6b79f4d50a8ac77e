"""The second family's rig one period at a time: the same equations and instruments, for a controller in the loop."""

import math
from typing import Any, Final, cast

import numpy as np

from hil.reference.compiling import Array, State, compiled
from hil.reference.disturbance import Disturbance
from hil.reference.fluidic.disturbance import RigLaw
from hil.reference.fluidic.integrate import CONTROL_STEPS, rest, settle, step
from hil.reference.fluidic.mechanics import ANGLE
from hil.reference.fluidic.physics import ATMOSPHERE_MPA, Physics, Session
from hil.reference.fluidic.pneumatics import PRESSURE, VALVE_STATES
from hil.reference.fluidic.sensing import COUNT_DEG, bent, monitor_reading, noise_deg
from hil.reference.plant import Plant
from hil.reference.stepping import REST_MPA, Blocks, LateSetPoints, require_without_memory
from rig.errors import RigError

_MOST_RAD: Final = 1.4
_TIMING: Final = ("delay_s",)
_READING: Final = ("gain", "gain_uneven", "bend_deg", "bend_even", "ripple_deg", "ripple_per_deg", "offset_deg")


@compiled
def advance(set_1_mpa: Array, set_2_mpa: Array, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """The rig under set-points on the internal grid, shape (n,) with n a multiple of CONTROL_STEPS."""
    for i in range(len(set_1_mpa)):
        step(set_1_mpa[i], set_2_mpa[i], i % CONTROL_STEPS == 0, s, physics, rig, dt_s)


class Stepped:
    """See hil.reference.families.Stepped."""

    def __init__(
        self, plant: Plant, session: Session, disturbance: Disturbance, period_s: float, noise_seed: int
    ) -> None:
        require_without_memory(disturbance.timing, _TIMING, "the timing")
        require_without_memory(disturbance.reading, _READING, "the reading")
        self._session, self._disturbance, self._period_s, self._zero_rad = (
            session,
            disturbance,
            period_s,
            plant.zero_rad,
        )
        substeps = plant.build.substeps(period_s)
        settling = round(plant.build.settle_s / plant.build.step_s)
        self._step_s = period_s / substeps
        self._random = np.random.default_rng(np.random.SeedSequence((9907, session.seed, noise_seed)))
        self._noise = Blocks(lambda n: noise_deg(n, period_s, self._random))
        self._set_points = LateSetPoints(disturbance.timing.delay_s, self._step_s, substeps)
        self._state = cast(Any, rest(REST_MPA, REST_MPA, session.warm))
        settle(REST_MPA, REST_MPA, settling, self._state, session.physics, disturbance.rig, self._step_s)
        self._ticks = 0

    def step(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> tuple[float, float, float]:
        """p1, p2 (MPa) and angle (deg) as read one period later."""
        session, state = self._session, self._state
        due = self._set_points.sent(p1_cmd_mpa, p2_cmd_mpa)
        advance(*due, state, session.physics, self._disturbance.rig, self._step_s)
        self._ticks += 1
        if not abs(state[ANGLE]) < _MOST_RAD:
            raise RigError(f"fluidic plant: the joint left +-80 degrees at {self._ticks * self._period_s:.2f} s")
        return (
            self._monitor(0, session.monitor_bias_1_mpa, session.monitor_gain_1),
            self._monitor(1, session.monitor_bias_2_mpa, session.monitor_gain_2),
            self._angle(),
        )

    def _monitor(self, valve: int, bias_mpa: float, gain: float) -> float:
        pressure = np.array([self._state[valve * VALVE_STATES + PRESSURE] - ATMOSPHERE_MPA])
        return float(monitor_reading(pressure, bias_mpa, gain, self._period_s, self._random)[0])

    def _angle(self) -> float:
        law = self._disturbance.reading
        angle = np.array([math.degrees(self._state[ANGLE] - self._zero_rad)])
        reading = bent(angle, law, self._session) + self._session.angle_offset_deg + law.offset_deg
        return float(np.floor((reading[0] + self._noise.next()) / COUNT_DEG + 0.5) * COUNT_DEG)

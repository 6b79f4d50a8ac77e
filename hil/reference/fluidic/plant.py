"""The second family's rig as a function: set-points, day and disturbance in, one record's columns out."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from hil.reference.compiling import Array
from hil.reference.fluidic.disturbance import HEALTHY, Disturbance
from hil.reference.fluidic.integrate import integrate
from hil.reference.fluidic.physics import Physics, Session, draw_session, draw_unit
from hil.reference.fluidic.sensing import angle_reading, monitor_reading, pink
from hil.reference.fluidic.timing import delayed, lost, stamped
from rig.errors import RigError

STEP_S: Final = 0.0005
"""Internal step: halving it moves the angle by less than 0.15 degrees."""
SETTLE_S: Final = 3.0
SET_POINT_NOISE_MPA: Final = 0.0001
"""What the regulators add to their set-points."""


@dataclass(frozen=True)
class Plant:
    """One unit: a healthy rig with its own parameters, its angle counted from where it rests at P0 = 0.2 MPa."""

    physics: Physics
    zero_rad: float

    def session(self, seed: int, drift: float = 0.004) -> Session:
        """A day on this unit; `drift` is the relative standard deviation of what drifts (0.004 to 0.02)."""
        return draw_session(self.physics, drift, np.random.default_rng(np.random.SeedSequence((6203, seed))))

    def still(self) -> Session:
        """A day without any drift, as the unit was built."""
        return Session(self.physics)

    def simulate(
        self,
        p1_cmd_mpa: Array,
        p2_cmd_mpa: Array,
        period_s: float,
        session: Session,
        disturbance: Disturbance = HEALTHY,
        noise_seed: int = 0,
    ) -> dict[str, Array]:
        """One record; see hil.reference.families.Unit."""
        random = np.random.default_rng(np.random.SeedSequence((9907, session.seed, noise_seed)))
        p1, p2, angle = stamped(
            _true_motion(p1_cmd_mpa, p2_cmd_mpa, period_s, session, disturbance, random), period_s, disturbance.timing
        )
        columns = np.array([
            monitor_reading(p1, session.monitor_bias_1_mpa, session.monitor_gain_1, period_s, random),
            monitor_reading(p2, session.monitor_bias_2_mpa, session.monitor_gain_2, period_s, random),
            angle_reading(angle - self.zero_rad, disturbance.reading, session, period_s, random),
        ])  # fmt: skip
        p1, p2, angle = lost(columns, disturbance.timing, random)
        return {
            "t_s": np.arange(len(p1_cmd_mpa)) * period_s, "p1_cmd_mpa": p1_cmd_mpa, "p2_cmd_mpa": p2_cmd_mpa,
            "dp_cmd_mpa": p1_cmd_mpa - p2_cmd_mpa, "p1_mpa": p1, "p2_mpa": p2, "angle_deg": angle,
        }  # fmt: skip


def make_plant(unit_seed: int) -> Plant:
    """The unit of that number; the same number gives the same unit."""
    physics = draw_unit(np.random.default_rng(np.random.SeedSequence((2719, unit_seed))))
    quiet = np.full(round(0.5 / STEP_S), 0.2)
    out = integrate(quiet, quiet, len(quiet), round(SETTLE_S / STEP_S), STEP_S, 0.0, physics, HEALTHY.rig)
    return Plant(physics, float(out[2, 0]))


def _true_motion(
    p1_mpa: Array,
    p2_mpa: Array,
    period_s: float,
    session: Session,
    disturbance: Disturbance,
    random: np.random.Generator,
) -> Array:
    """Pressures at the muscles (MPa) and joint angle (rad) at each tick, shape (3, n), before any instrument."""
    n, substeps = len(p1_mpa), max(2, 2 * round(0.5 * period_s / STEP_S))
    set_1, set_2 = (
        delayed(p + pink(n, SET_POINT_NOISE_MPA, period_s, random), substeps, period_s, disturbance.timing, random)
        for p in (p1_mpa, p2_mpa)
    )
    step_s = period_s / substeps
    out = integrate(
        set_1, set_2, substeps, round(SETTLE_S / step_s), step_s, session.warm, session.physics, disturbance.rig
    )
    if not np.isfinite(out).all():
        raise RigError(
            f"fluidic plant: the joint left +-80 degrees at {np.isfinite(out[2]).sum() * period_s:.2f} s; use a "
            "smaller effect or command"
        )
    return out

"""What every family's rig does alike, whatever its physics: set-points on the internal grid, motion, readings, in that
order.

A family brings a `Build`: its equations and what happens to set-points and readings on their way. A `ReferencePlant`
is one unit.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator, SeedSequence, default_rng

from hil.reference.compiling import Array
from hil.reference.disturbance import Disturbance
from hil.reference.own_zero import from_own_zero, rest_rows, resting_before
from rig.errors import RigError


class PlantDay(NamedTuple):
    """What a day brings to a unit: the drifted rig, and the errors of its instruments; which of them, the family
    says."""

    physics: Any
    """The family's own parameters, as they are on this day."""
    monitor_bias_1_mpa: float = 0.0
    monitor_bias_2_mpa: float = 0.0
    monitor_gain_1: float = 1.0
    monitor_gain_2: float = 1.0
    angle_offset_deg: float = 0.0
    angle_gain: float = 1.0
    warm: float = 0.0
    """How warm the muscles are when a record starts, 0..1."""
    seed: int = 0


@dataclass(frozen=True)
class Seeds:
    """Roots of the family's own random numbers: of its units, its days, and the noise of records."""

    unit: int
    day: int
    noise: int


@dataclass(frozen=True)
class Build:
    """The physics of one family. Physics and laws are the family's own named tuples."""

    name: str
    seeds: Seeds
    healthy: Disturbance
    step_s: float
    """Internal step."""
    settle_s: float
    """For how long the first set-points stand before a record."""
    travel: str
    """Beyond which angle the equations end, for the message."""
    draw_unit: Callable[[Generator], Any]
    draw_session: Callable[[Any, float, Generator], PlantDay]
    """(physics, relative standard deviation of what drifts, chance) -> a day."""
    set_points: Callable[[Array, Array, int, float, Any, Generator], tuple[Array, Array]]
    """(p1, p2 in MPa, internal steps a period, period in s, timing law, chance) -> both on the internal grid."""
    integrate: Callable[..., Array]
    """(set-points, internal steps a period and before the record, step in s, day's warmth, physics, rig law) -> p1, p2
    in MPa and the angle in rad at each tick, shape (3, n)."""
    stamped: Callable[[Array, float, Any], Array]
    """(columns, period in s, timing law) -> columns by the readings' clock."""
    readings: Callable[[Array, Any, PlantDay, float, Generator], Array]
    """(columns, reading law, day, period in s, chance) -> p1, p2 in MPa, angle in deg as recorded."""
    lost: Callable[[Array, Any, Generator], Array]
    """(columns, timing law, chance) -> columns with readings lost on the way."""
    even: int = 1
    """Internal steps come in multiples of this."""

    def substeps(self, period_s: float) -> int:
        """Internal steps a period."""
        return self.even * max(1, round(period_s / (self.even * self.step_s)))


@dataclass(frozen=True)
class ReferencePlant:
    """One unit: a healthy rig with its own parameters, its angle counted from where it rests at P0 = 0.2 MPa."""

    build: Build
    physics: Any
    zero_rad: float
    own_zero: bool = False
    """Each record counts the angle from where the joint rested before it, and not from there."""

    def session(self, seed: int, drift: float = 0.004) -> PlantDay:
        """A day on this unit; `drift` is the relative standard deviation of what drifts (0.004 to 0.02)."""
        return self.build.draw_session(self.physics, drift, default_rng(SeedSequence((self.build.seeds.day, seed))))

    def still(self) -> PlantDay:
        """A day without any drift, as the unit was built."""
        return PlantDay(self.physics)

    def simulate(
        self,
        p1_cmd_mpa: Array,
        p2_cmd_mpa: Array,
        period_s: float,
        session: PlantDay,
        disturbance: Disturbance | None = None,
        noise_seed: int = 0,
    ) -> dict[str, Array]:
        """One record; see hil.reference.families.Unit."""
        build, wrong = self.build, disturbance or self.build.healthy
        rest = rest_rows(period_s) if self.own_zero else 0
        p1_cmd_mpa, p2_cmd_mpa = (resting_before(column, rest) for column in (p1_cmd_mpa, p2_cmd_mpa))
        random = default_rng(SeedSequence((build.seeds.noise, session.seed, noise_seed)))
        motion = _true_motion(build, (p1_cmd_mpa, p2_cmd_mpa), period_s, session, wrong, random)
        motion = build.stamped(motion, period_s, wrong.timing)
        motion[2] -= self.zero_rad
        columns = build.readings(motion, wrong.reading, session, period_s, random)
        p1, p2, angle = build.lost(columns, wrong.timing, random)
        record = {
            "t_s": np.arange(len(p1_cmd_mpa)) * period_s, "p1_cmd_mpa": p1_cmd_mpa, "p2_cmd_mpa": p2_cmd_mpa,
            "dp_cmd_mpa": p1_cmd_mpa - p2_cmd_mpa, "p1_mpa": p1, "p2_mpa": p2, "angle_deg": angle,
        }  # fmt: skip
        return from_own_zero(record, rest, period_s) if self.own_zero else record


def varied(nominal: dict[str, float], spreads: Mapping[str, float], random: Generator) -> dict[str, float]:
    """The parameters of another rig of the build: each off by chance, by its relative standard deviation, twice that at
    most."""
    off = {
        name: float(np.exp(spread * np.clip(random.standard_normal(), -2.0, 2.0))) for name, spread in spreads.items()
    }
    return {name: value * off.get(name, 1.0) for name, value in nominal.items()}


def make_plant(build: Build, unit_seed: int, own_zero: bool = False) -> ReferencePlant:
    """The unit of that number; the same number gives the same unit."""
    physics, step_s = build.draw_unit(default_rng(SeedSequence((build.seeds.unit, unit_seed)))), build.step_s
    quiet = np.full(round(0.5 / step_s), 0.2)
    settling = round(build.settle_s / step_s)
    out = build.integrate(quiet, quiet, len(quiet), settling, step_s, 0.0, physics, build.healthy.rig)
    return ReferencePlant(build, physics, float(out[2, 0]), own_zero)


def _true_motion(
    build: Build,
    set_points_mpa: tuple[Array, Array],
    period_s: float,
    session: PlantDay,
    disturbance: Disturbance,
    random: Generator,
) -> Array:
    """Pressures (MPa) and joint angle (rad) at each tick, shape (3, n), before any instrument."""
    substeps = build.substeps(period_s)
    step_s = period_s / substeps
    set_1, set_2 = build.set_points(*set_points_mpa, substeps, period_s, disturbance.timing, random)
    settling = round(build.settle_s / step_s)
    out = build.integrate(set_1, set_2, substeps, settling, step_s, session.warm, session.physics, disturbance.rig)
    if not np.isfinite(out).all():
        raise RigError(
            f"{build.name} plant: the joint left {build.travel} at {np.isfinite(out[2]).sum() * period_s:.2f} s; use a "
            "smaller effect or command"
        )
    return out

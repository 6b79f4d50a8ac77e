"""The response model: how one rig answers, described beside the Bouc-Wen muscles closely enough to stand for a day of
its records.

Each regulator as a dead time and two lags, the muscles as a ridge bank of low-passes and plays on the drive, the
joint's balance as Maxwell-slip friction, viscous friction and inertia over the stiffness.
`rig.identify.response.response_fit` fits it; nothing is fitted here.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rig.model.compiled.columns import Ends, Joint, balanced, drive, pulled_to, settled
from rig.model.compiled.response import propagated, regulated
from rig.model.equations.joint_balance import LOOP_RADII_DEG, MOST_SOFTER_PER_DEG, MOST_SOFTER_PER_DEG2
from rig.model.fingerprint import Fingerprint
from rig.model.parameters import Model, StageKind, regulator_times_s
from rig.record import Column

Regulator = tuple[float, float, float]
"""Dead time, time constant of filling, time constant of exhausting; s."""


@dataclass(frozen=True)
class Balance:
    """The numbers of `rig.model.equations.joint_balance`, and the equilibrium angle as a polynomial of the drive."""

    viscous_s: float
    inertia_s: float
    """Square root of inertia over stiffness."""
    slip: tuple[float, ...]
    """Maxwell-slip weights, one for each of LOOP_RADII_DEG."""
    curve: tuple[float, float, float]
    """Equilibrium angle by powers of the drive: deg/MPa, deg/MPa^2, deg/MPa^3."""

    def stage_numbers(self) -> dict[str, float]:
        """The same under the names of the effect stages that solve the balance again."""
        slip = {f"loop_{j + 1}": weight for j, weight in enumerate(self.slip)}
        return slip | {"viscous_time_s": self.viscous_s, "inertia_time_s": self.inertia_s} | self._softer()

    def _softer(self) -> dict[str, float]:
        """How much further a torque turns the joint at another angle, to the first two orders: as a change of the drive
        does, which is a torque of the muscles."""
        first, second, third = self.curve
        if first == 0.0:
            return {}
        even, odd = second / first**2, third / first**3
        softer, softer_out = 2.0 * even, 3.0 * odd - 2.0 * even**2
        return {
            "softer": min(max(softer, -MOST_SOFTER_PER_DEG), MOST_SOFTER_PER_DEG),
            "softer_out": min(max(softer_out, -MOST_SOFTER_PER_DEG2), MOST_SOFTER_PER_DEG2),
        }


REGULATOR_TERMS = 8
"""Numbers of a regulator's correction, see `regulator_terms`."""
TYPICAL_REGULATOR: Regulator = (0.005, 0.05, 0.05)
"""A regulator of which nothing is known."""
NO_FRICTION = Balance(0.0, 0.0, (0.0,) * len(LOOP_RADII_DEG), (0.0, 0.0, 0.0))


@dataclass(frozen=True, eq=False)
class ResponseModel:
    """How the rig answers; the drive is d = (p1 - p2) (2 P0 / (p1 + p2))^exponent."""

    p0_mpa: float
    regulators: tuple[Regulator, Regulator]
    weights: Column
    """(RESPONSE_TERMS,) of the bank."""
    balance: Balance
    misfit_deg: float
    """What the bank leaves of the angles that it was fitted to, rms."""
    exponent: float = 1.0
    """How the mean pressure divides the drive."""
    corrections: tuple[Column, ...] = ()
    """(REGULATOR_TERMS,) of each valve: what its monitor shows beside the regulator; none where that is not known."""
    zero_deg: float = 0.0
    """What the sensor shows where nothing moves the joint: motion counts from there."""

    @cached_property
    def tau0_s(self) -> float:
        """Mean time constant of the regulators."""
        return float(np.mean([tau for regulator in self.regulators for tau in regulator[1:]]))

    @cached_property
    def stage_numbers(self) -> dict[str, float]:
        """What effects act on, under the names of the stages' numbers."""
        return {"p0_mpa": self.p0_mpa, "tau0_s": self.tau0_s} | self.balance.stage_numbers()

    def pressures(self, u1: Column, u2: Column, dt_s: float) -> tuple[Column, Column]:
        """Both regulators' pressures (MPa) under set-points (MPa); all (n,)."""
        return regulated(u1, *self.regulators[0], dt_s), regulated(u2, *self.regulators[1], dt_s)

    def monitored(self, u1: Column, u2: Column, dt_s: float) -> tuple[Column, Column]:
        """What both monitors show (MPa) under set-points (MPa): the regulators' pressures with their corrections; all
        (n,)."""
        p1, p2 = self.pressures(u1, u2, dt_s)
        if not self.corrections:
            return p1, p2
        first, second = self.corrections
        return (
            p1 + regulator_terms(p1, self.p0_mpa, dt_s) @ first,
            p2 + regulator_terms(p2, self.p0_mpa, dt_s) @ second,
        )

    def angle(self, p1: Column, p2: Column, dt_s: float) -> Column:
        """The angle (deg) of the bank under pressures (MPa); all (n,)."""
        angle: Column = propagated(p1, p2, self.p0_mpa, self.exponent, dt_s, self.weights)
        return angle

    def equilibrium(self, p1: Column, p2: Column) -> Column:
        """The angle (deg) to which the muscles pull under pressures (MPa), friction aside; all (n,)."""
        by = drive(p1, p2, self.p0_mpa, self.exponent)
        first, second, third = self.balance.curve
        angle: Column = by * (first + by * (second + by * third))
        return angle

    def balanced(self, angle: Column, offset: Column, compliance: Column, dt_s: float) -> Column:
        """The joint's angle when its equilibrium lies `offset` degrees further and its friction counts `compliance`
        times; all (n,)."""
        return balanced(angle, offset, compliance, self._joint, dt_s)

    def pulled_to(self, angle: Column, dt_s: float | Column, ends: Ends = None) -> Column:
        """The equilibrium (deg) under which the joint has these angles (deg), both (n,); of several records with their
        `ends` and each one's dt_s."""
        return pulled_to(angle, self._joint, dt_s, ends)

    def settled(
        self, angle: Column, equilibrium: Column, compliance: Column, dt_s: float | Column, ends: Ends = None
    ) -> Column:
        """The joint's angle under another equilibrium, see `compiled.columns.settled`."""
        return settled(angle, equilibrium, compliance, self._joint, dt_s, ends)

    @cached_property
    def _joint(self) -> Joint:
        return Joint(self.balance.viscous_s, self.balance.inertia_s, self.balance.slip)


def response_of(fingerprint: Fingerprint) -> ResponseModel:
    """The response model that a fingerprint holds; for one whose `fingerprint_trouble` is None."""
    first, second = fingerprint.regulators_s
    curve = (fingerprint.curve[0], fingerprint.curve[1], fingerprint.curve[2])
    return ResponseModel(
        fingerprint.p0_mpa,
        (first, second),
        np.array(fingerprint.weights),
        Balance(fingerprint.viscous_s, fingerprint.inertia_s, fingerprint.slip, curve),
        fingerprint.misfit_deg,
        fingerprint.exponent,
        tuple(np.array(row) for row in fingerprint.corrections),
        fingerprint.weights[0],
    )


def regulator_terms(pressure: Column, p0_mpa: float, dt_s: float) -> Column:
    """(n, REGULATOR_TERMS) in which a real regulator differs from a dead time and a lag, from its pressure (n,) in MPa.

    Offset; gain; first and second order of its answer; filling against exhausting; its characteristic bent evenly and
    oddly; an answer whose speed depends on the pressure.
    """
    speed, moved = np.gradient(pressure, dt_s), pressure - p0_mpa
    return np.column_stack(
        [
            np.ones_like(pressure),
            moved,
            -speed,
            np.gradient(speed, dt_s),
            -np.abs(speed),
            moved**2 / p0_mpa,
            moved**3 / p0_mpa**2,
            -speed * moved / p0_mpa,
        ]
    )


def regulators_of(model: Model | None) -> tuple[Regulator, Regulator]:
    """The model's regulators as the response model has them, without limits of the flow; usual ones where it has
    none."""
    if model is None or model.valve.kind != StageKind.REGULATORS:
        return TYPICAL_REGULATOR, TYPICAL_REGULATOR
    fills_s, exhausts_s = np.clip(regulator_times_s(model.valve), 0.002, 1.0).tolist()
    return (TYPICAL_REGULATOR[0], fills_s[0], exhausts_s[0]), (TYPICAL_REGULATOR[0], fills_s[1], exhausts_s[1])

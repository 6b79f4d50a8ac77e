"""The healthy rig as the diagnosis sees it: its mean baseline, and frozen descriptions of its parts that carry effects through it.

Three descriptions, all fitted to the baseline alone and never to the case: each regulator, the muscles (a ridge bank of low-passes
and plays on the pressures) and the joint's balance (Maxwell-slip friction, drag, mass). They are used in differences only: what an
effect changes in them is added to the measured baseline, so their own misfit cancels.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import lsq_linear

from rig.gap.kernels import CARRIER_TERMS, carried, carrier_terms, pushed, regulated, stops
from rig.gap.records.pairs import Pair
from rig.gap.solve import descend
from rig.model.joint_balance import LOOP_RADII_DEG
from rig.record import Column

RIDGE = 1e-6
LOOP_RIDGE = 1e-4
JOINT_SMOOTHING_S = 0.025


@dataclass(frozen=True)
class Reference:
    """The healthy rig under one pair's command; all columns (n,). Pressures are virtual when none were measured."""

    p1_mpa: Column
    p2_mpa: Column
    angle_deg: Column


@dataclass(frozen=True)
class Nominal:
    """The frozen descriptions; `loop` holds drag_s, sway_s and the weights of the Maxwell-slip elements."""

    p0_mpa: float
    regulators: tuple[tuple[float, float, float], tuple[float, float, float]]
    """(dead time, fill and exhaust time constant) in s of each valve."""
    weights: Column
    loop: dict[str, float]
    curve: tuple[float, float, float]
    """Angle to which the muscles pull by powers of the drive, from the same fit as `loop`."""
    misfit_deg: float
    """What the carrier leaves of the baseline, rms."""
    exponent: float = 1.0
    """How the mean pressure divides the drive: d = (p1 - p2) (2 P0 / (p1 + p2))^exponent."""
    softness: float = 1.0
    """How far the stiffness follows the mean pressure: 1 in proportion, 0 not at all."""

    @cached_property
    def grip(self) -> Column:
        """(5,) weights of the Maxwell-slip elements."""
        return np.array([self.loop[f"loop_{j + 1}"] for j in range(len(LOOP_RADII_DEG))])

    @cached_property
    def tau0_s(self) -> float:
        """Mean time constant of the regulators."""
        return float(np.mean([tau for regulator in self.regulators for tau in regulator[1:]]))

    def pressures(self, u1: Column, u2: Column, dt_s: float) -> tuple[Column, Column]:
        """Both regulators' pressures under set-points."""
        return regulated(u1, *self.regulators[0], dt_s), regulated(u2, *self.regulators[1], dt_s)

    def angle(self, p1: Column, p2: Column, dt_s: float) -> Column:
        """The carrier's angle under pressures."""
        if self.exponent != 1.0:
            mean = 0.5 * (p1 + p2)
            half = 0.5 * (p1 - p2) * (np.maximum(mean, 0.1 * self.p0_mpa) / self.p0_mpa) ** (1.0 - self.exponent)
            p1, p2 = mean + half, mean - half
        angle: Column = carried(p1, p2, self.p0_mpa, dt_s, self.weights)
        return angle

    def pull(self, p1: Column, p2: Column) -> Column:
        """The angle to which the muscles pull under pressures, friction aside."""
        drive = (p1 - p2) * (2 * self.p0_mpa / np.maximum(p1 + p2, 0.2 * self.p0_mpa)) ** self.exponent
        first, second, third = self.curve
        pulled: Column = drive * (first + drive * (second + drive * third))
        return pulled

    def pushed(self, angle: Column, push: Column, soft: Column, dt_s: float) -> Column:
        """The joint's angle when it is pulled `push` degrees further and its friction counts `soft` times; all (n,)."""
        out: Column = pushed(angle, push, soft, self.grip, self.loop["drag_s"], self.loop["sway_s"], dt_s)
        return out


def mean_session(pair: Pair, pressures: bool) -> tuple[Column | None, Column | None, Column]:
    """The mean of a pair's baseline sessions."""
    angle = np.mean([session.angle_deg for session in pair.sessions], axis=0)
    if not pressures:
        return None, None, angle
    first = np.mean([session.p1_mpa for session in pair.sessions if session.p1_mpa is not None], axis=0)
    second = np.mean([session.p2_mpa for session in pair.sessions if session.p2_mpa is not None], axis=0)
    return first, second, angle


def fit_regulators(pairs: Sequence[Pair], measured: Sequence[tuple[Column, Column]]) -> tuple[tuple[float, float, float], ...]:
    """Dead time, fill and exhaust time constants of both valves from set-points and measured pressures."""
    return tuple(
        _fit_regulator([(pair.u1_mpa, pair.u2_mpa)[k] for pair in pairs], [both[k] for both in measured], pairs) for k in (0, 1)
    )


def _fit_regulator(commands: Sequence[Column], pressures: Sequence[Column], pairs: Sequence[Pair]) -> tuple[float, float, float]:
    def residual(x: Column) -> Column:
        parts = []
        for u, p, pair in zip(commands, pressures, pairs, strict=True):
            left = (p - regulated(u, x[0], x[1], x[2], pair.dt_s)) * pair.used
            parts.append(left - left.mean())
        return np.concatenate(parts)

    low, high = np.array([0.0, 2e-3, 2e-3]), np.array([0.5, 1.0, 1.0])
    starts = (np.array([0.01, 0.04, 0.04]), np.array([0.06, 0.1, 0.1]))
    fits = [descend(residual, start, low, high) for start in starts]
    best = min(fits, key=lambda fit: fit.cost)
    return float(best.x[0]), float(best.x[1]), float(best.x[2])


def fit_carrier(pairs: Sequence[Pair], references: Sequence[Reference], p0_mpa: float) -> tuple[Column, float]:
    """Ridge weights of the bank that gives the reference angles from the reference pressures, and the rms it leaves."""
    gram, right = np.zeros((CARRIER_TERMS, CARRIER_TERMS)), np.zeros(CARRIER_TERMS)
    total, power = 0.0, 0.0
    for pair, reference in zip(pairs, references, strict=True):
        terms = np.empty((len(pair), CARRIER_TERMS))
        carrier_terms(reference.p1_mpa, reference.p2_mpa, p0_mpa, pair.dt_s, terms)
        weighted = terms * pair.used[:, None]
        gram += weighted.T @ terms
        right += weighted.T @ reference.angle_deg
        power += float(np.sum(pair.used * reference.angle_deg**2))
        total += float(pair.used.sum())
    mean = gram[0] / max(total, 1.0)
    spread = np.sqrt(np.maximum(np.diag(gram) / max(total, 1.0) - mean**2, 1e-12))
    spread[0] = 1.0
    scaled = gram / np.outer(spread, spread) + RIDGE * total * np.eye(CARRIER_TERMS)
    weights = np.linalg.solve(scaled, right / spread) / spread
    left = max(power - 2 * weights @ right + weights @ gram @ weights, 0.0)
    return weights, float(np.sqrt(left / max(total, 1.0)))


def fit_loop(
    pairs: Sequence[Pair], references: Sequence[Reference], p0_mpa: float
) -> tuple[dict[str, float], tuple[float, float, float]]:
    """The joint's balance over its stiffness: y + sum loop stop(y) + drag y' + sway^2 y'' = polynomial of the drive."""
    blocks = [_loop_rows(pair, reference, p0_mpa) for pair, reference in zip(pairs, references, strict=True)]
    rows = np.concatenate([terms for terms, _ in blocks])
    angle = np.concatenate([target for _, target in blocks])
    spread = np.maximum(rows.std(axis=0), 1e-9)
    spread[0] = 1.0
    columns = rows.shape[1]
    stacked = np.vstack(
        [
            np.column_stack([rows / spread, angle]),
            np.column_stack([np.sqrt(LOOP_RIDGE * len(angle)) * np.eye(columns), np.zeros(columns)]),
        ]
    )
    triangle: Column = np.asarray(np.linalg.qr(stacked, mode="r"))
    low = np.full(columns, -np.inf)
    low[4:] = 0.0
    solved = lsq_linear(triangle[:columns, :columns], triangle[:columns, columns], (low, np.full(columns, np.inf))).x / spread
    loop = {f"loop_{j + 1}": float(min(solved[4 + j], 50.0)) for j in range(len(LOOP_RADII_DEG))}
    curve = (float(solved[1]), float(solved[2]), float(solved[3]))
    return loop | {"drag_s": float(min(solved[-2], 2.0)), "sway_s": float(np.sqrt(min(solved[-1], 0.25)))}, curve


def _loop_rows(pair: Pair, reference: Reference, p0_mpa: float) -> tuple[Column, Column]:
    """Terms (n, 11) and target (n,) of the balance; both smoothed alike, so that its derivatives are not noise."""
    sigma = JOINT_SMOOTHING_S / pair.dt_s

    def smooth(column: Column) -> Column:
        out: Column = gaussian_filter1d(column, sigma, mode="nearest") if sigma > 0.5 else column
        return out

    angle = reference.angle_deg
    speed = np.gradient(angle, pair.dt_s)
    total = np.maximum(reference.p1_mpa + reference.p2_mpa, 0.2 * p0_mpa)
    drive = (reference.p1_mpa - reference.p2_mpa) * 2 * p0_mpa / total
    terms = [np.ones_like(drive), *(smooth(drive**k) for k in (1, 2, 3))]
    terms += [-smooth(stops(angle, radius)) for radius in LOOP_RADII_DEG]
    terms += [-smooth(speed), -smooth(np.gradient(speed, pair.dt_s))]
    used = pair.used > 0
    return np.column_stack(terms)[used], smooth(angle)[used]


def describe(
    pairs: Sequence[Pair], references: Sequence[Reference], p0_mpa: float, regulators: Sequence[tuple[float, float, float]]
) -> Nominal:
    """All frozen descriptions of the reference rig."""
    weights, misfit = fit_carrier(pairs, references, p0_mpa)
    loop, curve = fit_loop(pairs, references, p0_mpa)
    return Nominal(p0_mpa, (regulators[0], regulators[1]), weights, loop, curve, misfit)

"""Fits of the response model (`rig.model.response.model`) to records on a regular grid.

Nothing is known here of sessions, pairs or files: a `Drive` holds the columns of one record.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.columns import rms
from rig.identify.response.descent import descend
from rig.identify.response.nonnegative import nonnegative
from rig.model.compiled.columns import drive
from rig.model.compiled.response import RESPONSE_TERMS, regulated, response_terms, stops
from rig.model.equations.joint_balance import LOOP_RADII_DEG, REACHES_DEG, SHARES
from rig.model.response.model import NO_FRICTION, REGULATOR_TERMS, Balance, Regulator, ResponseModel, regulator_terms
from rig.record import Column
from rig.smoothing import smoothed

GRID_S = 0.01
"""Finest grid of the fits, and of the diagnosis, s: regulators and joint have nothing above 15 Hz."""
SMOOTHING_S = 0.012
"""Standard deviation of the symmetric smoothing before a fit and before a diagnosis, s; the sample time when that is
longer. It keeps noise from rattling in the bank's plays."""
RIDGE = 1e-6
"""Of the bank's weights, in units of each term's own spread: its low-passes and plays are nearly dependent."""
BALANCE_RIDGE = 1e-4
"""Of the joint's balance, in the same units: its terms come from one motion, and are nearly dependent."""
BALANCE_SMOOTHING_S = 0.025
"""Standard deviation of the smoothing of the balance's terms, which hold second derivatives."""
MOST_SLIP, MOST_VISCOUS_S, MOST_INERTIA_S = 50.0, 2.0, 0.5
"""Bounds of the balance: those of the effect stages that solve it again."""
CORRECTION_RIDGE = 1e-6
"""Of a regulator's correction, in units of each term's own power."""
REGULATOR_LOW, REGULATOR_HIGH = np.array([0.0, 2e-3, 2e-3]), np.array([0.5, 1.0, 1.0])
REGULATOR_STARTS: tuple[Regulator, ...] = ((0.01, 0.04, 0.04), (0.06, 0.1, 0.1))
"""Dead time, fill and exhaust time constant (s) from which a fit begins: a quick regulator and a slow one."""
MOST_EXPONENT = 2.0
"""Of the law of the mean pressure."""
EXPONENT_TO, EXPONENTS = 0.02, 7
"""How wide an interval of it is left, and how many are tried in each. Fewer than five miss the middle of one."""
MEAN_MOVES = 0.05
"""Where (p1 + p2) / 2 stays within this share of P0 (between its 5 and 95 % quantiles), records say nothing of that
law."""


@dataclass(frozen=True, eq=False)
class Drive:
    """One record on a regular grid: what drives the muscles and what the joint answers; columns (n,)."""

    dt_s: float
    p1_mpa: Column
    p2_mpa: Column
    angle_deg: Column
    used: Column
    """1 where the record counts, 0 in holes and at its edges."""


@dataclass(frozen=True, eq=False)
class RegulatorRecord:
    """One record of one regulator on a regular grid; columns (n,)."""

    dt_s: float
    command_mpa: Column
    pressure_mpa: Column
    used: Column


def fit_regulator(
    lines: Sequence[RegulatorRecord], starts: Sequence[Regulator] = REGULATOR_STARTS, steps: int = 8
) -> Regulator:
    """Dead time, fill and exhaust time constant of a regulator from set-points and measured pressures."""

    def residual(x: Column) -> Column:
        return np.concatenate([_missed(line, x) for line in lines])

    fits = [descend(residual, np.array(start), REGULATOR_LOW, REGULATOR_HIGH, steps) for start in starts]
    dead, fill, exhaust = min(fits, key=lambda fit: fit.cost).x
    return float(dead), float(fill), float(exhaust)


def _missed(line: RegulatorRecord, regulator: Sequence[float] | Column) -> Column:
    """What a regulator leaves of its pressure, MPa, apart from an offset; 0 in rows that do not count."""
    regulated_mpa = regulated(line.command_mpa, regulator[0], regulator[1], regulator[2], line.dt_s)
    return _without_offset(line.pressure_mpa - regulated_mpa, line.used)


def _without_offset(column: Column, used: Column) -> Column:
    """(n,) less its mean over the rows that count, 0 in the others."""
    return np.asarray((column - np.sum(column * used) / max(float(np.sum(used)), 1.0)) * used)


def fit_correction(lines: Sequence[RegulatorRecord], regulator: Regulator, p0_mpa: float) -> Column:
    """(REGULATOR_TERMS,) ridge weights (MPa) of what a regulator leaves of its pressure."""
    blocks = [_correction_rows(line, regulator, p0_mpa) for line in lines]
    terms, left = np.concatenate([rows for rows, _ in blocks]), np.concatenate([column for _, column in blocks])
    power = np.maximum(np.sum(terms**2, axis=0), 1e-30)
    scale = np.sqrt(power)
    gram = (terms / scale).T @ (terms / scale) + CORRECTION_RIDGE * np.eye(REGULATOR_TERMS)
    weights: Column = np.linalg.solve(gram, (terms / scale).T @ left) / scale
    return weights


def _correction_rows(line: RegulatorRecord, regulator: Regulator, p0_mpa: float) -> tuple[Column, Column]:
    """Terms (n, REGULATOR_TERMS) and what they are to explain (n,), nought in rows that do not count."""
    regulated_mpa = regulated(line.command_mpa, *regulator, line.dt_s)
    terms = regulator_terms(regulated_mpa, p0_mpa, line.dt_s) * line.used[:, None]
    return terms, (line.pressure_mpa - regulated_mpa) * line.used


def corrected_misfit_mpa(
    lines: Sequence[RegulatorRecord], regulator: Regulator, correction: Column, p0_mpa: float
) -> float:
    """Rms (MPa) that a regulator with its correction (REGULATOR_TERMS,) leaves of records, their offsets aside."""
    rows = [_correction_rows(line, regulator, p0_mpa) for line in lines]
    left = [column - terms @ correction for terms, column in rows]
    return _rms_used([_without_offset(column, line.used) for column, line in zip(left, lines, strict=True)], lines)


def _rms_used(columns: Sequence[Column], lines: Sequence[RegulatorRecord]) -> float:
    return rms(np.concatenate(columns), np.concatenate([line.used for line in lines]))


@dataclass(frozen=True, eq=False)
class BankSums:
    """What a fit of the bank needs of some records: sums over their rows that count, which add up over records."""

    gram: Column
    """(RESPONSE_TERMS, RESPONSE_TERMS) of the terms with each other."""
    right: Column
    """(RESPONSE_TERMS,) of the terms with the angle, deg."""
    power: float
    """Of the angle's squares, deg2."""
    rows: float

    def __add__(self, other: "BankSums") -> "BankSums":
        return BankSums(
            self.gram + other.gram, self.right + other.right, self.power + other.power, self.rows + other.rows
        )

    def weights(self) -> Column:
        """(RESPONSE_TERMS,) ridge weights (deg a unit of each term) of the least squared error."""
        rows = max(self.rows, 1.0)
        mean = self.gram[0] / rows
        spread = np.sqrt(np.maximum(np.diag(self.gram) / rows - mean**2, 1e-12))
        spread[0] = 1.0
        scaled = self.gram / np.outer(spread, spread) + RIDGE * self.rows * np.eye(RESPONSE_TERMS)
        weights: Column = np.linalg.solve(scaled, self.right / spread) / spread
        return weights

    def misfit_deg(self, weights: Column) -> float:
        """Rms (deg) that the bank with `weights`, (RESPONSE_TERMS,), leaves of these records."""
        left = self.power - 2 * weights @ self.right + weights @ self.gram @ weights
        return float(np.sqrt(max(float(left), 0.0) / max(self.rows, 1.0)))


def bank_sums(record: Drive, p0_mpa: float, exponent: float) -> BankSums:
    """The sums of one record."""
    terms = np.empty((len(record.angle_deg), RESPONSE_TERMS))
    response_terms(record.p1_mpa, record.p2_mpa, p0_mpa, exponent, record.dt_s, terms)
    weighted = terms * record.used[:, None]
    power = float(np.sum(record.used * record.angle_deg**2))
    return BankSums(weighted.T @ terms, weighted.T @ record.angle_deg, power, float(record.used.sum()))


def fit_bank(records: Sequence[Drive], p0_mpa: float, exponent: float = 1.0) -> tuple[Column, float]:
    """Ridge weights (RESPONSE_TERMS,) of the bank that gives the angles from the pressures, and the rms (deg) that it
    leaves."""
    first, *others = [bank_sums(record, p0_mpa, exponent) for record in records]
    total = sum(others, first)
    weights = total.weights()
    return weights, total.misfit_deg(weights)


def mean_pressure_moves(means_mpa: Sequence[Column], p0_mpa: float) -> bool:
    """Whether the mean pressure (p1 + p2) / 2, (n,) in MPa of each record, moves far enough, within records or between
    them, to show what it does."""
    low, high = np.quantile(np.concatenate(means_mpa), (0.05, 0.95))
    return bool(high - low > MEAN_MOVES * p0_mpa)


def shown_mean_exponent(records: Sequence[Drive], p0_mpa: float, otherwise: float = 1.0) -> float:
    """`fit_mean_exponent` where the mean pressure moves far enough to show it; `otherwise` where it does not."""
    means = [0.5 * (record.p1_mpa + record.p2_mpa) for record in records]
    return fit_mean_exponent(records, p0_mpa) if mean_pressure_moves(means, p0_mpa) else otherwise


def fit_mean_exponent(records: Sequence[Drive], p0_mpa: float) -> float:
    """The exponent of the mean pressure, 0 .. MOST_EXPONENT, with which the bank leaves least of the angles, to 0.01:
    a few are tried, then as many between the neighbours of the best. An optimiser of scipy takes longer to be imported
    than this, and a diagnosis needs no other."""
    low, high, best = 0.0, MOST_EXPONENT, 0.0
    while high - low > EXPONENT_TO:
        tried = np.linspace(low, high, EXPONENTS)
        at = int(np.argmin([fit_bank(records, p0_mpa, float(exponent))[1] for exponent in tried]))
        best, low, high = float(tried[at]), float(tried[max(at - 1, 0)]), float(tried[min(at + 1, EXPONENTS - 1)])
    return best


def fit_balance(records: Sequence[Drive], p0_mpa: float, exponent: float = 1.0) -> Balance:
    """The joint's balance over its stiffness, by bounded linear least squares."""
    blocks = [_balance_rows(record, p0_mpa, exponent) for record in records]
    rows = np.concatenate([terms for terms, _ in blocks])
    angle = np.concatenate([target for _, target in blocks])
    if not len(angle):
        return NO_FRICTION
    spread = np.maximum(rows.std(axis=0), 1e-9)
    spread[0] = 1.0
    columns = rows.shape[1]
    ridge = np.column_stack([np.sqrt(BALANCE_RIDGE * len(angle)) * np.eye(columns), np.zeros(columns)])
    triangle: Column = np.asarray(np.linalg.qr(np.vstack([np.column_stack([rows / spread, angle]), ridge]), mode="r"))
    solved = nonnegative(triangle[:columns, :columns], triangle[:columns, columns], 4) / spread
    slip = tuple(float(min(weight, MOST_SLIP)) for weight in solved[4 : 4 + len(LOOP_RADII_DEG)])
    viscous, inertia = float(min(solved[-2], MOST_VISCOUS_S)), float(np.sqrt(min(solved[-1], MOST_INERTIA_S**2)))
    return Balance(viscous, inertia, slip, (float(solved[1]), float(solved[2]), float(solved[3])))


def _balance_rows(record: Drive, p0_mpa: float, exponent: float) -> tuple[Column, Column]:
    """Terms (n, 11) and target (n,) of the balance; both smoothed alike, so that its derivatives are not noise."""
    sigma = BALANCE_SMOOTHING_S / record.dt_s

    def smooth(column: Column) -> Column:
        return smoothed(column, sigma) if sigma > 0.5 else column

    angle = record.angle_deg
    speed = np.gradient(angle, record.dt_s)
    by = drive(record.p1_mpa, record.p2_mpa, p0_mpa, exponent)
    terms = [np.ones_like(by), *(smooth(by**k) for k in (1, 2, 3))]
    elements = np.array(REACHES_DEG).reshape(len(LOOP_RADII_DEG), -1), np.array(SHARES).reshape(len(LOOP_RADII_DEG), -1)
    terms += [-smooth(stops(angle, radii, shares)) for radii, shares in zip(*elements, strict=True)]
    terms += [-smooth(speed), -smooth(np.gradient(speed, record.dt_s))]
    used = record.used > 0
    return np.column_stack(terms)[used], smooth(angle)[used]


def fit_response(
    records: Sequence[Drive], p0_mpa: float, regulators: tuple[Regulator, Regulator], exponent: float = 1.0
) -> ResponseModel:
    """The response model of the rig that made these records; its regulators are given (see `fit_regulator`)."""
    weights, misfit = fit_bank(records, p0_mpa, exponent)
    balance = fit_balance(records, p0_mpa, exponent)
    return ResponseModel(p0_mpa, regulators, weights, balance, misfit, exponent, zero_deg=float(weights[0]))

"""What re-tuning the simulator's own parameters to these records would close, and which of them moved.

A model that is fitted again follows the records closer whatever causes the gap; so this is said beside the causes,
never instead of them, and judged on records, or on the half of a single one, that the fit has not seen.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.columns import NORMAL_95
from rig.errors import ModelError, RigError
from rig.gap.answer.facts import ParameterMove, Retuning
from rig.gap.answer.how_far.halves import in_halves
from rig.gap.answer.settings import COLOUR_S, LEAST_MOVE, PLAIN, RETUNED_ALIKE, USEFUL, WIDE
from rig.gap.records.pairs import Pair
from rig.gap.reference.expected import Expected
from rig.gap.reference.gaps import without_mean
from rig.gap.reference.simulated import at_rest
from rig.identify.provenance import FITTED_AGAIN
from rig.identify.response.descent import Descent, descend, square_sum
from rig.model.parameters import Model, Parameter, StageModel
from rig.model.simulation import simulate
from rig.record import Column

GAUSS_NEWTON_STEPS = 5
"""Gauss-Newton steps of the fit; from there each half is one step away."""
THINNED = 4
"""Every fourth row of a record counts: its neighbours say the same."""
TUNED = {
    "valve": ("gain", "offset_mpa", "tau_s", "exhaust_ratio"),
    "muscle": (
        "lambda1",
        "lambda2",
        "xi1",
        "xi2",
        "phi1",
        "phi2",
        "beta1",
        "beta2",
        "xi",
        "psi",
        "beta",
        "mean_exponent",
    ),
    "joint": ("omega_rad_per_s", "damping"),
    "sensor": ("gain", "offset_deg"),
}
"""Slot -> the ends of the names of parameters that re-tuning may move."""
SCALES = {"offset_mpa": 0.005, "offset_deg": 1.0, "tau_s": 0.01}
"""A usual move of parameters whose value may be zero, in their unit; of the others a tenth of their value."""


@dataclass(frozen=True)
class Refit:
    """A simulator whose own parameters were fitted again."""

    model: Model
    retuning: Retuning


def retuned_model(model: Model, expected: Expected) -> Model:
    """`model` with its own parameters fitted again to the records, and a word on that; ModelError where it runs away
    under them."""
    found = retune(at_rest(model, expected.pairing), expected.pairs, expected.pairing.pressures)
    if found is None:
        raise ModelError(
            "--retuned: the simulator runs away under these records, or has no parameters of "
            "pamrig's, so it cannot be fitted to them"
        )
    text = f"{model.provenance.text} {FITTED_AGAIN}".strip()
    return replace(found.model, provenance=replace(model.provenance, text=text))


@dataclass(frozen=True)
class EffectChange:
    """What an effect, as it fits best, changes in the columns of all pairs, one after the other."""

    angle_deg: Column
    """(n,)"""
    pressures_mpa: tuple[Column, Column] | None = None
    """(n,) each; None for what acts behind the monitors."""


def retune(
    model: Model, pairs: Sequence[Pair], pressures: bool, changes: Mapping[str, EffectChange] | None = None
) -> Refit | None:
    """The simulator fitted again to these records; None where it runs away under them or has no parameters to fit.

    `changes`: of which effects it is asked whether the simulator's own parameters absorb them.
    """
    names = _tuned(model)
    if not names:
        return None
    scales = np.array([_scale(model.stages()[slot].parameters[name], name) for slot, name in names])
    start = np.array([model.stages()[slot].parameters[name].value for slot, name in names])
    errors = _Errors(model, names, start, scales, pairs, pressures)
    as_it_is = errors.weighed(np.zeros(len(names)))
    before = errors.angle_ms(as_it_is)
    if not np.isfinite(before).all():
        return None
    fit, spread, held = _cross_fitted(errors, len(names))
    x, after, shares = fit.x, errors.angle_ms(held), _shares(as_it_is, fit, errors.of_angle)
    moved = [
        ParameterMove(
            name if slot == "valve" else f"{slot}_{name}",
            float(start[k]),
            float(start[k] + scales[k] * x[k]),
            float(start[k] + scales[k] * (x[k] - NORMAL_95 * spread[k])),
            float(start[k] + scales[k] * (x[k] + NORMAL_95 * spread[k])),
            model.stages()[slot].parameters[name].unit,
            float(shares[k]),
        )
        for k, (slot, name) in enumerate(names)
        if abs(x[k]) > max(PLAIN * spread[k], LEAST_MOVE) and slot != "muscle" and after.mean() < USEFUL * before.mean()
    ]
    retuning = Retuning(
        float(np.sqrt(before.mean())),
        float(np.sqrt(after.mean())),
        tuple(sorted(moved, key=lambda one: -one.share)),
        _alike(errors, fit, [slot for slot, _ in names], changes or {}),
        float(sum(shares[k] for k, (slot, _) in enumerate(names) if slot == "muscle")),
    )
    return Refit(_with(model, names, start + scales * x), retuning)


def _tuned(model: Model) -> list[tuple[str, str]]:
    """Slot and name of each parameter that is fitted again."""
    return [
        (slot, name)
        for slot, stage in model.stages().items()
        for name in stage.parameters
        if any(name == end or name.endswith(f"_{end}") for end in TUNED[slot])
    ]


def _alike(
    errors: "_Errors", fit: Descent, slots: Sequence[str], changes: Mapping[str, EffectChange]
) -> tuple[str, ...]:
    """The effects that these parameters absorb, and whose absorbed part is what the fit closed; likeliest first.

    Where the pressures are known, what acts behind the monitors looks like what the parameters behind them closed of
    the angle, and what acts ahead of them like what all closed of all columns.
    """
    driven = any(change.pressures_mpa is not None for change in changes.values())
    behind = np.array([slot != "valve" or not driven for slot in slots])
    slopes = fit.jacobian[: -len(slots)]
    of_all = square_sum(errors.of_angle * (slopes @ fit.x))
    absorbing = {
        False: _Absorbing(slopes[:, behind] * errors.of_angle[:, None], fit.x[behind]),
        True: _Absorbing(slopes, fit.x),
    }
    found = {}
    for name, change in changes.items():
        those = absorbing[change.pressures_mpa is not None]
        if square_sum(errors.of_angle * those.closed) < (1.0 - USEFUL) * of_all:
            continue
        moved = -errors.of_change(change)
        absorbed = those.absorbed(moved)
        share = square_sum(absorbed) / max(square_sum(moved), 1e-12)
        same = float(absorbed @ those.closed) / max(
            float(np.sqrt(square_sum(absorbed) * square_sum(those.closed))), 1e-12
        )
        if share >= RETUNED_ALIKE and same > 0.0 and same**2 >= RETUNED_ALIKE:
            found[name] = same
    return tuple(sorted(found, key=lambda name: -found[name]))


class _Absorbing:
    """Parameters that a fit moved by `x` (k,), by their slopes (r, k) in the columns that are compared."""

    def __init__(self, slopes: Column, x: Column) -> None:
        self._slopes, self.closed = slopes, slopes @ x
        self._inverse = np.linalg.pinv(slopes.T @ slopes + np.eye(len(x)))

    def absorbed(self, moved: Column) -> Column:
        """(r,) what they absorb of what moves these columns (r,)."""
        out: Column = self._slopes @ (self._inverse @ (self._slopes.T @ moved))
        return out


def _shares(before: Column, fit: Descent, of_angle: Column) -> Column:
    """(k,) the part of what a fit closes of the angle's mean square that goes with each move, by the errors `before` it
    (r,): |a|^2 - |b|^2 = (a + b)(a - b) for errors a and b, and a - b is a sum over the moves. Zeros where it closes
    nothing."""
    rows = len(before)
    both = (before + fit.residual[:rows]) * of_angle
    closed: Column = -(both @ (fit.jacobian[:rows] * fit.x))
    total = float(closed.sum())
    return closed / total if total > 0.0 else np.zeros_like(closed)


def _scale(parameter: Parameter, name: str) -> float:
    return next((scale for end, scale in SCALES.items() if name.endswith(end)), 0.1 * max(abs(parameter.value), 1e-4))


def _cross_fitted(errors: "_Errors", count: int) -> tuple[Descent, Column, Column]:
    """The fit of all moves (in scales, each held to zero by one unit), their standard deviations, and the residual of
    each half by a fit to the other: one Gauss-Newton step from the common optimum, so that nothing is simulated
    again."""

    def residual(x: Column) -> Column:
        return np.concatenate([errors.weighed(x), x])

    wide = np.full(count, WIDE)
    fit = descend(residual, np.zeros(count), -wide, wide, GAUSS_NEWTON_STEPS)
    rows = len(fit.residual) - count
    slopes, left = fit.jacobian[:rows], fit.residual[:rows]
    level = max(float(np.sum(left**2)) / max(rows, 1), 1e-12) * errors.rows_as_one
    spread = np.sqrt(np.maximum(np.diag(np.linalg.pinv(slopes.T @ slopes / level + np.eye(count))), 0.0))
    held = left.copy()
    for seen in (errors.half == 0.0, errors.half == 1.0):
        gram = slopes[seen].T @ slopes[seen] + np.eye(count)
        step = -np.linalg.solve(gram, slopes[seen].T @ left[seen] + fit.x)
        held[~seen] = left[~seen] + slopes[~seen] @ step
    return fit, spread, held


def _with(model: Model, names: Sequence[tuple[str, str]], values: Column) -> Model:
    """The model with other values, kept within the parameters' own bounds. What was known of the old values (their
    spreads, the fingerprint that describes the rig by them) does not hold for it."""
    changed: dict[str, StageModel] = {}
    for (slot, name), value in zip(names, values, strict=True):
        stage = changed.get(slot, model.stages()[slot])
        parameter = stage.parameters[name]
        held = replace(parameter, value=float(np.clip(value, parameter.low, parameter.high)), std=None, at_bound=False)
        changed[slot] = replace(stage, parameters={**stage.parameters, name: held})
    return replace(model, fingerprint=None, **changed)  # type: ignore[arg-type]


class _Errors:
    """The simulator's error on some records for moves of its parameters."""

    def __init__(
        self,
        model: Model,
        names: Sequence[tuple[str, str]],
        start: Column,
        scales: Column,
        pairs: Sequence[Pair],
        pressures: bool,
    ) -> None:
        self._made: Callable[[Column], Model] = lambda x: _with(model, names, start + scales * x)
        self._pairs, self._pressures = pairs, pressures
        self._zeroed = all(pair.zeroed for pair in pairs)
        """The mean of a record's error is none: each took its own zero."""
        angle = np.concatenate([pair.case.angle_deg for pair in pairs])
        self._angle_unit = 0.01 * max(float(np.ptp(angle)), 1e-3)
        pressure = np.concatenate([pair.case.p1_mpa for pair in pairs if pair.case.p1_mpa is not None] or [np.zeros(1)])
        self._pressure_unit = 0.01 * max(float(np.ptp(pressure)), 1e-3)
        self.record = np.concatenate([np.full(3 * len(pair.t_s[::THINNED]), k) for k, pair in enumerate(pairs)])
        halves = in_halves([pair.used for pair in pairs])
        self.half = np.concatenate([np.tile(rows[::THINNED], 3) for rows in halves])

    def _errors(self, x: Column) -> list[tuple[Column, Column, Column]]:
        """For each record: error of the angle (deg) and of both pressures (MPa), on every THINNED-th row."""
        model, found = self._made(x), []
        for pair in self._pairs:
            simulated = simulate(model, pair.raw, begun_s=pair.begun_s)
            t = simulated.t_s - simulated.t_s[0]
            angle, p1, p2 = (
                None if c is None else np.interp(pair.t_s[::THINNED], t, c)
                for c in (simulated.angle_deg, simulated.p1_mpa, simulated.p2_mpa)
            )
            assert angle is not None
            case, used = pair.case, pair.used[::THINNED]
            off = case.angle_deg[::THINNED] - angle
            found.append(
                (
                    without_mean(off, used) if self._zeroed else off * used,
                    self._pressure_error(case.p1_mpa, p1, used),
                    self._pressure_error(case.p2_mpa, p2, used),
                )
            )
        return found

    def _pressure_error(self, measured: Column | None, simulated: Column | None, used: Column) -> Column:
        if not self._pressures or measured is None or simulated is None:
            return np.zeros_like(used)
        return (measured[::THINNED] - simulated) * used

    def weighed(self, x: Column) -> Column:
        """(r,) errors of every record, in a hundredth of their range; not a number where the simulator runs
        away."""
        try:
            errors = self._errors(x)
        except RigError:
            return np.full(len(self.record), np.nan)
        units = (self._angle_unit, self._pressure_unit, self._pressure_unit)
        return np.concatenate([column / unit for one in errors for column, unit in zip(one, units, strict=True)])

    @property
    def rows_as_one(self) -> float:
        """Rows that lie so close that they count once."""
        return max(COLOUR_S / (THINNED * float(np.mean([pair.dt_s for pair in self._pairs]))), 1.0)

    @property
    def of_angle(self) -> Column:
        """(r,) 1 for errors of the angle, 0 for those of the pressures."""
        return np.concatenate(
            [np.repeat([1.0, 0.0], [rows, 2 * rows]) for rows in (len(pair.t_s[::THINNED]) for pair in self._pairs)]
        )

    def of_change(self, change: EffectChange) -> Column:
        """(r,) a change, as errors are counted."""
        p1, p2 = change.pressures_mpa or (np.zeros_like(change.angle_deg),) * 2
        columns = (change.angle_deg / self._angle_unit, p1 / self._pressure_unit, p2 / self._pressure_unit)
        ends = np.cumsum([len(pair.t_s) for pair in self._pairs])[:-1]
        parts = zip(self._pairs, *(np.split(column, ends) for column in columns), strict=True)
        return np.concatenate([(one * pair.used)[::THINNED] for pair, *three in parts for one in three])

    def angle_ms(self, weighed: Column) -> Column:
        """Mean square of each record's angle error, deg^2, from its thinned errors."""
        found = []
        for k, pair in enumerate(self._pairs):
            rows = np.flatnonzero(self.record == k)
            angle = weighed[rows[: len(rows) // 3]] * self._angle_unit
            found.append(float(np.sum(angle**2)) / max(float(pair.used[::THINNED].sum()), 1.0))
        return np.array(found)

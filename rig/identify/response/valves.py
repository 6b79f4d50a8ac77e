"""The regulators identified from set-points and measured pressures: gain, offset, lag and the limit of the flow each
way.

Each valve is fitted to its own pressure, so filling and exhausting do not cancel as they do in the difference.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from rig.columns import rms
from rig.errors import RecordError
from rig.identify.response.descent import descend
from rig.identify.search.uncertainty import independent_samples, inverse_information, spread_within
from rig.model.compiled.stages import compiled
from rig.model.equations.stages import regulators
from rig.model.parameters import Parameter, StageKind, StageModel
from rig.model.resample import held_commands, on_grid
from rig.record import Column, Record

_BOUNDS = {
    "gain": (0.5, 1.5, "1"),
    "offset_mpa": (-0.1, 0.1, "MPa"),
    "tau_s": (0.001, 1.0, "s"),
    "fill_limit_mpa_per_s": (0.05, 20.0, "MPa/s"),
    "exhaust_limit_mpa_per_s": (0.05, 20.0, "MPa/s"),
    "exhaust_ratio": (0.1, 10.0, "1"),
}
_LIMIT_SHARE = 0.98
"""A flow limit beyond the fastest slope of the data, by this share of its bound, was not reached: nothing is known of
it."""
_DEAD_STEP_S, _DEAD_MOST_S = 0.01, 0.2
"""Steps in which a dead time is looked for first, and its most."""
_DEAD_FINE = 0.05
"""How finely it is looked for about the best of them, as a share of a tick."""
_DEAD_WORTH = 0.95
"""A dead time is looked for when its first step or half of it takes this share of the error, and taken when it leaves
less than its fourth power."""
_DEAD_DIGITS = 5
"""Of its value in seconds: 10 us."""
_CHI_SQUARE_95 = 3.84
"""Of one degree of freedom."""
_ZERO = 1e-12
"""An rms that is none, MPa."""
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
_STARTS = ((0.05, 19.8), (0.05, 1.0))
"""Lag (s) and flow limit (MPa/s) from which the least squares start."""


_MOST_STEPS = 80
"""Steps of one fit at most."""
_SLOPE_TICKS = 10
"""Ticks over which the steepest change of a fitted pressure is taken; over fewer, a corner of the set-point counts."""


@dataclass(frozen=True)
class ValveFit:
    """Both regulators."""

    stage: StageModel
    rmse_mpa: tuple[float, float]
    """Of valve 1 and valve 2 over all records."""
    dead_time_s: float
    """Between set-point and answer, the same for both; 0 where a lag alone does as well."""
    notes: list[str]
    """What the records do not show: a flow limit that was never reached."""


@dataclass(frozen=True)
class _Fit:
    """One valve: values in the order of _BOUNDS, RMSE, standard deviations, and whether the records show each at
    all."""

    values: Column
    rmse_mpa: float
    independent: float
    """To how many independent samples its residuals amount."""
    std: Column
    shown: "np.typing.NDArray[np.bool_]"


@dataclass(frozen=True)
class _Step:
    """One record of one valve: set-points in force and the pressure measured."""

    command: Column
    pressure: Column


def identify_valves(records: Sequence[Record], dt_s: float, p0_mpa: float) -> ValveFit:
    """The regulators from records with set-points and both pressures; RecordError without pressures."""
    if not all(record.has_pressures for record in records):
        raise RecordError(f"{records[0].name}: the pressures were not measured: the regulators cannot be identified")
    both = {valve: [_steps_of(record, dt_s, p0_mpa, valve) for record in records] for valve in (1, 2)}

    @cache
    def late_by(ticks: float) -> dict[int, _Fit]:
        return {valve: _fit([_late(step, ticks) for step in steps], dt_s) for valve, steps in both.items()}

    def gained(ticks: float, better: float) -> float:
        pairs = zip(late_by(ticks).values(), late_by(better).values(), strict=True)
        return sum(2.0 * one.independent * math.log(max(one.rmse_mpa, _ZERO) / max(other.rmse_mpa, _ZERO))
                   for one, other in pairs)  # fmt: skip

    late = _dead_ticks(lambda ticks: math.hypot(*(fit.rmse_mpa for fit in late_by(ticks).values())), gained, dt_s)
    parameters: dict[str, Parameter] = {}
    errors, notes = [], []
    for valve, fit in late_by(late).items():
        errors.append(fit.rmse_mpa)
        for index, (name, (low, high, unit)) in enumerate(_BOUNDS.items()):
            value = float(fit.values[index])
            reached = not name.endswith("per_s") or (bool(fit.shown[index]) and value < _LIMIT_SHARE * high)
            if not reached:
                value = high
                fastest = _fastest([_late(step, late) for step in both[valve]], fit.values, dt_s, name)
                notes.append(f"valve {valve}: {name} was not reached; it is at least {fastest:.2g} MPa/s")
            determined = bool(np.isfinite(fit.std[index]))
            if reached and not determined:
                notes.append(f"valve {valve}: {name} is not determined by these records")
            deviation = float(fit.std[index]) if reached and determined else None
            parameters[f"valve{valve}_{name}"] = Parameter(value, unit, low, high, False, deviation, not reached)
    return ValveFit(
        StageModel(StageKind.REGULATORS, parameters), (errors[0], errors[1]), round(late * dt_s, _DEAD_DIGITS), notes
    )


def _dead_ticks(error: Callable[[float], float], gained: Callable[[float, float], float], dt_s: float) -> float:
    """Ticks between a set-point and the first answer of the regulators, by what is left of their pressures without so
    many; 0 unless a dead time explains much that a lag does not, and one of the steps unless the records tell a finer
    one from it (`gained`: twice the logarithm of the likelihood)."""
    none, step = error(0.0), max(1.0, round(_DEAD_STEP_S / dt_s))
    if min(error(0.5 * step), error(step)) > _DEAD_WORTH * none:
        return 0.0
    best = min(np.arange(0.0, _DEAD_MOST_S / dt_s + 0.5, step).tolist(), key=error)
    finer = _least(error, max(best - step, 0.0), best + step)
    best = finer if gained(best, finer) > _CHI_SQUARE_95 else best
    return best if error(best) < _DEAD_WORTH**4 * none else 0.0


def _least(error: Callable[[float], float], low: float, high: float) -> float:
    """Where an error of one valley is least, by golden sections."""
    while high - low > _DEAD_FINE:
        width = _GOLDEN * (high - low)
        if error(high - width) < error(low + width):
            high = low + width
        else:
            low = high - width
    return 0.5 * (low + high)


def _late(step: _Step, ticks: float) -> _Step:
    """The same with the set-points in force so many ticks later, between two as the delay of a model has it."""
    if not ticks:
        return step
    rows = np.arange(len(step.command))
    return _Step(np.interp(rows - ticks, rows, step.command), step.pressure)


def _steps_of(record: Record, dt_s: float, p0_mpa: float, valve: int) -> _Step:
    grid = on_grid(record, dt_s)
    command = held_commands(grid, p0_mpa)[valve - 1]
    pressure = grid.p1_mpa if valve == 1 else grid.p2_mpa
    return _Step(command, np.zeros(0) if pressure is None else pressure)


def _simulated(values: Column, step: _Step, dt_s: float) -> Column:
    """The valve's pressure, started at its first measured one."""
    p1, p2 = step.command.copy(), step.command.copy()
    state = np.array([1.0, step.pressure[0], step.pressure[0]])
    params = np.concatenate([values, values])
    compiled(regulators)(p1, p2, np.zeros(len(p1)), state, params, dt_s)
    return p1


def _fit(steps: Sequence[_Step], dt_s: float) -> _Fit:
    """Least squares from each start: as fast both ways first, then apart, for from afar a limit and a time constant of
    one way are alike."""
    low = np.array([bound[0] for bound in _BOUNDS.values()])
    high = np.array([bound[1] for bound in _BOUNDS.values()])

    def residuals(values: Column) -> Column:
        return np.concatenate([_simulated(values, step, dt_s) - step.pressure for step in steps])

    def alike(values: Column) -> Column:
        return residuals(np.append(values, 1.0))

    even = [
        descend(alike, np.array([1.0, 0.0, tau, limit, limit]), low[:-1], high[:-1], _MOST_STEPS)
        for tau, limit in _STARTS
    ]
    fit = descend(residuals, np.append(min(even, key=lambda one: one.cost).x, 1.0), low, high, _MOST_STEPS)
    rmse = rms(fit.residual)
    # residuals are slow: n of them say as much as so many fewer independent ones
    independent = independent_samples(fit.residual)
    inverse, blind = inverse_information(fit.jacobian * (high - low))
    std = spread_within(rmse * np.sqrt(np.diag(inverse) * len(fit.residual) / independent), blind)
    return _Fit(fit.x, rmse, independent, std * (high - low), np.any(fit.jacobian != 0.0, axis=0))


def _fastest(steps: Sequence[_Step], values: Column, dt_s: float, name: str) -> float:
    """The steepest rise (fill) or fall (exhaust) of the fitted pressure over some ticks, MPa/s: of the measured one it
    would be the monitor's noise."""
    sign = 1.0 if name.startswith("fill") else -1.0
    pressures = [_simulated(values, step, dt_s) for step in steps]
    return max(float(np.max(sign * (p[_SLOPE_TICKS:] - p[:-_SLOPE_TICKS]))) / (_SLOPE_TICKS * dt_s) for p in pressures)

"""The regulators identified from set-points and measured pressures: gain, offset, lag and the limit of the flow each
way.

Each valve is fitted to its own pressure, so filling and exhausting do not cancel as they do in the difference.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rig.columns import rms
from rig.errors import RecordError
from rig.identify.descent import descend
from rig.model.kernels import compiled
from rig.model.parameters import Parameter, StageKind, StageModel
from rig.model.resample import held_commands, on_grid
from rig.model.stages import regulators
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
_DEAD_WORTH = 0.95
"""A dead time is looked for when its first step takes this share of the error, and taken when it leaves less than its
fourth power."""
_STARTS = ((0.05, 19.8), (0.05, 1.0))
"""Lag (s) and flow limit (MPa/s) from which the least squares start."""


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
    late = _dead_ticks(both, dt_s)
    parameters: dict[str, Parameter] = {}
    errors, notes = [], []
    for valve, steps in both.items():
        delayed = [_late(step, late) for step in steps]
        fit = _best(delayed, dt_s)
        errors.append(fit.rmse_mpa)
        for index, (name, (low, high, unit)) in enumerate(_BOUNDS.items()):
            value = float(fit.values[index])
            reached = not name.endswith("per_s") or (bool(fit.shown[index]) and value < _LIMIT_SHARE * high)
            if not reached:
                value = high
                notes.append(
                    f"valve {valve}: {name} was not reached; it is at least {_fastest(steps, dt_s, name):.2g} MPa/s"
                )
            deviation = float(fit.std[index]) if reached and np.isfinite(fit.std[index]) else None
            parameters[f"valve{valve}_{name}"] = Parameter(value, unit, low, high, False, deviation, not reached)
    return ValveFit(StageModel(StageKind.REGULATORS, parameters), (errors[0], errors[1]), late * dt_s, notes)


def _dead_ticks(both: Mapping[int, Sequence[_Step]], dt_s: float) -> int:
    """Ticks between a set-point and the first answer of the regulators; 0 unless a dead time explains much that a lag
    does not."""

    def error(ticks: int) -> float:
        fits = [_best([_late(step, ticks) for step in steps], dt_s, 25) for steps in both.values()]
        return float(np.hypot(fits[0].rmse_mpa, fits[1].rmse_mpa))

    none, step = error(0), max(1, round(_DEAD_STEP_S / dt_s))
    if error(step) > _DEAD_WORTH * none:
        return 0
    tried = {ticks: error(ticks) for ticks in range(step, round(_DEAD_MOST_S / dt_s) + 1, step)}
    best = min(tried, key=lambda ticks: tried[ticks])
    return best if tried[best] < _DEAD_WORTH**4 * none else 0


def _late(step: _Step, ticks: int) -> _Step:
    """The same with the set-points in force so many ticks later."""
    if not ticks:
        return step
    return _Step(np.concatenate([np.full(ticks, step.command[0]), step.command[:-ticks]]), step.pressure)


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


def _best(steps: Sequence[_Step], dt_s: float, most_steps: int = 80) -> _Fit:
    """The best of the fits from each start."""
    return min((_fit(steps, dt_s, start, most_steps) for start in _STARTS), key=lambda fit: fit.rmse_mpa)


def _fit(steps: Sequence[_Step], dt_s: float, start: tuple[float, float], most_steps: int) -> _Fit:
    """Least squares from a lag and a flow limit: as fast both ways first, then apart, for from afar a limit and a time
    constant of one way are alike."""
    low = np.array([bound[0] for bound in _BOUNDS.values()])
    high = np.array([bound[1] for bound in _BOUNDS.values()])

    def residuals(values: Column) -> Column:
        return np.concatenate([_simulated(values, step, dt_s) - step.pressure for step in steps])

    def alike(values: Column) -> Column:
        return residuals(np.append(values, 1.0))

    tau, limit = start
    even = descend(alike, np.array([1.0, 0.0, tau, limit, limit]), low[:-1], high[:-1], most_steps)
    fit = descend(residuals, np.append(even.x, 1.0), low, high, most_steps)
    rmse = rms(fit.residual)
    covariance = np.linalg.pinv(fit.jacobian.T @ fit.jacobian, hermitian=True) * rmse**2
    return _Fit(fit.x, rmse, np.sqrt(np.diag(covariance)), np.any(fit.jacobian != 0.0, axis=0))


def _fastest(steps: Sequence[_Step], dt_s: float, name: str) -> float:
    """The steepest rise (fill) or fall (exhaust) of the pressure over 10 ticks, MPa/s."""
    sign = 1.0 if name.startswith("fill") else -1.0
    return max(float(np.max(sign * (step.pressure[10:] - step.pressure[:-10]))) / (10 * dt_s) for step in steps)

"""Records and sweeps as curves for the page: thinned out to what a screen can show, peaks kept. Called in the process
for what takes long."""

from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rig.errors import RecordError
from rig.excite.run_plan import RunPlan
from rig.log import compare
from rig.log.check import check
from rig.log.mcap.reader import McapLog
from rig.log.mcap.schema import ended_of
from rig.log.reader import read
from rig.record import Record
from rig.rig_config import RigConfig
from rig.service.queue.expander import plans_of
from rig.service.session.run_setup import program_of
from rig.service.web.units import units_of

CURVE_POINTS: Final = 2000
"""Points of one curve, and lines of a log, on a page at most."""
_PRESSURES: Final = ("p1_cmd_mpa", "p2_cmd_mpa", "p1_mpa", "p2_mpa")
_FACTS: Final = ("valid", "ticks", "missed", "dropped", "complete", "fault", "ended", "angle_zero_deg")
_NAMED: Final = 50

Rows = NDArray[np.intp]
Column = NDArray[np.float64]


def preview(path: Path, rig: RigConfig) -> dict[str, Any]:
    """A sweep as it would run: set-points over time, how long it takes, how near it comes to the envelope.

    EnvelopeError with time and value when it would leave it."""
    plans = plans_of(path, rig)
    p1, p2 = (np.concatenate(parts) for parts in zip(*(_set_points(plan) for plan in plans), strict=True))
    time_s = np.arange(len(p1)) * rig.period_ns / 1e9
    rows, own = ends(p1 - p2, CURVE_POINTS), rig.channels
    shown = {"p1_cmd_mpa": p1, "p2_cmd_mpa": p2} if own.has_valves else {"input": own.own_input(p1 - p2)}
    lowest, highest = (float(of([of(column) for column in shown.values()])) for of in (np.min, np.max))
    steps = max(float(np.abs(np.diff(column)).max(initial=0.0)) for column in shown.values())
    return {
        "units": units_of(own),
        "records": len(plans),
        "seconds": sum(plan.ticks for plan in plans) * rig.period_ns / 1e9,
        "names": [plan.name for plan in plans[:_NAMED]],
        "columns": {"t_s": _plain(time_s[rows]), **{name: _plain(column[rows]) for name, column in shown.items()}},
        "lowest": lowest,
        "highest": highest,
        "fastest_per_s": steps / (rig.period_ns / 1e9),
        "allowed": list(rig.limits.pressure_mpa) if own.has_valves else None,
        "allowed_per_s": rig.limits.slew_mpa_s * (1.0 if own.has_valves else 2.0 * own.input_per_mpa),
    }


def facts_of(path: Path) -> dict[str, Any]:
    """What a record says of itself; `problem` instead where it cannot be read."""
    try:
        with McapLog(path) as log:
            facts = log.result_facts
            return {key: facts.get(key) for key in _FACTS} | {"ended": ended_of(facts)}
    except RecordError as error:
        return {"valid": False, "problem": str(error).removeprefix(f"{path}: ")}


def record(path: Path) -> dict[str, Any]:
    """One record: its columns over time, what it says of itself, and its log."""
    shown = _first(path)
    with McapLog(path) as log:
        samples, lines = log.everything()
    begin_ns = int(samples.log_time_ns[0]) if len(samples) else 0
    log_lines = [{"t_s": (line.time_ns - begin_ns) / 1e9, "level": line.level, "text": line.message} for line in lines]
    seen = {"units": units_of(shown.channels), "columns": _columns(shown), "lines": log_lines[:CURVE_POINTS]}
    return {**facts_of(path), "seconds": float(shown.t_s[-1]), **seen}


def findings(path: Path) -> list[str]:
    """What `pamrig log check` says, without the path."""
    return [line.removeprefix(f"{path}: ") for line in check(path)]


def compared(a: Path, b: Path) -> dict[str, Any]:
    """Two records over the time they have in common: both, and B minus A, in their own unit."""
    (pair,) = compare.compare([_first(a)], [_first(b)]).pairs
    left = np.asarray(pair.b.angle_deg, dtype=np.float64) - np.asarray(pair.a.angle_deg, dtype=np.float64)
    rows, per_deg = ends(left, CURVE_POINTS), pair.channels.output_per_deg
    off = pair.angle.times(per_deg)
    return {
        "units": units_of(pair.channels),
        "a": _columns(pair.a, rows),
        "b": _columns(pair.b, rows),
        "difference": _plain(per_deg * left[rows]),
        "shift_s": pair.shift_s,
        "rmse": off.rms,
        "max": off.max,
        "mean": off.mean,
    }


def ends(column: Column, points: int) -> Rows:
    """Rows of a column (n,) to draw: of each stretch the ones with the smallest and the largest value, so that no peak
    is lost."""
    if len(column) <= points:
        return np.arange(len(column))
    stretches = points // 2
    size = len(column) // stretches
    whole = np.nan_to_num(column[: size * stretches]).reshape(stretches, size)
    first = np.arange(stretches) * size
    chosen = [first + whole.argmin(axis=1), first + whole.argmax(axis=1), [0, len(column) - 1]]
    return np.unique(np.concatenate(chosen))


def _set_points(plan: RunPlan) -> tuple[Column, Column]:
    """Of the whole run: at rest, ramp in, sweep, ramp out."""
    program = program_of(plan, 1)
    sweep = [np.asarray(column) for column in (program.p1_cmd_mpa, program.p2_cmd_mpa)]
    rest = program.rest_p1_mpa, program.rest_p2_mpa
    before = np.full(plan.settle_ticks + plan.zero_ticks, plan.p0_mpa)
    whole = []
    for column, at_rest in zip(sweep, rest, strict=True):
        ramps = [
            np.linspace(at_rest, column[0], plan.ramp_in_ticks, endpoint=False),
            np.linspace(column[-1], at_rest, plan.ramp_out_ticks),
        ]
        whole.append(np.concatenate([before, ramps[0], column, ramps[1]]))
    return whole[0], whole[1]


def _first(path: Path) -> Record:
    return read(path)[0]


def _columns(record: Record, rows: Rows | None = None) -> dict[str, list[float | None]]:
    if rows is None:
        rows = ends(record.dp_cmd_mpa if record.angle_deg is None else record.angle_deg, CURVE_POINTS)
    own = record.channels
    shown = {"t_s": record.t_s, "input": own.own_input(record.dp_cmd_mpa)}
    if record.angle_deg is not None:
        shown["output"] = own.own_output(record.angle_deg)
    if own.has_valves:
        shown |= {name: column for name in _PRESSURES if (column := getattr(record, name)) is not None}
    return {name: _plain(column[rows]) for name, column in shown.items()}


def _plain(column: Column) -> list[float | None]:
    """JSON has no not-a-number."""
    return [round(float(value), 5) if np.isfinite(value) else None for value in column]

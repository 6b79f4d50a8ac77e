"""Is a log whole, and is what it says true? Each doubt is one finding, one line of text.

The file's frame and CRCs, then its schema, then the ticks and values, then whether `valid` tells the truth.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
import yaml
from numpy.typing import NDArray

from rig.config import structure
from rig.errors import ConfigError, RecordError
from rig.log.mcap import schema
from rig.log.mcap.collector import LogLine, SampleCollector, is_sample_channel
from rig.log.mcap.columns import DTYPES, Samples, layout_of
from rig.log.mcap.contents import Contents, map_file
from rig.log.mcap.framing import MAGIC, DamageError
from rig.log.mcap.salvage import salvage
from rig.log.reader import record_from_columns, table_of
from rig.number_text import counted
from rig.realtime.faults import Fault
from rig.realtime.guard import Limits
from rig.record import Record
from rig.sample import ABSENT_BY_COLUMN, WIRES, Flag, Phase

ESSENTIAL: Final = (
    "tick",
    "scheduled_ns",
    "dp_cmd_mpa",
    "p1_cmd_mpa",
    "p2_cmd_mpa",
    "p1_mpa",
    "p2_mpa",
    "angle_deg",
    "phase",
    "run",
)
_FAILED = Flag.READ_ERROR | Flag.SUSPECT | Flag.BROKEN_WIRE
_CLOCK_SET_NS: Final = 946_684_800_000_000_000
"""1 January 2000: a wall clock before it was never set."""
_OLDEST_AGE_NS: Final = 10_000_000_000
_GAP_PERIODS: Final = 1.5
"""Two rows further apart than this are a gap, in periods: half a period is more than any clock jitters, and one tick
left out is two."""
_ANGLES_DEG: Final = (-360.0, 360.0)
"""What an angle from its zero can be (`rig.realtime.guard.Limits.angle_deg`)."""
_ROUNDING: Final = 1e-9
"""A value beyond its range by no more is on its end, in its own unit."""


def check(path: Path) -> list[str]:
    """Every finding about one file, none when all is well. RecordError when it cannot even be opened."""
    data = map_file(path)
    if bytes(data[: len(MAGIC)]) == MAGIC or path.name.endswith((".mcap", ".mcap.partial")):
        return list(_check_mcap(data))
    try:
        columns, facts = table_of(path)
        record = record_from_columns(columns, facts, path)
    except RecordError as error:
        return [str(error).removeprefix(f"{path}").lstrip(":, ")]
    return [*_check_empty(columns), *_check_columns(record)]


def _check_mcap(data: memoryview) -> Iterator[str]:
    if not len(data):
        yield "the file is empty"
        return
    found = salvage(data)
    for damage in found.damages:
        where = f"bytes {damage.start} to {damage.end}" if damage.end > damage.start else f"byte {damage.start}"
        yield f"{where}: {damage.what}"
    contents = found.contents
    contents.schemas.clear()  # what the file itself defines is judged, not what salvage assumes
    contents.channels.clear()
    collector = SampleCollector(contents, len(data))
    try:
        samples = collector.all_chunks(data)
    except DamageError as error:
        yield str(error)
        return
    yield from _check_end(contents.facts(schema.RESULT_METADATA))
    yield from _check_lines(collector.lines, samples)
    yield from _check_schema(contents)
    yield from _check_summary(contents, samples)
    if len(samples):
        yield from _check_samples(samples, contents, damaged=bool(found.damages))


def _check_schema(contents: Contents) -> Iterator[str]:
    kinds = contents.schemas
    ours = [c for c in contents.channels.values() if c.schema_id in kinds and is_sample_channel(c, kinds[c.schema_id])]
    if not ours:
        yield f"no channel {schema.SAMPLE_TOPIC} of {schema.SAMPLE_SCHEMA}; it has {contents.describe_channels()}"
        return
    layout = layout_of(kinds[ours[0].schema_id].data, schema.SAMPLE_SCHEMA, ours[0].id)
    missing = [name for name in ESSENTIAL if name not in layout.names]
    if missing:
        yield f"the schema lacks {', '.join(missing)}"
    for name, kind in zip(layout.names, layout.kinds, strict=True):
        if name in WIRES and DTYPES[kind] != DTYPES[WIRES[name].kind]:
            yield f"the schema has {name} as {kind}, not {WIRES[name].kind}"


def _check_summary(contents: Contents, samples: Samples) -> Iterator[str]:
    if not len(samples):
        yield "it holds no samples"
    if contents.finished and contents.statistics is not None and contents.statistics.message_count < len(samples):
        yield f"the summary counts {counted(contents.statistics.message_count, 'message')}, the file has more"
    if contents.finished and not contents.facts(schema.RESULT_METADATA):
        yield f"no metadata {schema.RESULT_METADATA}: how the run ended is not said"


def _check_samples(samples: Samples, contents: Contents, damaged: bool) -> Iterator[str]:
    run_facts, result = contents.facts(schema.RUN_METADATA), contents.facts(schema.RESULT_METADATA)
    lost = list(_check_order(samples)) + list(_check_counts(samples, result))
    yield from lost
    for name, kind in schema.unsound(run_facts | result).items():
        yield f"the fact `{name}` is {str((run_facts | result)[name])[:40]!r}, not {kind}"
    yield from _check_times(samples, run_facts)
    yield from _check_values(samples, _limits(contents))
    faults = sorted({int(code) for code in samples["fault"]} - {0})
    for code in faults:
        yield f"fault {_fault_name(code)} from tick {_first(samples, samples['fault'] == code)} on"
    if result.get("valid") is True and (lost or damaged or faults):
        yield "`valid` is true, and should be false for what stands above"
    whole = schema.ended_of(result) in (None, schema.Ended.COMPLETE)
    if result.get("valid") is False and whole and not (lost or damaged or faults):
        yield "`valid` is false, and nothing in the samples says why"


def _check_end(result: dict[str, Any]) -> Iterator[str]:
    """How the run ended, where that was not at the end of its sweep."""
    ended = schema.ended_of(result)
    if ended is schema.Ended.FAULT:
        yield f"the run ended in a fault: {result.get('fault') or 'which one is not said'}"
    elif ended is schema.Ended.STOPPED:
        yield "the run was stopped before its sweep was over"
    elif ended is schema.Ended.CUT:
        yield "the recording breaks off, or lacks a part"
    if result.get("valid") is True and ended not in (None, schema.Ended.COMPLETE):
        yield "`valid` is true, and should be false for that"


def _check_lines(lines: list[LogLine], samples: Samples) -> Iterator[str]:
    """What the loop or the recorder themselves wrote down as an error; each text once."""
    start_ns = int(samples.log_time_ns[0]) if len(samples) else 0
    bad = {line.message: line for line in reversed(lines) if line.level in ("error", "fatal")}
    for line in reversed(bad.values()):
        yield f"its log says {line.level} at {(line.time_ns - start_ns) / 1e9:.3f} s: {line.message}"


def _fault_name(code: int) -> str:
    return Fault(code).name if code in set(Fault) else str(code)


def _check_order(samples: Samples) -> Iterator[str]:
    ticks = samples["tick"].astype(np.int64)
    steps = np.diff(ticks)
    if (backwards := steps <= 0).any():
        yield f"ticks do not rise: {counted(int(backwards.sum()), 'time')}, first after tick {ticks[:-1][backwards][0]}"
    skipped = samples["missed"][1:].astype(np.int64)
    unexplained = (steps > 0) & (steps - 1 != skipped)
    if unexplained.any():
        lacking = int(np.abs(steps - 1 - skipped)[unexplained].sum())
        yield (
            f"{counted(lacking, 'tick is', 'ticks are')} missing without being counted as missed, first after tick "
            f"{ticks[:-1][unexplained][0]}"
        )
    gaps = np.diff(samples.sequence.astype(np.int64)) - 1
    if (gaps > 0).any():
        samples_were = counted(int(gaps[gaps > 0].sum()), "sample was", "samples were")
        yield f"{samples_were} lost between loop and file, first after tick {ticks[:-1][gaps > 0][0]}"
    missed = samples["missed"] > 0
    if missed.any():
        count = int(samples["missed"].sum())
        yield f"{counted(count, 'tick was', 'ticks were')} missed, first before tick {_first(samples, missed)}"


def _check_counts(samples: Samples, result: dict[str, Any]) -> Iterator[str]:
    there = {"ticks": len(samples), "records": len(samples), "missed": int(samples["missed"].sum())}
    for name, count in there.items():
        if name in result and result[name] != count:
            yield f"`{name}` says {result[name]}, the file has {count}"
    if result.get("dropped"):
        yield f"{counted(result['dropped'], 'sample was', 'samples were')} dropped by the recorder"


def _check_times(samples: Samples, run_facts: dict[str, Any]) -> Iterator[str]:
    scheduled = samples["scheduled_ns"]
    for earlier, later in (("scheduled_ns", "woken_ns"), ("woken_ns", "read_ns"), ("read_ns", "written_ns")):
        wrong = samples[later] < samples[earlier]
        if wrong.any():
            ticks = counted(int(wrong.sum()), "tick")
            yield f"{later} lies before {earlier} at {ticks}, first at tick {_first(samples, wrong)}"
    shift = samples.log_time_ns - scheduled
    if np.ptp(shift):
        yield f"the log time jumps against the loop's clock, first at tick {_first(samples, shift != shift[0])}"
    period_ns = run_facts.get("period_ns")
    if isinstance(period_ns, int) and "period_ns" not in schema.unsound(run_facts):
        expected = scheduled[0] + (samples["tick"].astype(np.int64) - int(samples["tick"][0])) * period_ns
        off = scheduled != expected
        if off.any():
            yield f"ticks are not due on the grid of {period_ns} ns, first at tick {_first(samples, off)}"
        if samples.log_time_ns[0] < _CLOCK_SET_NS:
            yield "the log time lies before the year 2000: the wall clock was not set"
    elif len(samples) > 1:
        yield from _check_steps(samples)
    for name in ("p1_age_ns", "p2_age_ns", "angle_age_ns"):
        wrong = (samples[name] < 0) | (samples[name] > _OLDEST_AGE_NS)
        if wrong.any():
            yield f"{name} is implausible, {samples[name][wrong][0]} at tick {_first(samples, wrong)}"


def _check_steps(samples: Samples) -> Iterator[str]:
    """The time of a log without a period (another program's): that it rises, and gaps that its ticks do not show."""
    steps_ns = np.diff(samples["scheduled_ns"])
    next_ticks = np.diff(samples["tick"].astype(np.int64)) == 1
    if (falls := steps_ns <= 0).any():
        yield f"time does not rise: {counted(int(falls.sum()), 'time')}, first after tick {_first(samples, falls)}"
    gaps = next_ticks & (steps_ns > _GAP_PERIODS * np.median(steps_ns))
    if gaps.any():
        yield (
            f"{counted(int(gaps.sum()), 'gap')} in time longer than {_GAP_PERIODS:g} periods, first "
            f"{steps_ns[gaps][0] / 1e9:g} s after tick {_first(samples, gaps)}"
        )


def _check_values(samples: Samples, limits: Limits) -> Iterator[str]:
    """Values outside what the sensor can give; those that the guard itself marked as failed are known to be wrong."""
    ranges = {"p1_mpa": limits.monitor_mpa, "p2_mpa": limits.monitor_mpa, "angle_deg": _ANGLES_DEG}
    ranges |= dict.fromkeys(("p1_cmd_mpa", "p2_cmd_mpa"), limits.pressure_mpa)
    known_bad = (samples["flags"] & np.uint32(_FAILED)) != 0
    if (unknown := ~np.isin(samples["phase"], [int(phase) for phase in Phase])).any():
        yield f"the phase is none at {counted(int(unknown.sum()), 'tick')}, first at tick {_first(samples, unknown)}"
    if (none := ~np.isfinite(samples["dp_cmd_mpa"])).any():
        yield f"dp_cmd_mpa is no number at {counted(int(none.sum()), 'tick')}, first at tick {_first(samples, none)}"
    for name, (low, high) in ranges.items():
        values = samples[name]
        absent = (samples["flags"] & np.uint32(ABSENT_BY_COLUMN.get(name, 0))) != 0
        unmarked = np.isnan(values) & ~absent & ~known_bad
        if name in ABSENT_BY_COLUMN and unmarked.any():
            yield (
                f"{name} is missing without a flag at {counted(int(unmarked.sum()), 'tick')}, first at tick "
                f"{_first(samples, unmarked)}"
            )
        yield from _outside(name, values, low, high, samples["tick"], "tick", ~known_bad)


def _outside(
    name: str, values: NDArray[Any], low: float, high: float, places: NDArray[Any], place: str, judged: Any
) -> Iterator[str]:
    wrong = judged & ((values < low - _ROUNDING) | (values > high + _ROUNDING) | np.isinf(values))
    if wrong.any():
        row = int(np.argmax(wrong))
        rows = counted(int(wrong.sum()), "row")
        yield f"{name} is outside {low:g} .. {high:g} at {rows}, first {values[row]:g} at {place} {places[row]:g}"


def _check_empty(columns: Mapping[str, NDArray[Any]]) -> Iterator[str]:
    """Measurements that have a column and not a single number in it, which a record leaves out; not those of which each
    row says itself that there are none."""
    flags = columns.get("flags", np.zeros(1)).astype(np.int64)
    for name, absent in ABSENT_BY_COLUMN.items():
        if name in columns and np.isnan(columns[name]).all() and not (flags & int(absent)).all():
            yield f"{name} has a column, and no number in it"


def _check_columns(record: Record) -> Iterator[str]:
    """A log without ticks: what can be said of its columns."""
    limits = Limits()
    ranges = {"p1_mpa": limits.monitor_mpa, "p2_mpa": limits.monitor_mpa, "angle_deg": _ANGLES_DEG}
    for name, column in record.columns().items():
        low, high = ranges.get(name, (-np.inf, np.inf))
        yield from _outside(name, column, low, high, record.t_s, "second", True)
        if name in ranges and np.isnan(column).any():
            missing = int(np.isnan(column).sum())
            yield f"{name} is missing in {missing} of {counted(len(record), 'row')}"
    steps = np.diff(record.t_s)
    if len(steps) and (gaps := steps > _GAP_PERIODS * record.period_s).any():
        row = int(np.argmax(gaps))
        yield (
            f"{counted(int(gaps.sum()), 'gap')} in time longer than {_GAP_PERIODS:g} periods, first {steps[row]:g} s "
            f"after {record.t_s[row]:g} s"
        )


def _limits(contents: Contents) -> Limits:
    """The limits of the rig that made the file, by the config inside it; the usual ones without it."""
    try:
        raw = yaml.safe_load(contents.attachments.get("rig.yaml", b"{}"))
        given = raw.get("limits", {}) if isinstance(raw, dict) else {}
        return structure(given, Limits, "rig.yaml")
    except (yaml.YAMLError, ConfigError, UnicodeDecodeError):
        return Limits()


def _first(samples: Samples, where: NDArray[np.bool_]) -> int:
    return int(samples["tick"][int(np.argmax(where))])

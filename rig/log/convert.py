"""Everything a log holds as one value, and from it, or from a record, a file in our format.

A record that comes from elsewhere becomes samples with the phase SWEEP and with what nobody measured marked as absent.
"""

import bisect
import math
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rig.errors import RecordError
from rig.further_channels import PLACES, furthers_of
from rig.log.mcap import schema
from rig.log.mcap.collector import LogLine
from rig.log.mcap.columns import DTYPES, Array, Samples, kept_as, message_rows, pack_columns
from rig.log.mcap.reader import McapLog
from rig.log.mcap.writer import RunWriter
from rig.log.replay import ReplayComparison
from rig.outputs import UNFINISHED, make_folder
from rig.record import AGED, Record
from rig.sample import ABSENT_BY_COLUMN, WIRES, Phase

CHUNK_ROWS = 100
"""Rows in a chunk: 0.5 s at 200 Hz, between what a recorder puts into one in real time (a flush) and in virtual time
(`rig.log.mcap.writer.CHUNK_SAMPLES`)."""
_BATCH_ROWS = 40 * CHUNK_ROWS
_Message = tuple[int, int, bytes]
"""Log time, channel, data."""
_FROM_TIME = frozenset({"scheduled_ns", "woken_ns", "read_ns", "written_ns"})
"""Fields that a record's time and lateness make."""


@dataclass(frozen=True)
class LogContent:
    """A log, whole: what a round trip through another format must bring back."""

    samples: Samples
    run_facts: Mapping[str, Any]
    result_facts: Mapping[str, Any]
    attachments: Mapping[str, bytes] = field(default_factory=dict)
    lines: tuple[LogLine, ...] = ()
    comparison: ReplayComparison | None = None
    """A replay's, derived from the samples and the recording: written as a channel of its own, not read back."""


def read_content(path: Path) -> LogContent:
    """All of an MCAP file; RecordError when it is not whole."""
    with McapLog(path) as log:
        samples, lines = log.everything()
        return LogContent(samples, log.run_facts, log.result_facts, log.attachments, tuple(lines))


def write_content(content: LogContent, path: Path) -> Path:
    """Write a log as it was, folders on the way are made; RecordError when `path` exists or cannot be written."""
    make_folder(path.parent)
    writer = RunWriter(path, content.run_facts, content.attachments, unfinished=f".{os.getpid()}{UNFINISHED}")
    try:
        extra = sorted([*_log_messages(writer, content.lines), *_comparison_messages(writer, content.comparison)])
        for records, times_ns in _runs(content.samples, writer.sample_channel):
            writer.add_records(records, times_ns)
            due = bisect.bisect_right(extra, times_ns[-1], key=lambda message: message[0])
            for time_ns, channel, message in extra[:due]:
                writer.put(channel, message, time_ns)
            del extra[:due]
            writer.close_chunk()
        for time_ns, channel, message in extra:
            writer.put(channel, message, time_ns)
        return writer.finish(content.result_facts)
    except BaseException:
        writer.discard()
        raise


def _runs(samples: Samples, channel: int) -> Iterator[tuple[bytes, list[int]]]:
    """The samples as message records, CHUNK_ROWS at a time, with their log times."""
    for start in range(0, len(samples), _BATCH_ROWS):
        part = samples.rows(slice(start, start + _BATCH_ROWS))
        rows, times_ns = message_rows(part, channel), part.log_time_ns.tolist()
        for first in range(0, len(rows), CHUNK_ROWS):
            yield rows[first : first + CHUNK_ROWS].tobytes(), times_ns[first : first + CHUNK_ROWS]


def _log_messages(writer: RunWriter, lines: Iterable[LogLine]) -> Iterator[_Message]:
    for time_ns, level, text in lines:
        yield time_ns, writer.log_channel, schema.log_message(level, text, time_ns)


def _comparison_messages(writer: RunWriter, comparison: ReplayComparison | None) -> Iterator[_Message]:
    """The messages of a replay's own channel."""
    if comparison is None:
        return
    channel = writer.open_channel(schema.REPLAY_TOPIC, schema.REPLAY_SCHEMA, schema.REPLAY_WIRES)
    columns: dict[str, Array] = {
        "tick": comparison.tick,
        "recorded_tick": comparison.recorded_tick,
        "recorded_angle_deg": comparison.recorded_deg,
        "angle_deg": comparison.replayed_deg,
        "residual_deg": comparison.residual_deg,
    }
    rows = pack_columns(columns, schema.REPLAY_WIRES)
    yield from (
        (time_ns, channel, row.tobytes()) for time_ns, row in zip(comparison.log_time_ns.tolist(), rows, strict=True)
    )


def write_record(record: Record, path: Path, facts: Mapping[str, Any]) -> Path:
    """Write columns over time as a finished log; no run loop was there, and `facts` should say what was: `started_ns`,
    since 1970, when it began. RecordError for facts that cannot be so."""
    for name, allowed in schema.unsound(facts).items():
        raise RecordError(f"{path}: fact {name}: {facts[name]!r:.60}; allowed: {allowed}")
    return write_content(content_of_record(record, facts), path)


def content_of_record(record: Record, facts: Mapping[str, Any]) -> LogContent:
    """A record as the log it would be; `facts` are added to its own. It is `valid` or not where they say so, else
    nothing is said of it."""
    given = {"name": record.name} | dict(record.facts) | dict(facts)
    if not given.get("t0_s"):
        given.pop("t0_s", None)  # the log's own time says as much
    samples = samples_of(record, schema.count_of(given, "started_ns"))
    result: dict[str, Any] = {"ticks": len(record), "missed": int(samples["missed"].sum()), "dropped": 0}
    if "valid" in given:
        result["valid"] = bool(given.pop("valid"))
    return LogContent(samples, given, result)


def samples_of(record: Record, started_ns: int) -> Samples:
    """A record as samples that start at `started_ns` since the Unix epoch; what is not known is NaN, flagged absent, or
    zero."""
    count, where = len(record), record.source or record.name
    fields: dict[str, Array] = {
        name: np.full(count, np.nan if wire.kind == "double" else 0, DTYPES[wire.kind]) for name, wire in WIRES.items()
    }
    known = record.columns()
    for name in fields.keys() & known.keys():
        fields[name][:] = kept_as(fields[name].dtype, known[name], f"{where}: {name}")
    for place, one in zip(PLACES, furthers_of(record.facts), strict=False):
        fields[place][:] = known.get(one.name, np.nan)
    offsets = _nanoseconds(record.t_s, 1e9, f"{where}: t_s, in ns")
    late = _nanoseconds(known["lateness_us"], 1e3, f"{where}: lateness_us, in ns") if "lateness_us" in known else 0
    for name in AGED:
        if f"{name}_age_s" in known:
            fields[f"{name}_age_ns"] = _nanoseconds(known[f"{name}_age_s"], 1e9, f"{where}: {name}_age_s, in ns")
    fields["scheduled_ns"] = offsets
    for name in _FROM_TIME - {"scheduled_ns"}:
        fields[name] = offsets + late
    if "tick" not in known:
        fields["tick"][:] = grid_ticks(record)
    if "phase" not in known:
        fields["phase"][:] = Phase.SWEEP
    if "run" not in known:
        fields["run"][:] = 1
    if "angle_zero_deg" not in known:
        fields["angle_zero_deg"][:] = 0.0
    for name, flag in ABSENT_BY_COLUMN.items():
        fields["flags"][np.isnan(fields[name])] |= np.uint32(flag)
    return Samples(fields, offsets + np.int64(started_ns), np.arange(count, dtype=np.uint32))


def _nanoseconds(values: Array, per_unit: float, where: str) -> Array:
    with np.errstate(over="ignore"):  # what is too long for a file is told as that
        return kept_as(np.dtype(np.int64), np.rint(values * per_unit), where)


def unkept_columns(record: Record) -> list[str]:
    """The columns of a record that our format has no field for."""
    kept = (set(WIRES) - _FROM_TIME) | {one.name for one in furthers_of(record.facts)}
    return sorted(set(record.extra) - kept - {"lateness_us", *(f"{name}_age_s" for name in AGED)})


def grid_ticks(record: Record) -> Array:
    """Index of each row on the grid of the usual period; the plain row number where time is too irregular for one."""
    rows = np.arange(len(record))
    if len(record) < 2 or not math.isfinite(record.period_s):
        return rows
    ticks = np.rint(record.t_s / record.period_s).astype(np.int64)
    return ticks if (np.diff(ticks) > 0).all() and ticks[-1] < 1 << 32 else rows

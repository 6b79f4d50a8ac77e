"""Rescue of a recording that was cut or damaged: what proved itself goes into a new file, and what is missing is said.

The damaged file stays as it is. A finished file without damage needs nothing and gets nothing.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from rig.errors import RecordError
from rig.log.convert import LogContent, write_content
from rig.log.log_files import stem
from rig.log.mcap import schema
from rig.log.mcap.collector import LogLine, SampleCollector
from rig.log.mcap.columns import Samples
from rig.log.mcap.contents import map_file
from rig.log.mcap.framing import DamageError, Unpacker
from rig.log.mcap.salvage import DamagedStretch, Salvage, salvage

RECOVERED_SUFFIX: Final = ".recovered.mcap"


@dataclass(frozen=True)
class SampleGap:
    """A stretch without samples, between two that were saved; times are seconds from the first saved sample."""

    from_s: float
    to_s: float
    records: int


@dataclass(frozen=True)
class Recovery:
    """What was saved, and what was not."""

    file: Path
    """The new file, or the old one when nothing had to be done."""
    records: int
    gaps: tuple[SampleGap, ...]
    unsaved_bytes: int
    """Bytes after the last saved sample that proved nothing: at most so much was lost at the end."""
    lost_at_the_ends: int | None
    """Samples missing before the first and after the last saved one; None when the file does not say how many it
    held."""
    damages: tuple[DamagedStretch, ...]
    period_s: float

    @property
    def lost_records(self) -> int:
        """Samples known to be missing."""
        return sum(gap.records for gap in self.gaps) + (self.lost_at_the_ends or 0)

    @property
    def lost_seconds(self) -> float:
        """Time known to be missing; what a cut at the end took was never flushed and is not known."""
        return self.lost_records * self.period_s


def recover(path: Path, target: Path | None = None) -> Recovery:
    """Save what can be saved of the MCAP file at `path` into `target` (default: NAME.recovered.mcap beside it).

    RecordError when nothing proved itself, or `target` exists.
    """
    data = map_file(path)
    found = salvage(data)
    samples, lines, found = _collect(data, found)
    if found.whole:
        return _described(path, samples, found)
    if not len(samples):
        first = found.damages[0] if found.damages else DamagedStretch(0, 0, "it holds no chunk")
        raise RecordError(
            f"{path}: nothing to save: no chunk of samples proves itself (byte {first.start}: {first.what})"
        )
    target = target or path.with_name(stem(path) + RECOVERED_SUFFIX)
    described = _described(target, samples, found)
    run_facts = found.contents.facts(schema.RUN_METADATA)
    kept_facts = found.contents.facts(schema.RESULT_METADATA)
    result = kept_facts | _result_facts(described, path, kept_facts)
    write_content(LogContent(samples, run_facts, result, found.contents.attachments, tuple(lines)), target)
    return described


def _collect(data: memoryview, found: Salvage) -> tuple[Samples, list[LogLine], Salvage]:
    """The samples and lines of all proven chunks; a chunk that holds something else counts as damage."""
    collector, unpacker = SampleCollector(found.contents, len(data)), Unpacker(len(data))
    for chunk in found.contents.chunks:
        try:
            collector.feed(unpacker.open(chunk), chunk.start)
        except DamageError as error:
            found.damages.append(DamagedStretch(chunk.start, chunk.start + len(chunk.packed), error.what))
    try:
        return collector.samples(), collector.lines, found
    except DamageError as error:
        raise RecordError(f"{error}") from None


def _described(file: Path, samples: Samples, found: Salvage) -> Recovery:
    gaps, period_s = _gaps(samples)
    total = found.contents.facts(schema.RESULT_METADATA).get("records")
    inside = len(samples) + sum(gap.records for gap in gaps)
    ends = max(total - inside, 0) if isinstance(total, int) else None
    last = found.contents.chunks[-1] if found.contents.chunks else None
    tail = [damage for damage in found.damages if last is None or damage.start > last.start]
    unsaved = sum(damage.end - damage.start for damage in tail)
    return Recovery(file, len(samples), gaps, unsaved, ends, tuple(found.damages), period_s)


def _gaps(samples: Samples) -> tuple[tuple[SampleGap, ...], float]:
    """Where the recorder's count jumps, and the usual time between samples."""
    if len(samples) < 2:
        return (), 0.0
    time_s = (samples["scheduled_ns"] - samples["scheduled_ns"][0]) / 1e9
    missing = np.diff(samples.sequence.astype(np.int64)) - 1
    rows = np.flatnonzero(missing > 0)
    gaps = tuple(SampleGap(float(time_s[row]), float(time_s[row + 1]), int(missing[row])) for row in rows)
    return gaps, float(np.median(np.diff(time_s)))


def _result_facts(recovery: Recovery, source: Path, result: Mapping[str, Any]) -> dict[str, Any]:
    """What the new file says of itself: it is never valid, how its run ended as far as that is known, and how much is
    missing."""
    lost = recovery.lost_records or not result
    ended = schema.Ended.CUT if lost else schema.ended_of(result) or schema.Ended.CUT
    return {
        "valid": False,
        "ended": str(ended),
        "recovered_from": source.name,
        "lost_records": recovery.lost_records,
        "lost_seconds": recovery.lost_seconds,
        "lost_spans_s": [[gap.from_s, gap.to_s] for gap in recovery.gaps],
        "unsaved_bytes": recovery.unsaved_bytes,
    }

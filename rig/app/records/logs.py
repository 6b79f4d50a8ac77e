"""What the commands about logs do between their arguments and rig.log: finding files, describing, choosing a way in."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, NamedTuple

import yaml

from rig.errors import RecordError
from rig.further_channels import furthers_of
from rig.log import log_files, reader
from rig.log.convert import LogContent, content_of_record, read_content, unkept_columns
from rig.log.exchange import SUFFIXES, read_exported
from rig.log.foreign.guess import Guess, guess
from rig.log.foreign.kinds import FileKind, kind_of
from rig.log.foreign.mapping import Mapping as ColumnMapping
from rig.log.foreign.mapping import left_out, load_mapping, mapped, mapping_of, raw_table
from rig.log.foreign.tables import foreign_columns, read_tdms
from rig.log.mcap.reader import McapLog
from rig.log.mcap.schema import ended_of, sound, unsound
from rig.log.mcap.writer import PARTIAL_SUFFIX
from rig.model.resample import on_grid
from rig.outputs import check_free, file_name, make_folder, targets_in
from rig.record import Record
from rig.report.shown_text import in_one_line
from rig.sample import Phase

_SHORTEST_PERIOD_S: Final = 1e-4
"""Of an export on a regular grid: 50 rows for each of 5 ms. Shorter fills the disk with what was interpolated."""
IMPORTED: Final = "imported_from"
"""The run fact of a log that was made of another tool's file, of whose run nothing is known: that file's name."""
UNFINISHED: Final = "not finished: still being written, or cut; `pamrig log recover` saves what it holds"


def found_files(paths: tuple[Path, ...]) -> list[Path]:
    """The paths themselves, and for a folder every log in it; RecordError for a folder without."""
    return [file for path in paths for file in (log_files.logs_in(path) if path.is_dir() else [path])]


def found_or_unfinished(paths: tuple[Path, ...]) -> tuple[list[Path], list[Path]]:
    """As `found_files`, and what recorders began in the folders and did not finish; a folder with neither is a
    RecordError."""
    finished, unfinished = [], []
    for path in paths:
        inside = log_files.below(path) if path.is_dir() else ()
        begun = sorted(file for file in inside if file.name.endswith(PARTIAL_SUFFIX))
        unfinished += begun
        try:
            finished += found_files((path,))
        except RecordError:
            if not begun:
                raise
    return finished, unfinished


def describe(path: Path) -> dict[str, Any]:
    """What a file holds, as plain data."""
    if kind_of(path) is FileKind.MCAP:
        return _describe_mcap(path)
    records = reader.read(path, phases=None)
    return {
        "file": str(path),
        "records": [_describe_record(record) for record in records],
        "facts": dict(records[0].facts),
    }


OVERVIEW: Final = ("log", "session", "began (UTC)", "seconds", "samples", "missed", "ended")
"""The columns of `overview`."""


def overview(described: Mapping[str, Any]) -> list[list[str]]:
    """A line of a table for each record of a described file, in the order of `OVERVIEW`; a fault stands behind how the
    record ended."""
    file, facts = described["file"], described["facts"]
    session = str(facts.get("session", ""))
    began = "" if (started_ns := sound(facts).get("started_ns")) is None else _utc(started_ns)
    if "records" in described:
        return [
            [file, session, began, f"{one['seconds']:.4g}", str(one["rows"]), "", ""] for one in described["records"]
        ]
    ended = ": ".join(filter(None, (described["ended"], str(facts.get("fault") or ""))))
    missed = str(facts.get("missed", ""))
    return [[file, session, began, f"{described['seconds']:.4g}", str(described["samples"]), missed, ended]]


def plain_lines(described: Mapping[str, Any]) -> Iterator[str]:
    """A description for a person: a line a value, what belongs to one key below it."""
    for key, value in described.items():
        if isinstance(value, Mapping) and value:
            yield in_one_line(f"{key}:")
            yield from (f"  {line}" for line in plain_lines(value))
        elif isinstance(value, list) and value and all(isinstance(each, Mapping) for each in value):
            yield in_one_line(f"{key}:")
            yield from (f"  {line}" for each in value for line in plain_lines(each))
        else:
            yield in_one_line(f"{key}: {_shown(key, value)}")


def _shown(key: str, value: Any) -> str:
    if key == "started_ns" and not unsound({key: value}):
        return f"{value} ({_utc(value)} UTC)"
    if isinstance(value, list):
        return ", ".join(map(str, value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _utc(started_ns: int) -> str:
    return f"{datetime.fromtimestamp(started_ns / 1e9, UTC):%Y-%m-%d %H:%M:%S}"


def _describe_mcap(path: Path) -> dict[str, Any]:
    with McapLog(path) as opened:
        samples, lines = opened.everything()
        start_ns = int(samples.log_time_ns[0]) if len(samples) else 0
        phases = {
            phase.name: int((samples["phase"] == phase).sum()) for phase in Phase if (samples["phase"] == phase).any()
        }
        seconds = (int(samples["scheduled_ns"][-1]) - int(samples["scheduled_ns"][0])) / 1e9 if len(samples) else 0.0
        return {
            "file": str(path),
            "samples": len(samples),
            "seconds": seconds,
            "bytes_a_record": path.stat().st_size / max(len(samples), 1),
            "ended": _ended(opened),
            "phases": phases,
            "facts": opened.run_facts | opened.result_facts,
            "attachments": {name: len(data) for name, data in opened.attachments.items()},
            "channels": opened.contents.describe_channels(),
            "log": [((line.time_ns - start_ns) / 1e9, line.level, line.message) for line in lines],
        }


def _ended(opened: McapLog) -> str:
    """How the run of a log ended, or why that is not known."""
    source = opened.run_facts.get(IMPORTED)
    unknown = "not said" if source is None else f"not known: imported from {source}"
    return str(ended_of(opened.result_facts) or unknown)


def _describe_record(record: Record) -> dict[str, Any]:
    return {
        "name": record.name,
        "rows": len(record),
        "seconds": float(record.t_s[-1]),
        "period_s": record.period_s if len(record) > 1 else None,
        "columns": list(record.columns()),
    }


def import_content(path: Path, mapping_path: Path | None) -> tuple[LogContent, list[str]]:
    """A foreign file as a log, and the columns that found no place in it. RecordError for anything ambiguous."""
    _require_file(path)
    unused: list[str] = []
    if mapping_path is None:
        if path.suffix.lower() in (".parquet", ".mat") or kind_of(path) is FileKind.TEXT:
            content = read_exported(path)
            if content is not None:
                return content, []
        if path.suffix.lower() in (".parquet", ".mat"):
            raise RecordError(f"{path}: not written by `pamrig log export`; export it as CSV and give a --mapping")
        if kind_of(path) is FileKind.MCAP:
            raise RecordError(f"{path}: importing MCAP needs a --mapping; {_channels(path)}")
        (record,) = reader.read(path, phases=None)
        unused = foreign_columns(read_tdms(path)) if kind_of(path) is FileKind.TDMS else []
    else:
        record, unused = _import_by(load_mapping(mapping_path), path)
    return content_of_record(record, {IMPORTED: path.name}), unused + unkept_columns(record)


class Imported(NamedTuple):
    """A foreign file on its way to a log."""

    source: Path
    target: Path
    content: LogContent
    not_kept: list[str]
    """Its columns that found no place in the log."""


def imports(files: Sequence[Path], mapping_path: Path | None, out: Path | None) -> Iterator[Imported]:
    """Each foreign file as a log, one in memory at a time, with where it goes: `out`, or by its own name into that
    folder, by default the current one. All are read once before the first is given, so that one that cannot be
    imported leaves no half of a folder behind; RecordError, RigError as for `import_content`, and where a log is in
    the way."""
    if len(files) == 1 and out is not None and out.suffix and not out.is_dir():
        targets = [out]
    else:
        targets = targets_in(out or Path(), map(log_files.stem, files), ".mcap")
    if len(files) > 1:
        check_free(targets)
        for file in files:
            import_content(file, mapping_path)
    for file, target in zip(files, targets, strict=True):
        yield Imported(file, target, *import_content(file, mapping_path))


def _require_file(path: Path) -> None:
    """RecordError for a folder, which may hold tables of other shapes and notes beside those that are meant."""
    if path.is_dir():
        suffixes = Counter(file.suffix for file in path.iterdir() if file.suffix and file.is_file())
        suffix = suffixes.most_common(1)[0][0] if suffixes else ".csv"
        raise RecordError(f"{path}: a folder; name its files, as in {path}/*{suffix}")


def _import_by(mapping: ColumnMapping, path: Path) -> tuple[Record, list[str]]:
    """The table at `path` as a record, and the columns that the mapping has no use for."""
    raw = raw_table(path, mapping)
    columns, facts = mapped(raw, mapping)
    return reader.record_from_columns(columns, facts, path), left_out(raw, mapping)


def proposed_mapping(path: Path) -> tuple[Guess, str]:
    """What a mapping for FILE may be, and its YAML, by which FILE can be imported; RecordError when there is none."""
    _require_file(path)
    found = guess(path)
    text = yaml.safe_dump(found.mapping, sort_keys=False, allow_unicode=True, default_flow_style=None, width=110)
    _import_by(mapping_of(yaml.safe_load(text), path), path)
    return found, f"# proposed for {path.name}; look it through before it is used\n{text}"


def _channels(path: Path) -> str:
    with McapLog(path) as opened:
        return f"it has {opened.contents.describe_channels()}"


def contents_of(path: Path, period_s: float | None) -> list[tuple[Path, LogContent]]:
    """What a log holds, whole; or its sweeps on a regular grid of `period_s`. Each with the name of a file for it."""
    if period_s is None and kind_of(path) is FileKind.MCAP:
        return [(path, read_content(path))]
    records = reader.read(path, reader.SWEEP_ONLY if period_s else None)
    if period_s is not None:
        records = [_resampled(record, period_s) for record in records]
    several = len(records) > 1
    return [
        (path.with_name(f"{file_name(record.name)}.mcap") if several else path, content_of_record(record, {}))
        for record in records
    ]


def _resampled(record: Record, period_s: float) -> Record:
    if not _SHORTEST_PERIOD_S <= period_s <= record.t_s[-1]:
        raise RecordError(
            f"{record.source}: a period of {period_s:g} s; allowed is {_SHORTEST_PERIOD_S:g} s up to the "
            f"record's {record.t_s[-1]:g} s"
        )
    facts = dict(record.facts) | {"resampled_to_s": period_s, "resampled_from_rows": len(record)}
    kept = {"reference_deg", *(one.name for one in furthers_of(facts))}
    return replace(on_grid(record, period_s, kept), facts=facts)


def exports(
    files: Sequence[Path], kind: str, out: Path | None, period_s: float | None
) -> Iterator[tuple[Path, LogContent]]:
    """Where each log goes, and what it holds: one in memory at a time. All are read once before the first is given, so
    that a damaged one leaves no half of a folder behind, nor one that stands already; RecordError, RigError as for
    `contents_of`, `export_targets` and `check_free`."""
    names = [name for file in files for name, _ in contents_of(file, period_s)]
    check_free(places := export_targets(names, kind, out))
    targets = iter(places)
    for file in files:
        for _, content in contents_of(file, period_s):
            yield next(targets), content


def export_targets(logs: list[Path], kind: str, out: Path | None) -> list[Path]:
    """Where the exports of `logs` go; RigError when the folder cannot be made, the name of the one file says
    another kind, or two would be one file beside their logs."""
    names = [log_files.stem(file) for file in logs]
    if out is None:
        beside = [file.with_name(name + SUFFIXES[kind]) for file, name in zip(logs, names, strict=True)]
        if twice := next((place for place in beside if beside.count(place) > 1), None):
            raise RecordError(f"{twice}: two records would be written there; -o FOLDER gives each a file of its own")
        return beside
    if len(logs) == 1 and not out.is_dir() and out.suffix:
        if not out.name.lower().endswith(SUFFIXES[kind]):
            raise RecordError(f"-o {out}: a {kind} file ends in {SUFFIXES[kind]}; --to says which kind is written")
        return [out]
    make_folder(out)
    return targets_in(out, names, SUFFIXES[kind])

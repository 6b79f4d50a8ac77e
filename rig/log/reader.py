"""Logs into records: MCAP, CSV, CSV.gz, TDMS, or a folder of them.

Which files are logs is log_files.py. Time stays as it is, irregular or not; nothing here resamples. A file that is not
whole is refused with the byte at fault.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rig.channels import channels_of
from rig.errors import RecordError
from rig.further_channels import PLACES, furthers_of
from rig.log.foreign.delimited import read_table
from rig.log.foreign.kinds import FileKind, kind_of
from rig.log.foreign.sidecar import read_sidecar
from rig.log.foreign.tables import own_columns, read_tdms
from rig.log.log_files import is_mcap, logs_in, name_facts, pairing_name, warn
from rig.log.mcap import schema
from rig.log.mcap.columns import Array, Samples
from rig.log.mcap.reader import McapLog
from rig.log.session_times import LOOP_NS
from rig.record import AGED, MAIN_COLUMNS, Column, Record
from rig.sample import Phase

SWEEP_ONLY: Final = (Phase.SWEEP,)
RUNS_LIMIT: Final = 1000
"""Runs in one file; the recorder puts one into each, other tools may merge files."""

_NOT_COMPLETE: Final[Mapping[schema.Ended | None, str]] = {
    schema.Ended.STOPPED: "it was stopped before its sweep was over",
    schema.Ended.FAULT: "it ended in a fault",
    schema.Ended.CUT: "it breaks off or lacks a part",
}
_KEPT_FIELDS = (
    *("tick", "missed", "p1_raw", "p2_raw", "angle_raw", "excitation_raw", "angle_zero_deg", "reference_deg"),
    *("run", "state", "phase", "flags", "fault"),
)
_TIMES = ("scheduled_ns", "woken_ns")


class NotCompleteError(RecordError):
    """The record is whole as a file, and not a measurement of its whole sweep."""


def read(path: Path, phases: Iterable[Phase] | None = SWEEP_ONLY) -> list[Record]:
    """All records in the file or folder, those of a folder sorted by session, name and repeat.

    Of a folder, records that are not complete (stopped, ended in a fault, cut) are left out, with a warning that names
    them: whoever asks for a folder asks for its measurements. A file that is named itself is read as it is.

    `phases` says which ticks of a run are kept, None for all of them (files without phases are kept whole).
    RecordError when a file cannot be read or holds no such tick.
    """
    if not path.is_dir():
        return _number_repeats(_read_file(path, phases))
    records, left_out = _complete_ones(logs_in(path), phases)
    if not records:
        raise RecordError(
            f"{left_out[0]}; nothing in {path} is complete (a file that is named itself is read as it is)"
        )
    recordings_first = sorted(records, key=lambda record: record.source is None or not is_mcap(record.source))
    kept = sorted(_each_once(recordings_first), key=lambda record: (str(record.facts["session"]), record.name))
    return _number_repeats(kept)


def _complete_ones(
    files: Iterable[Path], phases: Iterable[Phase] | None
) -> tuple[list[Record], list[NotCompleteError]]:
    """The records that are measurements of their whole sweep, and why the others are none; each of these is said."""
    records: list[Record] = []
    left_out: list[NotCompleteError] = []
    for file in files:
        try:
            records += _read_file(file, phases, complete_only=True)
        except NotCompleteError as error:
            left_out.append(error)
            warn(error)
    return records, left_out


def read_all(paths: Iterable[Path]) -> list[Record]:
    """The records of several files or folders, each sweep only; one that is found twice counts once."""
    return list(_each_once(record for path in paths for record in read(path)))


def _each_once(records: Iterable[Record]) -> Iterator[Record]:
    """Without what repeats another to the last bit, which is said: a copy beside its original, a file of a folder that
    is named as well. As a second measurement it would make what is fitted too sure of itself. Repeats of a sweep are
    numbered, and stay, also where a simulator without noise has made them."""
    seen: dict[tuple[object, ...], Record] = {}
    for record in records:
        columns = (getattr(record, name) for name in MAIN_COLUMNS[1:])
        contents = (None if column is None else sha256(column.tobytes()).digest() for column in columns)
        first = seen.setdefault((record.facts.get("repeat"), *contents), record)
        if first is record:
            yield record
        else:
            warn(f"{record.source}: passed over: the same record as {first.source}, which counts once")


def read_samples(path: Path) -> Samples:
    """Every tick of an MCAP file in every phase, with every field of rig.sample.Sample; RecordError when it is not
    whole."""
    with McapLog(path) as log:
        return log.samples()


def records_of(samples: Samples, facts: Mapping[str, Any], path: Path, phases: Iterable[Phase] | None) -> list[Record]:
    """Samples as records, one for each run in them; RecordError when there is none, or time does not rise.

    Takes the samples apart field by field, so as not to hold an hour twice: afterwards they are empty.
    """
    if phases is not None:
        wanted = np.isin(samples["phase"], [int(phase) for phase in phases])
        if not wanted.any():
            has = (
                ", ".join(Phase(number).name for number in np.unique(samples["phase"]) if number in set(Phase))
                or "no ticks"
            )
            raise RecordError(f"{path}: holds no {' or '.join(Phase(p).name for p in phases)}, only {has}")
        samples = samples.rows(_stretch(wanted))
    if not len(samples):
        raise RecordError(f"{path}: holds no ticks")
    runs = np.unique(samples["run"])
    if len(runs) > RUNS_LIMIT:
        raise RecordError(f"{path}: {len(runs)} runs in one file, at most {RUNS_LIMIT} are read")
    parts = [samples] if len(runs) == 1 else [samples.rows(samples["run"] == run) for run in runs]
    return [_record_of(part, facts, path, several=len(runs) > 1) for part in parts]


def _stretch(wanted: NDArray[np.bool_]) -> slice | NDArray[np.bool_]:
    """The same rows as a slice where they follow one another, which copies nothing."""
    first, end = int(wanted.argmax()), len(wanted) - int(wanted[::-1].argmax())
    return slice(first, end) if wanted[first:end].all() else wanted


def _needed(facts: Mapping[str, Any]) -> set[str]:
    """The fields of samples that a record with these facts is made of."""
    further = (place for place, _ in zip(PLACES, furthers_of(facts), strict=False))
    return {*MAIN_COLUMNS[1:], *_KEPT_FIELDS, *_TIMES, *(f"{name}_age_ns" for name in AGED), *further}


def record_from_columns(columns: Mapping[str, Array], facts: Mapping[str, Any], path: Path) -> Record:
    """A record from columns named like ours; RecordError when one is missing or time does not rise."""
    table = dict(columns)
    require_columns(list(table), path)
    if "dp_cmd_mpa" not in table:
        table["dp_cmd_mpa"] = table["p1_cmd_mpa"] - table["p2_cmd_mpa"]
    _require_plausible(table, path)
    time = table.pop("t_s")
    main: dict[str, Any] = {name: column for name in MAIN_COLUMNS if (column := table.pop(name, None)) is not None}
    given = name_facts(path) | {"t0_s": float(time[0])} | schema.sound(facts)
    channels_of(given, str(path))  # a record whose channel map is none is refused here
    name = pairing_name(given, path)
    measured = {key: column for key, column in main.items() if key == "dp_cmd_mpa" or not np.isnan(column).all()}
    extra = {key: column for key, column in table.items() if not np.isnan(column).all()}
    return Record(name=name, t_s=time - time[0], extra=extra, facts=given, source=path, **measured)


_MAPS = "`pamrig log import FILE --mapping MAPPING.yaml` takes other names and units, and --guess proposes a mapping"


def require_columns(names: list[str], path: Path) -> None:
    """RecordError when the time, or the command, is not among the columns."""
    shown = ", ".join(names[:12])
    if "t_s" not in names:
        other = "; another separator?" if len(names) == 1 and re.search(r"[;\t]", shown) else ""
        raise RecordError(f"{path}: no column t_s; it has {shown[:200]!r}{other}; {_MAPS}")
    if "dp_cmd_mpa" not in names and not {"p1_cmd_mpa", "p2_cmd_mpa"} <= set(names):
        raise RecordError(f"{path}: no column dp_cmd_mpa, nor p1_cmd_mpa and p2_cmd_mpa; it has {shown[:200]}; {_MAPS}")


def require_complete(facts: Mapping[str, Any], path: Path) -> None:
    """NotCompleteError when the facts of a record say that its run did not come to its end."""
    ended = schema.ended_of(facts)
    if ended not in (None, schema.Ended.COMPLETE):
        why = str(facts.get("fault") or "").partition(":")[0]
        raise NotCompleteError(f"{path}: left out: {_NOT_COMPLETE[ended]}{f', {why}' if why else ''}")


def is_complete(path: Path) -> bool:
    """Whether an MCAP file is a measurement of its whole sweep; says why when it is not. RecordError when it is not
    whole."""
    try:
        with McapLog(path) as log:
            require_complete(log.result_facts, path)
    except NotCompleteError as error:
        warn(error)
        return False
    return True


def _read_file(path: Path, phases: Iterable[Phase] | None, *, complete_only: bool = False) -> list[Record]:
    kind = kind_of(path)
    if kind is FileKind.MCAP:
        with McapLog(path) as log:
            if complete_only:
                if log.run_facts.get("kind") == schema.BLACK_BOX:
                    raise NotCompleteError(f"{path}: left out: a black box, no record of a sweep")
                require_complete(log.result_facts, path)
            facts = log.run_facts | log.result_facts
            return records_of(log.samples(names=_needed(facts)), facts, path, phases)
    columns, facts = table_of(path)
    if kind is FileKind.TDMS:
        return [record_from_columns(columns, facts, path)]
    if phases is not None and "phase" in columns:
        wanted = np.isin(columns["phase"], [int(phase) for phase in phases])
        columns = {name: column[wanted] for name, column in columns.items()}
    if complete_only:
        require_complete(facts, path)
    return [record_from_columns(columns, facts, path)]


def table_of(path: Path) -> tuple[dict[str, Array], dict[str, Any]]:
    """The columns of a table (CSV or TDMS) that are named like ours, also those without a single number, and its facts;
    RecordError when it cannot be read."""
    if kind_of(path) is FileKind.TDMS:
        raw = read_tdms(path)
        return dict(own_columns(raw)), dict(raw.facts)
    columns = dict(read_table(path, require=lambda names: require_columns(names, path)))
    return columns, dict(read_sidecar(path).facts)


def _record_of(samples: Samples, facts: Mapping[str, Any], path: Path, several: bool) -> Record:
    take, run, given = samples.fields.pop, samples["run"][0], dict(facts)
    given["started_ns"] = int(samples.log_time_ns[0])
    scheduled = take("scheduled_ns")
    given.setdefault(LOOP_NS, int(scheduled[0]))
    columns: dict[str, Array] = {"t_s": (scheduled - scheduled[0]) / 1e9}
    columns |= {name: take(name) for name in MAIN_COLUMNS if name != "t_s"}
    columns |= {name: take(name).astype(np.float64, copy=False) for name in _KEPT_FIELDS}
    columns["lateness_us"] = (take("woken_ns") - scheduled) / 1e3
    columns |= {one.name: take(place) for place, one in zip(PLACES, furthers_of(given), strict=False)}
    columns |= {f"{name}_age_s": take(f"{name}_age_ns") / 1e9 for name in AGED}
    name = pairing_name(given, path)
    return record_from_columns(columns, given | {"name": f"{name}_run{run}" if several else name}, path)


def _require_plausible(table: Mapping[str, Column], path: Path) -> None:
    time, dp = table["t_s"], table["dp_cmd_mpa"]
    if not len(time):
        raise RecordError(f"{path}: holds no rows of the sweep")
    for name, column in (("t_s", time), ("dp_cmd_mpa", dp)):
        if not np.isfinite(column).all():
            row = int(np.argmin(np.isfinite(column)))
            raise RecordError(f"{path}: {name} is {column[row]} at row {row + 1} of the data; it must be a number")
    steps = np.diff(time)
    if not (steps > 0).all():
        row = int(np.argmin(steps > 0))
        raise RecordError(
            f"{path}: time does not rise: {time[row + 1]:g} s at row {row + 2} of the data follows {time[row]:g} s"
        )


def _number_repeats(records: list[Record]) -> list[Record]:
    """Fills in the fact `repeat` for records of one name and session that do not say it."""
    counts: dict[tuple[str, str], int] = {}
    out = []
    for record in records:
        key = (str(record.facts["session"]), record.name)
        counts[key] = counts.get(key, 0) + 1
        out.append(replace(record, facts={"repeat": counts[key]} | dict(record.facts)))
    return out

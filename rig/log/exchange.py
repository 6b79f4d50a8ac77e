"""Logs in the formats of other tools and back: CSV with a metadata file, Parquet, MAT. A round trip loses nothing.

Each holds every field of every tick under its own name, time in seconds (t_s), units, run facts, attachments and log
lines.
"""

import contextlib
import csv
import gzip
import io
import json
import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final, TextIO

import numpy as np

from rig.channels import channels_of
from rig.config import check_regular
from rig.errors import RecordError
from rig.further_channels import PLACES, furthers_of
from rig.log.convert import LogContent
from rig.log.foreign.delimited import read_lines
from rig.log.foreign.sidecar import Sidecar, from_plain, read_sidecar, sidecar_path, write_sidecar
from rig.log.foreign.units import unit_in_name
from rig.log.mcap.collector import LogLine
from rig.log.mcap.columns import DTYPES, Array, Samples, kept_as
from rig.log.mcap.framing import unpacked_limit
from rig.outputs import OutputKind, check_free, writing
from rig.sample import WIRES, Sample

SUFFIXES: Final = {"csv": ".csv", "csv.gz": ".csv.gz", "parquet": ".parquet", "mat": ".mat"}
"""Format -> how its files end."""

_TYPES: Final = {name: DTYPES[wire.kind] for name, wire in WIRES.items()} | {
    "log_time_ns": np.dtype("<i8"),
    "sequence": np.dtype("<u4"),
}
_LATER: Final = frozenset(Sample._field_defaults)
"""Fields that the exports of earlier versions lack; they are filled in, as a reader of MCAP files does."""
_NEEDED: Final = frozenset(_TYPES) - _LATER
_MEANINGS: Final = (
    {"t_s": ("s", "time since the first tick, by the loop's clock")}
    | {name: (wire.unit, wire.meaning) for name, wire in WIRES.items()}
    | {"log_time_ns": ("ns", "wall time since the Unix epoch"), "sequence": ("1", "counts in the recorder")}
)


_OWN_MEANING: Final = "by the rig's own name; a field of the sample beside it holds the same on the working range"
_LONGEST_NAME: Final = 63
"""Of a variable in a MAT file."""


def export(content: LogContent, path: Path, kind: str) -> list[Path]:
    """Write `content` in the format `kind` (a key of SUFFIXES); returns the files. RecordError when one exists or
    cannot be written."""
    files = [path, sidecar_path(path)] if kind.startswith("csv") else [path]
    check_free(files)
    written: list[Path] = []
    try:
        with writing(path, OutputKind.RECORDING) as part:
            written += _WRITERS[kind](content, part, path)
    except BaseException:
        for beside in written:  # not another's, which came there meanwhile
            beside.unlink(missing_ok=True)  # it would stand alone, and in the way of the next try
        raise
    return files


def read_exported(path: Path) -> LogContent | None:
    """A log that `export` wrote; None when the file is something else, RecordError when it is damaged."""
    try:
        check_regular(path)
    except OSError as error:
        raise RecordError(f"{path}: cannot be read: {error.strerror}") from None
    if path.suffix.lower() == ".parquet":
        return _read_parquet(path)
    if path.suffix.lower() == ".mat":
        return _read_mat(path)
    return _read_csv(path)


def file_columns(content: LogContent) -> dict[str, Array]:
    """All columns in the order of the file."""
    samples = content.samples
    scheduled = samples["scheduled_ns"]
    time = {"t_s": (scheduled - scheduled[0]) / 1e9 if len(samples) else np.empty(0)}
    return (
        time
        | {name: samples[name] for name in WIRES}
        | {"log_time_ns": samples.log_time_ns, "sequence": samples.sequence}
        | {name: column for name, (column, _) in _own(content).items()}
    )


def _own(content: LogContent) -> dict[str, tuple[Array, str]]:
    """What a rig has under names of its own, each with its unit: further channels, input and output of a channel map.
    They repeat fields of the sample, from which a log is read back."""
    samples, facts = content.samples, content.run_facts
    own = channels_of(facts, "channels")
    columns = {one.name: (samples[place], one.unit) for one, place in zip(furthers_of(facts), PLACES, strict=False)}
    if not own.has_valves:
        wanted = own.own_input(samples["p1_cmd_mpa"] - samples["p2_cmd_mpa"])
        columns[own.input.column] = wanted, own.input.unit
        columns[own.output.column] = own.own_output(samples["angle_deg"]), own.output.unit
    return {name: column for name, column in columns.items() if name not in _MEANINGS and len(name) <= _LONGEST_NAME}


def _meanings(content: LogContent) -> dict[str, tuple[str, str]]:
    """Column -> unit and meaning."""
    return _MEANINGS | {name: (unit, _OWN_MEANING) for name, (_, unit) in _own(content).items()}


def _content(table: dict[str, Array], aside: Sidecar, where: str) -> LogContent:
    missing = [name for name in _TYPES if name in _NEEDED and name not in table]
    if missing:
        raise RecordError(f"{where}: lacks the columns {', '.join(missing[:5])}")
    unknown = np.full(len(table["log_time_ns"]), np.nan)
    columns = {
        name: kept_as(dtype, np.ascontiguousarray(table.get(name, unknown)), f"{where}: {name}")
        for name, dtype in _TYPES.items()
    }
    times, sequence = columns.pop("log_time_ns"), columns.pop("sequence")
    attachments = {name: text.encode("utf-8", "surrogateescape") for name, text in aside.attachments.items()}
    lines = tuple(LogLine(*line) for line in aside.lines)
    return LogContent(Samples(columns, times, sequence), aside.run, aside.result, attachments, lines)


def _aside(content: LogContent) -> Sidecar:
    attachments = {name: data.decode("utf-8", "surrogateescape") for name, data in content.attachments.items()}
    return Sidecar(
        content.run_facts,
        content.result_facts,
        attachments,
        tuple((line.time_ns, line.level, line.message) for line in content.lines),
    )


def _write_csv(content: LogContent, part: Path, path: Path) -> list[Path]:
    table = file_columns(content)
    with _text_file(part, path.name) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(table)
        writer.writerows(zip(*(column.tolist() for column in table.values()), strict=True))
    kinds = {name: "double" if column.dtype.kind == "f" else "integer" for name, column in table.items()}
    meanings = _meanings(content)
    described = {name: (kinds[name], "[{}] {}".format(*meanings[name])) for name in table}
    return [write_sidecar(path, described, _aside(content))]


@contextlib.contextmanager
def _text_file(path: Path, name: str) -> Iterator[TextIO]:
    """`path` opened for the text of what will be called `name`."""
    if not name.endswith(".gz"):
        with path.open("w", encoding="utf-8") as file:
            yield file
        return
    with (
        path.open("wb") as raw,
        gzip.GzipFile(name, "wb", fileobj=raw, mtime=0) as packed,
        io.TextIOWrapper(packed, encoding="utf-8") as file,
    ):
        yield file


def _read_csv(path: Path) -> LogContent | None:
    """The log in a CSV that holds every field; one whose metadata file was left behind is without its facts."""
    lines = read_lines(path)
    names = lines[0].split(",")
    if not set(names) >= _NEEDED:
        return None  # somebody's table, or one of ours without some fields
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise RecordError(f"{path}: the column {twice!r} stands twice in the header")
    dtype = np.dtype([(name, _TYPES.get(name, np.dtype("<f8"))) for name in names])
    try:
        rows = (
            np.loadtxt(lines[1:], dtype, delimiter=",", comments=None, ndmin=1)
            if any(lines[1:])
            else np.empty(0, dtype)
        )
    except ValueError as error:
        raise RecordError(f"{path}: {_said(str(error), names)}") from None
    return _content({name: rows[name] for name in names}, read_sidecar(path), str(path))


def _said(fault: str, names: list[str]) -> str:
    """What numpy says of a cell, with its row as an editor counts it and the name of its column."""
    cell = re.match(r"could not convert string (.*) to (int|uint|float)\d+ at row (\d+), column (\d+)", fault)
    if cell is None:
        return fault
    text, kind, row, column = cell.groups()
    wanted = "a number" if kind == "float" else "a whole number as it was exported; did a spreadsheet round it?"
    return f"row {int(row) + 2}: {names[int(column) - 1]}: {text[:40]} is not {wanted}"


def _write_parquet(content: LogContent, part: Path, path: Path) -> list[Path]:
    arrow, parquet = _pyarrow(path)
    table, meanings = file_columns(content), _meanings(content)
    fields = [
        arrow.field(name, arrow.from_numpy_dtype(column.dtype), metadata=_described(*meanings[name]))
        for name, column in table.items()
    ]
    schema = arrow.schema(fields, metadata={"pamrig": json.dumps(_aside(content).plain())})
    parquet.write_table(arrow.table(list(table.values()), schema=schema), part, compression="zstd")
    return []


def _read_parquet(path: Path) -> LogContent | None:
    arrow, parquet = _pyarrow(path)
    try:
        head = parquet.read_metadata(path)
        _require_possible(head.num_rows * head.num_columns * 8, path)
        table = parquet.read_table(path)
    except (arrow.ArrowException, OSError) as error:
        raise RecordError(f"{path}: not a readable Parquet file: {str(error).splitlines()[0]}") from None
    raw = (table.schema.metadata or {}).get(b"pamrig")
    if raw is None:
        return None
    columns = {name: table.column(name).to_numpy() for name in table.column_names}
    return _content(columns, _from_json(raw, path), str(path))


def _write_mat(content: LogContent, part: Path, _: Path) -> list[Path]:
    from scipy.io import savemat

    table, known = file_columns(content), _meanings(content)
    units = {name: known[name][0] for name in table}
    meanings = {name: known[name][1] for name in table}
    extra = {"units": units, "meanings": meanings, "pamrig": json.dumps(_aside(content).plain())}
    savemat(part, table | extra, oned_as="column", do_compression=True, appendmat=False, long_field_names=True)
    return []


def _read_mat(path: Path) -> LogContent | None:
    from scipy.io import loadmat, whosmat

    try:
        _require_possible(sum(8 * math.prod(shape) for _, shape, _ in whosmat(path, appendmat=False)), path)
        table = loadmat(path, appendmat=False, variable_names=[*_TYPES, "pamrig"])
    except RecordError:
        raise
    except Exception as error:  # noqa: BLE001 - scipy raises whatever its parser stumbles over
        raise RecordError(f"{path}: not a readable MAT file ({type(error).__name__})") from None
    if "pamrig" not in table:
        return None
    aside = _from_json("".join(str(part) for part in np.ravel(table["pamrig"])), path)
    return _content({name: np.ravel(table[name]) for name in _TYPES if name in table}, aside, str(path))


def _require_possible(claimed: int, path: Path) -> None:
    if claimed > (allowed := unpacked_limit(path.stat().st_size)):
        raise RecordError(
            f"{path}: claims {claimed >> 20} MiB of numbers, more than a log of this size can hold ({allowed >> 20} "
            "MiB)"
        )


def _from_json(text: str | bytes, path: Path) -> Sidecar:
    try:
        return from_plain(json.loads(text), str(path))
    except (ValueError, RecursionError):
        raise RecordError(f"{path}: its facts are not readable as JSON") from None


def unit_of(column: str) -> str | None:
    """The unit of one of our columns, or the one that its name ends in; None where neither says it."""
    known = _MEANINGS.get(column)
    return known[0] if known else unit_in_name(column)


def _described(unit: str, meaning: str) -> dict[str, str]:
    return {"unit": unit, "meaning": meaning}


def _pyarrow(path: Path) -> tuple[Any, Any]:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise RecordError(f"{path}: Parquet needs the package pyarrow: pip install 'pamrig[tables]'") from None
    return pyarrow, parquet


_WRITERS: dict[str, Callable[[LogContent, Path, Path], list[Path]]] = {
    "csv": _write_csv,
    "csv.gz": _write_csv,
    "parquet": _write_parquet,
    "mat": _write_mat,
}
"""Format -> who writes a log to a place that becomes the second one when it is whole; returns what it wrote beside."""

"""The file beside a CSV that says what the CSV cannot: units, run facts, attachments, log lines.

It follows the W3C's "CSV on the Web" (NAME.csv-metadata.json); what that vocabulary has no word for stands under
`pamrig`.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from rig.config import read_text
from rig.errors import ConfigError, RecordError
from rig.outputs import OutputKind, write_text

SUFFIX: Final = "-metadata.json"
_MOST_BYTES: Final = 64 * 1024 * 1024
"""Attachments and log lines of a day."""


@dataclass(frozen=True)
class Sidecar:
    """What a table does not hold in its columns."""

    run: Mapping[str, Any] = field(default_factory=dict)
    """Facts known at the start."""
    result: Mapping[str, Any] = field(default_factory=dict)
    """Facts known at the end."""
    attachments: Mapping[str, str] = field(default_factory=dict)
    """File name -> text."""
    lines: tuple[tuple[int, str, str], ...] = ()
    """Log lines: time in nanoseconds since the Unix epoch, level, message."""

    @property
    def facts(self) -> dict[str, Any]:
        """Start and end together; the end wins."""
        return dict(self.run) | dict(self.result)

    def plain(self) -> dict[str, Any]:
        """As JSON has it."""
        lines = [list(line) for line in self.lines]
        return {"run": dict(self.run), "result": dict(self.result), "attachments": dict(self.attachments), "log": lines}


def from_plain(raw: object, where: str) -> Sidecar:
    """The inverse of `plain`; RecordError when the JSON is something else."""
    try:
        if not isinstance(raw, dict) or not all(
            isinstance(raw.get(key, {}), dict) for key in ("run", "result", "attachments")
        ):
            raise TypeError
        lines = tuple((int(time), str(level), str(message)) for time, level, message in raw.get("log", []))
    except (TypeError, ValueError):
        raise RecordError(f"{where}: not facts as pamrig writes them") from None
    return Sidecar(raw.get("run", {}), raw.get("result", {}), raw.get("attachments", {}), lines)


def sidecar_path(table: Path) -> Path:
    """Where the facts of a CSV lie."""
    return table.with_name(table.name + SUFFIX)


def read_sidecar(table: Path) -> Sidecar:
    """The facts beside a CSV, empty when there are none; RecordError when the file is broken."""
    path = sidecar_path(table)
    if not path.exists():
        return Sidecar()
    try:
        raw = json.loads(read_text(path, _MOST_BYTES))
    except ConfigError as error:
        raise RecordError(str(error)) from None
    except (ValueError, RecursionError):
        raise RecordError(f"{path}: not readable as JSON") from None
    return from_plain(raw.get("pamrig", {}) if isinstance(raw, dict) else raw, str(path))


def write_sidecar(table: Path, columns: Mapping[str, tuple[str, str]], sidecar: Sidecar) -> Path:
    """Write the facts beside a CSV; `columns` maps each name to its datatype (integer or double) and its
    description."""
    schema = {
        "columns": [{"name": name, "datatype": kind, "dc:description": text} for name, (kind, text) in columns.items()]
    }
    path = sidecar_path(table)
    document = {
        "@context": "http://www.w3.org/ns/csvw",
        "url": table.name,
        "tableSchema": schema,
        "pamrig": sidecar.plain(),
    }
    write_text(path, json.dumps(document, indent=1) + "\n", OutputKind.RECORDING)
    return path

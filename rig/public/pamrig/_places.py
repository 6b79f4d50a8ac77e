"""Things that a caller may give as an object, as a place, or by the name of one that comes with pamrig."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rig.outputs import file_name
from rig.record import Record

Logs = Record | Iterable[Record] | str | Path
"""A record, several, or the place of a log or of a folder of them."""


def records_of(logs: Logs) -> list[Record]:
    """The records that were given, read where they are a place."""
    from rig.log.reader import read

    if isinstance(logs, Record):
        return [logs]
    return read(Path(logs)) if isinstance(logs, str | Path) else list(logs)


@contextmanager
def sweep_file(sweep: str | Path | dict[str, Any]) -> Iterator[Path]:
    """The sweep as a file: the place that was given, or a mapping written as YAML while this lasts."""
    if not isinstance(sweep, dict):
        yield Path(sweep)
        return
    import yaml

    with TemporaryDirectory(prefix="pamrig-") as folder:
        path = Path(folder) / f"{file_name(str(sweep.get('name', 'sweep')))}.yaml"
        path.write_text(yaml.safe_dump(sweep, sort_keys=False), encoding="utf-8")
        yield path

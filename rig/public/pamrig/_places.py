"""Things that a caller may give as an object, as a place, or by the name of one that comes with pamrig."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rig.errors import ConfigError, EnvelopeError, RecordError
from rig.outputs import file_name
from rig.record import Record

Logs = Record | str | Path | Iterable[Record | str | Path]
"""A record, the place of a log or of a folder of them, or several of these."""


def records_of(logs: Logs) -> list[Record]:
    """The records that were given, read where they are a place; RecordError when there is none, or one without rows."""
    if not isinstance(logs, Record | str | Path | Iterable):
        raise RecordError(f"logs: expected records or places of logs, got {logs!r:.60}")
    records = [
        record for one in ([logs] if isinstance(logs, Record | str | Path) else logs) for record in _records(one)
    ]
    if not records:
        raise RecordError("logs: no record was given")
    empty = next((record.name for record in records if not len(record)), None)
    if empty is not None:
        raise RecordError(f"{empty}: it has no rows")
    return records


def _records(one: Record | str | Path) -> list[Record]:
    from rig.log.reader import read

    return [one] if isinstance(one, Record) else read(place_of(one, "logs"))


def place_of(given: object, what: str) -> Path:
    """A path that was given as text or as a Path; ConfigError for anything else."""
    if not isinstance(given, str | Path):
        raise ConfigError(f"{what}: expected a path as text or Path, got {given!r:.60}")
    return Path(given)


def require_one_of(given: object, allowed: Iterable[str], what: str) -> None:
    """ConfigError when an argument is none of the words that it may be."""
    words = list(allowed)
    if given not in words:
        raise ConfigError(f"{what}: {given!r:.60} is unknown; allowed: {', '.join(words)}")


@contextmanager
def sweep_file(sweep: str | Path | dict[str, Any]) -> Iterator[Path]:
    """The sweep as a file: the place that was given, or a mapping written as YAML while this lasts, in which waveforms
    are found from the current folder. ConfigError when it holds what YAML cannot."""
    if not isinstance(sweep, dict):
        yield place_of(sweep, "sweep")
        return
    import yaml

    with TemporaryDirectory(prefix="pamrig-") as folder:
        path = Path(folder) / f"{file_name(str(sweep.get('name', 'sweep')))}.yaml"
        try:
            text = yaml.safe_dump(plain(sweep), sort_keys=False)
        except yaml.YAMLError as error:
            raise ConfigError(f"sweep: {' '.join(map(str, error.args))}") from None
        path.write_text(text, encoding="utf-8")
        try:
            yield path
        except (ConfigError, EnvelopeError) as error:  # whoever gave a mapping knows nothing of a file
            raise type(error)(str(error).replace(f"{path}: ", "sweep: ")) from None


def _whole(file: Any) -> Any:
    if isinstance(file, list | tuple):
        return [_whole(one) for one in file]
    return str(Path(file).absolute()) if isinstance(file, str | Path) else plain(file)


def plain(value: Any) -> Any:
    """Values of numpy, tuples and paths as YAML has them; the file of a waveform, or each of several, by its whole
    path."""
    if isinstance(value, dict):
        return {key: _whole(item) if key == "file" else plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):
        return value.tolist()
    return str(value) if isinstance(value, Path) else value

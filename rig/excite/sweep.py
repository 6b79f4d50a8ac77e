"""A sweep as its YAML has it: its records, each a signal with its timing, the rest pressures, and how often all of it
is repeated. With angles in place of differences it is a list of references to follow (reference.py).

Which runs it stands for is run_plan.py.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from rig.config import one_line, parse_yaml, read_text, shown, structure, suggest
from rig.errors import ConfigError
from rig.excite.reference import AMPLITUDE, Amplitude, AngleReference
from rig.excite.signals import Chirp, Mixed, Multisine, Signal, Sine, Triangle
from rig.excite.steps import Hold, Prbs, Staircase
from rig.excite.table import AngleTable, Waveform
from rig.fields import bounded
from rig.gains import ClosedLoop

SIGNALS: dict[str, type] = {
    "sine": Sine,
    "triangle": Triangle,
    "mixed": Mixed,
    "multisine": Multisine,
    "chirp": Chirp,
    "staircase": Staircase,
    "prbs": Prbs,
    "hold": Hold,
    "waveform": Waveform,
}
"""The name in a sweep's YAML -> the signal."""

MOST_SWEEP_BYTES = 256 * 1024
"""Of a sweep's YAML; a longer file is none."""
MOST_RECORDS = 20_000
"""Of one sweep: two days of records of ten seconds."""


@dataclass(frozen=True)
class Timing:
    """How long the parts of a run last; a sweep's defaults, and what one of its records may change."""

    settle_s: float = bounded(0.0, 3600.0, "s", default=2.0)
    zero_s: float = bounded(0.0, 60.0, "s", default=0.5)
    ramp_in_s: float = bounded(0.0, 60.0, "s", default=0.5)
    duration_s: float = bounded(0.01, 86400.0, "s", default=10.0)
    ramp_out_s: float = bounded(0.0, 60.0, "s", default=1.0)


@dataclass(frozen=True)
class Entry:
    """One record of a sweep."""

    signal: Signal
    timing: Timing
    p0_mpa: tuple[float, ...] = ()
    """Rest pressures of its own; none: those of the sweep."""


@dataclass(frozen=True)
class _Own(Timing):
    """The keys that a record may have beside its signal."""

    p0_mpa: tuple[float, ...] = bounded(0.0, 1.0, "MPa", default=())


@dataclass(frozen=True)
class Sweep:
    """Everything a sweep's YAML says. Runs come in the order repeat, P0, record: a repeat is the whole programme
    again."""

    name: str
    entries: tuple[Entry, ...]
    p0_mpa: tuple[float, ...] = (0.2,)
    """Rest pressures of the records that name none of their own."""
    repeats: int = 1
    closed_loop: ClosedLoop | None = None
    """Gains for its references."""
    text: str = ""
    """The YAML that it was read from."""

    @property
    def tracks(self) -> bool:
        """Its records are angles to follow."""
        return any(isinstance(entry.signal, AngleReference) for entry in self.entries)

    @property
    def rests_mpa(self) -> tuple[float, ...]:
        """Every rest pressure of the sweep, those of the head first, in the order in which they come."""
        return tuple(dict.fromkeys([*self.p0_mpa, *(p0 for entry in self.entries for p0 in entry.p0_mpa)]))


@dataclass(frozen=True)
class _Head(Timing):
    """The keys of a sweep's YAML beside its records; a record may have a `Timing` of its own."""

    name: str = ""
    p0_mpa: tuple[float, ...] = bounded(0.0, 1.0, "MPa", default=(0.2,))
    repeats: int = bounded(1, 10_000, default=1)
    closed_loop: ClosedLoop | None = None


def load_sweep(path: Path) -> Sweep:
    """The sweep at `path`; ConfigError names the key when it does not fit. Any parameter of a signal may be a list."""
    text = read_text(path, MOST_SWEEP_BYTES)
    raw = parse_yaml(text, path)
    if not isinstance(raw, dict):
        raise ConfigError(
            f"{path}: expected a mapping with the keys records, {', '.join(f.name for f in fields(_Head))}"
        )
    keys = dict(raw)
    records = keys.pop("records", None)
    if not isinstance(records, list) or not records:
        example = "- sine: {frequency_hz: 0.5, amplitude_mpa: 0.2}"
        raise ConfigError(f"{path}: records: expected a list of signals, for example `{example}`")
    _check_lists(keys, str(path))
    head = structure(_listed(keys), _Head, str(path))
    count = head.repeats * sum(_combinations(record, len(head.p0_mpa)) for record in records)
    if count > MOST_RECORDS:
        raise ConfigError(
            f"{path}: records: stand for {shown(count)} records (lists, p0_mpa and repeats multiply); at most "
            f"{MOST_RECORDS}"
        )
    shared = {f.name: keys[f.name] for f in fields(Timing) if f.name in keys}
    records = with_files(records, lambda file: path.parent / file)
    angles = head.closed_loop is not None or any(_is_reference(record) for record in records)
    entries = tuple(
        entry
        for index, record in enumerate(records)
        for entry in _record(record, shared, path, f"records[{index}]", angles)
    )
    name = one_line(head.name, f"{path}: name") or path.stem
    return Sweep(name, entries, head.p0_mpa, head.repeats, head.closed_loop, text)


def with_files(records: list[Any], place: Callable[[Path], Path]) -> list[Any]:
    """The `records` of a sweep's YAML, each table's `file` where `place` puts it; an absolute one stays. Whatever else
    stands there is as it was."""
    return [_with_file(record, place) for record in records]


def _with_file(record: Any, place: Callable[[Path], Path]) -> Any:
    settings = record.get("waveform") if isinstance(record, dict) else None
    if not isinstance(settings, dict) or "file" not in settings:
        return record
    files = settings["file"] if isinstance(settings["file"], list) else [settings["file"]]
    placed = [str(file if Path(str(file)).is_absolute() else place(Path(str(file)))) for file in files]
    return record | {"waveform": settings | {"file": placed if isinstance(settings["file"], list) else placed[0]}}


def _is_reference(record: object) -> bool:
    """It has an amplitude in degrees."""
    parts = record.values() if isinstance(record, dict) else ()
    return any(isinstance(part, dict) and AMPLITUDE in part for part in parts)


def _check_lists(keys: object, where: str) -> None:
    """ConfigError where a list is empty: it would stand for no record, and nobody would be told."""
    for key, value in keys.items() if isinstance(keys, dict) else ():
        if value == []:
            raise ConfigError(f"{where}: {key}: expected a value or a list of at least one, got an empty list")


def _listed(keys: Mapping[str, Any]) -> dict[str, Any]:
    """The same with a single rest pressure as a list of one."""
    p0 = keys.get("p0_mpa", [])
    return dict(keys) if isinstance(p0, list) else {**keys, "p0_mpa": [p0]}


def _record(raw: object, shared: Mapping[str, Any], path: Path, where: str, angles: bool) -> Iterator[Entry]:
    """One entry of `records`: the product of every list in it; `angles`: they are references."""
    names = [key for key in raw if key in SIGNALS] if isinstance(raw, dict) else []
    if not isinstance(raw, dict) or len(names) != 1:
        shown = next(iter(raw), "") if isinstance(raw, dict) and raw else ""
        raise ConfigError(f"{path}: {where}: expected one signal; {suggest(str(shown), list(SIGNALS))}")
    own = {key: value for key, value in raw.items() if key != names[0]}
    settings = raw[names[0]]
    _check_lists(own, f"{path}: {where}")
    _check_lists(settings, f"{path}: {where}.{names[0]}")
    for chosen in _product(settings):
        make = _reference if angles else _signal
        signal: Any = make(chosen, names[0], f"{path}: {where}.{names[0]}")
        shape = signal.signal if isinstance(signal, AngleReference) else signal
        whole = {"duration_s": shape.length_s} if isinstance(shape, Waveform) else {}
        mine = structure(dict(shared) | whole | _listed(own), _Own, f"{path}: {where}")
        timing = Timing(**{f.name: getattr(mine, f.name) for f in fields(Timing)})
        yield Entry(signal, timing, mine.p0_mpa)


def _signal(settings: object, name: str, where: str) -> Signal:
    signal: Signal = structure(settings, SIGNALS[name], where)
    return signal


def _reference(settings: object, name: str, where: str) -> AngleReference:
    """The shape of that name in degrees: a table of angles, or a signal of amplitude 1 times `amplitude_deg`."""
    if name == "waveform":
        return AngleReference(structure(settings, AngleTable, where))
    if not isinstance(settings, dict) or AMPLITUDE not in settings or "amplitude_mpa" in settings:
        raise ConfigError(f"{where}: an angle to follow needs {AMPLITUDE}, and no amplitude_mpa")
    size = structure({AMPLITUDE: settings[AMPLITUDE]}, Amplitude, where)
    shape = {key: value for key, value in settings.items() if key != AMPLITUDE} | {"amplitude_mpa": 1.0}
    return AngleReference(_signal(shape, name, where), size.amplitude_deg)


def _combinations(record: object, rests: int) -> int:
    """How many records one entry of `records` stands for at that many rest pressures, without making them; what is no
    signal counts once, and is told later."""
    settings = [value for key, value in record.items() if key in SIGNALS] if isinstance(record, dict) else []
    lists = [item for each in settings if isinstance(each, dict) for item in each.values() if isinstance(item, list)]
    own = _listed(record).get("p0_mpa") if isinstance(record, dict) else None
    return math.prod(len(item) for item in lists) * (len(own) if own else rests)


def _product(settings: object) -> Iterator[object]:
    """{a: [1, 2], b: 3} as {a: 1, b: 3}, {a: 2, b: 3}; the first key varies slowest."""
    if not isinstance(settings, dict):
        yield settings
        return
    lists = [value if isinstance(value, list) else [value] for value in settings.values()]
    for values in itertools.product(*lists):
        yield dict(zip(settings, values, strict=True))

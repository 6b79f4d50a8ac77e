"""The YAML of a rig: which devices fill which roles, at what period, inside which envelope, and what is safe.

    name: simulated
    period_ms: 5
    safe: {p1_mpa: 0.2, p2_mpa: 0.2}
    devices:
      main: {kind: simulated, model: ../models/simulated.yaml}
    roles: {valve_1: main, valve_2: main, monitor_1: main, monitor_2: main, angle: main}
    further: [{name: load_n, unit: N, same_within: 5}]
    tags: {muscle: DMSP-10, load_kg: 0.5}

What stands under a device beside `kind` belongs to the driver, which has the schema for it.
"""

import itertools
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from rig.channels import EFFECTS_FACT, PNEUMATIC, Channels, check_channels
from rig.channels import FACT as CHANNELS_FACT
from rig.config import nearest_file, one_line, parse_yaml, read_text, structure, suggest
from rig.errors import ConfigError
from rig.fields import bounded
from rig.further_channels import FACT as FURTHER_FACT
from rig.further_channels import Further, check_new, plain
from rig.interfaces import Role
from rig.realtime.guard import Limits
from rig.realtime.measures import Measures
from rig.sample import WIRES
from rig.tags import FACT as TAGS_FACT
from rig.tags import Tags, check_tags


@dataclass(frozen=True)
class Safe:
    """The safe state: what is written when a program is over, and at once on a fault."""

    p1_mpa: float = bounded(0.0, 1.0, "MPa", default=0.2)
    p2_mpa: float = bounded(0.0, 1.0, "MPa", default=0.2)
    """Where the muscles come to rest."""
    return_mpa_s: float = bounded(0.001, 100.0, "MPa/s", default=0.2)
    """How fast the set-points return there after a program; a fault writes them in one step."""
    watchdog_s: float = bounded(0.1, 60.0, "s", default=1.0)
    """A device whose own watchdog takes longer is refused at arming and by `run`, unless forced."""


@dataclass(frozen=True)
class DeviceEntry:
    """One device of the rig before its driver has looked at it."""

    name: str
    kind: str
    settings: dict[str, Any]
    roles: frozenset[Role]
    read: dict[str, Any] = field(default_factory=dict)
    """Settings that its driver has read from files which the YAML names, once: nobody reads those again."""
    checked: Any = None
    """All its settings as its driver takes them, once the rig is loaded: the processes of loop and watchers are told
    them, and check nothing again."""


PERIODS_MS = (1.0, 100.0)
"""Periods that a rig's loop may have."""


@dataclass(frozen=True)
class _File:
    """The keys of a rig's YAML."""

    name: str
    devices: dict[str, Any]
    roles: dict[str, str]
    period_ms: float = bounded(*PERIODS_MS, "ms", default=5.0)
    safe: Safe = field(default_factory=Safe)
    limits: Limits = field(default_factory=Limits)
    realtime: Measures = field(default_factory=Measures)
    calibration: Path | None = None
    channels: Channels | None = None
    further: list[Further] = field(default_factory=list)
    tags: dict[str, Any] = field(default_factory=dict)
    effects: list[str] | None = None


@dataclass(frozen=True)
class RigConfig:
    """A rig as its YAML describes it, checked as far as that is possible without the drivers."""

    name: str
    path: Path
    period_ns: int
    safe: Safe
    limits: Limits
    realtime: Measures
    devices: tuple[DeviceEntry, ...]
    calibration: dict[str, Any]
    files: Mapping[str, bytes]
    """The file as it was, and the files that it names (calibration, models), by name: for the log."""
    channels: Channels = PNEUMATIC
    """What its input and its output are."""
    further: tuple[Further, ...] = ()
    """Further channels that its devices read, in the order of their places in a sample."""
    tags: Tags = field(default_factory=dict)
    """What every record of this rig shall say of it: muscle, load, who."""
    used: Mapping[Path, bytes] = field(default_factory=dict)
    """The files that the settings of its devices name, as they were when the rig was loaded."""
    effects: tuple[str, ...] | None = None
    """Effects, or stages of the chain, that the rig can have; None: whatever its channels allow."""

    @property
    def own_facts(self) -> dict[str, Any]:
        """Channels, effects and tags as the facts of a record hold them."""
        channels = {} if self.channels.has_valves else {CHANNELS_FACT: self.channels.plain()}
        further = {FURTHER_FACT: plain(self.further)} if self.further else {}
        effects = {} if self.effects is None else {EFFECTS_FACT: list(self.effects)}
        return channels | further | effects | ({TAGS_FACT: dict(self.tags)} if self.tags else {})


def load_rig(path: Path) -> RigConfig:
    """The rig at `path`; ConfigError, one line, when it does not fit."""
    text = read_text(path)
    file = structure(parse_yaml(text, path), _File, str(path))
    _check_pairs(file.limits, path)
    low, high = file.limits.pressure_mpa
    for key, value in (("p1_mpa", file.safe.p1_mpa), ("p2_mpa", file.safe.p2_mpa)):
        if not low <= value <= high:
            raise ConfigError(
                f"{path}: safe.{key}: {value:g} MPa is outside limits.pressure_mpa, {low:g} .. {high:g} MPa"
            )
    channels = PNEUMATIC if file.channels is None else check_channels(file.channels, f"{path}: channels")
    calibration, calibration_file = _calibration(path, file.calibration)
    return RigConfig(
        name=one_line(file.name, f"{path}: name"),
        path=path,
        period_ns=round(file.period_ms * 1e6),
        safe=file.safe,
        limits=file.limits,
        realtime=file.realtime,
        devices=_devices(file, path),
        calibration=calibration,
        files=apart({"rig.yaml": text.encode()}, calibration_file),
        channels=channels,
        further=check_new(file.further, f"{path}: further", channels, WIRES),
        tags=check_tags(file.tags, f"{path}: tags"),
        effects=None if file.effects is None else tuple(file.effects),
    )


def _check_pairs(limits: Limits, path: Path) -> None:
    for key in ("pressure_mpa", "angle_deg", "monitor_mpa"):
        low, high = getattr(limits, key)
        if not low < high:
            raise ConfigError(
                f"{path}: limits.{key}: {low:g} .. {high:g} is empty; the first value must be the smaller one"
            )


def apart(*groups: Mapping[str, bytes]) -> dict[str, bytes]:
    """Files for a log, by name: of two files of one name, from two folders, the later one is numbered."""
    kept: dict[str, bytes] = {}
    for name, data in (item for group in groups for item in group.items()):
        stem, suffix = os.path.splitext(name)
        numbered = (name if n == 1 else f"{stem}_{n}{suffix}" for n in itertools.count(1))
        kept.setdefault(next(free for free in numbered if kept.get(free, data) == data), data)
    return kept


def _calibration(path: Path, named: Path | None) -> tuple[dict[str, Any], dict[str, bytes]]:
    """What the calibration says, and its file by name: read once, so that a log has what the rig goes by."""
    if named is None:
        return {}, {}
    place = path.parent / named
    require_file(place, f"{path}: calibration", named)
    text = read_text(place)
    raw = parse_yaml(text, place)
    if not isinstance(raw, dict):
        raise ConfigError(f"{place}: expected a mapping of roles to calibrations")
    return raw, {named.name: text.encode()}


def _devices(file: _File, path: Path) -> tuple[DeviceEntry, ...]:
    known = [role.value for role in Role]
    for role, device in file.roles.items():
        if role not in known:
            raise ConfigError(f"{path}: roles: unknown role {role!r}; {suggest(role, known)}")
        if device not in file.devices:
            raise ConfigError(f"{path}: roles.{role}: no device {device!r}; {suggest(device, list(file.devices))}")
    for needed in (Role.VALVE_1, Role.VALVE_2, Role.ANGLE):
        if needed not in file.roles:
            raise ConfigError(f"{path}: roles: {needed.value} is missing; a rig needs valve_1, valve_2 and angle")
    return tuple(_device(name, raw, file.roles, path) for name, raw in file.devices.items())


def _device(name: str, raw: object, roles: dict[str, str], path: Path) -> DeviceEntry:
    one_line(name, f"{path}: devices")
    if not isinstance(raw, dict) or not isinstance(raw.get("kind"), str):
        raise ConfigError(f"{path}: devices.{name}: expected a mapping with the key kind")
    mine = frozenset(Role(role) for role, device in roles.items() if device == name)
    if not mine and not raw.get("further"):
        raise ConfigError(f"{path}: devices.{name}: no role names this device")
    settings = {key: value for key, value in raw.items() if key != "kind"}
    return DeviceEntry(name, raw["kind"], settings, mine)


def require_file(place: Path, where: str, written: object, own: Sequence[str] = ()) -> None:
    """ConfigError when a file that a rig's YAML names is not there: the YAML and its key, what it says, where that was
    looked for, and the names of files of `own` that may stand there."""
    if not os.path.isfile(place):
        near = nearest_file(place) if os.path.isdir(place.parent) else ""
        ours = f"; {suggest(str(written), list(own))}" if own and not near else near
        raise ConfigError(f"{where}: {written}: no such file; looked for at {place.resolve()}{ours}")


def resolve_paths(settings: Any, base: Path) -> dict[str, Path]:
    """The path fields of a device's settings, made relative to the folder of the rig's file."""
    values = {f.name: getattr(settings, f.name) for f in fields(settings)}
    return {name: base / value for name, value in values.items() if isinstance(value, Path) and not value.is_absolute()}

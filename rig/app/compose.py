"""The roof: the one place that knows rig, drivers and hil. It loads a rig's config, checks it as a whole, and makes the
devices that it names.

Nothing heavy is imported here: this module is also loaded by the loop's process, on the controller.
"""

import contextlib
import dataclasses
import importlib
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from rig.app.shipped import default_rig, find_config, own_file, own_names
from rig.config import structure
from rig.errors import ConfigError, RigError
from rig.interfaces import Clock, Device, DeviceContext, Role, abilities_of, wiring_of
from rig.realtime.clock import VirtualClock
from rig.rig_config import DeviceEntry, RigConfig, apart, load_rig, require_file, resolve_paths

STAND_INS = {
    "simulated": "hil.bench:SimulatedRig",
    "simulated_faulty": "hil.faults:FaultyRig",
    "physics": "hil.physics:PhysicsRig",
    "emulated": "rig.app.stand_ins.emulated:EmulatedRig",
    "playback": "rig.app.stand_ins.playback:PlaybackRig",
}
"""Devices that are no hardware: kind -> where; the real ones stand in drivers.catalog."""
_VALVES = frozenset({Role.VALVE_1, Role.VALVE_2})


def device_class(kind: str, where: str) -> Any:
    """The class of a device, imported now; ConfigError when there is no such kind."""
    if kind in STAND_INS:
        module, name = STAND_INS[kind].split(":")
        return getattr(importlib.import_module(module), name)
    from drivers import catalog

    return catalog.entry(kind, where, STAND_INS).driver


def device_settings(entry: DeviceEntry, rig: RigConfig, options: Mapping[str, Any]) -> tuple[Any, Any]:
    """Class and checked settings of one device; `options` may override settings (model, seed)."""
    where = f"{rig.path}: devices.{entry.name}"
    kind = device_class(entry.kind, where)
    own = {f.name for f in dataclasses.fields(kind.Settings)}
    overrides = {key: value for key, value in options.items() if key in own}
    plain = {key: value for key, value in overrides.items() if not isinstance(value, Path | list)}
    if entry.checked is not None and not plain:
        return kind, dataclasses.replace(entry.checked, **overrides)
    settings = structure({**entry.settings, **entry.read, **plain}, kind.Settings, where)
    files = {name: _own_or(place, name) for name, place in resolve_paths(settings, rig.path.parent).items()}
    return kind, dataclasses.replace(settings, **files | overrides)


def _own_or(place: Path, setting: str) -> Path:
    """The file that a device's setting names, or pamrig's own model or rig of that bare name: a rig's YAML that says
    `model: simulated` holds wherever pamrig is installed."""
    ours = own_file(setting, place.name)
    return ours if not os.path.exists(place) and os.path.isfile(ours) else place


def make_device(
    rig: RigConfig, clock: Clock, options: Mapping[str, Any] | None = None, *, looking: bool = False,
    driven: Callable[[], bool] = lambda: False,
) -> Device:  # fmt: skip
    """The rig's device, closed: the one that fills all roles, or the mixture of several; `looking`: only to look;
    `driven`: whether another process drives it."""
    parts = []
    for entry in rig.devices:
        kind, settings = device_settings(entry, rig, options or {})
        context = DeviceContext(
            clock, entry.roles, rig.safe.p1_mpa, rig.safe.p2_mpa, rig.period_ns, rig.calibration,
            tuple(one.name for one in rig.further), f"{rig.path}: devices.{entry.name}", looking, driven,
        )  # fmt: skip
        parts.append(kind(settings, context))
    if len(parts) == 1:
        device: Device = parts[0]
        return device
    from drivers.mixed import MixedRig

    return MixedRig(parts, clock, rig.period_ns)


def check_wiring(rig: RigConfig) -> None:
    """ConfigError when a device of the rig cannot be made as it is wired and calibrated: a channel that its module has
    not, two roles on one channel. Nothing is opened."""
    make_device(rig, VirtualClock(), looking=True)


def wires_of(rig: RigConfig) -> list[str]:
    """The names of what carries the rig's set-points, the same for every process of this machine; none for a stand-in
    that keeps them in its own process. Whoever only reads disturbs nobody."""
    settings = [device_settings(entry, rig, {})[1] for entry in _driving(rig)]
    return sorted({name for own in settings for name in wiring_of(own).wires})


def held_wires(rig: RigConfig) -> list[str]:
    """What the process that drives the rig holds for itself: its wires, and what its devices only read by lines that
    give each byte to one reader."""
    settings = [device_settings(entry, rig, {})[1] for entry in rig.devices]
    return sorted({*wires_of(rig), *(name for own in settings for name in wiring_of(own).one_reader)})


def _driving(rig: RigConfig) -> list[DeviceEntry]:
    return [entry for entry in rig.devices if entry.roles & _VALVES]


def is_simulated(rig: RigConfig) -> bool:
    """No device of the rig moves anything real."""
    return all(entry.kind in STAND_INS for entry in rig.devices)


def allow_virtual(rig: RigConfig) -> None:
    """RigError where the clock may not be turned: a device moves something real."""
    if not is_simulated(rig):
        raise RigError(f"{rig.path}: a real rig runs in real time; --clock virtual needs a simulated one")


def outlives_the_loop(rig: RigConfig) -> bool:
    """Whether set-points stand at the valves when the loop's process is gone, so that another process has to see to
    them."""
    return any(abilities_of(device_class(entry.kind, str(rig.path))).second_path for entry in _driving(rig))


def load(path: Path | None) -> RigConfig:
    """The rig's config at `path`, or the simulated rig's; settings of all devices are checked too, and the maps that
    they name are read: whoever makes safe later must not depend on a disk."""
    rig = load_rig(find_config(path, "rigs") if path else default_rig())
    named: list[Mapping[str, bytes]] = []
    used: dict[Path, bytes] = {}
    settings = {entry.name: device_settings(entry, rig, {})[1] for entry in rig.devices}
    _check_further(rig, settings)
    _check_ranges(rig, settings)
    _check_effects(rig)
    for entry in rig.devices:
        own = settings[entry.name]
        _require_files(entry, own, rig.path)
        used |= {path: path.read_bytes() for path in _paths(own)}
        if entry.kind == "emulated":
            named.append({name: data for name, data in load(own.rig).files.items() if name != "rig.yaml"})
    _check_apart(rig, settings)
    devices = tuple(
        dataclasses.replace(entry, read=wiring_of(settings[entry.name]).read_now()) for entry in rig.devices
    )
    for path, data in used.items():  # what a device has just read of it is what the log will hold
        _check_unchanged(path, data, "while it was read; try again")
    files = apart(rig.files, *({path.name: data} for path, data in used.items()), *named)
    rig = dataclasses.replace(rig, files=files, devices=devices, used=used)
    checked = (dataclasses.replace(entry, checked=device_settings(entry, rig, {})[1]) for entry in devices)
    return dataclasses.replace(rig, devices=tuple(checked))


def _check_unchanged(path: Path, data: bytes, when: str) -> None:
    """ConfigError when a file holds something else by now."""
    with contextlib.suppress(OSError):  # one that is gone is told by who needs it
        if path.read_bytes() != data:
            raise ConfigError(f"{path}: was written to {when}")


def check_as_loaded(rig: RigConfig) -> None:
    """ConfigError when a file from which a device of the rig is made anew for each session has been written to since
    the rig was loaded: the records would hold what it was then."""
    for entry in rig.devices:
        if not entry.read:
            for path in _paths(device_settings(entry, rig, {})[1]):
                if path in rig.used:
                    _check_unchanged(path, rig.used[path], "since the rig was loaded: start anew")


def _check_effects(rig: RigConfig) -> None:
    """ConfigError for an effect that no library has: it would be in the facts of every record, and refused with them
    when they are diagnosed."""
    if rig.effects is not None:
        from rig.gap.possible_effects import named_effects  # most rigs say nothing of it, and start sooner

        named_effects(rig.effects, f"{rig.path}: effects")


def _check_further(rig: RigConfig, settings: Mapping[str, Any]) -> None:
    """ConfigError when a further channel of the rig is read by no device or by two, or one is read that it has not;
    `settings`: those of each device."""
    read = [(name, device) for device, own in settings.items() for name in wiring_of(own).further or {}]
    known = [one.name for one in rig.further]
    for name, device in read:
        if name not in known:
            raise ConfigError(
                f"{rig.path}: devices.{device}.further: {name!r} is not listed under `further` of the rig"
            )
    for name in known:
        by = [device for other, device in read if other == name]
        if len(by) != 1:
            who = " and ".join(by) or "none"
            raise ConfigError(f"{rig.path}: further: {name} is read by {who}; one device's `further` must have it")


def _check_ranges(rig: RigConfig, settings: Mapping[str, Any]) -> None:
    """ConfigError when the guard would let set-points pass, the safe ones among them, that a valve cannot be given: the
    driver would clamp them, and the log would say something else than what stood at the valve."""
    least, most = rig.limits.pressure_mpa
    for entry in _driving(rig):
        wiring = wiring_of(settings[entry.name])
        for role in sorted(entry.roles & _VALVES):
            low, high = wiring.range_mpa(role)
            if least < low or most > high:
                raise ConfigError(
                    f"{rig.path}: limits.pressure_mpa, {least:g} .. {most:g} MPa, goes beyond what {role.value} of "
                    f"devices.{entry.name} can be given, {low:g} .. {high:g} MPa; narrow the limits, or mend the "
                    "valve's range"
                )


def _check_apart(rig: RigConfig, settings: Mapping[str, Any]) -> None:
    """ConfigError when roles of two devices are wired to one terminal: the set-points of both valves would go to one of
    them, or one pressure be taken for both. What one device is wired to, it looks at itself."""
    taken: dict[str, tuple[str, Role]] = {}
    for entry in rig.devices:
        wiring = wiring_of(settings[entry.name])
        for role in sorted(entry.roles):
            for terminal in wiring.wired_to(role):
                other, its_role = taken.setdefault(terminal, (entry.name, role))
                if other != entry.name:
                    raise ConfigError(
                        f"{rig.path}: devices.{other}: {its_role.value} and devices.{entry.name}: {role.value} are "
                        f"both on {terminal}: each needs its own"
                    )


def _require_files(entry: DeviceEntry, settings: Any, path: Path) -> None:
    """ConfigError when a YAML file that a device's settings name is not there, or one of pamrig's own by its name. What
    else they name, the device looks for itself."""
    for field in dataclasses.fields(settings):
        place, written = getattr(settings, field.name), entry.settings.get(field.name)
        own = own_names(field.name)
        if isinstance(place, Path) and written is not None and (own or place.suffix in (".yaml", ".yml")):
            bare = os.sep not in str(written)
            require_file(place, f"{path}: devices.{entry.name}.{field.name}", written, own if bare else ())


def _paths(settings: Any) -> list[Path]:
    """The YAML files that a device's settings name, a model for example."""
    values = [getattr(settings, f.name) for f in dataclasses.fields(settings)]
    return [value for value in values if isinstance(value, Path) and value.suffix == ".yaml" and os.path.isfile(value)]

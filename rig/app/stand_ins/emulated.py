"""A rig of hardware without the hardware: its real drivers, each against an emulator, with one simulated plant behind
them all.

The rig's YAML is the one that goes to the lab. Only what a driver needs to find its stand-in (a port, an address, a
bitfile) is exchanged; wiring, signals, register maps and dialects are taken as they stand. The calibration is left out:
it belongs to the real parts, and the emulated ones are nominal.
"""

import dataclasses
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from hil.emulators.catalog import Emulator, emulate
from hil.emulators.world import World
from rig.app import compose
from rig.errors import ConfigError, DeviceLost
from rig.interfaces import Abilities, Device, DeviceContext, Measurement, Wiring
from rig.model.chain import Chain
from rig.model.parameters import load_model
from rig.rig_config import DeviceEntry, RigConfig, load_rig

EMULATORS_SWITCH_S = 0.0005
"""Emulators run on threads of this process; the interpreter must not leave the loop waiting its usual 5 ms for them."""


@dataclass(frozen=True)
class EmulatedSettings(Wiring):
    """A device of the kind emulated."""

    rig: Path
    """The rig's YAML as for the hardware."""
    model: Path
    """The plant: a model of the chain from set-point to angle."""


class EmulatedRig(Abilities):
    """All devices of another rig's YAML, their drivers real, their hardware emulated."""

    Settings = EmulatedSettings
    second_path = False
    """The plant lives in the loop's process: nobody else can write to it."""

    def __init__(self, settings: EmulatedSettings, context: DeviceContext) -> None:
        self.roles = context.roles
        self._settings, self._context = settings, context
        self._rig = load_rig(settings.rig)
        for entry in self._rig.devices:
            if entry.kind in compose.STAND_INS:
                raise ConfigError(f"{settings.rig}: devices.{entry.name}: kind {entry.kind!r} is a stand-in already")
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self.emulators: dict[str, Emulator] = {}
        """Name of the device -> its emulator, once opened; tests reach through it to the wires."""
        self.world: World | None = None
        self._device: Device | None = None

    def open(self) -> Mapping[str, str]:
        """Start the emulators, the first time, and open the rig's own devices on them."""
        if self._device is None:
            try:
                self._device = self._start()
            except BaseException:
                self.shut_down()
                raise
        emulated = ", ".join(f"{entry.name}: {entry.kind}" for entry in self._rig.devices)
        return {"emulated": emulated, "model": self._settings.model.name, **self._device.open()}

    def read(self) -> Measurement:
        """What the rig's drivers read from the emulators."""
        return self._opened().read()

    def write(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        """Through the rig's drivers."""
        self._opened().write(p1_cmd_mpa, p2_cmd_mpa)

    def safe(self) -> None:
        """Through the rig's drivers; before the first `open` there is no plant yet that could be unsafe."""
        if self._device is not None:
            self._device.safe()

    def close(self) -> None:
        """Close the drivers; the emulators and their plant stay, as hardware does."""
        if self._device is not None:
            self._device.close()

    def shut_down(self) -> None:
        """Stop the emulators as well."""
        self.close()
        for emulator in self.emulators.values():
            emulator.close()
        self.emulators.clear()
        self._device = None
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None

    def _opened(self) -> Device:
        if self._device is None:
            raise DeviceLost("emulated rig: not open")
        return self._device

    def _start(self) -> Device:
        context = self._context
        sys.setswitchinterval(EMULATORS_SWITCH_S)
        safe = context.safe_p1_mpa, context.safe_p2_mpa
        chain = Chain(load_model(self._settings.model))
        chain.reset(*safe)
        self.world = World(chain, context.clock, context.period_ns, safe)
        self._folder = tempfile.TemporaryDirectory(prefix="pamrig-emulated-")
        entries = tuple(self._emulated(entry) for entry in self._rig.devices)
        return compose.make_device(self._emulated_rig(entries), context.clock)

    def _emulated(self, entry: DeviceEntry) -> DeviceEntry:
        assert self.world is not None
        assert self._folder is not None
        _, checked = compose.device_settings(entry, self._rig, {})
        paths = {key: str(value) for key, value in vars(checked).items() if isinstance(value, Path)}
        emulator = emulate(entry.kind, entry.settings | paths, entry.roles, self.world, Path(self._folder.name))
        self.emulators[entry.name] = emulator
        if not emulator.virtual and self._is_virtual():
            raise ConfigError(f"{self._settings.rig}: {entry.kind} can only be emulated in real time; use --clock real")
        return dataclasses.replace(entry, settings={**entry.settings, **emulator.settings})

    def _emulated_rig(self, entries: tuple[DeviceEntry, ...]) -> RigConfig:
        context = self._context
        safe = dataclasses.replace(self._rig.safe, p1_mpa=context.safe_p1_mpa, p2_mpa=context.safe_p2_mpa)
        return dataclasses.replace(self._rig, devices=entries, period_ns=context.period_ns, safe=safe, calibration={})

    def _is_virtual(self) -> bool:
        """Whether this clock stands still while nobody waits for it."""
        from rig.realtime.clock import VirtualClock

        return isinstance(self._context.clock, VirtualClock)

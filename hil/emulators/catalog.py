"""Which emulator stands in for the hardware of which driver, and what every emulator offers. Imported when asked
for."""

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, Protocol, cast

from hil.emulators.world import World
from rig.errors import ConfigError
from rig.interfaces import Role

EMULATORS: Final[dict[str, str]] = {
    "myrio": "hil.emulators.nifpga.stand_in:emulate",
    "itv_serial": "hil.emulators.itv_serial.stand_in:emulate",
    "modbus_io": "hil.emulators.modbus.stand_in:emulate",
}
"""Kind of device, as in drivers.catalog -> 'module:function', an Emulate."""


class Emulator(Protocol):
    """A running stand-in for the hardware of one device; it serves from the moment it is made."""

    settings: Mapping[str, Any]
    """What must stand in the device's settings for its driver to find the stand-in: a port, an address, a bitfile."""
    virtual: bool
    """Whether it works under a clock that is turned by the loop. What sits behind a port or a socket does not."""

    def close(self) -> None:
        """Stop serving. Idempotent."""


class Emulate(Protocol):
    """Starts an emulator."""

    def __call__(self, settings: Mapping[str, Any], roles: frozenset[Role], world: World, folder: Path) -> Emulator:
        """`settings`: the device's part of the rig's YAML, from which the wiring is read; `folder`: for files of its
        own."""


def emulate(kind: str, settings: Mapping[str, Any], roles: frozenset[Role], world: World, folder: Path) -> Emulator:
    """Start the emulator for a kind of device; ConfigError when there is none."""
    if kind not in EMULATORS:
        raise ConfigError(f"no emulator for the kind {kind!r}; there are: {', '.join(EMULATORS)}")
    module, _, name = EMULATORS[kind].partition(":")
    start = cast(Emulate, getattr(importlib.import_module(module), name))
    return start(settings, roles, world, folder)

"""The drivers by name: kind -> where its class lives, imported when a rig asks for it.

A driver's class has `Settings` (a dataclass, see rig.config) and is made by `Class(settings, context)`; making one
touches no hardware. Stand-ins live in `hil` and are not listed here. Other packages register theirs in the group
`pamrig.devices` of Python's entry points (docs/how-to/add_a_device.md).
"""

import importlib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final, Protocol, cast

from rig import plugins
from rig.config import suggest
from rig.errors import ConfigError
from rig.interfaces import Device, DeviceContext

KINDS: Final[dict[str, str]] = {
    "myrio": "drivers.myrio.device:MyRio",
    "itv_serial": "drivers.itv_serial.device:ItvSerial",
    "modbus_io": "drivers.modbus_io.device:ModbusIo",
}
"""Kind, as it stands in a rig's YAML -> 'module:Class'."""


def kinds() -> list[str]:
    """Every kind that can be made: our own, then those of other packages."""
    return [*KINDS, *(kind for kind in plugins.names(plugins.DEVICES) if kind not in KINDS)]


def summary_of(kind: object) -> str:
    """What a class of devices says it is: the first paragraph of its docstring, on one line."""
    return " ".join((kind.__doc__ or "").strip().partition("\n\n")[0].split())


class Driver(Protocol):
    """What the class of a driver offers beside the calls of a Device; see rig.interfaces.Abilities."""

    Settings: type[Any]
    """A dataclass (see rig.config); what it may tell beside its fields stands in rig.interfaces.Wiring."""

    def __call__(self, settings: Any, context: DeviceContext) -> Device:
        """A closed device; nothing is opened and nothing moves."""


@dataclass(frozen=True)
class CatalogEntry:
    """One driver of the catalogue, imported."""

    kind: str
    driver: Driver

    @property
    def summary(self) -> str:
        """The first paragraph of the driver's docstring, on one line."""
        return summary_of(self.driver)


def entry(kind: str, where: str = "the rig's config", others: Iterable[str] = ()) -> CatalogEntry:
    """The driver called `kind`; ConfigError when there is none, or when its vendor's package is missing. `others`:
    kinds that may have been meant as well."""
    if kind not in KINDS and kind in plugins.names(plugins.DEVICES):
        return CatalogEntry(kind, cast(Driver, plugins.load(plugins.DEVICES, kind)))
    if kind not in KINDS:
        hint = suggest(kind, [*others, *kinds()])
        own = (
            "" if hint.startswith("did") else "; a device of your own is an entry point `pamrig.devices` of its package"
        )
        raise ConfigError(f"{where}: unknown kind of device {kind!r}; {hint}{own}")
    module, _, name = KINDS[kind].partition(":")
    try:
        return CatalogEntry(kind, cast(Driver, getattr(importlib.import_module(module), name)))
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"{where}: the kind {kind!r} needs the Python package {error.name!r}, which is not installed"
        ) from None

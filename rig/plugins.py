"""What other packages add from outside, by Python's entry points: the groups `pamrig.devices` and `pamrig.effects`.

A package names its device or effect in its own pyproject.toml; once it is installed, configs may use it by that name.
Nothing is looked up before a name is asked for that pamrig does not have itself, and a name of pamrig's own cannot be
taken.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any, TypeVar

from rig.errors import ConfigError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

T = TypeVar("T")
DEVICES = "pamrig.devices"
"""Kind of a device, as in a rig's YAML -> 'module:Class', a driver as `drivers.catalog` describes it."""
EFFECTS = "pamrig.effects"
"""Key of an effect stage -> 'module', which has STAGE, an EffectStage, and may have `library()`, its Effect for the
diagnosis."""


@cache
def names(group: str) -> tuple[str, ...]:
    """What is registered in the group, in alphabetical order."""
    return tuple(sorted(_found(group)))


def load(group: str, name: str) -> Any:
    """What is registered under `name`, imported; ConfigError, one line, when its package cannot be imported."""
    point = _found(group)[name]
    try:
        return point.load()
    except (ImportError, AttributeError) as error:
        raise ConfigError(
            f"{name}: registered as {point.value} in {group}, which cannot be imported: {error}"
        ) from None


def _found(group: str) -> "dict[str, EntryPoint]":
    from importlib.metadata import entry_points  # it brings email and zipfile, for which a loop has no use

    return {point.name: point for point in entry_points(group=group)}


class Registered(Mapping[str, T]):
    """A table of our own entries, then those from outside; these are looked up when a key is asked for that is not
    ours.

    `read(key, object)` makes an entry of what was registered, or returns None where it has nothing for this table.
    """

    def __init__(self, own: Mapping[str, T], group: str, read: Callable[[str, Any], T | None]) -> None:
        self._own, self._group, self._read = own, group, read
        self._outside: dict[str, T | None] = {}

    def __getitem__(self, key: str) -> T:
        if key in self._own:
            return self._own[key]
        entry = self._from_outside(key)
        if entry is None:
            raise KeyError(key)
        return entry

    def __iter__(self) -> Iterator[str]:
        yield from self._own
        yield from (key for key in names(self._group) if key not in self._own and self._from_outside(key) is not None)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def _from_outside(self, key: str) -> T | None:
        if key not in self._outside:
            found = key in names(self._group)
            self._outside[key] = self._read(key, load(self._group, key)) if found else None
        return self._outside[key]

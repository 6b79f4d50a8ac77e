"""The protocols at which the rooms meet: a device with its abilities, a clock, and what passes between them and the
loop."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol, TypeVar

T = TypeVar("T")
NAN = float("nan")
"""A reading that a device does not have."""


class Role(StrEnum):
    """What a channel does on the rig; each role is filled by exactly one device, monitors may be absent."""

    VALVE_1 = "valve_1"
    VALVE_2 = "valve_2"
    MONITOR_1 = "monitor_1"
    MONITOR_2 = "monitor_2"
    ANGLE = "angle"


class Measurement(NamedTuple):
    """What a device knows now. Roles it does not fill are NaN with the flag *_ABSENT and age 0.

    An age counts from the moment the value was taken to the return of `read`; a value is never passed as newer than it
    is.
    """

    p1_mpa: float = NAN
    p2_mpa: float = NAN
    angle_deg: float = NAN
    p1_raw: float = NAN
    p2_raw: float = NAN
    angle_raw: float = NAN
    excitation_raw: float = NAN
    p1_age_ns: int = 0
    p2_age_ns: int = 0
    angle_age_ns: int = 0
    flags: int = 0
    further_1: float = NAN
    further_2: float = NAN
    further_3: float = NAN
    further_4: float = NAN
    """Further channels (load cell, temperature) in their own units, in the order of the rig's YAML."""


class Clock(Protocol):
    """Monotonic time in nanoseconds. The loop knows no other."""

    def now_ns(self) -> int:
        """Never falls; its zero means nothing."""

    def wait_until_ns(self, deadline_ns: int) -> None:
        """Return at `deadline_ns` or, when that has passed, at once. May wake late, never early."""


@dataclass(frozen=True)
class DeviceContext:
    """What a device is given beside its own settings."""

    clock: Clock
    roles: frozenset[Role]
    """The roles that this rig wants from this device; `write` and `read` leave the others alone."""
    safe_p1_mpa: float = 0.0
    safe_p2_mpa: float = 0.0
    """What `safe` writes."""
    period_ns: int = 5_000_000
    calibration: Mapping[str, object] = field(default_factory=dict)
    """Role name -> calibration of its channel, as the rig's YAML has it; a device brings its own default."""
    further: tuple[str, ...] = ()
    """Names of the rig's further channels in the order of their places; a device reads those that its settings have."""
    where: str = ""
    """Where its settings stand, for messages: the rig's YAML and the key."""
    looking: bool = False
    """Nothing but looked at: whoever drives the rig meanwhile finds its outputs and its watchdog as they were."""
    driven: Callable[[], bool] = lambda: False
    """Whether another process drives the device now: `safe` from outside then leaves it its watchdog."""

    @property
    def places(self) -> tuple[str, str, str, str]:
        """The names of all four places of a Measurement, empty where the rig has none."""
        first, second, third, fourth = (*self.further, "", "", "", "")[:4]
        return first, second, third, fourth


class Device(Protocol):
    """One piece of hardware, or a stand-in. Called from one thread only. What it may offer beside stands in Abilities,
    what its settings may tell in Wiring.

    Every call returns within one period or raises: DeviceError when the next call may work, DeviceLost when it cannot.
    No call but `write` and `safe` changes an output; `open` and `close` leave outputs as the class documents.
    """

    roles: frozenset[Role]

    def open(self) -> Mapping[str, str]:
        """Connect and prove it is the right device; returns facts for the log (serial number, firmware, rates).

        After close, open works again. Outputs are unchanged until the first `write` or `safe`.
        """

    def read(self) -> Measurement:
        """The newest values, with their ages. Legal before the first write. Never blocks for longer than a period."""

    def write(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        """Hand over both set-points, to take effect together where the hardware can.

        Values are finite and inside the rig's envelope (the guard saw to it); the device clamps once more to its own
        range.
        """

    def safe(self) -> None:
        """Bring the outputs to the safe set-points at once, by every means left.

        Idempotent; legal in any state, after any error, and before `open` (then it opens for just this). Returns when
        the device has taken them, and waits for less than a period where it is open. DevicePending: they are on their
        way by somebody who outlives the caller, ask again. Any other error: the device could not be reached.
        """

    def close(self) -> None:
        """Let go of the hardware. Idempotent; does not change outputs (call `safe` first)."""


class Abilities:
    """What a device may offer beside `Device`, and what stands for it where it does not. A driver derives from this
    class and overrides what its hardware can; nothing here moves an output."""

    second_path: bool = True
    """Another process can make the plant safe by an instance of its own: set-points stand when the loop is gone. False
    for a plant that ends with the loop's process; asked of the class."""
    further: tuple[str, ...] = ()
    """Names of the rig's further channels that it reads."""

    def holds_safe(self) -> bool | None:
        """Whether the safe set-points stand at the outputs, by the device's own word and not by memory; None when it
        cannot tell, as here.

        Legal in any state, and before `open` (then it opens for just this). DeviceError when it was asked in vain.
        """
        return None

    def keep(self) -> None:
        """Let the device's own watchdog know of us, in a tick in which nothing is read or written: another device of
        the rig was lost, and this one is to stay at its safe set-points. Returns within one period; DeviceError when it
        could not be reached. Here: there is no watchdog."""

    def prepare_safe(self) -> None:
        """Get ready for `safe`, so that it is quick: asked of the instance of whoever may need it, the supervisor.
        RigError where that fails; `safe` then opens what it needs. Here: `safe` needs nothing."""

    def twin(self, clock: Clock) -> "Device | None":
        """Another on `clock` that reaches no hardware, whose calls cost what this one's do: ticks are rehearsed on it.
        Here: None, ticks are rehearsed without a device."""
        return None

    def shut_down(self) -> None:
        """End what `close` leaves: the emulators of a stand-in. Here: nothing."""


class Wiring:
    """What a device's settings may tell beside their fields, and what holds where they do not. Asked before anything is
    opened."""

    further: Mapping[str, Any] = MappingProxyType({})
    """The rig's further channels that the device reads, by name; usually a field of the settings."""

    @property
    def wires(self) -> tuple[str, ...]:
        """Names of what carries the set-points (an address, a port), the same for every process of the machine: one at
        a time drives it. Here: nothing that two could share."""
        return ()

    @property
    def one_reader(self) -> tuple[str, ...]:
        """Names, of the same kind, of what gives each byte to one reader only, as a serial port does: one process at a
        time opens it, also where nothing is driven by it. Here: nothing; looking disturbs nobody."""
        return ()

    def wired_to(self, role: Role) -> tuple[str, ...]:
        """Names of what a role is wired to, which no other device of the rig may share. Here: nobody knows."""
        return ()

    def range_mpa(self, role: Role) -> tuple[float, float]:
        """The lowest and the highest pressure that a valve can be given: the rig's limits have to keep to them. Here:
        any."""
        return -math.inf, math.inf

    def read_now(self) -> dict[str, Any]:
        """Settings that take the place of files which these settings name, read when the rig is loaded: every process
        then has what was read once. Here: none."""
        return {}


def abilities_of(device: object) -> Abilities:
    """The abilities of a device, or of a class of devices. One that does not derive from Abilities has those that it
    offers by the same names."""
    return _offered(Abilities, device)


def wiring_of(settings: object) -> Wiring:
    """The same of a device's settings."""
    return _offered(Wiring, settings)


def _offered(base: type[T], thing: object) -> T:
    if isinstance(thing, base):
        return thing
    names = [name for name in vars(base) if not name.startswith("_") and hasattr(thing, name)]
    found = {name: getattr(thing, name) for name in names}
    own = {name: staticmethod(one) if callable(one) else one for name, one in found.items()}
    made: T = type(base.__name__, (base,), own)()
    return made

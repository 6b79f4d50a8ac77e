"""The protocols at which the rooms meet: a device, a clock, and what passes between them and the loop."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple, Protocol

NAN = float("nan")


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
    """One piece of hardware, or a stand-in. Called from one thread only.

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


class ReadsBack(Protocol):
    """What a device may offer beside `Device`: to tell what stands at its outputs."""

    def holds_safe(self) -> bool | None:
        """Whether the safe set-points stand at the outputs, by the device's own word and not by memory; None when it
        cannot tell.

        Moves nothing. Legal in any state, and before `open` (then it opens for just this). DeviceError when it was
        asked in vain.
        """


class Keeps(Protocol):
    """What a device with a watchdog of its own may offer beside `Device`."""

    def keep(self) -> None:
        """Let the watchdog know of us, in a tick in which nothing is read or written: another device of the rig was
        lost, and this one is to stay at its safe set-points. Changes no output, and returns within one period.
        DeviceError when it could not be reached."""

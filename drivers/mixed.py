"""A rig made of several devices: each role is filled by one of them, and the whole is again one device."""

import math
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Final, TypeVar

from rig.errors import ConfigError, DeviceError, DeviceLost, DevicePending
from rig.interfaces import Abilities, Clock, Device, Measurement, Role, abilities_of
from rig.sample import ABSENT_BY_ROLE

_FIELDS: Final = {
    Role.MONITOR_1: ("p1_mpa", "p1_raw", "p1_age_ns"),
    Role.MONITOR_2: ("p2_mpa", "p2_raw", "p2_age_ns"),
    Role.ANGLE: ("angle_deg", "angle_raw", "excitation_raw", "angle_age_ns"),
}
_PLACES: Final = {role: tuple(Measurement._fields.index(name) for name in names) for role, names in _FIELDS.items()}
"""Role -> where its values stand in a Measurement; its age is the last."""
_FURTHER: Final = tuple(Measurement._fields.index(f"further_{place}") for place in (1, 2, 3, 4))
_EMPTY: Final = tuple(Measurement())
_FLAGS: Final = Measurement._fields.index("flags")
P = TypeVar("P")
T = TypeVar("T")


class MixedRig(Abilities):
    """Several devices with the roles divided among them.

    Set-points go to the devices one after the other, so the two valves change together only within the slower device's
    time. Every call reaches every device, also when one of them fails; then the worst error is raised, with the others'
    beside it.

    Of an instance that is not open, which is somebody's way past the loop, every device is made safe and looked at in a
    thread of its own: one that has to be found first does not keep the next one waiting. A loop has one thread, and
    devices that never wait.
    """

    def __init__(self, parts: Sequence[Device], clock: Clock, period_ns: int = 5_000_000) -> None:
        """ConfigError when two of the devices claim one role."""
        self._parts = list(parts)
        self._now = clock.now_ns
        self._period_ns = period_ns
        claimed = [role for part in parts for role in part.roles]
        for role in claimed:
            if claimed.count(role) > 1:
                raise ConfigError(f"roles: {role.value} is filled by two devices")
        self.roles = frozenset(claimed)
        self._writers = [part for part in parts if part.roles & {Role.VALVE_1, Role.VALVE_2}]
        self._able = [abilities_of(part) for part in self._writers]
        self.second_path = all(part.second_path for part in self._able)
        self._readers = [_reader(part) for part in parts if part.roles & set(_FIELDS) or abilities_of(part).further]
        self._absent = sum(flag for role, flag in ABSENT_BY_ROLE.items() if role not in self.roles)
        self._is_open = False

    def open(self) -> Mapping[str, str]:
        """Open all; when one cannot be opened, none stays open."""
        facts: dict[str, str] = {}
        self._is_open = True
        try:
            for index, part in enumerate(self._parts, 1):
                facts |= {f"{index}.{key}": value for key, value in part.open().items()}
        except BaseException:
            self.close()
            raise
        return facts

    def read(self) -> Measurement:
        """The newest values of all; an age counts to the return of this call, not of the part's own."""
        began = self._now()
        values: list[float] = [*_EMPTY]
        flags = self._absent
        taken: list[tuple[int, int]] = []
        errors: list[DeviceError] = []
        for part, places, ages, mine in self._readers:
            try:
                now = part.read()
            except DeviceError as error:
                errors.append(error)
                continue
            flags |= now.flags & mine
            for place in places:
                values[place] = now[place]
            for place in _FURTHER:
                if now[place] == now[place]:  # not NaN: this part reads it
                    values[place] = now[place]
            returned = self._now()
            taken += [(place, returned) for absent, place in ages if not now.flags & absent]
        ended = self._now()
        _raise_worst(errors)
        self._check_time(began, ended, "reading")
        for place, returned in taken:
            values[place] += ended - returned
        values[_FLAGS] = flags
        return Measurement(*values)  # type: ignore[arg-type]  # ages and flags are whole numbers among the floats

    def write(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        """Both set-points to every device with a valve; each takes its own. One that is not finite reaches none of
        them."""
        if not (math.isfinite(p1_cmd_mpa) and math.isfinite(p2_cmd_mpa)):
            raise DeviceError("mixed rig: a set-point is not finite; nothing was written")
        began = self._now()
        _in_turn(self._writers, lambda part: part.write(p1_cmd_mpa, p2_cmd_mpa))
        self._check_time(began, self._now(), "writing")

    def safe(self) -> None:
        """Every device's own safe state, whatever happens to the others."""
        self._on_every(self._writers, lambda part: part.safe())

    def holds_safe(self) -> bool | None:
        """Whether every valve's device holds its safe set-point; None when one of them cannot tell."""
        held = self._on_every(self._able, lambda part: part.holds_safe())
        return False if False in held else None if None in held else True

    def keep(self) -> None:
        """Feed the watchdog of every valve's device that has one, whatever happens to the others."""
        _in_turn(self._able, lambda part: part.keep())

    def prepare_safe(self) -> None:
        """Let every device with a valve get ready for `safe`, where it knows how."""
        for part in self._able:
            part.prepare_safe()

    def twin(self, clock: Clock) -> "MixedRig | None":
        """A mixture of the parts' twins, for rehearsals; None when one has none."""
        twins = [found for part in self._parts if (found := abilities_of(part).twin(clock))]
        return MixedRig(twins, clock, self._period_ns) if len(twins) == len(self._parts) else None

    def close(self) -> None:
        """Let go of all."""
        self._is_open = False
        _in_turn(self._parts, lambda part: part.close())

    def _check_time(self, began_ns: int, ended_ns: int, doing: str) -> None:
        if ended_ns - began_ns > self._period_ns:
            took, period = (ended_ns - began_ns) / 1e6, self._period_ns / 1e6
            raise DeviceError(
                f"mixed rig: {doing} all devices took {took:.1f} ms, longer than the period of {period:g} ms"
            )

    def _on_every(self, parts: Sequence[P], call: Callable[[P], T]) -> list[T]:
        return (_in_turn if self._is_open or len(parts) < 2 else _at_once)(parts, call)


def _in_turn(parts: Sequence[P], call: Callable[[P], T]) -> list[T]:
    """What each part answered. All are called, also after an error, and one that is a bug of a driver: the other
    valve's pressure must not stand for it."""
    answers: list[T] = []
    errors: list[Exception] = []
    for part in parts:
        try:
            answers.append(call(part))
        except Exception as error:  # noqa: BLE001  # raised below
            errors.append(error)
    if errors:
        _raise_worst(errors)
    return answers


def _at_once(parts: Sequence[P], call: Callable[[P], T]) -> list[T]:
    """The same, each in a thread of its own; those that get none are called after those that go on by themselves."""
    answers: dict[int, T] = {}
    errors: dict[int, Exception] = {}

    def one(place: int) -> None:
        try:
            answers[place] = call(parts[place])
        except Exception as error:  # noqa: BLE001  # raised below
            errors[place] = error

    threads = [threading.Thread(target=one, args=(place,), daemon=True) for place in range(len(parts))]
    late = [place for place, thread in enumerate(threads) if not _started(thread)]
    for place in late:
        one(place)
    for place, thread in enumerate(threads):
        if place not in late:
            thread.join()
    _raise_worst([error for _, error in sorted(errors.items())])
    return [answers[place] for place in range(len(parts))]


def _reader(part: Device) -> tuple[Device, tuple[int, ...], list[tuple[int, int]], int]:
    """A part, where its values stand, the flag and the place of each age, and the flags that are its own to set."""
    roles = [role for role in _FIELDS if role in part.roles]
    places = tuple(place for role in roles for place in _PLACES[role])
    ages = [(ABSENT_BY_ROLE[role], _PLACES[role][-1]) for role in roles]
    not_mine = sum(flag for role, flag in ABSENT_BY_ROLE.items() if role not in roles)
    return part, places, ages, ~not_mine


def _started(thread: threading.Thread) -> bool:
    """Whether this machine gives it: one that has none left is to be made safe all the same."""
    try:
        thread.start()
    except RuntimeError:
        return False
    return True


def _raise_worst(errors: Sequence[Exception]) -> None:
    """One error for all: a bug of a driver as it is; lost when any device is lost, pending when all of them are."""
    if not errors:
        return
    for error in errors:
        if not isinstance(error, DeviceError):
            raise error
    kind: type[DeviceError] = DeviceError
    if any(isinstance(error, DeviceLost) for error in errors):
        kind = DeviceLost
    elif all(isinstance(error, DevicePending) for error in errors):
        kind = DevicePending
    raise kind("; ".join(str(error) for error in errors)) from None

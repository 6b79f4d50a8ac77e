"""A simulated rig whose wires can be reached from outside, and which misbehaves on demand.

Each `Injection` is one way in which a device or its sensors fail; it is switched on and off through the terminals while
the rig runs, so that a test or `pamrig faults` can time what follows. What the faults of processes are (a kill, a stop)
needs no device.
"""

import os
import time
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from pathlib import Path

from hil.bench import SimulatedRig, SimulatedSettings
from hil.terminals import Terminals
from rig.errors import DeviceError, DeviceLost
from rig.interfaces import NAN, Abilities, DeviceContext, Measurement
from rig.sample import BROKEN_WIRE


class Injection(IntEnum):
    """Faults of the device, by number in the terminals."""

    NONE = 0
    ONE_TIMEOUT = 1
    TIMEOUTS = 2
    GARBLED = 3
    LOST = 4
    HANG = 5
    LATE = 6
    """One call takes 0.6 of a period."""
    SKIP = 7
    """One call takes 2.4 periods: whole periods are missed."""
    MISSES = 8
    """A call takes 1.5 periods, again and again."""
    STALL = 9
    """One call takes 8 periods."""
    FROZEN = 10
    NOT_A_NUMBER = 11
    OUT_OF_RANGE = 12
    JUMP = 13
    BROKEN_WIRE = 14
    STALE = 15
    NO_AIR = 16
    """The pressures fall and stay away, whatever is commanded."""
    CRASH = 17
    """An error that no driver should let through."""
    REFUSED = 18
    """The first valve's output is refused in every tick; by itself, as the safe state is written, it is taken."""


_ONCE = {Injection.ONE_TIMEOUT, Injection.LATE, Injection.SKIP, Injection.STALL}
_PERIODS = {Injection.LATE: 0.6, Injection.SKIP: 2.4, Injection.MISSES: 1.5, Injection.STALL: 8.0}
_STALE_NS = 1_000_000_000
_AIRLESS_MPA = 0.01


@dataclass(frozen=True, kw_only=True)
class FaultySettings(SimulatedSettings):
    """The simulated rig's settings, and where its terminals are."""

    terminals: Path

    @property
    def wires(self) -> tuple[str, ...]:
        """The terminals, by whichever name: what is written there stands for every process."""
        return (os.path.realpath(self.terminals),)


class FaultyRig(Abilities):
    """A simulated rig with terminals of its own and faults on demand."""

    Settings = FaultySettings
    second_path = True
    """Another process can write to the terminals."""

    def __init__(self, settings: FaultySettings, context: DeviceContext) -> None:
        self.roles = context.roles
        self._context = context
        self._settings, self._driven = settings, False
        self._terminals = Terminals.at(settings.terminals)
        self._given = (context.safe_p1_mpa, context.safe_p2_mpa)
        self._shown: Measurement | None = None
        self._shown_fault = 0
        self._airless_mpa = 0.0

    @cached_property
    def _inner(self) -> SimulatedRig:
        """The plant, made when it is first needed: not by who makes the terminals safe from outside."""
        self._driven = True
        return SimulatedRig(self._settings, self._context)

    def open(self) -> Mapping[str, str]:
        """Start the plant; the terminals keep what stands there."""
        return {**self._inner.open(), "terminals": "shared memory"}

    def read(self) -> Measurement:
        """The plant under what stands at the terminals, seen through the fault that is on."""
        fault = self._fault()
        self._fail(fault)
        standing = self._terminals.setpoints
        if standing != self._given and self._terminals.writes:
            self._given = standing
            self._inner.write(*standing)  # somebody else wrote
        return self._seen(self._inner.read(), fault)

    def write(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        """Put both on the terminals."""
        if self._fault() in (Injection.TIMEOUTS, Injection.GARBLED, Injection.LOST):
            self._fail(self._fault())
        refused = self._fault() is Injection.REFUSED
        self._inner.write(self._given[0] if refused else p1_cmd_mpa, p2_cmd_mpa)
        self._given = self._inner.setpoints_mpa
        self._terminals.write(*self._given)
        if refused:
            raise DeviceError("simulated rig: output 1 is refused")

    def safe(self) -> None:
        """The safe set-points at the terminals; works without `open` and past every fault of the sensors."""
        self._given = self._context.safe_p1_mpa, self._context.safe_p2_mpa
        self._terminals.write(*self._given)
        if self._driven:
            self._inner.safe()

    def holds_safe(self) -> bool:
        """What stands at the terminals, whoever wrote it."""
        return self._terminals.setpoints == (self._context.safe_p1_mpa, self._context.safe_p2_mpa)

    def close(self) -> None:
        """The terminals keep what stands there."""
        if self._driven:
            self._inner.close()

    def _fault(self) -> Injection:
        """The fault that is on; one that happens once switches itself off."""
        fault = Injection(self._terminals.fault)
        if fault in _ONCE:
            self._terminals.inject(Injection.NONE)
        return fault

    def _fail(self, fault: Injection) -> None:
        """The faults that are not a matter of values."""
        if fault in _PERIODS:
            time.sleep(_PERIODS[fault] * self._context.period_ns * 1e-9)
        elif fault in (Injection.TIMEOUTS, Injection.ONE_TIMEOUT):
            raise DeviceError("simulated rig: no reply within 5 ms")
        elif fault is Injection.GARBLED:
            raise DeviceError("simulated rig: the reply's checksum is wrong")
        elif fault is Injection.LOST:
            raise DeviceLost("simulated rig: the connection was closed")
        elif fault is Injection.CRASH:
            raise RuntimeError("simulated rig: a driver with a bug")
        while fault is Injection.HANG:
            time.sleep(1.0)

    def _seen(self, true: Measurement, fault: Injection) -> Measurement:
        """The measurement as the fault shows it."""
        if fault is not self._shown_fault:
            self._shown, self._shown_fault, self._airless_mpa = true, fault, min(true.p1_mpa, true.p2_mpa)
        if fault is Injection.FROZEN and self._shown is not None:
            return _repeated(true, self._shown)
        if fault is Injection.NOT_A_NUMBER:
            return true._replace(angle_deg=NAN)
        if fault is Injection.OUT_OF_RANGE:
            return true._replace(p1_mpa=9.9)
        if fault is Injection.JUMP:
            flip = 40.0 if time.monotonic_ns() // self._context.period_ns % 2 else -40.0
            return true._replace(angle_deg=true.angle_deg + flip)
        if fault is Injection.BROKEN_WIRE:
            return true._replace(p1_raw=0.0, p1_mpa=-0.125, flags=true.flags | BROKEN_WIRE)
        if fault is Injection.STALE:
            return true._replace(angle_age_ns=_STALE_NS)
        if fault is Injection.NO_AIR:
            self._airless_mpa = max(
                self._airless_mpa - 0.01, _AIRLESS_MPA
            )  # within what the guard takes for a true change
            return true._replace(p1_mpa=self._airless_mpa, p2_mpa=self._airless_mpa)
        return true


def _repeated(true: Measurement, shown: Measurement) -> Measurement:
    """The sensors' values of `shown` with the ages of `true`: a sensor that repeats itself does not know it."""
    return shown._replace(p1_age_ns=true.p1_age_ns, p2_age_ns=true.p2_age_ns, angle_age_ns=true.angle_age_ns)

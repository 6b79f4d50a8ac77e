"""A witness of how a core of this machine runs: a process that sleeps and wakes all the time, and notes each wake that
comes late.

It stays on one core at the highest real-time priority, above every process of the rig, so none of them can hold it up:
when it is late, so is everything on that core, by the kernel, the host of a virtual machine or somebody else's
real-time process. Without that priority or core it would prove nothing, so it says so and ends. `rig.qualify.stalls`
puts what it saw beside what the loop recorded.
"""

import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Final, NamedTuple, Self

from rig.realtime import measures

_HIGHEST: Final = 99
SLEEP_NS: Final = 1_000_000
"""Short against a period of 5 ms; each wake takes some 16 us of the core, which the loop may have to wait for."""
LATE_NS: Final = 1_000_000
"""A wake later than this is noted."""
_NEEDED: Final = ("mlock", "affinity", "fifo")
"""Without locked memory it could wait for a page of its own."""


class Stall(NamedTuple):
    """One late wake of a witness, in nanoseconds of CLOCK_MONOTONIC, the loop's clock."""

    ran_ns: int
    """When the witness ran for the last time before it."""
    due_ns: int
    """When it should have run again."""
    until_ns: int
    """When it did."""


@dataclass(frozen=True)
class Account:
    """What the witness of one core has to say."""

    core: int
    priority: int = 0
    """At which it ran; 0 without real-time priority."""
    stalls: tuple[Stall, ...] = ()
    why_not: str = ""
    """Why there is no account of this core; empty when there is."""


def watch(going: Callable[[], bool], now_ns: Callable[[], int], sleep: Callable[[float], object]) -> Iterator[Stall]:
    """Sleep and wake as long as `going`; each late wake is yielded."""
    sleep_s = SLEEP_NS / 1e9
    ran_ns = now_ns()
    while going():
        sleep(sleep_s)
        woken_ns = now_ns()
        if woken_ns - ran_ns > SLEEP_NS + LATE_NS:
            yield Stall(ran_ns, ran_ns + SLEEP_NS, woken_ns)
        ran_ns = woken_ns


class Witnesses:
    """A witness on each of `cores`, from the start of the `with` block until `accounts`."""

    def __init__(self, cores: Iterable[int]) -> None:
        self._cores = sorted(cores)
        self.processes: dict[int, subprocess.Popen[str]] = {}
        self._denied: dict[int, str] = {}

    def __enter__(self) -> Self:
        for core in self._cores:
            self.processes[core] = subprocess.Popen(
                [sys.executable, "-m", "rig.qualify.witness", str(core)],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                text=True,
            )
        for core in self._cores:
            if why := _why_not(self._answer(core)):
                self._denied[core] = why
        return self

    def __exit__(self, *_: object) -> None:
        for process in self.processes.values():
            process.kill()
            process.communicate()

    def accounts(self) -> list[Account]:
        """What each saw until now; they end by it."""
        for process in self.processes.values():
            process.terminate()
        return [self._account(core) for core in self._cores]

    def _account(self, core: int) -> Account:
        if why := self._denied.get(core):
            return Account(core, why_not=why)
        seen = self._answer(core)
        if seen is None:
            return Account(core, why_not="the witness ended before its time")
        return Account(core, seen["priority"], tuple(Stall(*one) for one in seen["stalls"]))

    def _answer(self, core: int) -> dict[str, Any] | None:
        out = self.processes[core].stdout
        assert out is not None
        line = out.readline()
        return json.loads(line) if line.endswith("\n") else None


def _why_not(granted: dict[str, str] | None) -> str:
    """Which measure was denied that a witness cannot do without; empty when it has them."""
    if granted is None:
        return "the witness did not start"
    return "; ".join(f"{name} {granted[name]}" for name in _NEEDED if granted[name] != "granted")


def main(core: int) -> None:
    """The process: say what was granted, watch until SIGTERM or the end of the parent, say what was seen."""
    parent, ended = os.getppid(), False

    def end(*_: object) -> None:
        nonlocal ended
        ended = True

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent
    signal.signal(signal.SIGTERM, end)
    priority = _permitted()
    granted = measures.apply(measures.Measures(fifo_priority=priority, cpu=core))
    _say(granted)
    if not _why_not(granted):
        stalls = list(watch(lambda: not ended and os.getppid() == parent, time.monotonic_ns, time.sleep))
        _say({"priority": priority, "stalls": stalls})


def _permitted() -> int:
    """The highest priority that this process may have: that of its limit, where it has one and no leave to go above
    it."""
    limit, _ = resource.getrlimit(resource.RLIMIT_RTPRIO)
    try:
        measures.fifo(_HIGHEST)
    except OSError:
        return limit if 0 < limit < _HIGHEST else _HIGHEST
    return _HIGHEST


def _say(what: dict[str, Any]) -> None:
    with suppress(BrokenPipeError):
        print(json.dumps(what), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]))

"""How soon an emergency stop reaches the valves while somebody keeps the daemon busy: the attacks, and the trials that
time it.

An attack is carried out by a process of its own, through the daemon's endpoints (its Unix socket, its TCP port) alone.
A trial brings the rig into a sweep, lets the attack begin, connects and stops the rig, and looks at the terminals.
"""

import asyncio
import contextlib
import math
import multiprocessing
import os
import random
import socket
import time
from collections.abc import Callable, Coroutine, Iterator, Sequence
from dataclasses import dataclass, field
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import Any, Final

from rig.errors import RigError
from rig.qualify.faults.bench import BY_THE_MACHINE, FaultBench, Spoilt
from rig.service.connections import protocol

GOAL_MS: Final = 10.0
GOAL_SHARE: Final = 0.99
"""Of the stops under an attack that are to be within GOAL_MS: two periods of the loop."""
_TOKEN: Final = "0123456789abcdef"
_CLIENTS: Final = 60
"""Leaves places free: the bench needs one itself."""
_MANY_CLIENTS: Final = 100
"""More than there are places."""
_STARTS: Final = 12
_STOP_WATCH_NICE: Final = -15
_UNDER_WAY_S: Final = (0.05, 0.5)
"""An attack has been going on for so long when the rig is stopped; drawn evenly by its logarithm."""
_TRIES: Final = 3

SWEEP: Final = """\
settle_s: 0.02
zero_s: 0.0
ramp_in_s: 0.02
duration_s: 60.0
ramp_out_s: 0.1
records: [{sine: {frequency_hz: 0.5, amplitude_mpa: 0.2}}]
"""
"""Under way as soon as it can be, for a stop needs no more than set-points that are not the safe ones."""

Streams = tuple[asyncio.StreamReader, asyncio.StreamWriter]


@dataclass(frozen=True)
class Endpoints:
    """Where the daemon can be reached, and what an attacker needs beside it."""

    socket: Path
    port: int
    sweeps: Path
    """A folder of the attacker's own."""


@dataclass(frozen=True)
class Attack:
    """One way to keep the daemon busy."""

    name: str
    done: str
    """What is done, in words."""
    client: Callable[[Endpoints, int], Coroutine[Any, Any, None]] | None
    """What each client of the attack does, for ever; it is given its number. None: nothing."""
    clients: int = _CLIENTS


@dataclass
class StopTimes:
    """What was measured under one attack."""

    attack: Attack
    ms: list[float] = field(default_factory=list)
    """From the call of `estop`, its connection included, to the safe set-points at the terminals."""
    connected_ms: list[float] = field(default_factory=list)
    """Of these, from the moment on at which the connection stood: what daemon and loop took. Before it, the caller
    waited for a processor."""
    spoilt: int = 0
    """Trials in which the machine itself stood still."""
    problem: str = ""

    def quantile(self, share: float, *, connected: bool = False) -> float:
        """Of the trials, by rank: 0.99 of a hundred is the last but one."""
        ordered = sorted(self.connected_ms if connected else self.ms)
        return ordered[max(math.ceil(len(ordered) * share) - 1, 0)] if ordered else math.nan

    def interval_ms(self, share: float) -> tuple[float, float]:
        """Where that quantile lies with 95 %, by ranks; infinity where so few trials give no end."""
        from scipy.stats import binom

        ordered = [0.0, *sorted(self.ms), math.inf]
        low, high = binom.ppf([0.025, 0.975], len(self.ms), share)
        return ordered[int(low)], ordered[min(int(high) + 1, len(ordered) - 1)]

    @property
    def late(self) -> int:
        """Stops that took longer than the goal."""
        return sum(ms > GOAL_MS for ms in self.ms)


# what the attackers do


async def _unix(endpoints: Endpoints) -> Streams:
    return await asyncio.open_unix_connection(endpoints.socket)


async def _send_and_read(endpoints: Endpoints, line: bytes) -> None:
    """The same line again and again, as fast as it is answered."""
    reader, writer = await _unix(endpoints)
    with contextlib.closing(writer):
        while True:
            writer.write(line)
            await reader.readline()


async def _status(endpoints: Endpoints, _: int) -> None:
    await _send_and_read(endpoints, protocol.encode({"id": 1, "command": "status"}))


async def _nonsense(endpoints: Endpoints, _: int) -> None:
    await _send_and_read(endpoints, b"[" * 60_000 + b"\n")


async def _subscribed(endpoints: Endpoints) -> Streams:
    reader, writer = await _unix(endpoints)
    writer.write(protocol.encode({"id": 1, "command": "subscribe", "rate_hz": 50, "samples": True}))
    return reader, writer


async def _subscriber(endpoints: Endpoints, _: int) -> None:
    reader, writer = await _subscribed(endpoints)
    with contextlib.closing(writer):
        while await reader.read(65536):
            pass


async def _deaf(endpoints: Endpoints, _: int) -> None:
    reader, writer = await _subscribed(endpoints)
    reader._transport.pause_reading()  # type: ignore[attr-defined]  # noqa: SLF001 (asyncio offers no other way not to read)
    with contextlib.closing(writer):
        await asyncio.Event().wait()


async def _silent(endpoints: Endpoints, number: int) -> None:
    """Every other one over the network, without a token; who is sent away comes back."""
    while True:
        opening = _unix(endpoints) if number % 2 else asyncio.open_connection("127.0.0.1", endpoints.port)
        reader, writer = await opening
        with contextlib.closing(writer):
            await reader.read()


async def _knocking(endpoints: Endpoints, number: int) -> None:
    """In and out again, as fast as it goes."""
    while True:
        _, writer = await (_unix(endpoints) if number % 2 else asyncio.open_connection("127.0.0.1", endpoints.port))
        writer.write(b'{"v": 1, "id"')
        writer.close()
        await asyncio.sleep(0)


def _starting(name: str, text: str) -> Callable[[Endpoints, int], Coroutine[Any, Any, None]]:
    """Each client starts a sweep of that text, again and again."""

    async def client(endpoints: Endpoints, number: int) -> None:
        path = endpoints.sweeps / f"{name}{number}.yaml"
        path.write_text(text, encoding="utf-8")
        await _send_and_read(endpoints, protocol.encode({"id": 1, "command": "start", "sweeps": [str(path)]}))

    return client


def _multiplying() -> str:
    """36 kB: lists in lists by aliases, and lists that multiply."""
    numbers = ", ".join(["0.1"] * 3000)
    laughs = "\n".join(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 9))
    record = f"records: [{{sine: {{frequency_hz: [{numbers}], amplitude_mpa: [{numbers}]}}}}]"
    return f"a0: &a0 [{', '.join(['x'] * 10)}]\n{laughs}\n{record}\n"


_LARGE: Final = "records:\n" + "- sine: {frequency_hz: 0.5, amplitude_mpa: 0.9}\n" * 5000
_SLOW: Final = (
    "records: [{multisine: {amplitude_mpa: 0.1, low_hz: 0.1, high_hz: 20, period_s: 100}, duration_s: 80000}]"
)

ATTACKS: Final = (
    Attack("none", "nobody else is there", None, 0),
    Attack("status", "60 clients ask for the status as fast as they are answered", _status),
    Attack("nonsense", "60 clients send lines of 60 kB that are no request", _nonsense),
    Attack("subscribers", "60 subscribers at 50 Hz with every sample", _subscriber),
    Attack("deaf", "60 subscribers that read nothing", _deaf),
    Attack("full house", "100 silent clients, half of them over the network without a token; who is sent away comes "
                         "back", _silent, _MANY_CLIENTS),
    Attack("knocking", "60 clients connect and leave in the middle of a line, as fast as it goes", _knocking),
    Attack("multiplying", "12 clients start sweeps of 36 kB whose lists and aliases multiply", _starting("m",
    _multiplying()), _STARTS),
    Attack("too large", "12 clients start sweeps of 4 MB", _starting("t", "# " + "x" * (4 * 1024 * 1024)), _STARTS),
    Attack("large", "12 clients start sweeps of 5000 records that leave the envelope", _starting("l", _LARGE), _STARTS),
    Attack("slow", "12 clients start sweeps that take longer to expand than they may", _starting("s", _SLOW), _STARTS),
)  # fmt: skip
"""Every attack, in the order of the table."""


def attacker(index: int, endpoints: Endpoints, go: Event, gone: Event) -> None:
    """Entry of the attacker's process: attack while `go` is set."""
    while True:
        go.wait()
        gone.clear()
        asyncio.run(_attack(ATTACKS[index], endpoints, go))
        gone.set()


async def _attack(attack: Attack, endpoints: Endpoints, go: Event) -> None:
    tasks = [asyncio.create_task(_again(attack, endpoints, number)) for number in range(attack.clients)]
    while go.is_set():
        await asyncio.sleep(0.01)
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


async def _again(attack: Attack, endpoints: Endpoints, number: int) -> None:
    """Who is hung up on comes back."""
    assert attack.client is not None
    while True:
        with contextlib.suppress(OSError, asyncio.IncompleteReadError, ValueError):
            await attack.client(endpoints, number)
        await asyncio.sleep(0.001)


# what is measured


def free_port() -> int:
    """One on which nobody listens now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def bench_in(folder: Path, port: int) -> FaultBench:
    """With a daemon that can be looked at over the network, as some attacks need."""
    (folder / "token").write_text(_TOKEN, encoding="utf-8")
    (folder / "daemon.yaml").write_text(f"view: {{port: {port}, token_file: {folder / 'token'}}}\n", encoding="utf-8")
    return FaultBench(folder, arguments=("--config", str(folder / "daemon.yaml")), sweep=SWEEP)


@contextlib.contextmanager
def _under_attack(attack: Attack, endpoints: Endpoints) -> Iterator[tuple[Event, Event]]:
    """The attacker's process; the events let it begin, and say that it has gone."""
    context = multiprocessing.get_context("spawn")
    go, gone = context.Event(), context.Event()
    gone.set()
    if attack.client is None:
        yield go, gone
        return
    process = context.Process(target=attacker, args=(ATTACKS.index(attack), endpoints, go, gone), daemon=True)
    process.start()
    try:
        yield go, gone
    finally:
        process.kill()
        process.join()


@contextlib.contextmanager
def _punctual() -> Iterator[None]:
    """Where it is allowed: who measures is not to wait for a processor behind who attacks."""
    before = os.getpriority(os.PRIO_PROCESS, 0)
    with contextlib.suppress(PermissionError):
        os.setpriority(os.PRIO_PROCESS, 0, _STOP_WATCH_NICE)
    try:
        yield
    finally:
        os.setpriority(os.PRIO_PROCESS, 0, before)


def time_stops(
    bench: FaultBench, attack: Attack, port: int, trials: int, seed: int, tell: Callable[[float, str], None]
) -> StopTimes:
    """So many emergency stops under one attack, at moments drawn from `seed`."""
    times, draw = StopTimes(attack), random.Random(seed)
    (bench.folder / "sweeps").mkdir(exist_ok=True)
    with _under_attack(attack, Endpoints(bench.socket, port, bench.folder / "sweeps")) as (go, gone), _punctual():
        while len(times.ms) < trials and not times.problem:
            try:
                ms, connecting_ms = _stop_once(bench, go, gone, _under_way_s(draw))
                times.ms.append(ms)
                times.connected_ms.append(ms - connecting_ms)
                tell(len(times.ms), "")
            except Spoilt:
                times.spoilt += 1
                if times.spoilt > _TRIES * trials:
                    times.problem = "the machine stood still in most trials"
            except RigError as error:
                times.problem = str(error)
    return times


def _under_way_s(draw: random.Random) -> float:
    least, most = _UNDER_WAY_S
    return float(least * (most / least) ** draw.random())


def _stop_once(bench: FaultBench, go: Event, gone: Event, after_s: float) -> tuple[float, float]:
    """Milliseconds to the safe set-points, and to the connection."""
    bench.ready()
    go.set()
    try:
        time.sleep(after_s)
        since_ns = time.monotonic_ns()
        with bench.client() as client:
            connected_ns = time.monotonic_ns()
            client.estop()
        ms = bench.ms_to_safe(since_ns)
    finally:
        go.clear()
    gone.wait(10.0)
    cause = bench.wait(bench.fault, "the fault to be reported")
    if cause in BY_THE_MACHINE:
        raise Spoilt(cause)
    if cause != "ESTOP":
        raise RigError(f"the rig stopped for another reason: {cause}")
    return ms, (connected_ns - since_ns) / 1e6


def shortfall(measured: Sequence[StopTimes]) -> str:
    """What did not hold, in one line; empty when all did."""
    for times in measured:
        if times.problem:
            return f"{times.attack.name}: {times.problem}"
        if times.quantile(GOAL_SHARE) > GOAL_MS:
            return (
                f"{times.attack.name}: p99 of the emergency stop is {times.quantile(GOAL_SHARE):.1f} ms; at most "
                f"{GOAL_MS:g} ms"
            )
    return ""

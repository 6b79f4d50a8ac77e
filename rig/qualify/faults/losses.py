"""Several processes lost together, at random: who is killed or stopped, when, and whether the rig reached its safe
state and kept it.

Every trial is a sweep of its own. It ends with a look at what was said: "safe" counts only when it was so at the
valves.
"""

import contextlib
import os
import random
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from rig.errors import RigError
from rig.qualify.faults.bench import FaultBench, Spoilt
from rig.qualify.faults.command_benches import (
    CalibrationBench,
    CalibrationOverModbus,
    CalibrationOverSerial,
    ProbeBench,
    ProbeOverModbus,
    ReplayBench,
    RunBench,
    RunOverModbus,
    RunOverSerial,
)
from rig.qualify.faults.wired import (
    MixedFaultBench,
    ModbusFaultBench,
    MyRioFaultBench,
    RtuFaultBench,
    SerialFaultBench,
)

_SIGNALS: Final = (signal.SIGKILL, signal.SIGSTOP)
_APART_S: Final = 0.5
_AT_ONCE: Final = 0.3
"""Share of the signals that come together with the one before."""
_MOMENT_S: Final = 1.0
"""The first is sent anywhere within this much of a sweep."""
_AFTERMATH_S: Final = 0.3
_SAID_S: Final = 4.0
_ENDED_S: Final = 15.0
_TRIES: Final = 4
_LONG_WATCHDOG_S: Final = 60.0


@dataclass(frozen=True)
class ProcessSignal:
    """One signal to one process, so long after the one before."""

    process: str
    number: signal.Signals
    after_s: float

    def __str__(self) -> str:
        return f"{self.number.name[3:]} {self.process}" + (f" +{self.after_s * 1e3:.0f} ms" if self.after_s else "")


@dataclass(frozen=True)
class Trial:
    """What one trial showed; `problem` is empty when the rig was safe, stayed so, and nobody said otherwise."""

    signals: tuple[ProcessSignal, ...]
    ms: float | None = None
    """From the first signal until the safe set-points stood at the valves."""
    words: str = ""
    """What the status said of the safe state; empty when nobody was left to ask."""
    problem: str = ""

    def __str__(self) -> str:
        return ", ".join(map(str, self.signals))


BENCHES: Final[dict[str, Callable[[Path], FaultBench]]] = {
    "simulated": FaultBench,
    "modbus": ModbusFaultBench,
    "modbus-long-watchdog": lambda folder: ModbusFaultBench(folder, _LONG_WATCHDOG_S),
    "rtu": RtuFaultBench,
    "serial": SerialFaultBench,
    "mixed": MixedFaultBench,
    "myrio": MyRioFaultBench,
    "run": RunBench,
    "run-modbus": RunOverModbus,
    "run-serial": RunOverSerial,
    "replay": ReplayBench,
    "calibrate": CalibrationBench,
    "calibrate-modbus": CalibrationOverModbus,
    "calibrate-serial": CalibrationOverSerial,
    "probe": ProbeBench,
    "probe-modbus": ProbeOverModbus,
}
"""What the trials can be made on; over Modbus with the module's watchdog as it is by default, and with one that is of
no help."""


def draw(
    chance: random.Random, struck: Sequence[str] = FaultBench.struck, sizes: Sequence[int] = (2, 3)
) -> tuple[ProcessSignal, ...]:
    """Two or three different processes of `struck`, killed or stopped, in any order, 0 to 500 ms apart."""
    drawn = chance.sample(struck, chance.choice(sizes))
    gaps = [0.0, *(0.0 if chance.random() < _AT_ONCE else chance.uniform(0.0, _APART_S) for _ in drawn[1:])]
    return tuple(ProcessSignal(name, chance.choice(_SIGNALS), gap) for name, gap in zip(drawn, gaps, strict=True))


def trials(bench: FaultBench, count: int, seed: int) -> Iterator[Trial]:
    """`count` trials; the same seed draws the same signals."""
    chance = random.Random(f"losses {seed}")
    for _ in range(count):
        yield try_losses(bench, draw(chance, bench.struck, bench.at_once), chance.uniform(0.0, _MOMENT_S))


def try_losses(bench: FaultBench, signals: tuple[ProcessSignal, ...], moment_s: float = 0.0) -> Trial:
    """Strike in the middle of a sweep and see; again when the machine stopped the rig just before."""
    trial = Trial(signals, problem="not tried")
    for _ in range(_TRIES):
        try:
            bench.ready()
            time.sleep(moment_s)
            trial = _carry_out(bench, signals)
        except Spoilt as error:
            trial = Trial(signals, problem=f"spoilt: {error}")
            continue
        except RigError as error:
            trial = Trial(signals, problem=str(error))
        finally:
            bench.revive()
        break
    return trial


def _carry_out(bench: FaultBench, signals: tuple[ProcessSignal, ...]) -> Trial:
    pids = bench.pids()
    if missing := {one.process for one in signals} - set(pids):
        raise Spoilt(f"not there: {', '.join(missing)}")
    first_ns = _send(signals, pids)
    ms = bench.ms_to_safe(first_ns)
    for pid in pids.values():  # who was stopped goes on: nothing old may be written now
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGCONT)
    _stays_safe(bench)
    killed = {one.process for one in signals if one.number is signal.SIGKILL}
    if "control" in killed:
        _all_end(pids)
        return Trial(signals, ms)
    return Trial(signals, ms, bench.said_of_safe(_SAID_S))


def _send(signals: tuple[ProcessSignal, ...], pids: dict[str, int]) -> int:
    first_ns = 0
    for one in signals:
        time.sleep(one.after_s)
        first_ns = first_ns or time.monotonic_ns()
        with contextlib.suppress(ProcessLookupError):  # ended meanwhile because of an earlier signal
            os.kill(pids[one.process], one.number)
    return first_ns


def _stays_safe(bench: FaultBench) -> None:
    until = time.monotonic() + _AFTERMATH_S
    while time.monotonic() < until:
        if not bench.is_safe:
            raise RigError(f"after it was safe, somebody wrote {bench.terminals.setpoints}")
        time.sleep(0.001)


def _all_end(pids: dict[str, int]) -> None:
    """Nobody stays behind when the commanding process is gone."""
    deadline = time.monotonic() + _ENDED_S
    left = dict(pids)
    while left := {name: pid for name, pid in left.items() if _runs(pid)}:
        if time.monotonic() > deadline:
            raise RigError(f"left behind: {', '.join(left)}")
        time.sleep(0.02)


def _runs(pid: int) -> bool:
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0] not in ("Z", "X")
    return False


def summary(found: Sequence[Trial]) -> dict[str, Any]:
    """Counts, and quantiles of the time until the safe state."""
    times = sorted(trial.ms for trial in found if trial.ms is not None)
    good = [trial for trial in found if not trial.problem]

    def quantile(share: float) -> float | None:
        return times[min(int(len(times) * share), len(times) - 1)] if times else None

    return {
        "trials": len(found), "safe": len(good), "p50_ms": quantile(0.5), "p99_ms": quantile(0.99),
        "max_ms": quantile(1.0), "ms": times,
        "problems": [f"{trial}: {trial.problem}" for trial in found if trial.problem],
    }  # fmt: skip

"""Measures how punctually the loop wakes, beside cyclictest, the reference for that on Linux. Used by `latency` and
`bench`."""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from rig.app.loop_process import loop_process
from rig.errors import RigError
from rig.realtime.program import Program
from rig.realtime.ring import RingReader
from rig.rig_config import RigConfig
from rig.sample import Sample, unpack
from rig.service.records.lateness import quantiles
from rig.service.records.recorder_messages import RunOrder
from rig.service.session.session import Session


def at_rest(rig: RigConfig, ticks: int) -> Program:
    """A sweep of so many ticks that holds the safe pressures."""
    rest = rig.safe.p1_mpa, rig.safe.p2_mpa
    return Program(
        1, *rest, [rest[0]] * ticks, [rest[1]] * ticks, settle_ticks=0, zero_ticks=0, ramp_in_ticks=0, ramp_out_ticks=0
    )


def loop_samples(
    rig: RigConfig, seconds: float, program_of: Callable[[RigConfig, int], Program] = at_rest
) -> tuple[list[Sample], dict[str, str]]:
    """Every sample of a full loop with recording that carries out a program of `seconds` (at rest unless another is
    given), and the real-time report.

    Late ticks are counted here, not faults: the limits on them are lifted.
    """
    rig = replace(rig, limits=replace(rig.limits, misses_per_s=1000, stall_periods=1000))
    ticks = max(round(seconds * 1e9 / rig.period_ns), 1)
    program = program_of(rig, ticks)
    samples: list[Sample] = []
    with TemporaryDirectory(prefix="pamrig-latency-") as folder, Session(loop_process, rig) as session:
        session.open([program], scripted=True)
        reader = RingReader(session.ring)
        session.recording.expect(
            RunOrder(1, Path(folder) / "latency.mcap", {}, {}, ticks, session.facts["wall_offset_ns"])
        )
        session.go()
        while session.loop_alive:
            session.beat()
            samples += [unpack(packed) for packed in reader]
            time.sleep(0.2)
        samples += [unpack(packed) for packed in reader]
        if error := session.loop_error():
            raise RigError(error)
        return [s for s in samples if s.run == 1], dict(session.facts["realtime"])


def lateness_us(samples: Sequence[Sample]) -> dict[str, float]:
    """How late the loop woke."""
    return quantiles([(s.woken_ns - s.scheduled_ns) / 1e3 for s in samples])


def cyclictest_us(seconds: float, priority: int, period_ns: int) -> dict[str, float] | None:
    """The same of cyclictest at the same priority, period and core; None where it is missing or not permitted."""
    program = shutil.which("cyclictest")
    if program is None:
        return None
    rt = ["-p", str(priority)] if priority else ["--policy=other"]
    command = [
        program,
        "-q",
        "-m",
        "-t",
        "1",
        "-a",
        _last_cpu(),
        *rt,
        "-i",
        str(period_ns // 1000),
        "-D",
        f"{max(round(seconds), 1)}",
        "-h",
        "100000",
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        return None
    return _histogram(done.stdout)


def _last_cpu() -> str:

    return str(sorted(os.sched_getaffinity(0))[-1])


def _histogram(text: str) -> dict[str, float] | None:
    """Quantiles of cyclictest's histogram: lines of `microseconds count`."""
    counts: dict[int, int] = {}
    for line in text.splitlines():
        parts = line.split()
        if len(parts) == 2 and parts[0].isdigit() and parts[1].isdigit() and int(parts[1]):
            counts[int(parts[0])] = int(parts[1])
    total = sum(counts.values())
    if not total:
        return None
    result: dict[str, float] = {}
    seen = 0
    for late_us in sorted(counts):
        seen += counts[late_us]
        for name, share in (("p50", 0.5), ("p99", 0.99)):
            if name not in result and seen >= share * total:
                result[name] = float(late_us)
    return {**result, "max": float(max(counts))}


@contextmanager
def load() -> Iterator[str]:
    """A busy machine: stress-ng on every core with memory traffic, or busy interpreters where it is missing; yields
    what it was."""
    if program := shutil.which("stress-ng"):
        command, what = (
            [[program, "--cpu", "0", "--vm", "1", "--vm-bytes", "64M", "--quiet"]],
            "stress-ng --cpu 0 --vm 1",
        )
    else:
        command, what = [[sys.executable, "-c", "while True: pass"]] * 2, "two busy interpreters"
    processes = [subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) for line in command]
    try:
        time.sleep(0.5)  # until the load is really there
        yield what
    finally:
        for process in processes:
            process.terminate()
        for process in processes:
            with suppress(subprocess.TimeoutExpired):
                process.wait(10)

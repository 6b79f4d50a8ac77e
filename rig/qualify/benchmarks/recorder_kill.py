"""Kills the recording process at random moments of a run and counts what was lost: used by `pamrig bench log` and by
the tests.

The recorder is the real one, in a process of its own; samples come at the rig's real pace through the real ring.
"""

import multiprocessing
import random
import time
from dataclasses import dataclass
from multiprocessing.process import BaseProcess
from pathlib import Path

from rig.errors import RecordError
from rig.log.mcap.contents import map_file
from rig.log.mcap.salvage import salvage
from rig.log.reader import read_samples
from rig.log.recover import recover
from rig.realtime.ring import Ring, RingWriter
from rig.sample import Phase, Sample
from rig.service.records.recorder import record
from rig.service.records.recorder_messages import RunOrder

PERIOD_NS = 5_000_000
"""Of the paper's rig."""
_READY_S = 120.0
AT_ONCE = 5
"""Recorders side by side: one after the other they would take as many times as long."""
_WALL_OFFSET_NS = 1_790_000_000_000_000_000


@dataclass(frozen=True)
class Killed:
    """One killed recording."""

    put: int
    """Samples that the loop had handed over from the first recorded one until the recorder was killed."""
    saved: int
    false: int
    """Saved samples that are not what was put in: must be 0."""

    @property
    def lost_s(self) -> float:
        """Time of the run that is gone."""
        return (self.put - self.saved) * PERIOD_NS / 1e9


class _Recording:
    """A ring, the recorder that reads it, and the moment at which that will die."""

    def __init__(self, folder: Path, number: int, moment_s: float) -> None:
        self.path = folder / f"killed_{number}.mcap"
        self.partial = self.path.with_name(self.path.name + ".partial")
        self.moment_s = moment_s
        self.put = 0
        session = random.getrandbits(63)
        self.ring = Ring.create(f"{session:016x}-kill", session)
        self._writer = RingWriter(self.ring)
        context = multiprocessing.get_context("spawn")
        theirs, self._orders = context.Pipe(duplex=False)
        self._results, results = context.Pipe(duplex=False)
        arguments = (self.ring.block.path, session, theirs, results)
        self.process: BaseProcess = context.Process(target=record, args=arguments, daemon=True)
        self.process.start()
        self._orders.send(
            RunOrder(1, self.path, {"name": self.path.stem, "period_ns": PERIOD_NS}, {}, 1_000_000, _WALL_OFFSET_NS)
        )

    def feed(self, count: int) -> None:
        """Put samples until `count` were put."""
        while self.put < count:
            self._writer.put(made_sample(self.put))
            self.put += 1

    def kill(self) -> None:
        """SIGKILL, as by a power cut."""
        self.process.kill()
        self.process.join()

    def result(self) -> Killed:
        """What can be saved of it."""
        self.ring.block.unlink()
        if not salvage(map_file(self.partial)).contents.chunks:
            return Killed(self.put, 0, 0)
        saved = recover(self.partial, self.path)
        samples = read_samples(saved.file)
        wanted = [made_sample(int(number)) for number in samples["tick"]]
        false = sum(tuple(samples[name][row] for name in Sample._fields) != sample for row, sample in enumerate(wanted))
        return Killed(self.put - int(samples["tick"][0]), len(samples), false)


def made_sample(number: int) -> Sample:
    """Sample `number` of a recording, every field of it known."""
    due = 1_000_000_000 + number * PERIOD_NS
    times = (due, due + 15_000 + number % 7, due + 90_000 + number % 11, due + 130_000)
    values = tuple(0.1 + field * 0.01 + (number * 37 % 4096) / 16384 for field in range(10))
    return Sample._make(
        (number, *times, 0, *values, 0, 0, 0, 1, 2, Phase.SWEEP, 0, 0, 1.5, 20.5, 21.5, 22.5, 23.5, 24.5)
    )


def killed_recordings(kills: int, folder: Path, seed: int) -> list[Killed]:
    """`kills` recordings, AT_ONCE of them side by side, each killed 0.3 to 2.5 s after it has begun."""
    rng = random.Random(seed)
    moments = [rng.uniform(0.3, 2.5) for _ in range(kills)]
    results: list[Killed] = []
    for start in range(0, kills, AT_ONCE):
        batch = [
            _Recording(folder, start + number, moment) for number, moment in enumerate(moments[start : start + AT_ONCE])
        ]
        try:
            _run(batch)
        finally:
            for recording in batch:
                recording.kill()
        results += [recording.result() for recording in batch]
    return results


def _run(batch: list[_Recording]) -> None:
    """Feed all at the rig's pace, and kill each at its moment."""
    until = time.monotonic() + _READY_S
    while not all(recording.partial.exists() for recording in batch):
        if time.monotonic() > until:
            raise RecordError("the recorders did not begin to write")
        for recording in batch:  # the first samples may come before a recorder knows its orders
            recording.feed(recording.put + 1)
        time.sleep(0.02)
    offsets = {recording.path: recording.put for recording in batch}
    begun, living = time.monotonic(), list(batch)
    while living:
        now_s = time.monotonic() - begun
        for recording in [recording for recording in living if recording.moment_s <= now_s]:
            recording.kill()
            living.remove(recording)
        for recording in living:
            recording.feed(offsets[recording.path] + int(now_s * 1e9) // PERIOD_NS)
        time.sleep(PERIOD_NS / 1e9)

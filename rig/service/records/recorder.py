"""The recorder: a process of its own that reads the ring and writes one MCAP file a run. The loop never waits for it.

It is told beforehand which runs to expect and where they go; which samples belong to a run says the run number in each
of them. Losses are counted, never hidden.
"""

import os
import signal
import time
from array import array
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from rig.errors import RecordError, StateError
from rig.log.mcap.writer import RunWriter
from rig.number_text import counted
from rig.realtime.faults import Fault, explain
from rig.realtime.ring import Ring, RingReader
from rig.realtime.state import State
from rig.sample import Flag, Phase, Sample, unpack
from rig.service.processes import name_process, stand_apart
from rig.service.records.lateness import quantiles
from rig.service.records.recorder_messages import Mark, RecorderTrouble, RunOrder, RunResult, message_of

FLUSH_NS = 250_000_000
"""A kill loses at most this much and one poll, well under the second that is promised."""
_POLL_S = 0.02
_EACH_SAMPLES = 256
"""In virtual time minutes come at once: after so many samples the cursor is told, by which the loop's clock is paced,
and the disk is looked at."""
_BUSY_SHARE = 8
"""Who took this part of the ring at one look takes more at once instead of sleeping."""
_LAST_WORDS_S = 2.0
"""For what a loop still publishes when nobody commands it any more: it is on its way to the safe state."""
_SAME_SIGNAL_S = 0.1
"""For a loop that was told to end by the same signal: its way out is the end of the record."""
_NICE = 5
"""Behind the daemon and the page, for the ring holds 41 s; before the live view, for a record is worth more."""
_ERRORS = Flag.READ_ERROR | Flag.WRITE_ERROR
_WORTH_A_LINE = (
    Flag.READ_ERROR,
    Flag.WRITE_ERROR,
    Flag.BROKEN_WIRE,
    Flag.SUSPECT,
    Flag.CLIPPED_RANGE,
    Flag.CLIPPED_SLEW,
)


def record(ring_path: Path, session: int, orders: Connection, results: Connection) -> None:
    """Entry of the recorder's process: until the orders end, then finish what is open."""
    stand_apart()
    # these are for the process that commands, or go to all when a terminal is closed: the file is to be finished also
    # then. The end of the orders ends the recorder, also when that process is killed
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGTSTP, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    name_process("recorder")
    with suppress(OSError):
        os.nice(_NICE)
    try:
        ring = Ring.attach(ring_path, session)
    except StateError as error:
        results.send(RecorderTrouble(0, str(error), final=True))
        return
    recorder = Recorder(ring, orders, results)
    signal.signal(signal.SIGTERM, lambda *_: recorder.end())
    recorder.run()


class Recorder:
    """Reads one ring and writes the runs that were ordered."""

    def __init__(self, ring: Ring, orders: Connection, results: Connection) -> None:
        self._ring, self._orders, self._results = ring, orders, results
        self._reader = RingReader(ring, start=0)
        self._expected: dict[int, RunOrder] = {}
        self._open: _OpenRun | None = None
        self._lost_before = 0
        self._told: RecorderTrouble | None = None
        self._over = False
        self._loop_fault = Fault.LOOP_DIED
        """What the end of the loop is called, where it says nothing itself."""
        self._at_once = False
        self._marks: list[Mark] = []

    def run(self) -> None:
        """Poll until the other end of the orders closes or says that the loop has ended, then finish."""
        while not self._over:
            self._take_orders()
            if self._drain() < self._ring.capacity // _BUSY_SHARE:
                time.sleep(_POLL_S)
        deadline = time.monotonic() + (_SAME_SIGNAL_S if self._at_once else _LAST_WORDS_S)
        while self._drain() and time.monotonic() < deadline:
            time.sleep(_POLL_S)  # a loop whose commander was killed is on its way to the safe state
        self._close_run(cut=True)

    def end(self) -> None:
        """Finish what is open and leave, although the loop may go on; for signal handlers."""
        self._over = self._at_once = True

    def _take_orders(self) -> None:
        try:
            while self._orders.poll():
                order = self._orders.recv()
                if isinstance(order, Fault):
                    self._over, self._loop_fault = True, order
                elif order is None:
                    self._over = True
                elif isinstance(order, Mark):
                    self._marks.append(order)
                else:
                    self._expected[order.run] = order
        except (EOFError, OSError):
            self._over = True

    def _drain(self) -> int:
        before = self._reader.cursor
        for packed in self._reader:
            self._put(packed)
            if self._reader.cursor % _EACH_SAMPLES == 0:
                self._ring.recorded = self._reader.cursor
        self._ring.recorded = self._reader.cursor
        if self._open is not None:
            self._open.flush_if_due()
            self._tell(self._open.trouble)
        return self._reader.cursor - before

    def _tell(self, trouble: RecorderTrouble) -> None:
        """Once, when it changes, and at once: a status that is told at the end of the run comes too late."""
        if trouble is not self._told:
            self._told = trouble
            with suppress(OSError):
                self._results.send(trouble)

    def _put(self, packed: bytes) -> None:
        sample = unpack(packed)
        if self._open is not None and sample.run != self._open.order.run:
            self._close_run()
        if self._open is None and sample.run and sample.run not in self._expected:
            self._take_orders()  # it may have come after the last look
        if self._open is None and sample.run in self._expected:
            # what was lost since the last sample that was seen may have been this run's beginning
            self._open = _OpenRun(self._expected.pop(sample.run), self._lost_before, self._ring)
        self._lost_before = self._reader.lost
        if self._open is not None:
            self._open.put(packed, sample)
            self._put_marks(self._open, sample)
            self._tell(self._open.trouble)

    def _put_marks(self, run: "_OpenRun", sample: Sample) -> None:
        """Behind the first sample that is not older; in virtual time behind the next."""
        while self._marks and (self._marks[0].at_ns <= sample.scheduled_ns or run.virtual):
            run.mark(self._marks.pop(0).text, sample)

    def _close_run(self, cut: bool = False) -> None:
        """`cut`: no sample came after the run's last one, so the loop may have died in it."""
        if self._open is None:
            return
        if cut:
            self._open.judge_end(self._loop_fault)
        result = self._open.finish(self._reader.lost)
        self._open = None
        self._marks.clear()
        with suppress(OSError):
            self._results.send(result)


class _OpenRun:
    """The run that is being written. A file that cannot be written ends the file, not the counting."""

    def __init__(self, order: RunOrder, lost_before: int, ring: Ring) -> None:
        self.order = order
        self._ring = ring
        self._lost_before = lost_before
        self._result = RunResult(order.run, order.path)
        self._lateness_ns = array("q")
        self._period_ns = int(order.facts.get("period_ns", 0))
        self._sweep_ticks = 0
        """Of the sweep, recorded or missed in the middle of it."""
        self._ticks_on_disk = 0
        self._last: Sample | None = None
        self._flushed_ns = time.monotonic_ns()
        self._writer: RunWriter | None = None
        self._cpu_s = time.process_time()
        self.trouble = RecorderTrouble(order.run, "")
        """What stands against the file now."""
        try:
            self._writer = RunWriter(order.path, order.facts, order.attachments)
        except RecordError as error:
            self._result.error = str(error)
            self._note_trouble(final=True)

    def put(self, packed: bytes, sample: Sample) -> None:
        """Count one sample and write it."""
        result = self._result
        result.ticks += 1
        result.missed += sample.missed
        result.angle_zero_deg = sample.angle_zero_deg
        self._lateness_ns.append(sample.woken_ns - sample.scheduled_ns + sample.missed * self._period_ns)
        in_sweep = sample.phase == Phase.SWEEP
        missed_there = sample.missed if in_sweep or (self._last and self._last.phase == Phase.SWEEP) else 0
        self._sweep_ticks += in_sweep + missed_there
        if self._writer is not None:
            time_ns = sample.scheduled_ns + self.order.wall_offset_ns
            for level, line in _news(self._last, sample, self._ring):
                self._writer.log(level, line, time_ns)
            self._writer.add(packed, time_ns, result.ticks - 1)
            if result.ticks % _EACH_SAMPLES == 0:
                self.flush_if_due()
        else:
            result.dropped += 1
        if sample.fault and not result.fault:
            result.fault, result.message = sample.fault, message_of(sample.fault, self._ring)
        self._last = sample

    def mark(self, text: str, sample: Sample) -> None:
        """A line of the operator's at the time of a sample."""
        if self._writer is not None:
            self._writer.log("info", f"marker: {text}", sample.scheduled_ns + self.order.wall_offset_ns)

    @property
    def virtual(self) -> bool:
        """The loop's clock is not this machine's."""
        return self.order.facts.get("clock") == "virtual"

    def flush_if_due(self) -> None:
        """Every quarter of a second, onto the disk."""
        now_ns = time.monotonic_ns()
        if self._writer is None or now_ns - self._flushed_ns < FLUSH_NS:
            return
        self._flushed_ns = now_ns
        try:
            self._writer.flush()
        except RecordError as error:
            self._result.error = str(error)  # what waits in memory goes out when the disk has room again
            self._note_trouble(final=self._writer.gone)
        else:
            self._ticks_on_disk, self._result.error = self._result.ticks, ""
            if self.trouble.error:
                self._note_trouble(final=False)

    def _note_trouble(self, *, final: bool) -> None:
        if (self.trouble.error, self.trouble.final) != (self._result.error, final):
            self.trouble = RecorderTrouble(self.order.run, self._result.error, final)

    def judge_end(self, loop_fault: Fault) -> None:
        """A record that ends in the middle says so, and why it is not valid."""
        last = self._last
        if last is not None and last.phase != Phase.NONE and not self._result.fault:
            self._result.fault = loop_fault
            if self._writer is not None:
                self._writer.log("fatal", explain(loop_fault), last.scheduled_ns + self.order.wall_offset_ns)

    def finish(self, lost: int) -> RunResult:
        """Close the file and say how it went."""
        result = self._result
        result.dropped += lost - self._lost_before
        result.lateness_us = {name: ns / 1e3 for name, ns in quantiles(self._lateness_ns).items()}
        result.complete = self._sweep_ticks >= self.order.sweep_ticks  # not when the operator stopped it early
        result.valid = result.complete and not (result.missed or result.dropped or result.fault or self._writer is None)
        result.cpu_s = time.process_time() - self._cpu_s
        if self._writer is not None:
            try:
                self._writer.finish(self._facts(result))
            except RecordError as error:
                self._result.error = str(error)
                self._writer.abort()
                result.valid = False
                result.file = self._writer.partial
                result.dropped += result.ticks - self._ticks_on_disk
            else:
                result.dropped += self._writer.dropped
                result.error = ""  # whatever stood against it before: it is whole
        return result

    def _facts(self, result: RunResult) -> dict[str, Any]:
        return {
            "valid": result.valid,
            "ticks": result.ticks,
            "missed": result.missed,
            "dropped": result.dropped,
            "complete": result.complete,
            "ended": str(result.ended),
            "fault": result.cause,
            "angle_zero_deg": result.angle_zero_deg,
            "lateness_us": result.lateness_us,
        }


def _news(before: Sample | None, now: Sample, ring: Ring) -> list[tuple[str, str]]:
    """The lines for people that a sample gives rise to: changes of phase, fault and flags, and missed ticks."""
    lines: list[tuple[str, str]] = []
    if before is None or before.phase != now.phase:
        lines.append(("info", f"phase {Phase(now.phase).name.lower()}, state {State(now.state).name.lower()}"))
    if now.missed:
        lines.append(("warning", f"{counted(now.missed, 'tick')} missed before tick {now.tick}"))
    if now.fault and (before is None or before.fault != now.fault):
        lines.append(
            ("fatal" if now.fault != Fault.ESTOP else "error", explain(now.fault, message_of(now.fault, ring)))
        )
    appeared = now.flags & ~(before.flags if before else 0)
    if appeared:
        why = f": {ring.device_message}" if appeared & _ERRORS else ""
        lines += [
            ("warning", f"{flag.name} at tick {now.tick}{why if flag & _ERRORS else ''}")
            for flag in _WORTH_A_LINE
            if appeared & flag
        ]
    return lines

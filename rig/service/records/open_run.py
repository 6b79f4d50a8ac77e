"""The run that a recorder writes: its samples counted and put into a file, which is flushed in time; what it says for
people beside them; and, at its end, whether it is valid.
"""

import time
from array import array
from typing import Any

from rig.errors import RecordError
from rig.log.mcap.writer import RunWriter
from rig.number_text import counted
from rig.realtime.faults import Fault, explain
from rig.realtime.ring import Ring
from rig.realtime.state import State
from rig.sample import Flag, Phase, Sample
from rig.service.records.lateness import quantiles
from rig.service.records.recorder_messages import RecorderTrouble, RunOrder, RunResult, message_of

FLUSH_NS = 250_000_000
"""A kill loses at most this much and one poll, well under the second that is promised."""
EACH_SAMPLES = 256
"""In virtual time minutes come at once: after so many samples the disk is looked at, and the recorder tells how far it
is, by which the loop's clock is paced."""
_ERRORS = Flag.READ_ERROR | Flag.WRITE_ERROR
_WORTH_A_LINE = (
    Flag.READ_ERROR,
    Flag.WRITE_ERROR,
    Flag.BROKEN_WIRE,
    Flag.SUSPECT,
    Flag.CLIPPED_RANGE,
    Flag.CLIPPED_SLEW,
)


class OpenRun:
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
            for level, line in _lines_for_people(self._last, sample, self._ring):
                self._writer.log(level, line, time_ns)
            self._writer.add(packed, time_ns, result.ticks - 1)
            if result.ticks % EACH_SAMPLES == 0:
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


def _lines_for_people(before: Sample | None, now: Sample, ring: Ring) -> list[tuple[str, str]]:
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

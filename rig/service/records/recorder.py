"""The recorder: a process of its own that reads the ring and writes one MCAP file a run. The loop never waits for it.

It is told beforehand which runs to expect and where they go; which samples belong to a run says the run number in each
of them. Losses are counted, never hidden.
"""

import os
import signal
import time
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path

from rig.errors import StateError
from rig.realtime.faults import Fault
from rig.realtime.ring import Ring, RingReader
from rig.sample import Sample, unpack
from rig.service.processes import name_process, stand_apart
from rig.service.records.open_run import EACH_SAMPLES, OpenRun
from rig.service.records.recorder_messages import Mark, RecorderTrouble, RunOrder

_POLL_S = 0.02
_BUSY_SHARE = 8
"""Who took this part of the ring at one look takes more at once instead of sleeping."""
_LAST_WORDS_S = 2.0
"""For what a loop still publishes when nobody commands it any more: it is on its way to the safe state."""
_SAME_SIGNAL_S = 0.1
"""For a loop that was told to end by the same signal: its way out is the end of the record."""
_NICE = 5
"""Behind the daemon and the page, for the ring holds 41 s; before the live view, for a record is worth more."""


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
        self._open: OpenRun | None = None
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
            if self._reader.cursor % EACH_SAMPLES == 0:
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
            self._open = OpenRun(self._expected.pop(sample.run), self._lost_before, self._ring)
        self._lost_before = self._reader.lost
        if self._open is not None:
            self._open.put(packed, sample)
            self._put_marks(self._open, sample)
            self._tell(self._open.trouble)

    def _put_marks(self, run: OpenRun, sample: Sample) -> None:
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

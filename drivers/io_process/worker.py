"""The I/O process itself: one wire, driven as fast as it goes, with the newest order and none older.

It owns the wire, so nothing that a wire does can hold up the loop: silence, slow replies, reconnecting. It also guards
the outputs: when the owner falls silent, dies, or the wire comes back after an outage, it writes the safe outputs by
itself and keeps to them (`Trip`). What the wire speaks is the business of a `WireLink`; this file knows none.
"""

import contextlib
import importlib
import json
import os
import select
import signal
import time
from collections.abc import Mapping
from typing import Any, Final, NamedTuple, Protocol, cast

from drivers.io_process.mailbox import IoMailbox, LinkState, OutputsMode, Report, Trip, remove_own
from rig.errors import DeviceError, DeviceLost, WatchdogTripped

_IDLE_MS: Final = 2
"""How long an idle I/O process sleeps at most before it looks at its owner again."""
_LAST_EFFORT_NS: Final = 2_000_000_000
"""How long an orphan tries to write the safe outputs before it gives up."""
_FIFO_PRIORITY: Final = 40
"""Below the loop (80) and above everything that is not real time."""


class Exchange(NamedTuple):
    """What one exchange on the wire brought."""

    sent: bool = False
    """The device confirmed the outputs of this exchange."""
    values: Mapping[int, tuple[float, int]] = {}
    """Index -> value and the time it was taken, CLOCK_MONOTONIC ns."""
    busy: bool = True
    """Go on at once; False: nothing more to do until something new is ordered."""


class WireLink(Protocol):
    """One wire and what it speaks."""

    def connect(self) -> Mapping[str, str]:
        """Open the wire and prove that the right device answers; facts for the log. DeviceError says what is wrong, in
        one line."""

    def exchange(self, outputs: tuple[float, ...] | None, fresh: bool, urgent: bool) -> Exchange:
        """One bounded exchange. `outputs` None: leave them alone; `fresh`: not confirmed yet, so they go first;
        `urgent`: at once.

        DeviceError when it failed and the next may work, DeviceLost when the wire is gone.
        """

    def close(self, settled: bool = False) -> None:
        """Let go of the wire. `settled`: outputs are where they are to stay, so that a watchdog of the device that
        would change them is stopped; else it goes on. Idempotent; never raises."""


class WorkerSetup(NamedTuple):
    """How an I/O process shall behave; sent by the owner as JSON."""

    module: str
    """Module with a function `link(settings) -> Link`."""
    settings: dict[str, Any]
    safe: tuple[float, ...]
    silence_ns: int
    """An owner that drives and says nothing for this long is taken for dead."""
    lost_after: int = 5
    """Failed exchanges in a row after which the wire counts as lost."""
    reconnect_ns: int = 250_000_000


class Worker:
    """One wire, one mailbox."""

    def __init__(self, link: WireLink, mailbox: IoMailbox, job: WorkerSetup) -> None:
        self._link, self._mailbox, self._job = link, mailbox, job
        self._report = Report()
        self._failed_in_a_row = 0
        self._retry_ns = 0
        self._urged = 0
        """The safe order for which a reconnection was tried at once."""
        self._alarm = 0
        self._confirmed: tuple[float, ...] | None = None
        self._tried: tuple[float, ...] | None = None
        """The outputs that were wanted last."""
        self._sent = False
        """Outputs were tried: the device may have taken them, whatever became of its reply."""
        self._orphan_since_ns = 0

    def connect(self) -> bool:
        """First connection; a refusal is reported and final."""
        try:
            facts = "\n".join(f"{key}={value}" for key, value in self._link.connect().items())
        except DeviceError as error:
            self._link.close()
            tripped = isinstance(error, WatchdogTripped)
            self._say(state=LinkState.TRIPPED if tripped else LinkState.REFUSED, text=str(error))
            return False
        self._say(state=LinkState.UP, text=facts)
        return True

    def turn(self) -> bool:
        """One exchange, or one look around; whether there is more to do at once."""
        order = self._mailbox.order()
        alarm = self._mailbox.alarm
        self._watch(order.mode, order.stamp_ns, alarm)
        outputs = self._wanted(order.mode, order.outputs)
        self._tried = outputs or self._tried
        if order.mode is OutputsMode.SAFE and order.number != self._urged:
            self._urged, self._retry_ns = order.number, 0
        if self._report.state is not LinkState.UP and not self._reconnect(outputs is not None):
            return False
        fresh = outputs is not None and outputs != self._confirmed
        self._sent |= outputs is not None
        try:
            done = self._link.exchange(outputs, fresh, fresh and outputs == self._job.safe)
        except DeviceError as error:
            self._failed(error)
            return False
        self._failed_in_a_row = 0
        self._accept(done, outputs, order.number, alarm)
        return done.busy

    def _wanted(self, mode: OutputsMode, outputs: tuple[float, ...]) -> tuple[float, ...] | None:
        if self._report.trip is not Trip.NONE:
            return self._job.safe
        return outputs if mode in (OutputsMode.DRIVE, OutputsMode.SAFE) else None

    def _watch(self, mode: OutputsMode, stamp_ns: int, alarm: int) -> None:
        """Latch a reason to take over. A supervisor's alarm counts in every mode."""
        if alarm != self._alarm:
            self._alarm, self._retry_ns = alarm, 0
            self._confirmed = None  # write once more, even if they are there already
            self._trip(Trip.ALARM)
        elif mode is OutputsMode.DRIVE and self._orphan_since_ns:
            self._trip(Trip.ORPHANED)
        elif mode is OutputsMode.DRIVE and time.monotonic_ns() - stamp_ns > self._job.silence_ns:
            self._trip(Trip.SILENCE)

    def _trip(self, why: Trip) -> None:
        if self._report.trip is Trip.NONE:
            self._report = self._report._replace(trip=why)

    def _accept(self, done: Exchange, outputs: tuple[float, ...] | None, number: int, alarm: int) -> None:
        now_ns = time.monotonic_ns()
        report = self._report
        values, stamps = list(report.values), list(report.stamps_ns)
        for index, (value, stamp_ns) in done.values.items():
            values[index], stamps[index] = value, stamp_ns
        if done.sent:
            self._confirmed = outputs
            report = report._replace(sent_ns=now_ns)
        if outputs is not None and outputs == self._confirmed:
            report = report._replace(
                order_done=number, alarm_done=alarm if outputs == self._job.safe else report.alarm_done
            )
        self._report = report._replace(exchanges=report.exchanges + 1, values=tuple(values), stamps_ns=tuple(stamps))
        self._say(longest_ns=max(report.longest_ns, now_ns - report.heartbeat_ns))

    def _failed(self, error: DeviceError) -> None:
        self._failed_in_a_row += 1
        state = self._report.state
        if isinstance(error, DeviceLost) or self._failed_in_a_row >= self._job.lost_after:
            self._link.close()
            state = LinkState.DOWN
            self._retry_ns = time.monotonic_ns()
            if self._sent:
                self._trip(Trip.OUTAGE)
            self._confirmed = None
        self._say(state=state, errors=self._report.errors + 1, text=str(error))

    def _reconnect(self, urgent: bool) -> bool:
        """Try again, not too often; the outputs were out of reach, so they are written anew."""
        now_ns = time.monotonic_ns()
        self._say()
        if now_ns < self._retry_ns:
            return False
        self._retry_ns = now_ns + (self._job.reconnect_ns // 5 if urgent else self._job.reconnect_ns)
        try:
            self._link.connect()
        except DeviceError as error:
            self._link.close()
            self._say(errors=self._report.errors + 1, text=str(error))
            return False
        self._failed_in_a_row = 0
        self._say(state=LinkState.UP, reconnects=self._report.reconnects + 1)  # what was wrong is still to be told
        return True

    def orphan(self) -> None:
        """The owner is gone, or told us to go."""
        self._orphan_since_ns = self._orphan_since_ns or time.monotonic_ns()

    @property
    def finished(self) -> bool:
        """Nobody is left, and the outputs are where the last order or the safe values want them, or out of reach for
        good."""
        if not self._orphan_since_ns:
            return False
        order = self._mailbox.order()
        if order.mode is OutputsMode.RELEASED or (order.mode is OutputsMode.NONE and self._report.trip is Trip.NONE):
            return True
        if order.mode is OutputsMode.DRIVE and self._report.trip is Trip.NONE:
            return False
        done = self._confirmed is not None and self._confirmed == self._wanted(order.mode, order.outputs)
        return done or time.monotonic_ns() - self._orphan_since_ns > _LAST_EFFORT_NS

    @property
    def deserted(self) -> bool:
        """The owner went without a word, so nobody tidies up after us."""
        return self._mailbox.order().mode is OutputsMode.DRIVE

    def end(self, text: str = "") -> None:
        """Last report, and off the wire."""
        self._link.close(settled=self._tried is None or self._tried == self._confirmed)
        self._say(state=LinkState.ENDED, text=text or self._report.text)

    def _say(self, **changes: Any) -> None:
        safe = self._confirmed is not None and self._confirmed == self._job.safe
        self._report = self._report._replace(heartbeat_ns=time.monotonic_ns(), holds_safe=safe, **changes)
        self._mailbox.post_report(self._report)


def serve(worker: Worker, wake: int) -> None:
    """Drive the wire until the owner's end of the pipe `wake` closes and the outputs are settled."""
    poll = select.poll()
    poll.register(wake, select.POLLIN)
    open_pipe = True
    while not worker.finished:
        busy = worker.turn()
        if not open_pipe:
            time.sleep(0 if busy else _IDLE_MS / 1000)
        elif poll.poll(0 if busy else _IDLE_MS) and not os.read(wake, 4096):
            open_pipe = False
            worker.orphan()


def read_job(stream_line: bytes) -> WorkerSetup:
    """The job as the owner sent it."""
    raw = cast(dict[str, Any], json.loads(stream_line))
    return WorkerSetup(**{**raw, "safe": tuple(raw["safe"])})


def stand_alone() -> None:
    """Leave the owner's priority, processor and signals behind, before the first exchange."""
    with contextlib.suppress(OSError):
        os.sched_setaffinity(0, range(os.cpu_count() or 1))
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_FIFO_PRIORITY))
    except OSError:
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the owner's business, which then tells us


def run(wake: int, descriptor: int) -> int:
    """The whole life of an I/O process: read the job from `wake`, serve, end. Returns the exit status."""
    stand_alone()
    line = b""
    while b"\n" not in line:
        chunk = os.read(wake, 65536)
        if not chunk:
            return 2
        line += chunk
    job = read_job(line.split(b"\n", 1)[0])
    mailbox = IoMailbox(descriptor)
    link = cast(WireLink, importlib.import_module(job.module).link(job.settings))
    worker = Worker(link, mailbox, job)
    signal.signal(signal.SIGTERM, lambda *_: worker.orphan())
    if not worker.connect():
        return 1
    try:
        serve(worker, wake)
    finally:
        worker.end()
    if worker.deserted:
        remove_own(descriptor)
    return 0

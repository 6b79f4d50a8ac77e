"""The owner's side of an I/O process: start it, give it the newest outputs, see what it reports, let it go.

No call but `start` and `stop` waits for a wire. A process that is not the owner reaches the same wire by alarm.py.
"""

import contextlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from drivers.io_process.alarm import ALARM_LOOK_S, NOT_YET, is_stopped, let_go_on
from drivers.io_process.lookup import find, path_for, remove_left, user_of
from drivers.io_process.mailbox import IoMailbox, LinkState, OutputsMode, Report, Trip, create, mapped, remove
from drivers.io_process.worker import WorkerSetup
from rig.errors import DeviceError, DeviceLost, DevicePending, WatchdogTripped
from rig.silence import Silence

_START_S: Final = 10.0
_RESTART_NS: Final = 500_000_000
_WHY: Final = {
    Trip.SILENCE: "no call came in time (busy machine? hung loop?), so the I/O process wrote the safe set-points; "
    "close and open again",
    Trip.ORPHANED: "its owner was gone, so the I/O process wrote the safe set-points; close and open again",
    Trip.OUTAGE: "the line was lost while driving; while the rig is held, the safe set-points are written as soon as "
    "it is back; close and open again",
    Trip.ALARM: "another process (the supervisor) took it to the safe set-points; close and open again",
}


class IoProcess:
    """One wire served by a process of its own. `resource` names the wire (a device file, or host:port)."""

    def __init__(self, resource: str, job: WorkerSetup, rescue: WorkerSetup, hang_ns: int) -> None:
        """`rescue`: its job where only the safe outputs are wanted. `hang_ns`: an I/O process that has not moved for
        this long is stuck in the kernel, or starved."""
        self.resource = resource
        self._job, self._rescue, self._hang_ns = job, rescue, hang_ns
        self._path: Path = path_for(resource)
        self._process: subprocess.Popen[bytes] | None = None
        self._mailbox: IoMailbox | None = None
        self._wake: int | None = None
        """Our end of the pipe that wakes it, and whose end tells it that we are gone."""
        self._mode = OutputsMode.NONE
        self._seen_errors = 0
        self._began_ns = self._woken_ns = 0
        self._silence = Silence(hang_ns)

    @property
    def running(self) -> bool:
        """Whether `start` succeeded and `stop` was not called."""
        return self._process is not None

    def start(self) -> Mapping[str, str]:
        """Start the process and wait until it has the wire; its facts. DeviceLost says in one line why not;
        WatchdogTripped: to who only looks."""
        remove_left()
        self._begin(self._job)
        return self.await_start()

    def start_rescue(self) -> None:
        """The same for the safe outputs alone; `safe` orders them."""
        self.begin_rescue()
        self.await_start()

    def begin_rescue(self) -> None:
        """The same without waiting: `safe` may be ordered at once, or `await_start` follow."""
        self._begin(self._rescue)

    def restart_safe(self, patience_s: float) -> None:
        """Replace a process that is dead or stuck, without waiting, by one that writes the safe outputs.

        DevicePending: not confirmed yet, look again with `safe`. Not more often than twice a second.
        """
        if time.monotonic_ns() - self._began_ns < _RESTART_NS:
            raise DeviceLost(f"{self.resource}: its I/O process ended; another one is started in a moment")
        self.stop(patience_s)
        self._begin(self._rescue)
        self.safe(0.0)

    def _begin(self, job: WorkerSetup) -> None:
        """Start the process without waiting for it, which takes milliseconds."""
        if (found := find(self.resource)) is not None:
            found[1].close()
            raise DeviceLost(
                f"{self.resource}: in use by another I/O process of {user_of(found[0])}; stop the other pamrig first"
            )
        descriptor = create(self._path)
        if descriptor is None:
            raise DeviceLost(f"{self.resource}: in use by another I/O process; stop the other pamrig first")
        try:
            self._process = self._spawned(job, descriptor)
        except OSError as error:  # no descriptor, process or memory to be had
            self.stop()
            raise DeviceLost(f"{self.resource}: its I/O process cannot be started: {error.strerror}") from None
        assert self._mailbox is not None
        assert self._wake is not None
        self._mailbox.served_by(self._process.pid, self._hang_ns)
        os.set_blocking(self._wake, False)

    def _spawned(self, job: WorkerSetup, descriptor: int) -> "subprocess.Popen[bytes]":
        with contextlib.ExitStack() as ours:
            ours.callback(os.close, descriptor)  # the child holds the lock then
            its_end, self._wake = os.pipe2(os.O_CLOEXEC)
            ours.callback(os.close, its_end)
            self._mailbox = mapped(self._path)
            self._mode, self._seen_errors = OutputsMode.NONE, 0
            self._began_ns, self._silence = time.monotonic_ns(), Silence(self._hang_ns)
            os.write(self._wake, json.dumps(job._asdict()).encode() + b"\n")  # before: it needs nobody any more then
            return subprocess.Popen(
                [sys.executable, "-P", "-m", "drivers.io_process", str(descriptor)],
                stdin=its_end, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, pass_fds=[descriptor],
                env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}, start_new_session=True,
            )  # fmt: skip

    def await_start(self) -> Mapping[str, str]:
        """Wait until a process that was begun has the wire; its facts. DeviceLost says in one line why not."""
        assert self._process
        assert self._mailbox
        deadline = time.monotonic() + _START_S
        while time.monotonic() < deadline:
            ended = self._process.poll() is not None
            report = self._mailbox.report()
            if report.state is LinkState.UP:
                if report.errors:  # since then already: the text is that of an error
                    return {}
                return dict(line.split("=", 1) for line in report.text.splitlines() if "=" in line)
            if report.state in (LinkState.REFUSED, LinkState.TRIPPED) or ended:
                why = report.text or self._last_words()
                self.stop()
                raise WatchdogTripped(why) if report.state is LinkState.TRIPPED else DeviceLost(why)
            time.sleep(ALARM_LOOK_S)
        self.stop()
        raise DeviceLost(f"{self.resource}: the I/O process did not get its line within {_START_S:g} s")

    def _last_words(self) -> str:
        assert self._process
        assert self._process.stderr
        lines = self._process.stderr.read().decode("utf-8", "replace").strip().splitlines()
        return f"{self.resource}: the I/O process ended: {lines[-1] if lines else f'status {self._process.returncode}'}"

    @property
    def alive(self) -> bool:
        """Whether the process is there and moving; its line may be down, then it tries by itself."""
        if self._process is None or self._mailbox is None or self._process.poll() is not None:
            return False
        report = self._mailbox.report()
        if report.state is LinkState.STARTING:
            return time.monotonic_ns() - self._began_ns <= _START_S * 1e9
        return not self._is_stuck(report)

    def _is_stuck(self, report: Report) -> bool:
        """It does not move, and not because the machine stood still: whoever replaces it then waits for a new one, with
        old set-points at the valves."""
        return self._silence.too_long(max(report.heartbeat_ns, self._woken_ns))

    def report(self) -> Report:
        """What the I/O process last said; DeviceLost when it is gone, stuck, has lost its line, or took over."""
        if self._mailbox is None or self._process is None:
            raise DeviceLost(f"{self.resource}: not open")
        report = self._mailbox.report()
        if report.trip is not Trip.NONE:
            raise DeviceLost(f"{self.resource}: {_WHY[report.trip]}")
        if report.state is LinkState.DOWN:
            raise DeviceLost(f"{self.resource}: the line is lost: {report.text}")
        if not report.heartbeat_ns or self._is_stuck(report):
            if self._process.poll() is not None:
                raise DeviceLost(f"{self.resource}: the I/O process is gone (status {self._process.returncode})")
            raise DeviceLost(f"{self.resource}: the I/O process has not moved for {self._hang_ns / 1e6:.0f} ms")
        return report

    def check_errors(self, report: Report) -> None:
        """DeviceError once for exchanges that failed since the last look: the next one may work."""
        if report.errors != self._seen_errors:
            self._seen_errors = report.errors
            raise DeviceError(f"{self.resource}: {report.text}")

    def touch(self) -> None:
        """Say that the owner lives, without ordering anything new."""
        if self._mode is OutputsMode.DRIVE:
            self._order(OutputsMode.DRIVE, self._outputs)

    def drive(self, outputs: tuple[float, ...]) -> None:
        """Order new outputs; they replace any that were not written yet."""
        self.report()
        self._order(OutputsMode.DRIVE, outputs)

    def _order(self, mode: OutputsMode, outputs: tuple[float, ...]) -> int:
        assert self._mailbox
        assert self._wake is not None
        self._mode, self._outputs = mode, outputs
        number = self._mailbox.post_order(time.monotonic_ns(), mode, outputs)
        try:
            os.write(self._wake, b".")
        except BlockingIOError:
            pass  # it is awake anyway
        except OSError:
            raise DeviceLost(f"{self.resource}: the I/O process is gone") from None
        return number

    def safe(self, patience_s: float) -> None:
        """Order the safe outputs and wait up to `patience_s` for the device to confirm them.

        DevicePending while they are on their way: a living I/O process finishes the order even if the owner dies now,
        and one that was stopped goes on. DeviceError when an exchange failed meanwhile, DeviceLost when nobody is there
        to write them.
        """
        if self._mailbox is None or self._process is None:
            raise DeviceLost(f"{self.resource}: not open")
        before = self._mailbox.report()
        number = self._order_safe(before)
        self._go_on()
        deadline = time.monotonic() + patience_s
        while (report := self._mailbox.report()).order_done < number and time.monotonic() < deadline:
            if self._process.poll() is not None:
                break
            time.sleep(ALARM_LOOK_S)
        if report.order_done >= number:
            return
        if report.state is LinkState.DOWN or not self.alive:
            raise DeviceLost(f"{self.resource}: the safe set-points could not be written: {report.text}")
        if report.errors != before.errors:
            raise DeviceError(f"{self.resource}: {NOT_YET}: {report.text}")
        raise DevicePending(f"{self.resource}: {NOT_YET}")

    def _order_safe(self, report: Report) -> int:
        """An order that stands is not given anew: on a slow wire it would never be done. On a lost one it makes it try
        again at once."""
        assert self._mailbox
        if self._mode is OutputsMode.SAFE and report.state is LinkState.UP:
            return self._mailbox.order().number
        return self._order(OutputsMode.SAFE, self._job.safe)

    def _go_on(self) -> None:
        """Let the process go on if somebody stopped it."""
        assert self._process
        if is_stopped(self._process.pid):
            self._woken_ns = time.monotonic_ns()
            let_go_on(self._process.pid)

    def confirmed(self) -> bool:
        """Whether the device has confirmed the safe outputs, and nothing else was ordered since; DevicePending while
        that may still come, DeviceLost when nobody is there to write them."""
        if self._mailbox is None or not self.alive:
            raise DeviceLost(
                f"{self.resource}: the safe set-points could not be written: its I/O process does not move"
            )
        if self._mode is OutputsMode.SAFE and not self._mailbox.confirmed:
            raise DevicePending(f"{self.resource}: {NOT_YET}")
        return self._mode is OutputsMode.SAFE

    def stop(self, patience_s: float = 3.0) -> None:
        """Let go: outputs stay; a safe order still on its way is finished first, if its line is up. Idempotent; never
        raises."""
        process, mailbox = self._process, self._mailbox
        self._process = self._mailbox = None
        if mailbox is not None and (self._mode is OutputsMode.DRIVE or mailbox.report().state is LinkState.DOWN):
            mailbox.post_order(time.monotonic_ns(), OutputsMode.RELEASED, ())
        if process is not None:
            assert process.stderr
            let_go_on(process.pid)
            self._close_pipe()
            try:
                process.wait(patience_s)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            process.stderr.close()
        if mailbox is not None:
            mailbox.close()
        self._close_pipe()
        remove(self._path)
        self._mode = OutputsMode.NONE

    def _close_pipe(self) -> None:
        wake, self._wake = self._wake, None
        if wake is not None:
            os.close(wake)

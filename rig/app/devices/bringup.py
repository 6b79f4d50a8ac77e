"""A device without a loop: ticked by a thread of its own while somebody types, for probing and calibrating.

The rig is held at its period without a program, set-points go at a gentle rate, and every way out ends in the safe
state.
"""

import contextlib
import math
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from statistics import fmean, pstdev
from types import TracebackType
from typing import Final, Self

from rig.app.supervised_command import SupervisedCommand
from rig.app.terminal import say
from rig.app.trying_on import TryingOn
from rig.errors import DeviceError, DeviceLost, RigError, beside
from rig.interfaces import Device, Measurement, abilities_of
from rig.realtime.clock import MonotonicClock
from rig.realtime.safe_report import NOT_SAFE, SafeReport, Writer
from rig.realtime.safe_report import Outcome as SafeOutcome
from rig.realtime.safe_state import RETRY_S, SecondPath, insist, write_and_look
from rig.realtime.way_out import LEAVING_NS
from rig.sample import BROKEN_WIRE, SUSPECT
from rig.service.signals import own_signals

SLEW_MPA_S: Final = 0.1
"""A fiftieth of what the guard allows in a run: somebody may have a hand at the joint."""
KEPT_TICKS: Final = 2000
"""Measurements kept at most: 10 s at 5 ms, ten times what anybody averages."""
_WAIT_LOOK_S: Final = 0.01
"""How often whoever waits for the ticker looks whether it still lives."""
AVERAGED_S: Final = 0.2
"""Measurements over this time are averaged before and after a step."""
MAKE_SAFE_S: Final = 2.0
"""For the safe state on the way out; a slow wire confirms within tenths of a second. Then it is said that it is tried
on."""
PRIORITY: Final = 20
"""Real-time, where it is allowed: a device that watches for silence gives a busy machine a few periods only."""
LETTING_GO_NS: Final = 7_000_000_000
"""For letting go of a safe device, as two I/O processes may take, before the supervisor takes over."""
MOST_FAILED_TICKS: Final = 20
"""Failed ticks in a row before the ticker lets go."""


class DeviceTicker:
    """Opens the device, ticks it in the background, and leaves it safe (when it was moved) and closed."""

    def __init__(
        self,
        device: Device,
        period_ns: int,
        safe_mpa: tuple[float, float],
        supervision: SupervisedCommand | None = None,
    ) -> None:
        """With `supervision`, whoever stands above this process is told of each tick, and missed when he is lost."""
        self.facts: dict[str, str] = {}
        self._device, self._period_ns, self._safe, self._supervision = device, period_ns, safe_mpa, supervision
        self._goal: tuple[float, float] | None = None
        self._at: tuple[float, float] | None = None
        self._history: deque[Measurement] = deque(maxlen=KEPT_TICKS)
        self._quit = threading.Event()
        self._error: DeviceError | None = None
        self._safe_outcome = SafeOutcome.UNKNOWN
        """Of the last time that the safe state was written."""
        self._thread = threading.Thread(target=self._ticks, name="ticker", daemon=True)

    def __enter__(self) -> Self:
        """The ticks begin before whoever stands above is started, which may take longer than the device's own watchdog
        waits for a request."""
        try:
            self.facts = dict(self._device.open())
            self._thread.start()
            if self._supervision is not None:
                self._supervision.start()
        except BaseException:
            with _ended_afterwards():
                self._quit.set()
                if self._thread.is_alive():
                    self._thread.join()
                self._let_go()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        outcome = ""
        with _ended_afterwards() as pressed:
            self._quit.set()
            self._thread.join()
            try:
                outcome = self._make_safe(pressed) if self._at is not None else ""
            except DeviceError as unsafe:
                raise beside(error, str(unsafe)) if isinstance(error, RigError) else unsafe from None
            finally:
                self._let_go()
            if outcome and not isinstance(error, RigError) and (error is not None or pressed):
                _tell(outcome)
        if outcome and isinstance(error, RigError):
            raise beside(error, outcome) from None

    def _let_go(self) -> None:
        """Of the device, and of who stands above to the last: until then a watchdog may go on."""
        with contextlib.ExitStack() as above:
            if self._supervision is not None:
                above.callback(self._supervision.end)
                self._supervision.beat(LETTING_GO_NS)
            let_go(self._device)

    def _make_safe(self, pressed: list[int]) -> str:
        """Until the device has taken it; one whose connection was lost may need a while. Returns what is known of it,
        for the end of a line; DeviceError when it has not."""
        path, how = SecondPath.of(self._device), ""
        self._safe_outcome = insist(path, MAKE_SAFE_S, self._beat_for_the_way_out)
        if self._safe_outcome < SafeOutcome.WRITTEN:
            before = len(pressed)
            trying = TryingOn(self._safe, lambda: len(pressed) > before)
            how = trying.go_on(lambda: self._safe_outcome >= SafeOutcome.WRITTEN, self._try_once)
        if self._safe_outcome >= SafeOutcome.WRITTEN:
            return f"{SafeReport(Writer.CONTROL, outcome=self._safe_outcome).words}{how}"
        try:
            self._device.safe()
        except DeviceError as error:
            raise DeviceError(f"{NOT_SAFE}: old set-points may stand, open the dump valve: {error}{how}") from None
        raise DeviceError(f"{NOT_SAFE}: the device holds something else, open the dump valve{how}")

    def _try_once(self) -> None:
        self._beat_for_the_way_out()
        self._safe_outcome = write_and_look(SecondPath.of(self._device))

    def _beat_for_the_way_out(self) -> None:
        if self._supervision is not None:
            self._supervision.beat(LEAVING_NS)

    def _look_up(self) -> None:
        """Beat; and without somebody above this process nothing is to stand under pressure."""
        if self._supervision is None:
            return
        self._supervision.beat()
        if self._at is not None and (why := self._supervision.trouble()):
            raise DeviceLost(f"{why}: nobody would see to the safe state if this command were lost, so it gave up")

    def go_to(self, p1_mpa: float, p2_mpa: float, settle_s: float = 0.0) -> None:
        """Bring both set-points there at SLEW_MPA_S, then wait. The first call starts from the pressures that stand, as
        far as they are known, so that nothing jumps."""
        self._at = self._at or self._standing((p1_mpa, p2_mpa))
        self._goal = (p1_mpa, p2_mpa)
        while self._at != self._goal:
            self._alive()
            time.sleep(_WAIT_LOOK_S)
        self.wait(settle_s)

    def _standing(self, goal_mpa: tuple[float, float]) -> tuple[float, float]:
        """The measured pressures, none above both the safe one and the goal; the safe ones where a monitor says
        nothing, or nothing that can be true."""
        found = self.collect(AVERAGED_S)
        if any(now.flags & (BROKEN_WIRE | SUSPECT) for now in found):
            return self._safe
        p1, p2 = (
            min(max(p, 0.0), max(safe, goal)) if math.isfinite(p := mean(found, name)[0]) else safe
            for name, safe, goal in zip(("p1_mpa", "p2_mpa"), self._safe, goal_mpa, strict=True)
        )
        return p1, p2

    @property
    def device(self) -> Device:
        """The device at its end."""
        return self._device

    def loosen(self) -> None:
        """Write no more set-points, only read, until the next `go_to`."""
        self._goal = None

    def wait(self, seconds: float) -> None:
        """Keep ticking for a while."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            self._alive()
            time.sleep(_WAIT_LOOK_S)

    def collect(self, seconds: float) -> list[Measurement]:
        """What is measured from now on, for so long; DeviceError when nothing comes."""
        self._history.clear()
        self.wait(seconds)
        found = list(self._history)
        if not found:
            raise DeviceError("the device gave no measurement")
        return found

    def _alive(self) -> None:
        if self._error is not None:
            raise self._error

    def _ticks(self) -> None:
        with contextlib.suppress(OSError):  # this thread alone; without permission it ticks as well as it can
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
        clock, failed = MonotonicClock(), 0
        due_ns = clock.now_ns()
        while not self._is_over():
            due_ns = max(due_ns + self._period_ns, clock.now_ns())
            clock.wait_until_ns(due_ns)
            try:
                self._look_up()
                self._history.append(self._device.read())
                self._step()
                failed = 0
            except DeviceError as error:
                failed += 1
                if failed >= MOST_FAILED_TICKS or isinstance(error, DeviceLost):
                    return self._give_up(error)
            except Exception as error:  # noqa: BLE001  # of a driver: who waits for the ticks must hear of it
                return self._give_up(DeviceLost(f"the device's driver failed by an error of the program: {error!r}"))
        return None

    def _is_over(self, wait_s: float = 0.0) -> bool:
        """The command is on its way out; or it ends without, by a signal that struck just before: the interpreter then
        waits for those above, who wait for this thread to beat no more."""
        return self._quit.wait(wait_s) or not threading.main_thread().is_alive()

    def _give_up(self, error: DeviceError) -> None:
        """After an error nothing is to stand under pressure while somebody is still asked for a number: what the device
        does not take is tried until it does, or the way out goes on with it."""
        self._error, reported = error, False
        owed = self._at is not None
        until_s = time.monotonic() + MAKE_SAFE_S
        while True:
            if owed:
                self._try_once()
                owed = self._safe_outcome < SafeOutcome.WRITTEN
                if not owed and reported:
                    _tell(SafeReport(Writer.CONTROL, outcome=self._safe_outcome).words)
                elif owed and not reported and time.monotonic() > until_s:
                    reported = True
                    _tell(f"{NOT_SAFE}: {error}; the safe state is written as soon as the device takes it")
            elif self._at is not None:
                owed = not self._answers()
            if self._supervision is not None:
                self._supervision.beat()
            if self._is_over(RETRY_S if owed else self._period_ns / 1e9):
                return

    def _answers(self) -> bool:
        """Asked each period, a module's own watchdog does not take the safe set-points elsewhere."""
        try:
            self._device.read()
        except Exception:  # noqa: BLE001  # whatever it is: what stands there is not known any more
            return False
        return True

    def _step(self) -> None:
        if self._goal is None or self._at is None:
            return
        step = SLEW_MPA_S * self._period_ns / 1e9
        a, b = (at + min(max(goal - at, -step), step) for at, goal in zip(self._at, self._goal, strict=True))
        self._device.write(a, b)
        self._at = (a, b)


def _tell(line: str) -> None:
    """Beside a question that somebody is asked."""
    say(f"\n{line}", "bold red" if line.startswith(NOT_SAFE) else "green")


@contextlib.contextmanager
def _ended_afterwards() -> Iterator[list[int]]:
    """Ctrl-C, SIGTERM and a closed terminal strike when this is over: whoever asks twice is not to keep the rig from
    its safe state, which has a bound of its own. Yields how often it was asked for, but by a terminal that is gone. Who
    stands above this process sees to one that hangs."""
    pressed: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield pressed
        return
    struck: list[int] = []

    def keep(number: int, _: object) -> None:
        struck.append(number)
        if number != signal.SIGHUP:
            pressed.append(number)

    with own_signals(keep):
        yield pressed
    if struck:
        raise KeyboardInterrupt


def let_go(device: Device) -> None:
    """Close a device; a stand-in's emulators end too."""
    device.close()
    abilities_of(device).shut_down()


def mean(found: list[Measurement], field: str) -> tuple[float, float]:
    """Mean and standard deviation of one field over measurements that have it; NaN when none has."""
    values = [value for now in found if math.isfinite(value := getattr(now, field))]
    return (fmean(values), pstdev(values)) if values else (math.nan, math.nan)


@dataclass(frozen=True)
class StepResult:
    """What moved when one valve was stepped."""

    valve: int
    step_mpa: float
    moved_1_mpa: float
    moved_2_mpa: float
    moved_deg: float

    def finding(self) -> str:
        """One line when the wiring is not as the config says; empty when it is."""
        own, other = (self.moved_1_mpa, self.moved_2_mpa) if self.valve == 1 else (self.moved_2_mpa, self.moved_1_mpa)
        if math.isnan(own):
            return f"valve {self.valve}: its monitor gives no value, so the step could not be seen"
        least = abs(self.step_mpa) / 2
        if abs(own) < least and abs(other) >= least:
            return f"valve {self.valve} moves monitor {3 - self.valve}: the valves or their monitors are swapped"
        if abs(own) < least:
            return (
                f"valve {self.valve}: stepped by {self.step_mpa:g} MPa, its monitor moved {own:.3f} MPa; is the air on?"
            )
        if own * self.step_mpa < 0:
            return f"valve {self.valve}: its monitor moves against the step; is its signal inverted?"
        if abs(other) >= least:
            return f"valve {self.valve} moves both monitors; are the muscles or the monitor wires joined?"
        return ""


def step_valves(
    ticker: DeviceTicker, safe_mpa: tuple[float, float], step_mpa: float, settle_s: float
) -> list[StepResult]:
    """Step each valve alone, up from the safe pressures and back, and see what moves."""
    results = []
    ticker.go_to(*safe_mpa, settle_s)
    for valve in (1, 2):
        before = ticker.collect(AVERAGED_S)
        stepped = [p + (step_mpa if n == valve else 0.0) for n, p in enumerate(safe_mpa, 1)]
        ticker.go_to(stepped[0], stepped[1], settle_s)
        after = ticker.collect(AVERAGED_S)
        moved = (mean(after, field)[0] - mean(before, field)[0] for field in ("p1_mpa", "p2_mpa", "angle_deg"))
        results.append(StepResult(valve, step_mpa, *moved))
        ticker.go_to(*safe_mpa, settle_s)
    return results

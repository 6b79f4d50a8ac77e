"""Keeps a tick's code warm: shortly before each tick a second loop, which owns nothing, carries out a tick of its own.

Between two ticks an idle processor, or a busy one, forgets the interpreter, the loop's bytecode and the tables they
use; fetching them again makes a tick several times slower than one that follows another at once. The second loop runs
the same code on memory that nobody else sees: its device, ring, mailbox and program are its own, and nothing of it
reaches an output or a record.
"""

from collections.abc import Callable, Mapping
from typing import Final

from rig.gains import ClosedLoop
from rig.interfaces import Device, Measurement, Role
from rig.realtime.clock import VirtualClock
from rig.realtime.closed_loop import TrackingProgram
from rig.realtime.commands import Mailbox, Script
from rig.realtime.loop import Loop, LoopSettings
from rig.realtime.program import Program
from rig.realtime.ring import Ring, RingWriter

_SWEEP_TICK: Final = 2
"""Tick 0 arms; tick 1 starts the program, whose first set-points are those of its sweep; from tick 2 on a closed loop
looks at the angle."""


class NoDevice:
    """Stands still and costs nothing: for rigs whose drivers cannot be called without an effect."""

    roles = frozenset(Role)

    def __init__(self, p1_mpa: float, p2_mpa: float) -> None:
        self._shown = Measurement(p1_mpa, p2_mpa, 0.0, p1_mpa, p2_mpa, 0.0)

    def open(self) -> Mapping[str, str]:
        """Nothing to open."""
        return {}

    def read(self) -> Measurement:
        """Always the same."""
        return self._shown

    def write(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        """Goes nowhere."""

    def safe(self) -> None:
        """Goes nowhere."""

    def close(self) -> None:
        """Nothing to close."""


class Rehearsal:
    """Call it to carry out one tick, in the middle of a sweep at rest, that has no effect."""

    def __init__(
        self, device: Device, clock: VirtualClock, settings: LoopSettings, *, closed_loop: bool = False
    ) -> None:
        """`device` must be nobody's and move nothing; it is opened here, and lives on `clock`. `closed_loop`: what is
        rehearsed is a tick that follows an angle."""
        self.failed = False
        program = _at_rest(settings, closed_loop)
        self._clock, self._period_ns = clock, settings.period_ns
        self.loop = Loop(device, clock, RingWriter(Ring.private()), Script([program], Mailbox.private()), settings)
        device.open()
        for tick in range(_SWEEP_TICK + 1):
            self._carry_out(tick)

    def __call__(self) -> None:
        """One tick, the same each time. An error of it must not end the real loop: then there is no rehearsal any
        more."""
        if self.failed:
            return
        try:
            self._carry_out(_SWEEP_TICK)
        except Exception:  # noqa: BLE001  # whatever it was, the real tick will meet it and say so
            self.failed = True

    def _carry_out(self, tick: int) -> None:
        self._clock.wait_until_ns(self._clock.now_ns() + self._period_ns)
        self.loop.tick(tick, self._clock.now_ns(), self._clock.now_ns(), 0)


class Rehearsals:
    """Call it to carry out a tick of the kind that is due: of an open or of a closed loop. Both are ready from the
    start, for a daemon's loop learns which it will be only when a run begins."""

    def __init__(self, open_loop: Rehearsal, closed_loop: Rehearsal) -> None:
        self._open, self._closed = open_loop, closed_loop
        self.follows_angle: Callable[[], bool] = lambda: False
        """Whether the real loop's next tick follows an angle."""

    def __call__(self) -> None:
        """One tick without an effect."""
        (self._closed if self.follows_angle() else self._open)()


def _at_rest(settings: LoopSettings, closed_loop: bool) -> Program:
    """A sweep that holds the safe pressures, or the angle at them."""
    p1_mpa, p2_mpa, period_s = settings.safe_p1_mpa, settings.safe_p2_mpa, settings.period_ns * 1e-9
    tables = [p1_mpa] * _SWEEP_TICK, [p2_mpa] * _SWEEP_TICK
    if not closed_loop:
        return Program(1, p1_mpa, p2_mpa, *tables, 0, 0, 0, 0)
    gains = ClosedLoop(kp_mpa_per_deg=1e-4, ki_mpa_per_deg_s=1e-4, error_deg=180.0)
    return TrackingProgram(1, p1_mpa, p2_mpa, *tables, 0, 0, 0, 0, [], [], [0.0] * _SWEEP_TICK, gains, period_s)

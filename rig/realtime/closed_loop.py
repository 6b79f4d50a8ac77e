"""A program that closes the loop over the angle: feed-forward by tick index, and PI(D) feedback on what was read.

    dp = feed-forward + kp e + ki integral(e) + kd de/dt,   e = reference - angle

The feed-forward was computed before the run and travels as a table, so that the loop only looks it up. The feedback may
add no more than `limit_mpa`, what limit or guard took away is taken from its integral (back-calculation, Åström and
Hägglund, Advanced PID Control, 2006, section 3.5), and two faults are its own: an angle that is lost, and an error that
stays too large. The guard comes after it, as after any program.
"""

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass, field, fields
from itertools import accumulate, pairwise
from pathlib import Path
from typing import ClassVar, Final, Self

from rig.errors import StateError
from rig.gains import ClosedLoop
from rig.realtime.faults import Fault
from rig.realtime.program import OPEN_LOOP, Program, read_block
from rig.realtime.shared import SharedBlock
from rig.sample import ANGLE_ABSENT, ANGLE_SUSPECT, READ_ERROR, Phase

CLOSED_LOOP: Final = 1
"""Kind of such a program in its block; see `rig.realtime.program`."""
LOST_TICKS: Final = 3
"""So many ticks in a row without an angle that can be true are a lost angle; until then the feedback holds. Below the
five after which a leaky bucket is full, so that the cause is told by its own name."""

_NO_FAULT, _SWEEP, _RAMP_IN = Fault.NONE, Phase.SWEEP, Phase.RAMP_IN
_NO_ANGLE: Final = ANGLE_SUSPECT | ANGLE_ABSENT | READ_ERROR
_ROUNDING_MPA: Final = 1e-9
"""A smaller difference between what was wanted and what the guard let through is rounding."""


class Feedback:
    """PI(D) on the error of the angle; one for each run."""

    def __init__(self, settings: ClosedLoop, period_s: float) -> None:
        self._kp, self._ki, self._kd = (
            settings.kp_mpa_per_deg,
            settings.ki_mpa_per_deg_s,
            settings.kd_mpa_s_per_deg,
        )
        self._settings, self._period_s = settings, period_s
        self._integral_time_s = abs(self._kp / self._ki) if self._ki else 0.0
        self._filter_s = settings.filter_s
        self._limit, self._error_deg, self._error_s = settings.limit_mpa, settings.error_deg, settings.error_s
        self.fault = _NO_FAULT
        self._begun = False
        self._integral = self._slope = self._added = self._wanted = 0.0
        self._error = self._outside_s = 0.0
        self._lost = 0
        self.tick = 0
        """The last tick of the closed loop that was carried out."""
        self.left_from: tuple[float, float] | None = None
        """The set-points (MPa) that stood when the loop was opened; None as long as it is closed."""

    def add(self, tick: int, reference_deg: float, angle_deg: float, flags: int, standing_mpa: float) -> float:
        """What the feedback adds to the differential pressure (MPa) in `tick` of the closed loop.

        `flags` are the sample's: without an angle that can be true the last value stands. `standing_mpa` is what the
        guard let through of the last difference beyond its feed-forward.
        """
        dt_s = (tick - self.tick) * self._period_s or self._period_s  # a rehearsal does the same tick again
        self.tick = tick
        if flags & _NO_ANGLE:
            return self._hold(flags)
        self._lost = 0
        error = reference_deg - angle_deg
        if not self._begun:
            self._begin(error)
        elif self._kd:
            share = dt_s / (self._filter_s + dt_s)
            self._slope += share * ((error - self._error) / dt_s - self._slope)
        taken = standing_mpa - self._wanted
        if not -_ROUNDING_MPA < taken < _ROUNDING_MPA:
            self._integral += taken * min(dt_s / self._integral_time_s, 1.0) if self._integral_time_s else 0.0
        self._integral += self._ki * error * dt_s
        self._error = error
        self._watch(error, dt_s)
        limit = self._limit
        self._wanted = wanted = self._kp * error + self._integral + self._kd * self._slope
        self._added = -limit if wanted < -limit else limit if wanted > limit else wanted
        return self._added

    def _begin(self, error: float) -> None:
        """Without a bump: the first output is the feed-forward alone, whatever the error is."""
        self._begun, self._error, self._integral = True, error, -self._kp * error

    def _hold(self, flags: int) -> float:
        """No angle: the last value stands, for a few ticks. A device that fails has a leaky bucket of its own."""
        if not flags & READ_ERROR:
            self._lost += 1
            if self._lost >= LOST_TICKS:
                self.fault = Fault.ANGLE_LOST
        return self._added

    def _watch(self, error: float, dt_s: float) -> None:
        if abs(error) <= self._error_deg:
            self._outside_s = 0.0
            return
        self._outside_s += dt_s
        if self._outside_s > self._error_s:
            self.fault = Fault.TRACKING_ERROR


@dataclass(frozen=True)
class TrackingProgram(Program):
    """A program whose set-points of the sweep are a feed-forward, to which the feedback adds.

    The loop closes with the first tick of the ramp in, where reference and feed-forward have entries of their own, and
    opens at the end of the sweep; the ramp out begins at the set-points that stand then. Settle and zero are those of
    any program.
    """

    lead_p1_mpa: Sequence[float]
    lead_p2_mpa: Sequence[float]
    """Feed-forward of the ramp in, one entry a tick."""
    reference_deg: Sequence[float]
    """Of ramp in and sweep, one entry a tick."""
    settings: ClosedLoop
    period_s: float
    closed: ClassVar[bool] = True
    _feedback: Feedback = field(init=False, repr=False, compare=False)
    """All that changes from tick to tick."""

    def __post_init__(self) -> None:
        if len(self.reference_deg) != self.ramp_in_ticks + len(self.p1_cmd_mpa):
            raise StateError("a tracking program needs a reference for each tick of ramp in and sweep")
        object.__setattr__(self, "_feedback", Feedback(self.settings, self.period_s))

    @property
    def fault(self) -> Fault:
        """The fault that the feedback has found."""
        return self._feedback.fault

    def wanted_deg(self, index: int) -> float:
        """The reference angle at a tick of the program; NaN where the loop is open."""
        closed = index - self.settle_ticks - self.zero_ticks
        return self.reference_deg[closed] if 0 <= closed < len(self.reference_deg) else math.nan

    def at(
        self,
        index: int,
        start: tuple[float, float],
        angle_deg: float = math.nan,
        flags: int = ANGLE_ABSENT,
        standing: tuple[float, float] | None = None,
    ) -> tuple[Phase, float, float]:
        """As of any program, with the feedback added while the loop is closed.

        `angle_deg` counts from the zero; `standing` are the set-points as the guard let them through in the last tick.
        """
        closed = index - self.settle_ticks - self.zero_ticks
        swept = closed - self.ramp_in_ticks
        if closed < 0:
            return super().at(index, start)
        if swept >= len(self.p1_cmd_mpa):
            left = self._feedback.left_from
            if left is None:
                self._feedback.left_from = left = standing or (self.p1_cmd_mpa[-1], self.p2_cmd_mpa[-1])
            return self.way_out(self.ramp_out_ticks - 1 - swept + len(self.p1_cmd_mpa), left)
        p1_mpa, p2_mpa = self._forward(closed)
        half = 0.0
        if closed:  # the zero holds from the first tick of the ramp in, which has been measured before it
            feedback = self._feedback
            before1, before2 = self._forward(feedback.tick)
            passed = 0.0 if standing is None else standing[0] - standing[1] - before1 + before2
            half = 0.5 * feedback.add(closed, self.reference_deg[closed], angle_deg, flags, passed)
        return _SWEEP if swept >= 0 else _RAMP_IN, p1_mpa + half, p2_mpa - half

    def _forward(self, closed: int) -> tuple[float, float]:
        swept = closed - self.ramp_in_ticks
        if swept >= 0:
            return self.p1_cmd_mpa[swept], self.p2_cmd_mpa[swept]
        return self.lead_p1_mpa[closed], self.lead_p2_mpa[closed]

    def publish(self, name: str, session: int) -> SharedBlock:
        """Write the program into a block of its own, for `attach` in the loop's process."""
        numbers = (self.period_s, *astuple(self.settings))
        return self._write(name, session, CLOSED_LOOP, numbers, self.lead_p1_mpa, self.lead_p2_mpa, self.reference_deg)

    @classmethod
    def attach(cls, path: Path, session: int) -> Self:
        """The program in the block at `path`; StateError when it is not one of this session, or closes no loop."""
        kind, common, more = read_block(path, session)
        lead, numbers = common["ramp_in_ticks"], 1 + len(fields(ClosedLoop))
        ends = list(accumulate((numbers, lead, lead, lead + len(common["p1_cmd_mpa"]))))
        if kind != CLOSED_LOOP or len(more) < ends[-1]:
            raise StateError(f"{path}: the program closes no loop, or is cut short")
        (period_s, *settings), lead_p1, lead_p2, reference = (more[begin:end] for begin, end in pairwise((0, *ends)))
        return cls(
            **common, lead_p1_mpa=lead_p1, lead_p2_mpa=lead_p2, reference_deg=reference,
            settings=ClosedLoop(*settings), period_s=period_s,
        )  # fmt: skip


def attach(path: Path, session: int) -> Program:
    """The program in the block at `path`, of whichever kind; StateError when it is not one of this session."""
    kind = read_block(path, session).kind
    if kind not in (OPEN_LOOP, CLOSED_LOOP):
        raise StateError(f"{path}: a program of kind {kind} is not known")
    return (TrackingProgram if kind == CLOSED_LOOP else Program).attach(path, session)

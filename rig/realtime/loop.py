"""The loop: every period, read -> check -> next command -> guard -> write -> record. One thread, standard library only.

It keeps an absolute grid of ticks. A tick that comes later than a period skips whole periods and counts them; the
program's phase follows the tick index. Every way out of `run` leaves the device in its safe state.
"""

import contextlib
import math
from dataclasses import dataclass, field

from rig.errors import DeviceError, DeviceLost, DevicePending, StateError
from rig.interfaces import NAN, Clock, Device, Measurement, abilities_of
from rig.realtime.commands import Answer, Commands, Request
from rig.realtime.faults import Fault
from rig.realtime.guard import Bucket, Guard, Limits, Misses
from rig.realtime.program import Program
from rig.realtime.rest_angle import RestAngle
from rig.realtime.ring import RingWriter
from rig.realtime.state import Event, State, after
from rig.realtime.way_out import leave_safe
from rig.sample import (
    ABSENT_BY_ROLE,
    ANGLE_ZEROED,
    BROKEN_WIRE,
    READ_ERROR,
    SUSPECT,
    WRITE_ERROR,
    Phase,
    Sample,
)

# members by names of this module: in Python 3.11 looking one up in its class takes as long as a call
_RUNNING, _DONE, _FAULT = State.RUNNING, State.DONE, State.FAULT
_NO_PHASE, _NO_FAULT = Phase.NONE, Fault.NONE
_COMMANDING = (State.ARMED, State.RUNNING, State.DONE)
_UNDER_COMMAND = (State.ARMED, State.RUNNING)
_SILENT = (State.DISARMED, State.FAULT)
_FAILED = READ_ERROR | WRITE_ERROR
_NO_MEASUREMENT = Measurement(flags=sum(ABSENT_BY_ROLE.values()) | READ_ERROR)

READ_BACKS = 3
"""Ticks in which the safe state is read back from a device that does not answer; then it counts as written only."""


@dataclass(frozen=True)
class LoopSettings:
    """What the loop needs to know beside its parts."""

    period_ns: int = 5_000_000
    safe_p1_mpa: float = 0.2
    safe_p2_mpa: float = 0.2
    return_mpa_s: float = 0.2
    """How fast the set-points return to the safe pressures after a program."""
    limits: Limits = field(default_factory=Limits)


class Loop:
    """Drives one device through states and programs until it is told to quit."""

    def __init__(
        self, device: Device, clock: Clock, ring: RingWriter, commands: Commands, settings: LoopSettings
    ) -> None:
        self._device, self._clock, self.ring, self._commands = device, clock, ring, commands
        self._settings, self._limits, self._period_ns = settings, settings.limits, settings.period_ns
        self.state = State.DISARMED
        self.fault = self._fault_due = Fault.NONE
        self._terminated = Fault.NONE
        self._quit = self._device_gone = False
        self._safe_pending, self._safe_under_way = True, False
        self._abilities = abilities_of(device)
        self._read_backs_left = 0
        self._seen_safe = False
        """The device has told that the safe state, which was written last, stands at its outputs."""
        self._forgive()
        self._grid = (0, 0, 0, 0)
        """Tick, due, woken (ns) and missed periods of the tick that is being carried out."""
        self._command = (settings.safe_p1_mpa, settings.safe_p2_mpa)
        self._program: Program | None = None
        self._started_tick, self._from, self._reference_deg = 0, self._command, NAN
        self._way_out_tick: int | None = None
        self._resting = True
        self._zero = RestAngle()

    def _forgive(self) -> None:
        """Begin to count errors, misses and repetitions anew."""
        expected = sum(flag for role, flag in ABSENT_BY_ROLE.items() if role in self._device.roles)
        self._guard = Guard(self._limits, self._period_ns / 1e9, expected)
        self._errors = Bucket(self._limits.bucket)
        self._misses = Misses(self._limits, self._period_ns)

    def terminate(self, why: Fault = Fault.TERMINATED) -> None:
        """Leave at the next tick through the safe state; for signal handlers."""
        self._terminated = why

    def run(self) -> Fault:
        """Tick an opened device until QUIT, a termination or an error, then make it safe and close it.

        Returns the fault that ended it, NONE when all was well.
        """
        try:
            self._tick_until_quit()
        except BaseException:
            self._latch(Fault.LOOP_ERROR)
            raise
        finally:
            try:
                self.leave()
            finally:
                if self.fault is Fault.LOOP_ERROR:  # the record shall say how it ended
                    gone = _NO_MEASUREMENT
                    self._publish(self._clock.now_ns(), gone, _NO_PHASE, 0.0, gone.flags, self._run)
        return self.fault

    def _tick_until_quit(self) -> None:
        clock, period_ns = self._clock, self._period_ns
        due_ns = clock.now_ns() + period_ns
        tick = missed = 0
        while not self._quit:
            clock.wait_until_ns(due_ns)
            woken_ns = clock.now_ns()
            skipped = (woken_ns - due_ns) // period_ns
            if skipped > 0:
                missed += skipped
                tick += skipped
                due_ns += skipped * period_ns
            self.tick(tick, due_ns, woken_ns, missed)
            missed = 0
            tick += 1
            due_ns += period_ns

    def follows_angle(self) -> bool:
        """Whether the program that is carried out looks at the angle."""
        return self._program is not None and self._program.closed

    @property
    def _run(self) -> int:
        return self._program.run if self._program else 0

    def tick(self, tick: int, due_ns: int, woken_ns: int, missed: int) -> None:
        """Carry out tick number `tick` of the grid; `missed`: whole periods skipped just before it."""
        self._grid = tick, due_ns, woken_ns, missed
        self.ring.beat()
        now = self._read()
        read_ns = self._clock.now_ns()
        flags, fault = self._guard.check(now, now.angle_deg - self._zero.deg, self.state in _COMMANDING)
        self._fault_due = self._own_faults(tick, missed, read_ns - due_ns) or fault
        if self._fault_due:
            self._latch(self._fault_due)
        self._carry_out_request(tick, now, flags)
        run = self._run
        phase, p1_cmd_mpa, p2_cmd_mpa = self._next_set_points(tick, now, flags)
        flags |= self._write(p1_cmd_mpa, p2_cmd_mpa, missed + 1)
        failed = self._device_gone or flags & _FAILED  # then the way to the safe state may be long: the cause first
        if pending := self._safe_pending and self.state in _SILENT:
            self.ring.beat()  # what a silent device took of this tick is no part of what the safe state may take
        if pending and not failed:
            flags |= self._write_safe()
        self._publish(read_ns, now, phase, p1_cmd_mpa - p2_cmd_mpa, flags, run)
        if pending and failed:
            self._write_safe()
        if self._program and self.state is _FAULT:
            self._program = None  # the tick of the fault is the last of its record

    def _publish(self, read_ns: int, now: Measurement, phase: Phase, dp_mpa: float, flags: int, run: int) -> None:
        """One sample into the ring, with the zero that holds now and the set-points as written."""
        tick, due_ns, woken_ns, missed = self._grid
        if self._zero.known:
            flags |= ANGLE_ZEROED
        p1_cmd_mpa, p2_cmd_mpa = self._command
        self.ring.put(
            tuple.__new__(Sample, (  # what `_make` does, in half its time
                tick & 0xFFFFFFFF, due_ns, woken_ns, read_ns, self._clock.now_ns(), missed,
                dp_mpa, p1_cmd_mpa, p2_cmd_mpa, now.p1_mpa, now.p2_mpa, now.angle_deg - self._zero.deg,
                now.p1_raw, now.p2_raw, now.angle_raw, now.excitation_raw, now.p1_age_ns, now.p2_age_ns,
                now.angle_age_ns, run, self.state, phase, flags, self.fault, self._zero.deg,
                now.further_1, now.further_2, now.further_3, now.further_4, self._reference_deg,
            ))
        )  # fmt: skip

    def _read(self) -> Measurement:
        if self._device_gone:
            with contextlib.suppress(DeviceError):
                self._abilities.keep()  # what is left of it holds its safe set-points
            return _NO_MEASUREMENT
        try:
            now = self._device.read()
        except DeviceError as error:
            self._count_error(error)
            return _NO_MEASUREMENT
        if self._errors.level:
            self._errors.add(failed=False)
        return now

    def _count_error(self, error: DeviceError) -> None:
        """A permanent error faults at once, a transient one goes into the leaky bucket. Its words are kept for the
        records."""
        self.ring.put_device_message(str(error))
        if isinstance(error, DeviceLost):
            self._device_gone = True
            stalled = self._grid[-1] >= self._limits.stall_periods  # whoever serves its wire stood still as well
            self._latch(Fault.LONG_STALL if stalled else Fault.DEVICE_LOST)
            if not self._seen_safe:  # what was written last may never have reached the valves
                self._safe_pending = True
                self.ring.not_safe()
            elif not self._safe_pending and not self._still_holds_safe():
                self._doubt_safe()
        elif self._errors.level < self._limits.bucket and self._errors.add(failed=True):  # when it gets full
            self._latch(Fault.DEVICE_ERRORS)

    def _own_faults(self, tick: int, missed: int, late_ns: int) -> Fault:
        """The fault that is due by the loop's own state: a termination, an emergency stop, a commander that is gone, or
        lateness."""
        if self._terminated:
            self._quit = True
            return self._terminated if self.state in _UNDER_COMMAND else _NO_FAULT
        if wanted := self._commands.estop_wanted():
            return wanted
        if self.state in _UNDER_COMMAND and self._commands.control_lost():
            return Fault.CONTROL_LOST
        return self._misses.add(tick, missed, late_ns) if missed or late_ns > self._period_ns else _NO_FAULT

    def _latch(self, fault: Fault) -> None:
        """The first fault is kept. The safe state is to be written now, and again where a watchdog may have left it."""
        if self.state is not _FAULT:
            self.state, self.fault, self._safe_pending = after(self.state, Event.FAULT), fault, True
        elif fault in (Fault.LONG_STALL, Fault.DEVICE_ERRORS):
            self._doubt_safe()

    def _carry_out_request(self, tick: int, now: Measurement, flags: int) -> None:
        try:
            request, program = self._commands.next(self.state, self._resting)
            if not request:
                return
            self._commands.answer(self._act(request, program, tick, now, flags))
        except StateError:
            self._commands.answer(Answer.REFUSED)

    def _act(self, request: Request, program: Program | None, tick: int, now: Measurement, flags: int) -> Answer:
        if request is Request.QUIT:
            self._quit = True
        elif request is Request.ARM:
            state = after(self.state, Event.ARM)
            if not self._hold_measured(now, flags):
                return Answer.NOT_READY
            self.ring.not_safe()
            self.state = state
        elif request is Request.START and program is not None:
            self.state = after(self.state, Event.START)
            self._program, self._started_tick, self._from = program, tick, self._command
            self._way_out_tick = None
            self._zero = RestAngle()
        elif request is Request.DISARM:
            self.state = after(self.state, Event.DISARM)
            self._safe_pending = True
        elif request is Request.RESET:
            state = after(self.state, Event.RESET)
            if self._device_gone:
                return Answer.GONE
            if self._safe_pending or self._fault_due or flags & (SUSPECT | BROKEN_WIRE | READ_ERROR):
                return Answer.NOT_READY
            self.state, self.fault = state, Fault.NONE
            self._forgive()
        return Answer.DONE

    def _hold_measured(self, now: Measurement, flags: int) -> bool:
        """Take the measured pressures as set-points, so that arming moves nothing; without monitors those that were
        written last, the safe ones or on the way there."""
        if (
            flags & (SUSPECT | READ_ERROR | BROKEN_WIRE)
            or max(now.p1_age_ns, now.p2_age_ns) > self._limits.max_age_s * 1e9
        ):
            return False
        low, high = self._limits.pressure_mpa
        found = now.p1_mpa, now.p2_mpa
        written = self._command if self.state is _DONE else (self._settings.safe_p1_mpa, self._settings.safe_p2_mpa)
        p1_cmd_mpa, p2_cmd_mpa = (
            min(max(p, low), high) if math.isfinite(p) else w for p, w in zip(found, written, strict=True)
        )
        self._command = p1_cmd_mpa, p2_cmd_mpa
        self._guard.start_from(p1_cmd_mpa, p2_cmd_mpa)
        self._resting = False
        return True

    def _next_set_points(self, tick: int, now: Measurement, flags: int) -> tuple[Phase, float, float]:
        """Phase and wanted set-points of this tick."""
        self._reference_deg = NAN
        if self.state is _RUNNING and self._program is not None:
            return self._follow(self._program, tick, now, flags)
        if self.state is _DONE:
            return _NO_PHASE, *self._towards_safe()
        return _NO_PHASE, *self._command

    def _follow(self, program: Program, tick: int, now: Measurement, flags: int) -> tuple[Phase, float, float]:
        index = tick - self._started_tick
        if self._commands.stop_wanted() and self._way_out_tick is None:
            self._way_out_tick, self._from = tick, self._command
        if self._way_out_tick is not None:
            left = program.ramp_out_ticks - (tick - self._way_out_tick)
            if left <= 0:
                return self._finish()
            return program.way_out(left, self._from)
        if index >= program.ticks:
            return self._finish()
        angle_deg = now.angle_deg - self._zero.deg
        phase, p1_cmd_mpa, p2_cmd_mpa = program.at(index, self._from, angle_deg, flags, self._command)
        if program.fault:
            self._latch(program.fault)
        self._reference_deg = program.wanted_deg(index)
        self._zero.take(phase, now, flags)
        return phase, p1_cmd_mpa, p2_cmd_mpa

    def _finish(self) -> tuple[Phase, float, float]:
        self.state = after(self.state, Event.FINISH)
        self._program = None
        return _NO_PHASE, *self._towards_safe()

    def _towards_safe(self) -> tuple[float, float]:
        settings, (p1_cmd_mpa, p2_cmd_mpa) = self._settings, self._command
        step = settings.return_mpa_s * self._period_ns / 1e9
        left1, left2 = settings.safe_p1_mpa - p1_cmd_mpa, settings.safe_p2_mpa - p2_cmd_mpa
        self._resting = abs(left1) <= step and abs(left2) <= step
        if self._resting:
            return settings.safe_p1_mpa, settings.safe_p2_mpa
        return p1_cmd_mpa + min(max(left1, -step), step), p2_cmd_mpa + min(max(left2, -step), step)

    def _write(self, p1_cmd_mpa: float, p2_cmd_mpa: float, periods: int) -> int:
        """Write what the state allows, but for the safe state; returns flags."""
        if self.state in _SILENT:
            if self._read_backs_left:
                self._read_back()
            return 0
        p1_cmd_mpa, p2_cmd_mpa, flags = self._guard.command(p1_cmd_mpa, p2_cmd_mpa, periods)
        self._command = p1_cmd_mpa, p2_cmd_mpa
        try:
            self._device.write(p1_cmd_mpa, p2_cmd_mpa)
        except DeviceError as error:
            self._count_error(error)
            return flags | WRITE_ERROR
        return flags

    def _write_safe(self) -> int:
        self._resting = True
        try:
            self._device.safe()
        except DeviceError as error:  # tried again next tick
            self._safe_under_way = isinstance(error, DevicePending)
            self.ring.safe_coming(self._safe_under_way)
            if self._seen_safe:
                self._doubt_safe()
            return 0 if self._safe_under_way else WRITE_ERROR
        self._safe_pending = self._safe_under_way = False
        self._command = self._settings.safe_p1_mpa, self._settings.safe_p2_mpa
        self.ring.made_safe()
        self._seen_safe = False
        self._read_backs_left = READ_BACKS
        self._read_back()
        return 0

    def _read_back(self) -> None:
        """Read the safe state back where the device can; it is written again when something else stands there."""
        self._read_backs_left -= 1
        try:
            held = self._abilities.holds_safe()
        except DeviceError:
            return  # asked again next tick
        self._read_backs_left = 0
        self._seen_safe = bool(held)
        if held:
            self.ring.saw_safe()
        elif held is False:
            self._safe_pending = True
            self.ring.not_safe()

    def _doubt_safe(self) -> None:
        """The device may have left the safe state that it took, by a watchdog of its own: it is written again."""
        self._safe_pending, self._seen_safe = True, False
        self.ring.doubt_safe()

    def _still_holds_safe(self) -> bool:
        """Whether a device that is lost still says that the safe state stands at its outputs."""
        with contextlib.suppress(DeviceError):
            return self._abilities.holds_safe() is True
        return False

    def leave(self) -> None:
        """Safe state, then let go; an unreachable device is left to its own watchdog and to the supervisor."""
        self._safe_pending = True
        try:
            leave_safe(self._try_once_more, self.ring.beat, self._clock, self._period_ns)
        finally:
            self._device.close()

    def _try_once_more(self) -> bool | None:
        """Whether the device has taken the safe state; None: it is on its way."""
        self._write_safe()
        return None if self._safe_pending and self._safe_under_way else not self._safe_pending

"""A loop whose device, clock and operator do what a script says: one test, one history, no waiting.

The device follows its set-points at once and its sensors answer to them, unless the script of the test spoils a
reading. Nothing here imports a driver or a simulated rig.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from rig.errors import DeviceError
from rig.interfaces import Measurement, Role
from rig.realtime.commands import Answer, Request
from rig.realtime.faults import Fault
from rig.realtime.loop import Loop, LoopSettings
from rig.realtime.program import Program
from rig.realtime.state import State
from rig.sample import Sample

PERIOD_NS = 5_000_000
OFFSET_DEG = 3.0
"""Sensor angle of the scripted rig when both pressures are equal."""
DEG_PER_MPA = 100.0

Spoil = Callable[[Measurement], Measurement]


class ScriptedClock:
    """Virtual time that wakes late where the script says so: number of the wait -> nanoseconds."""

    def __init__(self, late_ns: Mapping[int, int] | None = None) -> None:
        self._late_ns = dict(late_ns or {})
        self._now_ns = 1_000_000_000
        self._waits = 0

    def now_ns(self) -> int:
        return self._now_ns

    def let_pass(self, ns: int) -> None:
        self._now_ns += ns

    def wait_until_ns(self, deadline_ns: int) -> None:
        self._now_ns = max(self._now_ns, deadline_ns) + self._late_ns.get(self._waits, 0)
        self._waits += 1


@dataclass
class ScriptedDevice:
    """Answers to its set-points at once; `reads`, `writes` and `safes` say by number of the call what goes wrong
    instead."""

    reads: dict[int, Spoil | Exception] = field(default_factory=dict)
    writes: dict[int, Exception] = field(default_factory=dict)
    safes: dict[int, Exception] = field(default_factory=dict)
    found_mpa: tuple[float, float] = (0.1, 0.15)
    """The pressures before the first write."""
    safe_mpa: tuple[float, float] = (0.2, 0.2)
    roles: frozenset[Role] = frozenset(Role)
    outputs: list[tuple[float, float] | str] = field(default_factory=list)
    """Everything that reached the outputs, in order; 'safe' for the safe state."""
    closed: int = 0
    calls: dict[str, int] = field(default_factory=lambda: {"read": 0, "write": 0, "safe": 0})

    def __post_init__(self) -> None:
        self._pressures = self.found_mpa

    def open(self) -> Mapping[str, str]:
        return {"device": "scripted"}

    def read(self) -> Measurement:
        number = self._count("read")
        p1, p2 = self._pressures
        angle_deg = OFFSET_DEG + DEG_PER_MPA * (p1 - p2)
        alive = 1e-4 * (number % 2)  # a sensor that works never repeats itself
        measured = Measurement(p1, p2, angle_deg, p1 + alive, p2 + alive, angle_deg + alive, 5.0)
        spoil = self.reads.get(number)
        if isinstance(spoil, Exception):
            raise spoil
        return spoil(measured) if spoil else measured

    def write(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        self._fail(self.writes, "write")
        self._pressures = p1_cmd_mpa, p2_cmd_mpa
        self.outputs.append((p1_cmd_mpa, p2_cmd_mpa))

    def safe(self) -> None:
        self._fail(self.safes, "safe")
        self._pressures = self.safe_mpa
        self.outputs.append("safe")

    def close(self) -> None:
        self.closed += 1

    def _count(self, what: str) -> int:
        self.calls[what] += 1
        return self.calls[what] - 1

    def _fail(self, script: Mapping[int, Exception], what: str) -> None:
        if error := script.get(self._count(what)):
            raise error


@dataclass
class ScriptedOperator:
    """Requests by number of the tick; everything is answered in `answers`."""

    requests: dict[int, Request | Program]
    stop_at: int | None = None
    estop: range = range(0)
    """Ticks for which the emergency stop is held."""
    lost_at: int | None = None
    answers: list[tuple[int, Answer]] = field(default_factory=list)
    states: list[State] = field(default_factory=list)

    @property
    def _tick(self) -> int:
        return len(self.states)

    def next(self, state: State, resting: bool) -> tuple[Request, Program | None]:
        wanted = self.requests.get(self._tick, Request.NONE)
        self.states.append(state)
        return (Request.START, wanted) if isinstance(wanted, Program) else (wanted, None)

    def answer(self, answer: Answer) -> None:
        self.answers.append((self._tick - 1, answer))

    def stop_wanted(self) -> bool:
        return self.stop_at is not None and self._tick > self.stop_at

    def estop_wanted(self) -> Fault:
        return Fault.ESTOP if self._tick in self.estop else Fault.NONE

    def control_lost(self) -> bool:
        return self.lost_at is not None and self._tick >= self.lost_at


class ListRing:
    """Keeps what the loop publishes."""

    def __init__(self) -> None:
        self.samples: list[Sample] = []
        self.beats = 0
        self.device_messages: list[str] = []
        self.safe: list[str] = []
        self.now_ns: Callable[[], int] = int
        self.beaten_ns = self.ahead_ns = 0
        """When it beat last, by `now_ns`, and how long it told to be away at most from then on."""

    def made_safe(self) -> None:
        self.safe.append("made")

    def safe_coming(self, comes: bool) -> None:
        self.safe.append("coming" if comes else "failed")

    def saw_safe(self) -> None:
        self.safe.append("seen")

    def not_safe(self) -> None:
        self.safe.append("not")

    def doubt_safe(self) -> None:
        self.safe.append("doubted")

    def beat(self, ahead_ns: int = 0) -> None:
        self.beats += 1
        self.beaten_ns, self.ahead_ns = self.now_ns(), ahead_ns

    def put_device_message(self, text: str) -> None:
        self.device_messages.append(text)

    def put(self, sample: Sample) -> None:
        self.samples.append(sample)


def program(
    run: int = 1, *, sweep: int = 20, part: int = 4, p0_mpa: float = 0.2, amplitude_mpa: float = 0.02
) -> Program:
    """A triangle of `sweep` ticks between settle, zero, ramp in and ramp out of `part` ticks each."""
    dp = [amplitude_mpa * (1 - abs(4 * ((k / sweep + 0.25) % 1) - 2)) for k in range(sweep)]
    return Program(
        run, p0_mpa, p0_mpa, [p0_mpa + d / 2 for d in dp], [p0_mpa - d / 2 for d in dp], part, part, part, part
    )


def run_loop(
    device: ScriptedDevice,
    operator: ScriptedOperator,
    ticks: int,
    clock: ScriptedClock | None = None,
    settings: LoopSettings | None = None,
) -> tuple[list[Sample], Loop]:
    """Carry out `ticks` ticks and quit; returns what was published and the loop."""
    ring = ListRing()
    operator.requests.setdefault(ticks - 1, Request.QUIT)
    loop = Loop(device, clock or ScriptedClock(), ring, operator, settings or LoopSettings())  # type: ignore[arg-type]
    loop.run()
    return ring.samples, loop


def armed_and_running(extra: Mapping[int, Request | Program] | None = None, **more: object) -> ScriptedOperator:
    """ARM in tick 1, START of `program()` in tick 2, and what the test adds."""
    return ScriptedOperator({1: Request.ARM, 2: program(), **(extra or {})}, **more)  # type: ignore[arg-type]


def failing(first: int, count: int) -> dict[int, Exception]:
    """`count` transient errors from call number `first` on."""
    return {number: DeviceError("scripted: time-out") for number in range(first, first + count)}

"""The devices that must keep the contract of rig.interfaces.Device, each with hardware (or a stand-in) that the tests
can reach.

A factory makes a `Bench`: the device, its clock, what its regulators have been told, and a plug to pull. Devices behind
ports and sockets are in factories_fieldbus.py, in a table FIELDBUS of the same form as FACTORIES.
"""

import runpy
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from drivers.mixed import MixedRig
from drivers.myrio.device import MyRio
from drivers.myrio.settings import AngleInput, MyRioSettings, PressureLine
from drivers.signals import SignalRange
from hil.bench import SimulatedRig, SimulatedSettings
from hil.emulators.nifpga.bitfile import personality
from hil.emulators.nifpga.board import BoardWiring, Line
from hil.emulators.nifpga.shared import EVERY_CALL
from hil.emulators.nifpga.stand_in import StandIn
from hil.emulators.world import Outputs, World
from hil.faults import FaultyRig, FaultySettings, Injection
from hil.physics import PhysicsRig, PhysicsSettings
from hil.terminals import Terminals
from rig.app.stand_ins.playback import PlaybackRig, PlaybackSettings
from rig.interfaces import Clock, Device, DeviceContext, Role
from rig.realtime.clock import VirtualClock

MODEL = Path(__file__).resolve().parents[3] / "configs/models/simulated.yaml"
EXAMPLE = Path(__file__).resolve().parents[3] / "docs/examples/pamrig_example/pamrig_example/spring_rig.py"
SAFE = (0.21, 0.19)
LEFT_AT = (0.12, 0.34)
"""Where the regulators stand before anybody opens the device; unlike the safe pressures, so that a change shows."""
LOST = -63195  # nifpga: InvalidSession


class Lag:
    """A plant quick to reckon: pressures follow at once, the angle by their difference."""

    def step(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> tuple[float, float, float]:
        return p1_cmd_mpa, p2_cmd_mpa, 150.0 * (p1_cmd_mpa - p2_cmd_mpa)


@dataclass
class Bench:
    """One device under test."""

    context: DeviceContext
    make: Callable[[DeviceContext], Device]
    """A closed device on this hardware; a second one is another way to the same outputs."""
    commands: Callable[[], tuple[float, float]]
    """What the regulators follow now, MPa, found at the wires."""
    pull: Callable[[], None] | None = None
    """Pull the plug: from now on nothing is reached."""
    plug: Callable[[], None] | None = None
    step_mpa: float = 0.5 / 4096
    """Resolution of a set-point on the wire."""
    follows: bool = True
    """The pressures follow the set-points; a recording does not."""

    @property
    def clock(self) -> Clock:
        return self.context.clock

    def device(self) -> Device:
        return self.make(self.context)

    def soon(self, so: Callable[[], bool], seconds: float = 3.0) -> bool:
        """Whether `so` comes true while time passes; a device with a wire of its own needs some."""
        for _ in range(round(seconds / 0.005)):
            if so():
                return True
            self.clock.wait_until_ns(self.clock.now_ns() + 5_000_000)
            if not isinstance(self.clock, VirtualClock):
                time.sleep(0)
        return so()


def _context(clock: Clock, roles: frozenset[Role] = frozenset(Role)) -> DeviceContext:
    return DeviceContext(clock, roles, *SAFE)


@contextmanager
def simulated(folder: Path) -> Iterator[Bench]:
    """The in-process simulated rig: there is no plug to pull."""
    context = _context(VirtualClock())
    made: list[SimulatedRig] = []

    def make(asked: DeviceContext) -> SimulatedRig:
        made.append(SimulatedRig(SimulatedSettings(MODEL), asked))
        return made[-1]

    yield Bench(context, make, lambda: made[-1].setpoints_mpa, step_mpa=0.0)


@contextmanager
def physics(folder: Path) -> Iterator[Bench]:
    """A unit of a plant family, in the test's own process."""
    made: list[PhysicsRig] = []

    def make(asked: DeviceContext) -> PhysicsRig:
        made.append(PhysicsRig(PhysicsSettings(), asked))
        return made[-1]

    yield Bench(_context(VirtualClock()), make, lambda: made[-1].setpoints_mpa, step_mpa=0.0)


@contextmanager
def playback(folder: Path) -> Iterator[Bench]:
    """A record that is played, whatever is commanded."""
    rows = (f"{0.005 * k},{0.001 * k},{0.2 + 0.0005 * k},{0.2 - 0.0005 * k},{0.1 * k}" for k in range(4000))
    log = folder / "record.csv"
    log.write_text("t_s,dp_cmd_mpa,p1_mpa,p2_mpa,angle_deg\n" + "\n".join(rows) + "\n")
    made: list[PlaybackRig] = []

    def make(asked: DeviceContext) -> PlaybackRig:
        made.append(PlaybackRig(PlaybackSettings(log), asked))
        return made[-1]

    yield Bench(_context(VirtualClock()), make, lambda: made[-1].setpoints_mpa, step_mpa=0.0, follows=False)


@contextmanager
def simulated_faulty(folder: Path) -> Iterator[Bench]:
    """The simulated rig with terminals outside of its process, and a plug."""
    terminals = Terminals.at(folder / "terminals")
    terminals.write(*LEFT_AT)
    settings = FaultySettings(MODEL, terminals=folder / "terminals")
    yield Bench(
        _context(VirtualClock()),
        lambda asked: FaultyRig(settings, asked),
        lambda: terminals.setpoints,
        pull=lambda: terminals.inject(Injection.LOST),
        plug=lambda: terminals.inject(Injection.NONE),
        step_mpa=0.0,
    )


@contextmanager
def example(folder: Path) -> Iterator[Bench]:
    """The device of the example package, which others copy."""
    names = runpy.run_path(str(EXAMPLE))
    made: list[Device] = []

    def make(asked: DeviceContext) -> Device:
        made.append(names["SpringRig"](names["SpringSettings"](), asked))
        return made[-1]

    yield Bench(_context(VirtualClock()), make, lambda: made[-1].setpoints_mpa, step_mpa=0.0)


@contextmanager
def myrio(folder: Path) -> Iterator[Bench]:
    """The paper's wiring on connector A, through the real nifpga package."""
    world = World(Lag(), VirtualClock(), commands=LEFT_AT)
    stand_in = StandIn(world, folder, "RIO0", BoardWiring(), personality())
    settings = MyRioSettings(Path(stand_in.settings["bitfile"]))
    yield _myrio_bench(stand_in, settings, world)
    stand_in.close()


@contextmanager
def myrio_connector_c(folder: Path) -> Iterator[Bench]:
    """Signed counts: a 0-10 V valve and a 4-20 mA one on connector C, fixed reference for the potentiometer."""
    world = World(Lag(), VirtualClock(), commands=LEFT_AT)
    wiring = BoardWiring(
        valves=(Line("AO.C_0.VAL", 0.0, 10.0, 0.0, 0.9), Line("AO.C_1.VAL", 1.0, 5.0)),
        monitors=(Line("AI.C_0.VAL", 1.0, 5.0), Line("AI.C_1.VAL", 1.0, 5.0)),
        wiper="AI.A_2.VAL", excitation="", excitation_v=5.0,
    )  # fmt: skip
    stand_in = StandIn(world, folder, "RIO0", wiring, personality("I16"))
    settings = MyRioSettings(
        Path(stand_in.settings["bitfile"]),
        valve_1=PressureLine("AO.C_0.VAL", SignalRange.V_0_10, 0.0, 0.9),
        valve_2=PressureLine("AO.C_1.VAL", SignalRange.MA_4_20, units_per_volt=4.0),
        monitor_1=PressureLine("AI.C_0.VAL", SignalRange.V_1_5),
        monitor_2=PressureLine("AI.C_1.VAL", SignalRange.MA_4_20, units_per_volt=4.0),
        angle=AngleInput("AI.A_2.VAL", reference_v=5.0),
    )
    yield replace(_myrio_bench(stand_in, settings, world), step_mpa=0.9 / 2048)
    stand_in.close()


def _myrio_bench(stand_in: StandIn, settings: MyRioSettings, world: World) -> Bench:
    return Bench(
        _context(world.clock),
        lambda context: MyRio(settings, context),
        stand_in.board.commands_mpa,
        pull=lambda: stand_in.registers.fail(LOST, EVERY_CALL),
        plug=stand_in.registers.heal,
    )


@contextmanager
def mixed(folder: Path) -> Iterator[Bench]:
    """Two myRIOs, one a valve each; the first reads both monitors, the second the angle."""
    clock = VirtualClock()
    world = World(Lag(), clock, commands=LEFT_AT)
    first_world, second_world = _Half(world, 1), _Half(world, 2)
    stand_ins = [
        StandIn(half, folder, f"RIO{n}", BoardWiring(), personality())
        for n, half in enumerate((first_world, second_world))
    ]
    settings = [MyRioSettings(Path(s.settings["bitfile"]), resource=f"RIO{n}") for n, s in enumerate(stand_ins)]
    shares = (
        frozenset({Role.VALVE_1, Role.MONITOR_1, Role.MONITOR_2}),
        frozenset({Role.VALVE_2, Role.ANGLE}),
    )

    def make(context: DeviceContext) -> MixedRig:
        parts = [
            MyRio(s, replace(context, roles=share & context.roles)) for s, share in zip(settings, shares, strict=True)
        ]
        return MixedRig(parts, clock, context.period_ns)

    def commands() -> tuple[float, float]:
        for stand_in in stand_ins:
            stand_in.board.poll()
        return world.commands

    yield Bench(
        _context(clock), make, commands,
        pull=lambda: [s.registers.fail(LOST, EVERY_CALL) for s in stand_ins] and None,
        plug=lambda: [s.registers.heal() for s in stand_ins] and None,
    )  # fmt: skip
    for stand_in in stand_ins:
        stand_in.close()


class _Half(World):
    """A world of which one emulator reaches one valve only; the other wire is not connected to it."""

    def __init__(self, whole: World, valve: int) -> None:
        self._whole, self._valve = whole, valve

    @property
    def clock(self) -> Clock:
        return self._whole.clock

    @property
    def commands(self) -> tuple[float, float]:
        return self._whole.commands

    def command(self, valve: int, pressure_mpa: float) -> None:
        if valve == self._valve:
            self._whole.command(valve, pressure_mpa)

    def outputs(self) -> Outputs:
        return self._whole.outputs()


FACTORIES: dict[str, Callable[[Path], AbstractContextManager[Bench]]] = {
    "simulated": simulated,
    "physics": physics,
    "playback": playback,
    "simulated_faulty": simulated_faulty,
    "example": example,
    "myrio": myrio,
    "myrio_connector_c": myrio_connector_c,
    "mixed": mixed,
}
WITHOUT_PLUG = {"example", "simulated", "physics", "playback"}
"""There is nothing to pull: they live in the test's own process."""

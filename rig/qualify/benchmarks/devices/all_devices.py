"""`pamrig bench devices`: one tick's I/O of each device on its emulator, beside the bare calls of the vendor's package.

The myRIO's part and the stand-ins are here; serial valves and Modbus modules are in fieldbus.py.
"""

import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any, Final

from drivers.mixed import MixedRig
from drivers.myrio.device import MyRio
from drivers.myrio.settings import MyRioSettings
from hil.emulators.nifpga.bitfile import personality
from hil.emulators.nifpga.board import BoardWiring
from hil.emulators.nifpga.stand_in import StandIn
from hil.emulators.world import World
from rig.app import compose, shipped
from rig.interfaces import Device, DeviceContext, Role
from rig.model.chain import Chain
from rig.model.parameters import load_model
from rig.qualify.benchmarks import figure
from rig.qualify.benchmarks.devices.fieldbus import bench_fieldbus
from rig.qualify.benchmarks.devices.fieldbus_rig import quantiles_us, tick
from rig.qualify.benchmarks.devices.tick import bench_tick
from rig.realtime.clock import MonotonicClock

ALL_DEVICES_TICKS: Final = 20_000
"""Of driver and peer each; a quarter of them where a plant is stepped as well."""
ROUND: Final = 100
"""Driver and peer take turns in rounds of so many ticks, so that a drift of the machine meets both."""
_OURS: Final = "the simulated rig has no peer: it is this project's own model"
PAPER_READS: Final = ("AI.A_0.VAL", "AI.A_1.VAL", "AI.A_2.VAL", "AI.A_3.VAL")
PAPER_WRITES: Final = ("AO.A_0.VAL", "AO.A_1.VAL")


def bench_devices() -> dict[str, Any]:
    """Every device; see the figures' names for what is measured."""
    with TemporaryDirectory(prefix="pamrig-bench-") as folder:
        figures = _myrio(Path(folder))
    return figures | _simulated() | bench_fieldbus()


def _myrio(folder: Path) -> dict[str, Any]:
    clock = MonotonicClock()
    world = World(_plant(), clock, commands=(0.2, 0.2))
    stand_in = StandIn(world, folder, "RIO0", BoardWiring(), personality())
    settings = MyRioSettings(Path(stand_in.settings["bitfile"]))
    context = DeviceContext(clock, frozenset(Role), 0.2, 0.2, period_ns=1_000_000_000)
    device = MyRio(settings, context)
    device.open()
    with_plant = quantiles_us(_ticks(device, ALL_DEVICES_TICKS // 4))
    stand_in.close()  # registers stand still from here on: only driver and package are left to be timed
    ours, bare = _in_turns(lambda: tick(device), _bare_tick(settings))
    figures = {
        f"myRIO tick, {key}": figure(ours[key], "us", "the same calls of bare nifpga", bare[key])
        for key in ("p50", "p99")
    } | {
        f"myRIO tick with the plant behind its registers, {key}": figure(
            with_plant[key], "us", "still registers", ours[key]
        )
        for key in ("p50", "p99")
    }
    figures |= _safe_paths(settings, context, ours["p99"])
    figures |= _mixed(settings, context)
    device.close()
    figures |= bench_tick(settings, context, _bare_tick(settings))
    return figures


def _bare_tick(settings: MyRioSettings) -> Callable[[], None]:
    """Seven calls: four inputs, two outputs, the strobe."""
    import nifpga

    registers = nifpga.Session(str(settings.bitfile), settings.resource).registers
    m1, m2, wiper, excitation = (registers[name].read for name in PAPER_READS)
    v1, v2 = (registers[name].write for name in PAPER_WRITES)
    strobe = registers["AO.SYS.GO"].write

    def tick() -> None:
        m1()
        m2()
        wiper()
        excitation()
        v1(1638)
        v2(1638)
        strobe(True)

    return tick


def _safe_paths(settings: MyRioSettings, context: DeviceContext, tick_p99_us: float) -> dict[str, Any]:
    """The supervisor's second session: kept open, or opened when it is needed."""
    other = MyRio(settings, context)
    other.open()
    kept = quantiles_us([_timed(other.safe) for _ in range(500)])
    other.close()
    fresh = quantiles_us([_timed(other.safe) for _ in range(10)])
    return {
        "myRIO safe() through a session kept open, p99": figure(kept["p99"], "us", "a tick", tick_p99_us),
        "myRIO safe() through a session opened for it, p50": figure(
            fresh["p50"] / 1e3, "ms", "kept open", kept["p50"] / 1e3
        ),
    }


def _mixed(settings: MyRioSettings, context: DeviceContext) -> dict[str, Any]:
    """Two devices that share the roles, against one with all of them."""
    shares = (frozenset({Role.VALVE_1, Role.MONITOR_1, Role.MONITOR_2}), frozenset({Role.VALVE_2, Role.ANGLE}))
    parts = [MyRio(settings, DeviceContext(context.clock, share, 0.2, 0.2, context.period_ns)) for share in shares]
    mixed, single = MixedRig(parts, context.clock, context.period_ns), MyRio(settings, context)
    mixed.open()
    single.open()
    ours, one = _in_turns(lambda: tick(mixed), lambda: tick(single))
    mixed.close()
    single.close()
    return {
        f"mixed rig of two myRIO sessions, tick {key}": figure(ours[key], "us", "one session", one[key])
        for key in ("p50", "p99")
    }


def _simulated() -> dict[str, Any]:
    device = compose.make_device(compose.load(None), MonotonicClock())
    device.open()
    found = quantiles_us(_ticks(device, ALL_DEVICES_TICKS // 4))
    device.close()
    return {f"simulated rig in the process, tick {key}": figure(found[key], "us", why=_OURS) for key in ("p50", "p99")}


def _plant() -> Chain:
    chain = Chain(load_model(shipped.configs() / "models" / "simulated.yaml"))
    chain.reset(0.2, 0.2)
    return chain


def _ticks(device: Device, count: int) -> list[int]:
    return [_timed(lambda: tick(device)) for _ in range(count)]


def _timed(call: Callable[[], object]) -> int:
    began = time.perf_counter_ns()
    call()
    return time.perf_counter_ns() - began


def _in_turns(ours: Callable[[], None], peer: Callable[[], None]) -> tuple[dict[str, float], dict[str, float]]:
    """The median over the rounds of each round's quantiles: a pause of the machine meets one round, not the figure."""
    rounds: tuple[list[dict[str, float]], list[dict[str, float]]] = ([], [])
    for _ in range(ALL_DEVICES_TICKS // ROUND):
        for call, found in zip((ours, peer), rounds, strict=True):
            found.append(quantiles_us([_timed(call) for _ in range(ROUND)]))
    first, second = ({key: median(one[key] for one in found) for key in ("p50", "p99")} for found in rounds)
    return first, second

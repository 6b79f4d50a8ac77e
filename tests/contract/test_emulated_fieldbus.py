"""The Modbus rig and the serial rig end to end against the in-process simulated rig: the same but for the converters' counts."""

import math
import time
from pathlib import Path

import numpy as np
from test_emulated_rigs import CONFIGS, EXACT, run

from hil.emulators.world import World
from rig.cli.emulated import EmulatedRig, EmulatedSettings
from rig.errors import DeviceError
from rig.interfaces import DeviceContext, Role
from rig.log.reader import read
from rig.model.chain import Chain
from rig.model.parameters import load_model
from rig.realtime.clock import MonotonicClock, VirtualClock

MODEL = CONFIGS / "models/simulated.yaml"
WAGO_V = 10.0 / 32760
E1240_V = 10.0 / 65534
PERIOD_NS = 5_000_000
DEG_PER_MPA = 400.0
"""More than the simulated joint turns for a megapascal of difference."""


def test_the_modbus_rig_agrees_within_its_counts(tmp_path: Path) -> None:
    """Virtual clock: real pymodbus on a real socket, yet the same run every time."""
    rig = tmp_path / "exact.yaml"
    rig.write_text(EXACT.format(model=MODEL))
    (theirs,) = read(run(rig, tmp_path / "exact"))
    (ours,) = read(run(CONFIGS / "rigs/emulated_all_modbus.yaml", tmp_path / "modbus"))
    assert len(ours.t_s) == len(theirs.t_s) > 1000
    apart = np.abs(np.asarray(ours.angle_deg) - np.asarray(theirs.angle_deg))
    assert apart.max() <= 1.5 * 345.0 * WAGO_V / 5.0 + DEG_PER_MPA * 0.5 / 32767
    assert apart.max() > 0.0, "no converter in between?"
    for name in ("p1_mpa", "p2_mpa"):
        found = np.abs(np.asarray(getattr(ours, name)) - np.asarray(getattr(theirs, name)))
        assert found.max() <= 0.5 * WAGO_V / 4.0 + 1.5 * 0.5 / 32767


class Told:
    """Keeps when which set-point reached a regulator, and passes it on."""

    def __init__(self, world: World) -> None:
        self._obey = world.command
        self.orders: list[tuple[int, int, float]] = []
        world.command = self  # type: ignore[method-assign]

    def __call__(self, valve: int, pressure_mpa: float) -> None:
        self.orders.append((time.monotonic_ns(), valve, pressure_mpa))
        self._obey(valve, pressure_mpa)


def test_the_serial_rig_agrees_within_its_counts_given_what_reached_the_valves() -> None:
    """In real time the wire decides when a set-point arrives. Given these moments, the angle is that of the in-process plant."""
    context = DeviceContext(MonotonicClock(), frozenset(Role), 0.2, 0.2, PERIOD_NS)
    rig = EmulatedRig(EmulatedSettings(CONFIGS / "rigs/serial_modbus.yaml", MODEL), context)
    seen: list[tuple[int, int, float]] = []
    try:
        rig.open()
        assert rig.world is not None
        told, first_ns = Told(rig.world), rig.world._next_ns
        due_ns = time.monotonic_ns()
        for tick in range(300):
            due_ns += PERIOD_NS
            time.sleep(max(0, due_ns - time.monotonic_ns()) / 1e9)
            half = 0.05 * math.sin(2 * math.pi * 0.5 * tick * 0.005)
            asked_ns = time.monotonic_ns()
            try:
                angle_deg = rig.read().angle_deg
                seen.append((asked_ns, time.monotonic_ns(), angle_deg))
                rig.write(0.2 + half, 0.2 - half)
            except DeviceError:
                continue
    finally:
        rig.safe()
        rig.shut_down()
    assert first_ns is not None
    assert len({order[2] for order in told.orders}) > 20
    before, after = (replayed(first_ns, told.orders, [sample[place] for sample in seen]) for place in (0, 1))
    apart = [min(abs(angle - b), abs(angle - a)) for (_, _, angle), b, a in zip(seen, before, after, strict=True)]
    assert len(seen) > 100
    assert max(angle for _, _, angle in seen) > 3.0, "the joint moved"
    count_deg = 345.0 * E1240_V / 5.0
    assert np.quantile(apart, 0.98) <= 0.5 * count_deg + 1e-4, (
        "the rest: a set-point arrived, or the plant stepped, between two glances at the clock"
    )


def replayed(first_ns: int, orders: list[tuple[int, int, float]], times_ns: list[int]) -> list[float]:
    """The angle at these moments of an in-process plant at rest at `first_ns`, whose regulators get these orders."""
    chain = Chain(load_model(MODEL))
    chain.reset(0.2, 0.2)
    clock = VirtualClock(first_ns)
    world = World(chain, clock, PERIOD_NS, (0.2, 0.2))
    world.outputs()
    waiting, angles = list(orders), []
    for at_ns in times_ns:
        while waiting and waiting[0][0] <= at_ns:
            ordered_ns, valve, pressure_mpa = waiting.pop(0)
            clock.wait_until_ns(ordered_ns)
            world.command(valve, pressure_mpa)
        clock.wait_until_ns(at_ns)
        angles.append(world.outputs().angle_deg)
    return angles

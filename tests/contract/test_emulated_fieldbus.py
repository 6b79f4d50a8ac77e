"""The Modbus rig and the serial rig end to end against the in-process simulated rig: the same but for the converters'
counts."""

import contextlib
import math
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import CONFIGS
from support.rigs import fieldbus_rigs as rigs
from support.rigs.exact_rig import EXACT, run

from drivers.modbus_io.device import ModbusIo
from drivers.modbus_io.settings import ExchangeMode, FurtherChannel
from hil.emulators.world import EmulatedPlant
from rig.app.stand_ins.emulated import EmulatedRig, EmulatedSettings
from rig.errors import DeviceError
from rig.interfaces import DeviceContext, Role
from rig.log.reader import read
from rig.model.chain import Chain
from rig.model.parameters import load_model
from rig.realtime.clock import MonotonicClock

pytestmark = pytest.mark.real_time

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


class Recorded:
    """A plant that keeps what it was told at every step, and what it answered."""

    def __init__(self, plant: EmulatedPlant) -> None:
        self._plant = plant
        self.commands: list[tuple[float, float]] = []
        self.angles_deg: list[float] = []

    def step(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> tuple[float, float, float]:
        outputs = self._plant.step(p1_cmd_mpa, p2_cmd_mpa)
        self.commands.append((p1_cmd_mpa, p2_cmd_mpa))
        self.angles_deg.append(outputs[2])
        return outputs


def test_the_serial_rig_agrees_within_its_counts_given_what_reached_the_valves() -> None:
    """In real time the wire decides at which step a set-point arrives. Given the steps, the angle is that of the
    in-process plant."""
    context = DeviceContext(MonotonicClock(), frozenset(Role), 0.2, 0.2, PERIOD_NS)
    rig = EmulatedRig(EmulatedSettings(CONFIGS / "rigs/serial_modbus.yaml", MODEL), context)
    seen: list[tuple[int, int, float]] = []
    try:
        rig.open()
        assert rig.world is not None
        plant = Recorded(rig.world.plant)
        rig.world.plant = plant
        due_ns = time.monotonic_ns()
        for tick in range(300):
            due_ns += PERIOD_NS
            time.sleep(max(0, due_ns - time.monotonic_ns()) / 1e9)
            half = 0.05 * math.sin(2 * math.pi * 0.5 * tick * 0.005)
            try:
                first = len(plant.angles_deg)
                angle_deg = rig.read().angle_deg
                seen.append((first, len(plant.angles_deg), angle_deg))
                rig.write(0.2 + half, 0.2 - half)
            except DeviceError:
                continue
    finally:
        with contextlib.suppress(DeviceError):
            rig.safe()
        rig.shut_down()
    assert len(set(plant.commands)) > 20
    assert len(seen) > 100
    assert max(angle for _, _, angle in seen) > 3.0, "the joint moved"
    half_count_deg = 0.5 * 345.0 * E1240_V / 5.0
    for first, last, angle_deg in seen[1:]:
        possible = plant.angles_deg[max(0, first - 1) : last]
        assert min(abs(angle_deg - one) for one in possible) <= half_count_deg + 1e-4, (
            "an angle that no step in between had"
        )
    chain = Chain(load_model(MODEL))
    chain.reset(*plant.commands[0])
    again = [chain.step(*command)[2] for command in plant.commands]
    assert again == pytest.approx(plant.angles_deg, abs=1e-9)


def test_a_modbus_module_reads_a_further_channel_into_its_place(tmp_path: Path) -> None:
    table = rigs.MAPS / "wago_750.yaml"
    with rigs.served(table, tmp_path) as modules:
        settings = rigs.modbus_settings(
            modules.settings["port"],
            ExchangeMode.SEPARATE,
            map=table,
            further={"supply_mpa": FurtherChannel(3, 0.1, -0.05)},
        )
        device = ModbusIo(settings, replace(rigs.context(), further=("nobody", "supply_mpa")))
        device.open()
        try:
            now = device.read()
        finally:
            device.close()
        assert now.excitation_raw > 1.0
        assert now.further_2 == pytest.approx(0.1 * now.excitation_raw - 0.05)
        assert math.isnan(now.further_1)

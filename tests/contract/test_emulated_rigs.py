"""The paper's sweep through an emulated rig, end to end, against the in-process simulated rig: the same but for the
counts."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from conftest import CONFIGS
from support.rigs.exact_rig import EXACT, run

from rig.app.stand_ins.emulated import EmulatedRig, EmulatedSettings
from rig.errors import ConfigError, DeviceError
from rig.interfaces import DeviceContext, Measurement, Role
from rig.log.reader import read
from rig.realtime.clock import MonotonicClock, VirtualClock
from rig.sample import Flag

COUNT_DEG = 345.0 / 4096 * 5.0 / 4.95
COUNT_MPA = 0.5 / 4096 * 5.0 / 4.0  # 1-5 V of 0-5 V


@pytest.fixture(scope="module")
def exact(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("exact")
    rig = folder / "exact.yaml"
    rig.write_text(EXACT.format(model=CONFIGS / "models/simulated.yaml"))
    return run(rig, folder / "out")


def test_the_emulated_myrio_agrees_within_its_counts(exact: Path, tmp_path: Path) -> None:
    """Half a count for the sample, half for the zero at P0, and what half a count of each set-point turns the joint."""
    (ours,) = read(run(CONFIGS / "rigs/emulated_myrio.yaml", tmp_path / "out"))
    (theirs,) = read(exact)
    assert len(ours.t_s) == len(theirs.t_s) > 1000
    apart = np.abs(np.asarray(ours.angle_deg) - np.asarray(theirs.angle_deg))
    assert apart.max() <= 1.5 * COUNT_DEG
    assert apart.max() > 0.0, "no converter in between?"
    for name in ("p1_mpa", "p2_mpa"):
        assert np.abs(np.asarray(getattr(ours, name)) - np.asarray(getattr(theirs, name))).max() <= 1.5 * COUNT_MPA


MIXED = """
name: valves of two makes on a myRIO, potentiometer on a Modbus module
safe: {{p1_mpa: 0.2, p2_mpa: 0.2}}
devices:
  myrio:
    kind: myrio
    bitfile: none.lvbitx
    valve_1: {{register: AO.C_0.VAL, signal: 0-10 V, high_mpa: 0.9}}
    valve_2: {{register: AO.A_1.VAL, signal: 4-20 mA, units_per_volt: 4.0}}
    monitor_1: {{register: AI.C_0.VAL, signal: 1-5 V, high_mpa: 0.9}}
    monitor_2: {{register: AI.A_1.VAL, signal: 4-20 mA, units_per_volt: 4.0}}
  potentiometer:
    kind: modbus_io
    map: {maps}/moxa_e1240.yaml
    host: 192.168.1.18
    angle: {{wiper: 0, excitation: 1}}
roles: {{valve_1: myrio, valve_2: myrio, monitor_1: myrio, monitor_2: myrio, angle: potentiometer}}
"""


@pytest.mark.real_time
def test_roles_on_different_devices_and_valves_of_different_makes(tmp_path: Path) -> None:
    """One plant behind a myRIO and a Modbus module: valve 1 is 0-10 V for 0.9 MPa, valve 2 4-20 mA for 0.5 MPa."""
    (tmp_path / "mixed.yaml").write_text(MIXED.format(maps=CONFIGS / "modbus"))
    clock = MonotonicClock()
    context = DeviceContext(clock, frozenset(Role), 0.2, 0.2)
    device = EmulatedRig(EmulatedSettings(tmp_path / "mixed.yaml", CONFIGS / "models/simulated.yaml"), context)
    device.open()
    found: list[Measurement] = []
    until_ns = clock.now_ns() + 20_000_000_000
    while clock.now_ns() < until_ns and not (
        found and abs(found[-1].p1_mpa - 0.25) < 0.002 and found[-1].angle_deg > 15.0
    ):
        clock.wait_until_ns(clock.now_ns() + 5_000_000)
        with suppress(DeviceError):  # a call that took longer than 5 ms on a busy machine
            found.append(device.read())
        with suppress(DeviceError):
            device.write(0.25, 0.15)
    now = found[-1]
    assert (now.p1_mpa, now.p2_mpa) == pytest.approx((0.25, 0.15), abs=0.003)
    assert 15.0 < now.angle_deg < 25.0
    assert not now.flags & (Flag.P1_ABSENT | Flag.P2_ABSENT | Flag.ANGLE_ABSENT | Flag.BROKEN_WIRE | Flag.SUSPECT)
    device.safe()
    assert device.world is not None
    assert device.world.commands == pytest.approx((0.2, 0.2), abs=0.9 / 2048)
    device.shut_down()


def test_the_calibration_of_the_real_parts_is_not_for_the_emulated_ones(tmp_path: Path) -> None:
    text = (CONFIGS / "rigs/paper_myrio.yaml").read_text()
    (tmp_path / "cal.yaml").write_text("monitor_1: {knots: [[1.0, 0.1], [5.0, 0.7]]}\n")
    (tmp_path / "rig.yaml").write_text(text + "calibration: cal.yaml\n")
    context = DeviceContext(VirtualClock(), frozenset(Role), 0.2, 0.2)
    device = EmulatedRig(EmulatedSettings(tmp_path / "rig.yaml", CONFIGS / "models/simulated.yaml"), context)
    device.open()
    assert device.read().p1_mpa == pytest.approx(0.2, abs=COUNT_MPA)
    device.shut_down()


def test_a_stand_in_is_not_emulated_again() -> None:
    context = DeviceContext(VirtualClock(), frozenset(Role))
    settings = EmulatedSettings(CONFIGS / "rigs/simulated.yaml", CONFIGS / "models/simulated.yaml")
    with pytest.raises(ConfigError, match="'simulated' is a stand-in already"):
        EmulatedRig(settings, context)


@pytest.mark.parametrize("name", ["serial_modbus"])
def test_what_sits_behind_a_port_is_refused_in_virtual_time(name: str) -> None:
    context = DeviceContext(VirtualClock(), frozenset(Role), 0.2, 0.2)
    settings = EmulatedSettings(CONFIGS / f"rigs/{name}.yaml", CONFIGS / "models/simulated.yaml")
    device = EmulatedRig(settings, context)
    with pytest.raises(ConfigError, match="only be emulated in real time; use --clock real"):
        device.open()
    assert not device.emulators

"""`pamrig devices`: what it lists, what the probe finds out about wiring, and guided calibration; bad input in one
line."""

import errno
import json
import os
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import yaml
from click.testing import CliRunner, Result

from drivers.calibration import Calibration, parse_all
from drivers.myrio.device import MyRio
from drivers.myrio.settings import MyRioSettings
from hil.emulators.nifpga.bitfile import personality
from hil.emulators.nifpga.board import BoardWiring
from hil.emulators.nifpga.shared import READ
from hil.emulators.nifpga.stand_in import StandIn
from hil.emulators.world import World
from rig.app import compose
from rig.app.devices import bringup, calibrating, probing
from rig.app.devices.bringup import DeviceTicker, StepResult, step_valves, time_reads
from rig.cli.devices import devices
from rig.errors import CheckFailed, DeviceError, DeviceLost, RigError
from rig.interfaces import DeviceContext, Role
from rig.realtime.clock import MonotonicClock
from rig.sample import Flag

pytestmark = pytest.mark.real_time

RIGS = Path(__file__).resolve().parents[3] / "configs/rigs"
EMULATED = str(RIGS / "emulated_myrio.yaml")
SAFE = (0.2, 0.2)


class Lag:
    def step(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> tuple[float, float, float]:
        return p1_cmd_mpa, p2_cmd_mpa, 150.0 * (p1_cmd_mpa - p2_cmd_mpa)


@dataclass
class Lab:
    stand_in: StandIn
    device: MyRio


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[Lab]:
    clock = MonotonicClock()
    stand_in = StandIn(World(Lag(), clock, commands=SAFE), tmp_path, "RIO0", BoardWiring(), personality())
    settings = MyRioSettings(Path(stand_in.settings["bitfile"]))
    # a period no pause of a busy test machine can exceed
    yield Lab(stand_in, MyRio(settings, DeviceContext(clock, frozenset(Role), *SAFE, period_ns=1_000_000_000)))
    stand_in.close()


def call(*arguments: str, typed: str = "") -> Result:
    return CliRunner().invoke(devices, list(arguments), input=typed)


def refusal(*arguments: str, typed: str = "") -> str:
    """The one line with which a call ends."""
    result = call(*arguments, typed=typed)
    assert isinstance(result.exception, RigError), result.output
    assert "\n" not in str(result.exception)
    return str(result.exception)


@pytest.fixture(autouse=True)
def _hurried(monkeypatch: pytest.MonkeyPatch) -> None:
    """The ticker lives in real time; these rigs need none of its caution."""
    monkeypatch.setattr(bringup, "SLEW_MPA_S", 5.0)
    monkeypatch.setattr(bringup, "LOOK_S", 0.05)
    monkeypatch.setattr(calibrating, "COLLECT_S", 0.05)


# list


def test_list_shows_every_setting_also_those_of_each_valve() -> None:
    shown = call("list", "--rig", str(RIGS / "serial_modbus.yaml")).output
    for setting in ("valve_1.device /dev/ttyUSB0", "valve_2.device /dev/ttyUSB1", "angle.wiper 0", "host 192.168.1.18"):
        assert setting in shown


def test_list_tells_devices_roles_and_missing_calibrations() -> None:
    result = call("list", "--rig", str(RIGS / "paper_myrio.yaml"), "--json", "-")
    found = json.loads(result.stdout)
    assert [d["kind"] for d in found["devices"]] == ["myrio"]
    assert found["devices"][0]["roles"] == ["valve_1", "valve_2", "monitor_1", "monitor_2", "angle"]
    (never,) = [line for line in found["warnings"] if "never calibrated" in line]
    assert never.startswith("angle, monitor_1, monitor_2, valve_1, valve_2: nominal values")
    assert [line for line in found["warnings"] if "myRIO-1900.lvbitx: no such file yet" in line]
    assert {"myrio", "itv_serial", "modbus_io", "simulated"} <= set(found["kinds"])


def test_list_warns_of_an_old_calibration(tmp_path: Path) -> None:
    rig = yaml.safe_load((RIGS / "paper_myrio.yaml").read_text())
    (tmp_path / "cal.yaml").write_text(
        "valve_1: {knots: [[0, 0], [0.5, 0.49]], raw_unit: MPa, taken: {date: '2020-02-02'}}\n"
    )
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(rig | {"calibration": "cal.yaml"}))
    found = json.loads(call("list", "--rig", str(tmp_path / "rig.yaml"), "--json", "-").stdout)
    assert found["calibration"]["valve_1"]["date"] == "2020-02-02"
    assert [line for line in found["warnings"] if line.startswith("valve_1: calibrated on 2020-02-02")]


def test_a_broken_calibration_is_one_line(tmp_path: Path) -> None:
    rig = yaml.safe_load((RIGS / "paper_myrio.yaml").read_text())
    (tmp_path / "cal.yaml").write_text("monitor_1: {knots: [[0, .nan], [0.5, 0.49]]}\n")
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(rig | {"calibration": "cal.yaml"}))
    assert "finite" in refusal("list", "--rig", str(tmp_path / "rig.yaml"))


# probe


def test_probe_of_an_emulated_rig_says_it_holds_the_period() -> None:
    result = call("probe", "--rig", EMULATED, "--ticks", "40", "--json", "-")
    found = json.loads(result.stdout)["devices"][0]
    assert found["answers"]
    assert found["facts"]["device"] == "myRIO RIO0"
    assert found["read_p50_us"] > 0
    assert found["last"]["p1_mpa"] == pytest.approx(0.2, abs=0.001)


def test_probe_of_absent_hardware_is_not_so() -> None:
    line = refusal("probe", "--rig", str(RIGS / "paper_myrio.yaml"))
    assert "bitfile" in line


def test_steps_are_told_a_line_a_valve() -> None:
    step = StepResult(2, 0.03, 0.0, 0.029, -5.6)
    assert probing.moved(probing.Probe("bench", 5_000_000, (), (), (), (step,))) == [
        "valve 2 stepped +0.03 MPa: p1 +0.000 MPa, p2 +0.029 MPa, angle -5.60 deg"
    ]


def test_probe_asks_before_it_steps() -> None:
    assert "nothing was moved" in refusal("probe", "--rig", EMULATED, "--step", typed="n\n")
    assert "nothing was moved" in refusal("probe", "--rig", EMULATED, "--step")


@pytest.mark.parametrize("allowed", [True, False])
def test_the_leash_asks_for_priority_for_its_thread_alone(
    lab: Lab, monkeypatch: pytest.MonkeyPatch, allowed: bool
) -> None:
    asked: list[tuple[str, int, int]] = []

    def ask(pid: int, policy: int, _parameters: object) -> None:
        asked.append((threading.current_thread().name, pid, policy))
        if not allowed:
            raise PermissionError

    monkeypatch.setattr(os, "sched_setscheduler", ask)
    with DeviceTicker(lab.device, 5_000_000, SAFE) as ticker:
        assert ticker.collect(0.05)
    assert asked == [("ticker", 0, os.SCHED_FIFO)]


@pytest.mark.parametrize(("step_mpa", "fits"), [("0.06", False), ("0.05", True)])
def test_a_step_stays_inside_the_rig_s_envelope(tmp_path: Path, step_mpa: str, fits: bool) -> None:
    """Nothing but this stands between a step and the valves: a rig with thin muscles was taken beyond its limit."""
    text = (RIGS / "simulated.yaml").read_text().replace("../models/simulated.yaml", "simulated")  # one of pamrig's own
    thin = yaml.safe_load(text) | {"limits": {"pressure_mpa": [0.0, 0.25]}}
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(thin))
    asked = ("probe", "--rig", str(tmp_path / "rig.yaml"), "--ticks", "20", "--step", "--step-mpa", step_mpa)
    line = refusal(*asked, typed="n\n")
    beyond = "reaches 0.26 MPa, above 0.25 MPa, the end of limits.pressure_mpa"
    assert ("nothing was moved" if fits else beyond) in line


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        ("none", ["", ""]),
        ("swapped", ["valve 1 moves monitor 2: the valves or their monitors are swapped"] * 1),
        ("cut", ["valve 1: its monitor gives no value"]),
    ],
)
def test_stepping_one_valve_shows_which_monitor_moves(lab: Lab, damage: str, says: list[str]) -> None:
    if damage == "swapped":
        lab.stand_in.board.swap_valves()
    with DeviceTicker(lab.device, 5_000_000, SAFE) as ticker:
        if damage == "cut":
            lab.stand_in.board.cut("monitor_1")
        results = step_valves(ticker, SAFE, 0.03, 0.05)
    assert [one.valve for one in results] == [1, 2]
    for line, one in zip(says, results, strict=False):
        assert one.finding().startswith(line)
        assert bool(one.finding()) == bool(line)
    assert lab.stand_in.board.commands_mpa() == pytest.approx(SAFE, abs=1e-3)


@pytest.mark.parametrize(
    ("moved", "says"),
    [
        ((0.0, 0.0), "is the air on"),
        ((-0.03, 0.0), "against the step"),
        ((0.03, 0.03), "moves both monitors"),
        ((0.03, 0.001), ""),
    ],
)
def test_findings_of_a_step(moved: tuple[float, float], says: str) -> None:
    finding = StepResult(1, 0.03, *moved, 1.0).finding()
    assert says in finding
    assert bool(finding) == bool(says)


def test_timing_counts_what_failed_and_what_was_seen(lab: Lab) -> None:
    lab.device.open()
    lab.stand_in.board.cut("wiper")
    lab.stand_in.registers.fail(-61046, READ, after=8, count=3)
    timing = time_reads(lab.device, 1_000_000, 40)
    assert (timing.ticks, timing.failed) == (40, 3)
    assert timing.flags[Flag.SUSPECT.name] == 37
    assert not timing.holds(5_000_000)
    lab.device.close()


def test_timing_of_a_device_that_never_answers_is_not_so(lab: Lab) -> None:
    lab.device.open()
    lab.stand_in.registers.fail(-61046, READ)
    with pytest.raises(CheckFailed, match="no answer in 25 ticks"):
        time_reads(lab.device, 1_000_000, 25)
    lab.device.close()


def test_the_leash_lets_go_safely_when_the_device_is_lost(lab: Lab) -> None:
    with pytest.raises(DeviceLost), DeviceTicker(lab.device, 5_000_000, SAFE) as ticker:  # noqa: PT012
        ticker.go_to(0.22, 0.18)
        lab.stand_in.registers.lose_sessions()
        ticker.wait(2.0)
    assert lab.stand_in.board.commands_mpa() == pytest.approx(SAFE, abs=1e-3)


def test_a_device_that_does_not_open_is_an_error_not_a_hang(lab: Lab) -> None:
    lab.stand_in.registers.fail(-63195)
    with pytest.raises(DeviceError), DeviceTicker(lab.device, 5_000_000, SAFE):
        pass


# calibrate


def test_points_from_a_file_are_fitted_and_merged(tmp_path: Path) -> None:
    points, out = tmp_path / "points.yaml", tmp_path / "cal.yaml"
    points.write_text(
        "monitor_1: {raw_unit: V, serial_numbers: {gauge: G7}, points: [[1.0, 0.0], [3.0, 0.251], [5.0, 0.5]]}\n"
    )
    found = json.loads(call("calibrate", "--points", str(points), "-o", str(out), "--json", "-").stdout)
    assert found["calibrated"]["monitor_1"]["points"] == 3
    assert found["calibrated"]["monitor_1"]["residual"] < 0.001
    points.write_text("angle: {form: pieces, points: [[0.2, -100.0], [0.5, 0.0], [0.8, 101.0]]}\n")
    found = json.loads(call("calibrate", "--points", str(points), "-o", str(out), "--json", "-").stdout)
    assert found["kept"] == ["monitor_1"]
    read_back = parse_all(yaml.safe_load(out.read_text()), "cal.yaml")
    assert read_back[Role.MONITOR_1].taken.serial_numbers == {"gauge": "G7"}
    assert len(read_back[Role.ANGLE].knots) == 3


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("angle: {points: [[0.2, 1.0]]}", "too few"),
        ("valve_9: {points: []}", "unknown role 'valve_9'"),
        ("angle: {points: [[0.2]]}", "expected 2 values"),
        ("angle: {points: [[0.2, .inf], [0.3, 1]]}", "finite"),
        ("monitor_1: {form: cubic, points: [[1, 0], [2, 1]]}", "unknown value 'cubic'"),
        ("[]", "expected a mapping"),
    ],
)
def test_bad_points_write_nothing(tmp_path: Path, text: str, says: str) -> None:
    points, out = tmp_path / "points.yaml", tmp_path / "cal.yaml"
    points.write_text(text + "\n")
    assert says in refusal("calibrate", "--points", str(points), "-o", str(out))
    assert not out.exists()


def test_points_that_the_rig_s_devices_refuse_write_nothing(tmp_path: Path) -> None:
    """A monitor of 0.3 MPa on a rig whose YAML says 0.5: without a rig nobody can know, and it is taken."""
    points, out = tmp_path / "points.yaml", tmp_path / "cal.yaml"
    points.write_text("monitor_1: {points: [[1.0, 0.0], [5.0, 0.3]]}\n")
    with_rig = ("calibrate", "--points", str(points), "-o", str(out), "--rig", str(RIGS / "all_modbus.yaml"))
    assert "monitor_1: a reading of 5 V, nominally 0.5 MPa, is calibrated as 0.3 MPa" in refusal(*with_rig)
    assert not out.exists()
    assert call("calibrate", "--points", str(points), "-o", str(out)).exit_code == 0


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "say either what"),
        (["angle", "--points", "x.yaml"], "say either what"),
        (["pressures", "--yes", "--levels", "0.1,0.9"], "0.9 MPa is outside"),
        (["pressures", "--yes", "--levels", "0.1,x"], "expected pressures"),
        (["pressures", "--yes", "--levels", "0.1,0.1"], "2 different"),
        (["angle", "--serial", "gauge"], "PART=NUMBER"),
        (["pressures"], "nothing was moved"),
    ],
)
def test_bad_wishes_move_and_write_nothing(tmp_path: Path, arguments: list[str], says: str) -> None:
    out = tmp_path / "cal.yaml"
    assert says in refusal("calibrate", *arguments, "-o", str(out))
    assert not out.exists()


def test_a_guided_calibration_of_pressures(tmp_path: Path) -> None:
    """The gauge shows 1 % more than was set: the regulators' calibration must say so, and the monitors' too."""
    out = tmp_path / "cal.yaml"
    levels = (0.1, 0.2, 0.3)
    typed = "".join(f"{1.01 * level}\nx\n{1.01 * level}\n" for level in levels)
    result = call(
        "calibrate", "pressures", "--yes", "--rig", EMULATED, "--levels", ",".join(map(str, levels)), "--settle", "0.1",
        "--serial", "gauge=G1", "-o", str(out), typed=typed,
    )  # fmt: skip
    assert result.exception is None, result.output
    assert "'x' is not a number" in result.output
    found = parse_all(yaml.safe_load(out.read_text()), "cal.yaml")
    valve = found[Role.VALVE_1]
    assert isinstance(valve, Calibration)
    assert valve.raw_unit == "MPa"
    assert valve.knots == [pytest.approx((0.1, 0.101)), pytest.approx((0.3, 0.303))]
    assert len(found) == 4
    assert valve.taken.serial_numbers == {"gauge": "G1"}


def test_a_guided_calibration_of_the_angle_moves_nothing(tmp_path: Path) -> None:
    out = tmp_path / "cal.yaml"
    line = refusal("calibrate", "angle", "--rig", EMULATED, "-o", str(out), typed="0\n1\n\n")
    assert "nothing moved between them" in line  # the joint of the emulated rig cannot be turned by hand
    assert not out.exists()
    kept = tmp_path / "cal.points.yaml"
    assert str(kept) in line
    assert [angle for _, angle in yaml.safe_load(kept.read_text())["angle"]["points"]] == [0.0, 1.0]


LEVELS = ("--yes", "--rig", EMULATED, "--levels", "0.1,0.2,0.3", "--settle", "0.1")
TYPED = "0.101\n0.102\n0.201\n0.202\n"
"""Both gauges at two of three levels."""


def kept_points(out: Path) -> list[list[float]]:
    """Of the first regulator."""
    points: list[list[float]] = yaml.safe_load(out.with_suffix(".points.yaml").read_text())["valve_1"]["points"]
    return points


def test_points_that_were_typed_outlive_a_device_that_is_lost(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An hour of gauges went with it."""
    out, looks = tmp_path / "cal.yaml", []
    collect = DeviceTicker.collect

    def lost_at_the_last(ticker: DeviceTicker, seconds: float) -> Any:
        looks.append(seconds)
        if len(looks) == 4:  # the first is where the pressures stand
            raise DeviceLost("myRIO RIO0: the session is lost")
        return collect(ticker, seconds)

    monkeypatch.setattr(DeviceTicker, "collect", lost_at_the_last)
    result = call("calibrate", "pressures", *LEVELS, "-o", str(out), typed=TYPED)
    assert type(result.exception) is DeviceLost
    assert str(result.exception) == (
        f"myRIO RIO0: the session is lost; the points are kept in {tmp_path / 'cal.points.yaml'}"
    )
    assert kept_points(out) == [[0.1, 0.101], [0.2, 0.201]]
    assert not out.exists()
    assert call("calibrate", "--points", str(tmp_path / "cal.points.yaml"), "-o", str(out)).exit_code == 0


def test_points_that_were_typed_outlive_who_gives_up(tmp_path: Path) -> None:
    out = tmp_path / "cal.yaml"
    result = call("calibrate", "pressures", *LEVELS, "-o", str(out), typed=TYPED)
    assert f"calibration given up: the points are kept in {tmp_path / 'cal.points.yaml'}" in result.output
    assert result.exit_code != 0
    assert kept_points(out) == [[0.1, 0.101], [0.2, 0.201]]


def test_points_that_were_typed_stand_on_the_terminal_where_the_disk_takes_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    result = call("calibrate", "pressures", *LEVELS, "-o", str(tmp_path / "cal.yaml"), typed=f"{TYPED}0.301\n0.302\n")
    line = str(result.exception)
    assert line.startswith(
        f"{tmp_path / 'cal.yaml'}: cannot be written: No space left on device; the points stand above"
    )
    _, _, shown = result.output.partition("valve_1:")
    assert yaml.safe_load("valve_1:" + shown)["valve_1"]["points"] == [[0.1, 0.101], [0.2, 0.201], [0.3, 0.301]]
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_cannot_be_merged_into_is_found_before_the_work(tmp_path: Path) -> None:
    out = tmp_path / "cal.yaml"
    out.write_text("valve_7: {}\n")
    assert "unknown role 'valve_7'" in refusal("calibrate", "angle", "--rig", EMULATED, "-o", str(out), typed="0\n")
    assert "there is no folder" in refusal(
        "calibrate", "angle", "--rig", EMULATED, "-o", str(tmp_path / "no" / "cal.yaml"), typed="0\n"
    )


def test_giving_up_writes_nothing(tmp_path: Path) -> None:
    result = call("calibrate", "angle", "--rig", EMULATED, "-o", str(tmp_path / "cal.yaml"), typed="")
    assert "given up: nothing was written" in result.output
    assert result.exit_code != 0
    assert not (tmp_path / "cal.yaml").exists()


# the probe on hardware with faults: the rig's YAML of the lab, its device replaced by the lab's


@pytest.fixture
def probed(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> Lab:
    monkeypatch.setattr(compose, "make_device", lambda rig, clock, options=None, *, looking=False: lab.device)
    return lab


def finding(*arguments: str) -> str:
    """The line with which the probe says that something is not so."""
    result = call("probe", "--rig", str(RIGS / "paper_myrio.yaml"), "--ticks", "20", *arguments)
    assert isinstance(result.exception, CheckFailed), result.output
    assert "\n" not in str(result.exception)
    return str(result.exception)


@pytest.mark.parametrize(
    ("wire", "says"),
    [
        ("monitor_1", "below its live zero"),
        ("wiper", "the potentiometer is open"),
        ("excitation", "without excitation"),
    ],
)
def test_the_probe_names_a_broken_wire_and_moves_nothing(probed: Lab, wire: str, says: str) -> None:
    probed.stand_in.board.cut(wire)
    assert says in finding()
    assert probed.stand_in.registers.strobes == 0


def test_the_probe_names_swapped_valves(probed: Lab) -> None:
    probed.stand_in.board.swap_valves()
    assert "swapped" in finding("--step", "--yes", "--settle", "0.1")
    assert probed.stand_in.board.commands_mpa() == pytest.approx(SAFE, abs=1e-3)


def test_a_rig_with_a_broken_wire_is_not_stepped(probed: Lab) -> None:
    probed.stand_in.board.cut("monitor_2")
    assert "below its live zero" in finding("--step", "--yes")
    assert probed.stand_in.registers.strobes == 0


def test_the_probe_names_a_lost_session(probed: Lab) -> None:
    probed.stand_in.registers.fail(-63043)
    assert "RpcSessionError" in finding()

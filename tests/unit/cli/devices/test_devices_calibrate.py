"""`pamrig devices calibrate`: points from a file and guided; what was typed is not lost; bad input in one line."""

import errno
import json
import os
from pathlib import Path
from typing import Any

import pytest
import yaml
from support.rigs.devices_command import EMULATED, RIGS, call, refusal

from drivers.calibration import Calibration, parse_all
from rig.app.devices import calibrating
from rig.app.devices.bringup import DeviceTicker
from rig.errors import DeviceLost
from rig.interfaces import Role

pytest_plugins = "support.rigs.devices_lab"
pytestmark = pytest.mark.real_time


@pytest.fixture(autouse=True)
def _collects_briefly(hurried: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(calibrating, "COLLECT_S", 0.05)


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
def test_bad_options_move_and_write_nothing(tmp_path: Path, arguments: list[str], says: str) -> None:
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
        "myRIO RIO0: the session is lost; safe state written by the commanding process, not confirmed: the device has "
        f"not been read back; the points are kept in {tmp_path / 'cal.points.yaml'}"
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

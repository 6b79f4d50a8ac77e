"""`pamrig devices list`: devices, roles, settings, and what is missing or old."""

import json
from pathlib import Path

import yaml
from support.rigs.devices_command import RIGS, call, refusal


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

"""`pamrig devices probe`: what it finds out about wiring and timing, what it refuses to move, and its ticker."""

import json
import os
import threading
from pathlib import Path

import pytest
import yaml
from support.rigs.devices_command import EMULATED, RIGS, SAFE, Lab, call, refusal

from hil.emulators.nifpga.shared import READ
from rig.app import compose
from rig.app.devices import probing
from rig.app.devices.bringup import DeviceTicker, StepResult, step_valves
from rig.app.devices.timing import time_reads
from rig.errors import CheckFailed, DeviceError, DeviceLost
from rig.sample import Flag

pytest_plugins = "support.rigs.devices_lab"
pytestmark = [pytest.mark.real_time, pytest.mark.usefixtures("hurried")]


def test_probe_of_an_emulated_rig_says_it_holds_the_period() -> None:
    result = call("probe", "--rig", EMULATED, "--ticks", "40", "--json", "-")
    found = json.loads(result.stdout)["devices"][0]
    assert found["answers"]
    assert found["facts"]["device"] == "myRIO RIO0"
    assert found["read_p50_us"] > 0
    assert found["last"]["p1_mpa"] == pytest.approx(0.2, abs=0.001)


def test_probe_of_absent_hardware_fails_in_one_line() -> None:
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
def test_the_ticker_asks_for_priority_for_its_thread_alone(
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


def test_timing_of_a_device_that_never_answers_is_a_failed_check(lab: Lab) -> None:
    lab.device.open()
    lab.stand_in.registers.fail(-61046, READ)
    with pytest.raises(CheckFailed, match="no answer in 25 ticks"):
        time_reads(lab.device, 1_000_000, 25)
    lab.device.close()


def test_the_ticker_lets_go_safely_when_the_device_is_lost(lab: Lab) -> None:
    with pytest.raises(DeviceLost), DeviceTicker(lab.device, 5_000_000, SAFE) as ticker:  # noqa: PT012
        ticker.go_to(0.22, 0.18)
        lab.stand_in.registers.lose_sessions()
        ticker.wait(2.0)
    assert lab.stand_in.board.commands_mpa() == pytest.approx(SAFE, abs=1e-3)


def test_a_device_that_does_not_open_is_an_error_not_a_hang(lab: Lab) -> None:
    lab.stand_in.registers.fail(-63195)
    with pytest.raises(DeviceError), DeviceTicker(lab.device, 5_000_000, SAFE):
        pass


# hardware with faults: the rig's YAML of the lab, its device replaced by the lab's


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

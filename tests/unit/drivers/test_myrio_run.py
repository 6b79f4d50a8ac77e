"""A running myRIO through the real nifpga package: outputs, inputs, and every error on the way."""

import errno
import math
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from itertools import takewhile
from pathlib import Path

import pytest
from support.rigs.myrio_lab import (
    COMMUNICATION_TIMEOUT,
    FPGA_BUSY,
    INVALID_SESSION,
    Lab,
    lab_with,
    opened_when_let,
    paper_lab,
    refused,
    slow_to_open,
)

from drivers.myrio.settings import AngleInput, FurtherInput, PressureLine
from drivers.signals import SignalRange
from hil.emulators.nifpga.bitfile import guarded_personality, numbered, personality, write_bitfile
from hil.emulators.nifpga.shared import CONTROL, OPEN, READ, WRITE
from rig.errors import ConfigError, DeviceError, DeviceLost
from rig.interfaces import Device
from rig.sample import Flag

lab = pytest.fixture(paper_lab)


# outputs


def test_both_outputs_change_with_one_strobe(lab: Lab) -> None:
    device = lab.device()
    device.open()
    seen: list[tuple[float, float]] = []
    lab.plant.step = lambda a, b: (seen.append((a, b)), (a, b, 0.0))[1]  # type: ignore[method-assign]
    strobes = lab.fpga.strobes
    device.write(0.31, 0.09)
    assert lab.fpga.strobes == strobes + 1
    lab.tick()
    device.read()
    assert [pair for pair in seen if (abs(pair[0] - 0.31) < 1e-3) != (abs(pair[1] - 0.09) < 1e-3)] == []
    device.close()


@pytest.mark.parametrize(("asked", "volts"), [(9.0, 5.0), (-9.0, 0.0), (0.5, 5.0), (0.0, 0.0), (0.25, 2.5)])
def test_counts_are_clamped_and_rounded_never_wrapped(lab: Lab, asked: float, volts: float) -> None:
    device = lab.device()
    device.open()
    device.write(asked, 0.2)
    assert lab.fpga.pin("AO.A_0.VAL") == min(round(volts / 5 * 4096), 4095)
    device.close()


@pytest.mark.parametrize("datatype", ["U16", "I16"])
def test_connector_c_never_goes_below_its_signal(tmp_path: Path, datatype: str) -> None:
    """A 0-10 V regulator on a +-10 V output: the negative half must stay out of reach, whatever the calibration
    says."""
    lab = lab_with(tmp_path, personality(datatype))
    line = PressureLine("AO.C_0.VAL", SignalRange.V_0_10)
    lab.context = replace(
        lab.context, calibration={"valve_1": {"knots": [[0.1, 0.06], [0.5, 0.46]], "raw_unit": "MPa"}}
    )
    device = lab.device(valve_1=line)
    device.open()
    for asked in (-5.0, 0.0, 0.4, 5.0):
        device.write(asked, 0.2)
        raw = lab.fpga.pin("AO.C_0.VAL")
        assert 0 <= raw <= 2047
    device.close()
    lab.stand_in.close()


def test_limits_and_heartbeat_go_to_the_fpga_where_it_has_them(tmp_path: Path) -> None:
    lab = lab_with(tmp_path, guarded_personality())
    lab.fpga.measure("RIG.SAFE.AO.A_0", 1638)
    lab.fpga.measure("RIG.SAFE.AO.A_1", 1638)
    lab.fpga.measure("RIG.WATCHDOG_MS", 15)
    limits = {"limit_min": "RIG.LIMIT.AO.A_{}.MIN", "limit_max": "RIG.LIMIT.AO.A_{}.MAX"}
    lines = {
        f"valve_{n + 1}": PressureLine(
            f"AO.A_{n}.VAL", SignalRange.V_0_5, **{key: name.format(n) for key, name in limits.items()}
        )
        for n in range(2)
    }
    device = lab.device(heartbeat="RIG.HEARTBEAT", **lines)
    assert device.open()["heartbeat"] == "RIG.HEARTBEAT"
    assert lab.fpga.value("RIG.LIMIT.AO.A_0.MAX") == 0  # nothing is written before the first output
    device.write(0.4, 0.05)
    assert lab.fpga.value("RIG.LIMIT.AO.A_0.MAX") == 4095
    for _ in range(3):
        lab.tick()
        device.read()
    assert lab.stand_in.board.commands_mpa() == pytest.approx((0.4, 0.05), abs=1e-3)
    for _ in range(4):  # the host is gone: no reads, no beats
        lab.tick()
    assert lab.stand_in.board.commands_mpa() == pytest.approx((0.2, 0.2), abs=1e-3)
    assert lab.fpga.value("RIG.TRIPPED") == 1
    device.close()
    lab.stand_in.close()


# inputs


def test_the_ratio_takes_the_excitation_out(lab: Lab) -> None:
    device = lab.device()
    device.open()
    lab.plant.angle_deg = 30.0
    lab.tick()
    now = device.read()
    assert now.angle_deg == pytest.approx(30.0, abs=345 / 4096 * 1.5)
    assert now.excitation_raw == pytest.approx(4.95, abs=0.002)
    device.close()


def test_a_fixed_reference_needs_no_second_input(lab: Lab) -> None:
    device = lab.device(angle=AngleInput("AI.A_2.VAL", reference_v=4.95))
    device.open()
    lab.plant.angle_deg = -30.0
    lab.tick()
    now = device.read()
    assert now.angle_deg == pytest.approx(-30.0, abs=345 / 4096 * 1.5)
    assert math.isnan(now.excitation_raw)
    device.close()


@pytest.mark.parametrize("wire", ["monitor_1", "monitor_2"])
def test_zero_volts_on_a_live_zero_is_a_broken_wire_not_a_pressure(lab: Lab, wire: str) -> None:
    device = lab.device()
    device.open()
    lab.stand_in.board.cut(wire)
    now = device.read()
    assert now.flags & Flag.BROKEN_WIRE
    assert math.isnan(now.p1_mpa if wire == "monitor_1" else now.p2_mpa)
    assert not math.isnan(now.p2_mpa if wire == "monitor_1" else now.p1_mpa)
    device.close()


@pytest.mark.parametrize("wire", ["wiper", "excitation"])
def test_an_open_potentiometer_has_no_angle(lab: Lab, wire: str) -> None:
    device = lab.device()
    device.open()
    lab.stand_in.board.cut(wire)
    now = device.read()
    assert math.isnan(now.angle_deg)
    assert now.flags & Flag.ANGLE_ABSENT
    assert now.flags & Flag.SUSPECT
    device.close()


def test_the_dead_zone_has_no_angle(lab: Lab) -> None:
    device = lab.device()
    device.open()
    lab.plant.angle_deg = 174.0  # past the end of the 345 degrees of track
    lab.tick()
    assert math.isnan(device.read().angle_deg)
    lab.plant.angle_deg = 160.0
    lab.tick()
    assert device.read().angle_deg == pytest.approx(160.0, abs=0.2)
    device.close()


# errors while running


def test_a_lost_session_is_lost_until_opened_again(lab: Lab) -> None:
    device = lab.device()
    device.open()
    lab.fpga.power_cycle()
    assert refused(device.read, DeviceLost, "reading failed", "InvalidSession (-63195)", "restarted")
    assert refused(lambda: device.write(0.2, 0.2), DeviceLost, "writing failed")
    lab.fpga.measure("SYS.RDY", 1)
    device.open()
    assert math.isfinite(device.read().angle_raw)
    device.close()


def test_a_timeout_is_one_error_and_the_next_call_works(lab: Lab) -> None:
    device = lab.device()
    device.open()
    lab.fpga.fail(COMMUNICATION_TIMEOUT, READ, count=1)
    with pytest.raises(DeviceError) as caught:
        device.read()
    assert not isinstance(caught.value, DeviceLost)
    assert math.isfinite(device.read().p1_mpa)
    device.close()


@pytest.mark.parametrize("after", [0, 1, 2])
def test_an_error_between_the_outputs_strobes_nothing(lab: Lab, after: int) -> None:
    device = lab.device()
    device.open()
    device.write(0.2, 0.2)
    lab.fpga.fail(COMMUNICATION_TIMEOUT, WRITE, after=after, count=1)
    with pytest.raises(DeviceError):
        device.write(0.4, 0.1)
    assert lab.stand_in.board.commands_mpa() == pytest.approx((0.2, 0.2), abs=1e-4)
    device.close()


def test_a_warning_status_is_no_error(lab: Lab) -> None:
    device = lab.device()
    lab.fpga.fail(61003, CONTROL)  # FpgaAlreadyRunning
    assert device.open()["fpga_found"]
    device.close()


def test_a_stall_past_the_period_is_an_error_not_an_old_value(lab: Lab) -> None:
    device = lab.device()
    device.open()
    lab.fpga.fail(0, READ, count=1, stall_us=12_000)
    assert refused(device.read, DeviceError, "took 12.0 ms", "period of 5 ms")
    lab.fpga.fail(0, READ, count=1, stall_us=3_000)
    now = device.read()
    assert now.p1_age_ns == now.p2_age_ns == now.angle_age_ns == 3_000_000
    device.close()


def test_safe_gets_through_a_new_session_when_the_old_one_is_lost(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    device = lab.device()
    device.open()
    device.write(0.4, 0.05)
    lab.fpga.lose_sessions()
    let = opened_when_let(monkeypatch)
    assert refused(device.safe, DeviceError, "not written yet: a new session is being opened")
    assert refused(device.read, DeviceLost, "not open")
    let.set()
    device.close()  # waits for the write that is under way
    assert lab.stand_in.board.commands_mpa() == pytest.approx((0.2, 0.2), abs=1e-4)
    assert lab.fpga.sessions <= 1


def asked_to_be_safe(device: Device) -> Iterator[str]:
    """What the device answers, asked again and again: why it is not safe yet, or nothing where it is."""
    for _ in range(2000):
        try:
            device.safe()
            yield ""
        except DeviceError as error:
            yield str(error)


def test_safe_never_keeps_a_ticking_loop_waiting(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each call returns within the period; one of them finds that the new session has done it."""
    slow_to_open(monkeypatch)
    device = lab.device()
    device.open()
    device.write(0.4, 0.05)
    lab.fpga.lose_sessions()
    refusals = sum(1 for _ in takewhile(bool, asked_to_be_safe(device)))
    assert 0 < refusals < 1999
    assert lab.stand_in.board.commands_mpa() == pytest.approx((0.2, 0.2), abs=1e-4)
    device.close()


@pytest.mark.parametrize("becomes", ["gone", "no bitfile", "another design"])
def test_safe_opens_what_it_was_armed_with_whatever_becomes_of_the_bitfile(lab: Lab, becomes: str) -> None:
    """A project compiled anew meanwhile: its bitfile is another one than the FPGA runs, or is being written."""
    device = lab.device()
    device.open()
    device.write(0.4, 0.05)
    bitfile = lab.settings.bitfile
    if becomes == "gone":
        bitfile.unlink()
    elif becomes == "no bitfile":
        bitfile.write_bytes(bitfile.read_bytes()[:100])
    else:
        write_bitfile(bitfile, numbered(personality(), first=1002), "0" * 32)
    lab.fpga.lose_sessions()
    with suppress(DeviceError):  # not yet
        device.safe()
    device.close()
    assert lab.stand_in.board.commands_mpa() == pytest.approx((0.2, 0.2), abs=1e-4)
    with pytest.raises((ConfigError, DeviceLost)):  # who opens anew takes what is there
        device.open()


def test_what_keeps_a_new_session_from_opening_is_said(lab: Lab) -> None:
    device = lab.device()
    device.open()
    lab.fpga.fail(INVALID_SESSION)
    said = next((text for text in asked_to_be_safe(device) if "opening failed" in text), "")
    assert "opening failed: InvalidSession" in said
    lab.fpga.heal()
    device.close()


def test_safe_is_not_said_when_a_new_session_ends_in_an_error_of_another_kind(
    lab: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No descriptor was left for the kept bitfile: the error went with its thread, and what nobody had written was
    called safe."""
    device = lab.device()
    device.open()
    device.write(0.4, 0.05)
    lab.settings.bitfile.unlink()
    lab.fpga.lose_sessions()

    def exhausted(_: str) -> int:
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr("os.memfd_create", exhausted)
    said = set(asked_to_be_safe(device))
    assert "" not in said, f"safe at {lab.stand_in.board.commands_mpa()} MPa"
    assert any("not written: OSError(24, 'Too many open files')" in text for text in said), said
    monkeypatch.undo()
    with suppress(DeviceError):  # not yet
        device.safe()
    device.close()
    assert lab.stand_in.board.commands_mpa() == pytest.approx((0.2, 0.2), abs=1e-4)


def test_safe_from_another_process_while_this_one_holds_the_session(lab: Lab, tmp_path: Path) -> None:
    """The supervisor's second path: a process of its own, a session of its own, the same FPGA."""
    device = lab.device()
    device.open()
    device.write(0.4, 0.05)
    code = f"""
from pathlib import Path
from drivers.myrio.device import MyRio
from drivers.myrio.settings import MyRioSettings
from rig.interfaces import DeviceContext, Role
from rig.realtime.clock import MonotonicClock
context = DeviceContext(MonotonicClock(), frozenset(Role), 0.2, 0.2)
MyRio(MyRioSettings(Path({str(lab.settings.bitfile)!r})), context).safe()
"""
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
    lab.tick()
    device.read()
    lab.tick()
    now = device.read()
    assert (now.p1_mpa, now.p2_mpa) == pytest.approx((0.2, 0.2), abs=1e-3)
    device.close()


def test_who_stands_by_needs_no_new_session_to_make_it_safe(lab: Lab) -> None:
    device, supervisor = lab.device(), lab.device()
    device.open()
    supervisor.prepare_safe()
    before = lab.stand_in.board.commands_mpa()
    assert (lab.fpga.sessions, lab.fpga.strobes) == (2, 0)
    device.write(0.4, 0.05)
    lab.fpga.fail(FPGA_BUSY, OPEN)
    supervisor.safe()
    assert lab.stand_in.board.commands_mpa() == pytest.approx((0.2, 0.2), abs=1e-4) != before
    supervisor.close()
    device.close()


def test_a_further_channel_is_read_into_its_place(lab: Lab) -> None:
    lab.context = replace(lab.context, further=("nobody", "supply_mpa"))
    device = lab.device(further={"supply_mpa": FurtherInput("AI.A_3.VAL", scale=0.2, offset=-0.5)})
    device.open()
    now = device.read()
    assert now.further_2 == pytest.approx(0.2 * now.excitation_raw - 0.5)
    assert math.isnan(now.further_1)
    assert math.isnan(now.further_3)
    device.close()

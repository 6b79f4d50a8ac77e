"""What a myRIO is said to hold: by registers of an FPGA that runs, read back by whoever wrote them, and by nobody whose
silence lets its watchdog act."""

from pathlib import Path

import pytest
from support.rigs.myrio_lab import Lab, lab_with, paper_lab

from drivers.myrio.device import UNFED_PERIODS, MyRio
from hil.emulators.nifpga.bitfile import guarded_personality
from rig.errors import DeviceError

SAFE = pytest.approx((0.2, 0.2), abs=1e-4)


lab = pytest.fixture(paper_lab)


def make_safe(device: MyRio) -> None:
    """Ask until the device has taken the safe state."""
    for _ in range(5000):
        try:
            device.safe()
        except DeviceError:
            continue
        return
    raise AssertionError("the device never took the safe state")


@pytest.mark.parametrize("state", [0, 1, 3], ids=["not running", "invalid", "stopped by itself"])
def test_a_vi_that_was_stopped_is_started_before_anything_is_called_safe(lab: Lab, state: int) -> None:
    """Its registers took the safe set-points and told of them, 0.4 and 0.05 MPa stood at the terminals."""
    device = lab.device()
    device.open()
    device.write(0.4, 0.05)
    lab.fpga.set_vi_state(state)
    make_safe(device)
    assert lab.fpga.vi_state == 2
    assert lab.stand_in.board.commands_mpa() == SAFE
    assert device.holds_safe() is True
    device.close()


def test_what_registers_hold_is_not_believed_of_a_vi_that_does_not_run(lab: Lab) -> None:
    device = lab.device()
    device.open()
    device.write(0.4, 0.05)
    lab.fpga.set_vi_state(3)
    device.write(0.2, 0.2)
    assert lab.stand_in.board.commands_mpa() != SAFE
    assert device.holds_safe() is False
    device.close()


def test_a_new_session_reads_back_what_it_has_written(lab: Lab) -> None:
    """Who made safe by a new session said "not confirmed", opened one after the other for it, and called the device out
    of reach between them."""
    device = lab.device()
    device.open()
    device.write(0.4, 0.05)
    lab.fpga.lose_sessions()
    make_safe(device)
    assert lab.stand_in.board.commands_mpa() == SAFE
    assert device.holds_safe() is True
    assert device.holds_safe() is None, "what was read then says nothing of later"
    device.close()


def test_a_new_session_starts_no_programs(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    """nifpga looked for its library at each opening, by ldconfig and a compiler: 30 ms, in which a loop that was
    to be made safe hung, and was ended for it by its supervisor."""
    device = lab.device()
    device.open()
    started: list[object] = []
    monkeypatch.setattr("subprocess.Popen", lambda *command, **_: started.append(command))
    lab.fpga.lose_sessions()
    make_safe(device)
    assert started == []
    device.close()


def test_who_does_not_feed_the_fpgas_watchdog_does_not_vouch_for_its_outputs(tmp_path: Path) -> None:
    """The registers keep the safe set-points, and the watchdog takes the terminals to its own."""
    lab = lab_with(tmp_path, guarded_personality())
    lab.fpga.measure("RIG.WATCHDOG_MS", 500)
    device, supervisor = lab.device(heartbeat="RIG.HEARTBEAT"), lab.device(heartbeat="RIG.HEARTBEAT")
    device.open()
    supervisor.prepare_safe()
    device.read()
    supervisor.safe()
    assert device.holds_safe() is True
    assert supervisor.holds_safe() is None
    for _ in range(UNFED_PERIODS + 1):
        lab.tick()
    assert device.holds_safe() is None
    supervisor.close()
    device.close()
    lab.stand_in.close()

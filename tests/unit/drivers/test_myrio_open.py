"""Opening a myRIO through the real nifpga package: what is wrong is said in one line, and nothing moves."""

import ctypes.util
import math
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from support.rigs.myrio_lab import FPGA_BUSY, RPC_SESSION, Lab, lab_with, paper_lab, refused

from drivers.myrio.session import vendor_library
from drivers.myrio.settings import MyRioSettings
from hil.emulators.nifpga.bitfile import numbered, personality, write_bitfile
from hil.emulators.nifpga.library import build
from hil.emulators.nifpga.shared import OPEN
from rig.config import structure
from rig.errors import ConfigError, DeviceLost, RigError

lab = pytest.fixture(paper_lab)


def test_a_bitfile_that_is_missing_or_none_is_named(lab: Lab, tmp_path: Path) -> None:
    assert refused(lab.device(bitfile=tmp_path / "no.lvbitx").open, ConfigError, "no.lvbitx", "No such file")
    for text in ("not xml at all", "<Bitfile/>", "<Bitfile><SignatureRegister>A</SignatureRegister></Bitfile>"):
        (tmp_path / "bad.lvbitx").write_text(text)
        assert refused(lab.device(bitfile=tmp_path / "bad.lvbitx").open, ConfigError, "bad.lvbitx", "not a bitfile")
    assert lab.fpga.sessions == 0


def test_another_signature_is_refused(lab: Lab, tmp_path: Path) -> None:
    other = write_bitfile(tmp_path / "other.lvbitx", personality(), signature="F" * 32)
    assert refused(lab.device(bitfile=other).open, DeviceLost, "SignatureMismatch (-63106)", "not the one")


@pytest.mark.parametrize("missing", ["AO.A_1.VAL", "AI.A_0.VAL", "AI.A_3.VAL", "AO.SYS.GO", "SYS.RDY"])
def test_a_missing_register_is_named_before_anything_moves(tmp_path: Path, missing: str) -> None:
    lab = lab_with(tmp_path, [r for r in personality() if r.name != missing])
    assert refused(lab.device().open, ConfigError, f"no register {missing!r}")
    assert (lab.fpga.strobes, lab.fpga.sessions) == (0, 0)
    lab.stand_in.close()


def test_registers_are_found_by_name_wherever_they_stand(tmp_path: Path) -> None:
    lab = lab_with(tmp_path, numbered(list(reversed(personality())), first=514))
    device = lab.device()
    device.open()
    device.write(0.3, 0.1)
    assert lab.world.commands == pytest.approx((0.3, 0.1), abs=1e-4)
    device.close()
    lab.stand_in.close()


def test_a_register_of_another_type_is_named(tmp_path: Path) -> None:
    wrong = [replace(r, datatype="U32") if r.name == "AO.A_0.VAL" else r for r in personality()]
    lab = lab_with(tmp_path, wrong)
    assert refused(lab.device().open, ConfigError, "'AO.A_0.VAL'", "U32", "expected U16 or I16")
    lab.stand_in.close()


def test_an_unknown_resource_is_named(lab: Lab) -> None:
    assert refused(lab.device(resource="RIO7").open, DeviceLost, "RIO7", "InvalidResourceName")
    assert refused(lab.device(resource="rio://nobody/RIO0").open, DeviceLost, "rio://nobody/RIO0", "is it on")


def test_an_fpga_in_other_hands_is_named(lab: Lab) -> None:
    lab.fpga.fail(FPGA_BUSY, OPEN)
    assert refused(lab.device().open, DeviceLost, "FpgaBusy", "another program")


def test_not_ready_gives_up_after_its_time(lab: Lab) -> None:
    lab.fpga.measure("SYS.RDY", 0)
    assert refused(lab.device(ready_timeout_s=0.5).open, DeviceLost, "SYS.RDY", "0.5 s")
    assert lab.clock.now_ns() >= 500_000_000
    assert lab.fpga.sessions == 0


@pytest.mark.parametrize(
    ("state", "name"), [(0, "NotRunning"), (1, "Invalid"), (2, "Running"), (3, "NaturallyStopped")]
)
def test_the_fpga_is_brought_to_run_from_every_state(lab: Lab, state: int, name: str) -> None:
    lab.fpga.set_vi_state(state)
    device = lab.device()
    assert device.open()["fpga_found"] == name
    assert lab.fpga.vi_state == 2
    device.close()


def test_a_running_fpga_keeps_its_outputs_through_open_and_close(lab: Lab) -> None:
    before = lab.stand_in.board.commands_mpa()
    for _ in range(3):
        device = lab.device()
        device.open()
        device.close()
    assert lab.stand_in.board.commands_mpa() == before
    assert lab.fpga.sessions == 0


def test_a_library_that_answers_nonsense_is_one_line(lab: Lab) -> None:
    lab.fpga.set_vi_state(77)
    assert refused(lab.device().open, DeviceLost, "the library answers nonsense: 77")
    assert lab.fpga.sessions == 0


def test_a_library_that_cannot_be_loaded_is_one_line(lab: Lab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Cut short, or made for another machine: it ended in the system's words, or in a traceback of the loop."""
    vendor_library.cache_clear()
    (tmp_path / "libNiFpga.so").write_bytes(b"\x7fELF")
    monkeypatch.setattr(ctypes.util, "find_library", lambda _: str(tmp_path / "libNiFpga.so"))
    assert refused(lab.device().open, DeviceLost, "libNiFpga.so cannot be loaded: ", "file too short; install NI-RIO")


def test_without_the_library_it_says_what_to_install(tmp_path: Path) -> None:
    """In a process of its own: here the library is loaded."""
    bitfile = write_bitfile(tmp_path / "a.lvbitx", personality())
    code = f"""
from pathlib import Path
from drivers.myrio.device import MyRio
from drivers.myrio.settings import MyRioSettings
from rig.interfaces import DeviceContext, Role
from rig.realtime.clock import VirtualClock
MyRio(MyRioSettings(Path({str(bitfile)!r})), DeviceContext(VirtualClock(), frozenset(Role))).open()
"""
    environment = {key: value for key, value in os.environ.items() if key != "LD_LIBRARY_PATH"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=False)
    assert "DeviceLost: libNiFpga.so is not installed" in done.stderr


def test_a_compiler_that_is_missing_or_fails_is_one_line(tmp_path: Path) -> None:
    assert refused(lambda: build(tmp_path / "a", "no-such-compiler"), RigError, "no-such-compiler", "not installed")
    assert build(tmp_path / "b").read_bytes()[:4] == b"\x7fELF"


# remote sessions


@pytest.mark.parametrize(("latency_us", "fits"), [(100, True), (600, False)])
def test_a_remote_session_is_timed_and_refused_when_too_slow(tmp_path: Path, latency_us: int, fits: bool) -> None:
    lab = lab_with(tmp_path, personality(), "rio://10.0.0.2/RIO0")
    lab.fpga.set_latency_us(latency_us)
    device = lab.device()
    if fits:
        assert device.open()["remote_tick_p99_us"] == str(7 * latency_us)
        assert math.isfinite(device.read().angle_deg)
        device.close()
    else:
        assert refused(device.open, DeviceLost, "too slow", "7 calls", "4.2 ms", "run the loop on the myRIO")
    assert lab.fpga.strobes == 0
    assert lab.fpga.sessions == 0
    lab.stand_in.close()


def test_a_lost_network_is_named(tmp_path: Path) -> None:
    lab = lab_with(tmp_path, personality(), "rio://10.0.0.2/RIO0")
    device = lab.device()
    device.open()
    lab.fpga.fail(RPC_SESSION)
    assert refused(device.read, DeviceLost, "RpcSessionError (-63043)", "remote session is lost")
    device.close()
    lab.stand_in.close()


# settings


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"valve_1": {"register": "AO.A_0.VAL", "signal": "0-10 V"}}, "does not fit on AO.A_0.VAL (0 .. 5 V)"),
        ({"valve_1": {"register": "AI.A_0.VAL", "signal": "0-5 V"}}, "not an analog output"),
        ({"monitor_1": {"register": "AI.Z_0.VAL", "signal": "1-5 V"}}, "not an analog input"),
        ({"monitor_1": {"register": "AI.A_0.VAL", "signal": "1-6 V"}}, "unknown value '1-6 V'; did you mean '1-5 V'"),
        ({"valve_1": {"register": "AO.A_0.VAL", "signal": "0-5 V", "low_mpa": 0.5, "high_mpa": 0.1}}, "below"),
        ({"valve_1": {"register": "AO.A_0.VAL", "signal": "0-5 V", "units_per_volt": 0.0}}, "outside"),
        ({"angle": {"wiper": "AI.A_2.VAL"}}, "either excitation"),
        ({"angle": {"wiper": "AI.A_2.VAL", "excitation": "AI.A_3.VAL", "reference_v": 5.0}}, "either excitation"),
        ({"resource": ""}, "resource"),
        ({"bitfiles": "x"}, "did you mean 'bitfile'"),
    ],
)
def test_settings_that_cannot_work_are_one_line(change: dict, says: str) -> None:
    with pytest.raises(ConfigError) as caught:
        structure({"bitfile": "a.lvbitx", **change}, MyRioSettings, "rig.yaml: devices.myrio")
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("rig.yaml: devices.myrio:")

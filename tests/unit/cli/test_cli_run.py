"""`pamrig run` from outside: what it prints and writes, how it refuses, and that every way out leaves rig and file in
order.

The phase in which a test strikes is watched in the loop's ring, not guessed by time.
"""

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import psutil
import pytest
from mcap_files import contents

from rig.app import compose
from rig.errors import StateError
from rig.realtime import shared
from rig.realtime.faults import Fault
from rig.realtime.ring import Ring
from rig.realtime.state import State
from rig.sample import Phase

pytestmark = pytest.mark.real_time

PAMRIG = Path(sys.executable).with_name("pamrig")
SWEEP = """\
name: short
settle_s: 0.4
zero_s: 0.3
ramp_in_s: 0.3
duration_s: 0.6
ramp_out_s: 0.3
records:
  - sine: {frequency_hz: 2.0, amplitude_mpa: 0.1}
"""
PATIENCE_S = 30.0
T = TypeVar("T")


@pytest.fixture
def sweep(tmp_path: Path) -> Path:
    path = tmp_path / "short.yaml"
    path.write_text(SWEEP)
    return path


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    """The simulated rig with the patience that a test on a busy machine needs."""
    text = compose.default_rig().read_text().replace("../models", str(compose.configs() / "models"))
    path = tmp_path / "patient.yaml"
    path.write_text(
        text.replace("stall_periods: 40", "stall_periods: 1000").replace("misses_per_s: 20", "misses_per_s: 1000")
    )
    return path


def pamrig(
    *arguments: object, cwd: Path | None = None, prepare: Callable[[], None] | None = None
) -> subprocess.CompletedProcess[str]:
    """The command carried out to its end."""
    call = [str(PAMRIG), *map(str, arguments)]
    return subprocess.run(call, capture_output=True, text=True, cwd=cwd, preexec_fn=prepare, timeout=60, check=False)


def refused(done: subprocess.CompletedProcess[str]) -> str:
    """The one line of a call that is wrong."""
    assert done.returncode == 2, done
    assert done.stdout == ""
    lines = done.stderr.splitlines()
    assert len(lines) == 1, done.stderr
    assert lines[0].startswith("pamrig")
    return lines[0]


def until(look: Callable[[], T | None]) -> T:
    """What `look` finds, as soon as it finds it."""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        if found := look():
            return found
        time.sleep(0.002)
    raise AssertionError("waited in vain")


class Running:
    """A run on the real clock, watched through its ring."""

    def __init__(self, *arguments: object) -> None:
        call = [str(PAMRIG), "run", *map(str, arguments)]
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(call, stdout=pipe, stderr=pipe, text=True, start_new_session=True)
        self.ring = until(self._ring)

    def _ring(self) -> Ring | None:
        for path in shared.folder().glob("pamrig-*-ring"):
            if shared.living_owner(path) == self.process.pid:
                try:
                    return Ring.attach(path)
                except StateError:  # not complete yet
                    return None
        return None

    def reach(self, phase: Phase) -> None:
        """Return as soon as the loop is in `phase`."""
        until(lambda: (last := self.ring.latest()) is not None and last.phase == phase)

    def recorder(self) -> psutil.Process:
        """The process that has the unfinished file open."""

        def writes(child: psutil.Process) -> bool:
            return any(file.path.endswith(".partial") for file in child.open_files())

        return until(lambda: next((c for c in psutil.Process(self.process.pid).children() if writes(c)), None))

    def end(self) -> tuple[int, dict[str, Any], str]:
        """Exit status, result and stderr."""
        out, error = self.process.communicate(timeout=PATIENCE_S)
        assert "Traceback" not in error
        return self.process.returncode, json.loads(out) if out else {}, error

    @property
    def rest(self) -> tuple[float, float]:
        """The set-points that were written last."""
        last = self.ring.latest()
        assert last is not None
        return last.p1_cmd_mpa, last.p2_cmd_mpa


# what comes out


def test_the_result_has_the_shape_that_is_promised(sweep: Path, tmp_path: Path) -> None:
    done = pamrig("run", sweep, "--clock", "virtual", "--out", tmp_path / "out", "--json", "-")
    assert done.returncode == 0, done.stderr
    (run,) = json.loads(done.stdout)["runs"]
    assert run["file"] == str(tmp_path / "out" / "sine_2hz_0.10mpa.mcap")
    assert (run["ticks"], run["missed"], run["dropped"], run["valid"]) == (381, 0, 0, True)
    assert set(run["lateness_us"]) == {"p50", "p99", "max"}
    file = contents(Path(run["file"]))
    assert len(file.samples) == 381
    assert {"rig.yaml", "sweep.yaml", "simulated.yaml"} <= set(file.attachments)
    assert {"session", "rig", "clock", "device", "realtime", "host", "pamrig", "python", "started_ns"} <= set(file.run)


def test_json_goes_into_a_file_and_the_table_to_the_terminal(sweep: Path, tmp_path: Path) -> None:
    done = pamrig("run", sweep, "--clock", "virtual", "--out", tmp_path / "out", "--json", tmp_path / "r.json")
    assert json.loads((tmp_path / "r.json").read_text())["runs"][0]["valid"] is True
    assert "sine_2hz_0.10mpa" in done.stdout
    assert "1 of 1 records" in done.stdout


def test_without_out_the_records_lie_under_logs(sweep: Path, tmp_path: Path) -> None:
    done = pamrig("run", sweep, "--clock", "virtual", cwd=tmp_path)
    assert done.returncode == 0
    (file,) = (tmp_path / "logs").glob("*_short/*.mcap")
    assert contents(file).result["valid"] == "true"


# what is refused, before anything moves


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "Missing argument 'SWEEP'"),
        (["quik"], "quik: no such file, nor one of pamrig's own sweeps; did you mean 'quick'?"),
        (["/nowhere/x.yaml"], "/nowhere/x.yaml: no such file"),
        (["."], "cannot be read: Is a directory"),
        (["x" * 3000], "no such file"),
        (["quick", "--rig", "nosuch"], "nosuch: no such file, nor one of pamrig's own rigs"),
        (["quick", "--clock", "sundial"], "'sundial' is not one of 'real', 'virtual'"),
        (["quick", "--seed", "-3"], "-3 is not in the range x>=0"),
        (["quick", "--sed", "3"], "No such option '--sed'"),
        (["quick", "--out", "/dev/null"], "/dev/null: cannot be written: it is a file, and a folder is wanted"),
        (["quick", "--out", "/proc/nowhere"], "/proc/nowhere: cannot be made"),
        (["quick", "--json", "/nowhere/r.json"], "/nowhere/r.json: cannot be written: no such folder"),
    ],
)
def test_wrong_calls_are_one_line(arguments: list[str], says: str, tmp_path: Path) -> None:
    assert says in refused(pamrig("run", *arguments, cwd=tmp_path))
    assert not list(tmp_path.iterdir()), "nothing was made"


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("amplitude_mpa: 0.1", "amplitude_mpa: 0.9", "sine_2hz_0.90mpa: set-point p"),
        ("frequency_hz: 2.0", "frequency_hz: 90.0", "holds 90 Hz; a period of 5 ms allows 50 Hz"),
        ("frequency_hz: 2.0", "frequency: 2.0", "unknown key 'frequency'; did you mean 'frequency_hz'?"),
        ("ramp_in_s: 0.3", "ramp_in_s: 0.3 s", "ramp_in_s: expected a number, got '0.3 s'"),
        ("sine:", "sinus:", "did you mean 'sine'?"),
        ("name: short", "name: [", "not valid YAML"),
        ("records:", "recrods:", "records: expected a list of signals"),
    ],
)
def test_impossible_sweeps_are_one_line(sweep: Path, tmp_path: Path, old: str, new: str, says: str) -> None:
    sweep.write_text(SWEEP.replace(old, new))
    assert says in refused(pamrig("run", sweep, "--out", tmp_path / "out"))
    assert not (tmp_path / "out").exists()


def test_a_model_that_is_missing_is_one_line(sweep: Path, rig: Path, tmp_path: Path) -> None:
    rig.write_text(rig.read_text().replace("simulated.yaml", "simulatd.yaml"))
    assert "simulatd.yaml: no such file; did you mean" in refused(
        pamrig("run", sweep, "--rig", rig, "--out", tmp_path / "out")
    )


def test_nothing_is_ever_overwritten(sweep: Path, tmp_path: Path) -> None:
    for name, says in [
        ("sine_2hz_0.10mpa.mcap", "exists already"),
        ("sine_2hz_0.10mpa.mcap.partial", "an unfinished record lies there"),
    ]:
        folder = tmp_path / name
        folder.mkdir()
        (folder / name).write_text("precious")
        assert says in refused(pamrig("run", sweep, "--clock", "virtual", "--out", folder))
        assert [(p.name, p.read_text()) for p in folder.iterdir()] == [(name, "precious")]


# what goes wrong on the way


def test_a_full_disk_ends_in_an_invalid_record_and_not_in_a_dead_loop(tmp_path: Path) -> None:
    long = tmp_path / "long.yaml"
    long.write_text(SWEEP.replace("duration_s: 0.6", "duration_s: 210"))

    def little_room() -> None:  # more than the ring needs, less than the record
        resource.setrlimit(resource.RLIMIT_FSIZE, (2_100_000, 2_100_000))

    done = pamrig("run", long, "--clock", "virtual", "--out", tmp_path / "out", "--json", "-", prepare=little_room)
    assert done.returncode == 1, done
    assert "Traceback" not in done.stderr
    (run,) = json.loads(done.stdout)["runs"]
    assert run["valid"] is False
    assert "cannot be written: File too large" in run["error"]
    assert run["ticks"] == 42261, "the loop went on to the end"
    assert 0 < run["dropped"] < run["ticks"]
    assert Path(run["file"]).name.endswith(".partial")


def test_a_record_that_cannot_be_written_ends_those_that_were_to_follow(sweep: Path, rig: Path, tmp_path: Path) -> None:
    sweep.write_text(SWEEP.replace("amplitude_mpa: 0.1", "amplitude_mpa: [0.05, 0.06, 0.07, 0.08, 0.09, 0.1]"))
    running = Running(sweep, "--rig", rig, "--out", tmp_path / "out", "--json", "-")
    running.reach(Phase.SWEEP)
    shutil.rmtree(tmp_path / "out")
    status, result, error = running.end()
    assert status == 1
    assert "the rig was stopped" in error
    assert 1 <= len(result["runs"]) < 6
    assert running.rest == (0.2, 0.2)


@pytest.mark.parametrize("phase", [Phase.SETTLE, Phase.ZERO, Phase.RAMP_IN, Phase.SWEEP, Phase.RAMP_OUT])
def test_ctrl_c_in_every_phase_leaves_a_safe_rig_and_a_valid_file(
    phase: Phase, sweep: Path, rig: Path, tmp_path: Path
) -> None:
    run = Running(sweep, "--rig", rig, "--out", tmp_path / "out", "--json", "-")
    run.reach(phase)
    run.process.send_signal(signal.SIGINT)
    status, result, _ = run.end()
    assert status == 130
    assert result["interrupted"] is True
    (record,) = result["runs"]
    assert record["valid"] is (record["complete"] and record["missed"] == 0)
    assert record["complete"] is (phase is Phase.RAMP_OUT)
    assert record["fault"] == ""
    samples = contents(Path(record["file"])).samples
    assert samples[-1].state == State.DONE
    assert Phase.RAMP_OUT in {s.phase for s in samples}
    assert run.rest == pytest.approx((0.2, 0.2))
    assert not list(tmp_path.glob("out/*.partial"))


def test_ctrl_c_before_the_loop_moves_records_nothing(sweep: Path, rig: Path, tmp_path: Path) -> None:
    run = Running(sweep, "--rig", rig, "--out", tmp_path / "out", "--json", "-")
    run.process.send_signal(signal.SIGINT)
    status, result, _ = run.end()
    assert (status, result["runs"]) == (130, [])


def test_a_second_ctrl_c_is_an_emergency_stop(sweep: Path, rig: Path, tmp_path: Path) -> None:
    sweep.write_text(SWEEP.replace("ramp_out_s: 0.3", "ramp_out_s: 30"))
    run = Running(sweep, "--rig", rig, "--out", tmp_path / "out", "--json", "-")
    run.reach(Phase.SWEEP)
    run.process.send_signal(signal.SIGINT)
    run.reach(Phase.RAMP_OUT)
    run.process.send_signal(signal.SIGINT)
    status, result, _ = run.end()
    assert status == 130
    assert result["runs"][0]["fault"].startswith("ESTOP")
    assert result["runs"][0]["valid"] is False
    assert run.rest == pytest.approx((0.2, 0.2))


def test_sigterm_ramps_down_and_finishes_the_file(sweep: Path, rig: Path, tmp_path: Path) -> None:
    run = Running(sweep, "--rig", rig, "--out", tmp_path / "out", "--json", "-")
    run.reach(Phase.SWEEP)
    run.process.terminate()
    status, result, _ = run.end()
    assert status == 130
    assert contents(Path(result["runs"][0]["file"])).samples[-1].state == State.DONE


def test_a_terminal_that_is_closed_leaves_a_safe_rig_and_a_finished_file(
    sweep: Path, rig: Path, tmp_path: Path
) -> None:
    running = Running(sweep, "--rig", rig, "--out", tmp_path / "out", "--json", "-")
    running.reach(Phase.SWEEP)
    os.killpg(running.process.pid, signal.SIGHUP)  # the kernel tells every process of the terminal
    status, result, _ = running.end()
    assert status == 1
    (run,) = result["runs"]
    assert run["fault"].startswith("CONTROL_LOST")
    assert Path(run["file"]).name == "sine_2hz_0.10mpa.mcap"
    assert Path(run["file"]).exists()
    assert running.rest == (0.2, 0.2)
    assert not list(shared.folder().glob(f"{running.ring.block.path.name.removesuffix('-ring')}-*"))


def test_a_killed_recorder_stops_the_rig_and_the_record_is_invalid(sweep: Path, rig: Path, tmp_path: Path) -> None:
    run = Running(sweep, "--rig", rig, "--out", tmp_path / "out", "--json", "-")
    run.reach(Phase.ZERO)
    recorder = run.recorder()
    run.reach(Phase.SWEEP)
    recorder.kill()
    status, result, error = run.end()
    assert status == 1
    assert "RECORDER_DIED" in error
    (record,) = result["runs"]
    assert record["valid"] is False
    assert record["file"].endswith(".mcap.partial")
    assert Path(record["file"]).exists()
    assert record["ticks"] > 0
    assert run.rest == pytest.approx((0.2, 0.2))


def test_a_killed_loop_is_told_and_its_record_is_invalid(sweep: Path, rig: Path, tmp_path: Path) -> None:
    run = Running(sweep, "--rig", rig, "--out", tmp_path / "out", "--json", "-")
    run.reach(Phase.SWEEP)
    os.kill(run.ring.producer_pid, signal.SIGKILL)
    status, result, error = run.end()
    assert status == 1
    (record,) = result["runs"]
    assert record["valid"] is False
    assert record["fault"].startswith("LOOP_DIED")
    assert contents(Path(record["file"])).result["valid"] == "false"
    assert len(error.splitlines()) >= 1


def test_a_killed_command_leaves_a_safe_rig_and_a_finished_file(sweep: Path, rig: Path, tmp_path: Path) -> None:
    run = Running(sweep, "--rig", rig, "--out", tmp_path / "out")
    run.reach(Phase.SWEEP)
    loop = psutil.Process(run.ring.producer_pid)
    run.process.kill()
    run.process.communicate()
    psutil.wait_procs([loop], timeout=PATIENCE_S)
    assert not loop.is_running()
    last = run.ring.latest()
    assert last is not None
    assert (last.state, last.fault) == (State.FAULT, Fault.CONTROL_LOST)
    assert run.rest == pytest.approx((0.2, 0.2))
    (file,) = until(lambda: list(tmp_path.glob("out/*.mcap")))
    assert contents(file).result["valid"] == "false"
    for path in shared.folder().glob(f"{run.ring.block.path.name.removesuffix('-ring')}*"):
        path.unlink(missing_ok=True)


def test_a_command_that_hangs_loses_the_rig_to_the_safe_state(sweep: Path, rig: Path, tmp_path: Path) -> None:
    sweep.write_text(SWEEP.replace("duration_s: 0.6", "duration_s: 60"))
    run = Running(sweep, "--rig", rig, "--out", tmp_path / "out", "--json", "-")
    run.reach(Phase.SWEEP)
    run.process.send_signal(signal.SIGSTOP)  # as Ctrl-Z does
    until(lambda: (last := run.ring.latest()) is not None and last.fault == Fault.CONTROL_LOST)
    assert run.rest == pytest.approx((0.2, 0.2))
    run.process.send_signal(signal.SIGCONT)
    status, result, _ = run.end()
    assert status == 1
    assert result["runs"][0]["fault"].startswith("CONTROL_LOST")


# real-time permission


def without_privileges() -> None:
    """Take CAP_SYS_NICE and CAP_IPC_LOCK away from what is executed next; a user who is not root has neither."""
    import ctypes

    libc, drop_from_bounding_set = ctypes.CDLL(None), 24
    for capability in (23, 14):
        libc.prctl(drop_from_bounding_set, capability, 0, 0, 0)
    resource.setrlimit(resource.RLIMIT_RTPRIO, (0, 0))
    resource.setrlimit(resource.RLIMIT_MEMLOCK, (65536, 65536))


def test_without_permission_for_real_time_the_simulated_rig_runs_and_says_so(
    sweep: Path, rig: Path, tmp_path: Path
) -> None:
    done = pamrig("run", sweep, "--rig", rig, "--out", tmp_path / "out", "--json", "-", prepare=without_privileges)
    result = json.loads(done.stdout)
    assert result["realtime"]["fifo"].startswith("denied: ")
    assert "real-time measures not granted (fifo denied: " in done.stderr
    (record,) = result["runs"]
    assert record["complete"] is True
    assert "denied" in contents(Path(record["file"])).run["realtime"]
    assert done.returncode == (0 if record["valid"] else 1)

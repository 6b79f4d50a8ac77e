"""`pamrig run` when something goes wrong on the way: every way out leaves rig and file in order.

The phase in which a test strikes is watched in the loop's ring, not guessed by time.
"""

import json
import os
import resource
import shutil
import signal
from pathlib import Path

import psutil
import pytest
from support.records.mcap_files import contents
from support.run_command import LONG, PATIENCE_S, SWEEP, Running, pamrig, until

from rig.realtime import shared
from rig.realtime.faults import Fault
from rig.realtime.ring import CAPACITY
from rig.realtime.state import State
from rig.sample import SAMPLE_BYTES, Phase

pytest_plugins = "support.rigs.run_rig"
pytestmark = pytest.mark.real_time


def test_a_full_disk_ends_in_an_invalid_record_and_not_in_a_dead_loop(tmp_path: Path) -> None:
    long = tmp_path / "long.yaml"
    long.write_text(SWEEP.replace("duration_s: 0.6", "duration_s: 260"))

    room = round(1.1 * CAPACITY * (SAMPLE_BYTES + 8))  # more than the ring needs, less than the record

    def little_room() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))

    done = pamrig("run", long, "--clock", "virtual", "--out", tmp_path / "out", "--json", "-", prepare=little_room)
    assert done.returncode == 1, done
    assert "Traceback" not in done.stderr
    (run,) = json.loads(done.stdout)["runs"]
    assert run["valid"] is False
    assert "cannot be written: File too large" in run["error"]
    assert run["ticks"] == 52261, "the loop went on to the end"
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
    sweep.write_text(LONG[phase])
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
    sweep.write_text(LONG[Phase.SWEEP].replace("ramp_out_s: 0.3", "ramp_out_s: 30"))
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
    sweep.write_text(LONG[Phase.SWEEP])
    run = Running(sweep, "--rig", rig, "--out", tmp_path / "out", "--json", "-")
    run.reach(Phase.SWEEP)
    run.process.terminate()
    status, result, _ = run.end()
    assert status == 130
    assert contents(Path(result["runs"][0]["file"])).samples[-1].state == State.DONE


def test_a_terminal_that_is_closed_leaves_a_safe_rig_and_a_finished_file(
    sweep: Path, rig: Path, tmp_path: Path
) -> None:
    sweep.write_text(LONG[Phase.SWEEP])
    running = Running(sweep, "--rig", rig, "--out", tmp_path / "out", "--json", "-")
    running.reach(Phase.SWEEP)
    os.killpg(running.process.pid, signal.SIGHUP)  # the kernel tells every process of the terminal
    status, result, _ = running.end()
    assert status == 130
    (run,) = result["runs"]
    assert run["fault"] == ""
    assert contents(Path(run["file"])).samples[-1].state == State.DONE
    assert Path(run["file"]).name == "sine_2hz_0.10mpa.mcap"
    assert Path(run["file"]).exists()
    assert running.rest == (0.2, 0.2)
    assert not list(shared.folder().glob(f"{running.ring.block.path.name.removesuffix('-ring')}-*"))


def test_under_nohup_a_terminal_that_is_closed_ends_no_sweep(sweep: Path, rig: Path, tmp_path: Path) -> None:
    """The loop took it for the end of the process that commands."""
    sweep.write_text(LONG[Phase.SWEEP])
    running = Running(sweep, "--rig", rig, "--out", tmp_path / "out", "--json", "-", under=["nohup"])
    running.reach(Phase.SWEEP)
    os.killpg(running.process.pid, signal.SIGHUP)
    running.goes_on(ticks=200)
    running.process.terminate()
    status, result, _ = running.end()
    assert (status, result["runs"][0]["fault"]) == (130, "")


def test_a_killed_recorder_stops_the_rig_and_the_record_is_invalid(sweep: Path, rig: Path, tmp_path: Path) -> None:
    sweep.write_text(LONG[Phase.SWEEP])
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
    sweep.write_text(LONG[Phase.SWEEP])
    run = Running(sweep, "--rig", rig, "--out", tmp_path / "out", "--json", "-")
    run.reach(Phase.SWEEP)
    run.loop().kill()
    status, result, error = run.end()
    assert status == 1
    (record,) = result["runs"]
    assert record["valid"] is False
    assert record["fault"].startswith("LOOP_DIED")
    assert contents(Path(record["file"])).result["valid"] == "false"
    assert len(error.splitlines()) >= 1


def test_a_killed_command_leaves_a_safe_rig_and_a_finished_file(sweep: Path, rig: Path, tmp_path: Path) -> None:
    sweep.write_text(LONG[Phase.SWEEP])
    run = Running(sweep, "--rig", rig, "--out", tmp_path / "out")
    run.reach(Phase.SWEEP)
    loop = run.loop()
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
    sweep.write_text(LONG[Phase.SWEEP])
    run = Running(sweep, "--rig", rig, "--out", tmp_path / "out", "--json", "-")
    run.reach(Phase.SWEEP)
    run.process.send_signal(signal.SIGSTOP)  # as Ctrl-Z does
    until(lambda: (last := run.ring.latest()) is not None and last.fault == Fault.CONTROL_LOST)
    assert run.rest == pytest.approx((0.2, 0.2))
    run.process.send_signal(signal.SIGCONT)
    status, result, _ = run.end()
    assert status == 1
    assert result["runs"][0]["fault"].startswith("CONTROL_LOST")

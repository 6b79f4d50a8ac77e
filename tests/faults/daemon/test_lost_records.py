"""The place for the records goes away or fills up in the middle of a run: said at once, and in the exit status."""

import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner
from support.rigs.patient_rig import PATIENT

from rig.cli.service import daemon as cli_daemon
from rig.qualify.faults.bench import FaultBench, named_children

pytest_plugins = "support.rigs.run_rig"

AT_ONCE_S = 3.0
SWEEP = """\
settle_s: 0.1
zero_s: 0.05
ramp_in_s: 0.1
duration_s: 4.0
ramp_out_s: 0.1
records: [{sine: {frequency_hz: 0.5, amplitude_mpa: 0.2}}]
"""


def fill_up(recorder: int) -> None:
    """The files of this process may not grow any more: what a full disk is to it."""
    resource.prlimit(recorder, resource.RLIMIT_FSIZE, (1, resource.RLIM_INFINITY))


def make_room(recorder: int) -> None:
    resource.prlimit(recorder, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))


class Run:
    """`pamrig run` on the simulated rig, some way into its sweep."""

    def __init__(self, folder: Path, rig: Path) -> None:
        self.out = folder / "out"
        (folder / "sweep.yaml").write_text(SWEEP, encoding="utf-8")
        call = ["run", str(folder / "sweep.yaml"), "--rig", str(rig), "-o", str(self.out)]
        command = [sys.executable, "-m", "rig.cli.main", *call]
        self._said = folder / "stderr"
        with self._said.open("wb") as stderr:
            self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=stderr)
        self.wait(lambda: any(self.out.glob("*.partial")), "the record")
        time.sleep(0.5)

    def wait(self, condition: object, what: str, patience_s: float = 30.0) -> None:
        deadline = time.monotonic() + patience_s
        while not condition():  # type: ignore[operator]
            assert time.monotonic() < deadline, f"{what}: {self.said}"
            time.sleep(0.005)

    @property
    def said(self) -> str:
        return " ".join(self._said.read_text(encoding="utf-8").split())

    @property
    def recorder(self) -> int:
        return named_children(self.process.pid)["recorder"]


@pytest.fixture
def run(tmp_path: Path, rig: Path) -> Iterator[Run]:
    run = Run(tmp_path, rig)
    yield run
    run.process.kill()
    run.process.wait()


def test_a_run_whose_folder_is_deleted_ends_at_once_and_says_why(run: Run) -> None:
    shutil.rmtree(run.out)
    began = time.monotonic()
    assert run.process.wait(20) == 1
    assert time.monotonic() - began < AT_ONCE_S
    assert "the rig was stopped" in run.said
    assert str(run.out) in run.said


def test_a_run_on_a_full_disk_says_so_at_once_and_its_record_is_not_valid(run: Run) -> None:
    fill_up(run.recorder)
    run.wait(lambda: "cannot be written" in run.said, "the warning", AT_ONCE_S)
    assert run.process.poll() is None, "what is measured waits in memory: there may be room again"
    assert run.process.wait(20) == 1
    assert "not valid" in run.said


def test_a_run_goes_on_when_there_is_room_again(run: Run) -> None:
    recorder = run.recorder
    fill_up(recorder)
    run.wait(lambda: "cannot be written" in run.said, "the warning", AT_ONCE_S)
    make_room(recorder)
    missed_by_the_machine = "ticks missed"
    assert run.process.wait(20) == 0 or missed_by_the_machine in run.said, run.said
    assert "the record can be written again" in run.said
    assert not list(run.out.glob("*.partial"))


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[FaultBench]:
    with FaultBench(tmp_path, PATIENT) as bench:
        bench.ready()
        bench.wait(lambda: any(bench.logs.rglob("*.partial")), "the record")
        yield bench


def test_a_daemon_whose_folder_is_deleted_says_so_at_once_and_stops_the_sweep(bench: FaultBench) -> None:
    time.sleep(0.5)
    shutil.rmtree(bench.logs)
    error = bench.wait(lambda: bench.status()["recording_error"], "the status to say so", AT_ONCE_S)
    assert str(bench.logs) in error
    shown = CliRunner().invoke(cli_daemon.status, ["--socket", str(bench.socket)])
    assert str(bench.logs) in shown.output.replace("\n", "")
    status = bench.wait(lambda: (now := bench.status()) and not now["working"] and now, "the sweep to stop")
    assert [job["state"] for job in status["queue"]] == ["stopped"]
    assert status["queue"][0]["error"]
    assert status["fault"] is None
    refused = CliRunner().invoke(cli_daemon.start, [str(bench.sweep), "--only", "--socket", str(bench.socket)])
    assert "the folder for the records is gone" in str(refused.exception)


def test_a_daemon_on_a_full_disk_says_so_at_once_and_goes_on_when_there_is_room_again(bench: FaultBench) -> None:
    recorder = bench.pid("recorder")
    fill_up(recorder)
    error = bench.wait(lambda: bench.status()["recording_error"], "the status to say so", AT_ONCE_S)
    assert "cannot be written" in error
    make_room(recorder)
    bench.wait(lambda: not bench.status()["recording_error"], "the status to forget it", AT_ONCE_S)
    assert bench.status()["state"] == "running"


def test_who_waits_for_a_sweep_on_a_full_disk_gets_its_exit_status(bench: FaultBench) -> None:
    with bench.client() as client:
        client.stop()
        client.wait()
        client.clear()
    short = bench.folder / "short.yaml"
    short.write_text(SWEEP.replace("4.0", "1.0"), encoding="utf-8")
    fill_up(bench.pid("recorder"))
    done = CliRunner().invoke(cli_daemon.start, [str(short), "--wait", "--socket", str(bench.socket)])
    assert done.exit_code != 0
    assert done.exception is not None

"""`pamrig run` from outside: what it prints and writes, and how it refuses before anything moves."""

import json
import resource
from pathlib import Path

import pytest
from support.records.mcap_files import contents
from support.run_command import SWEEP, pamrig
from support.warm import Warm

pytest_plugins = "support.rigs.run_rig"


def refused(ended: tuple[int, str]) -> str:
    """The one line of a call that is wrong."""
    status, said = ended
    assert status == 2, said
    (line,) = said.splitlines()
    assert line.startswith("pamrig")
    return line


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
    assert "1 of 1 record" in done.stdout


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
        (["."], "cannot be read: it is a folder, and a file is meant"),
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
def test_wrong_calls_are_one_line(arguments: list[str], says: str, tmp_path: Path, warm: Warm) -> None:
    assert says in refused(warm.run(["pamrig", "run", *arguments], tmp_path))
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
def test_impossible_sweeps_are_one_line(sweep: Path, tmp_path: Path, warm: Warm, old: str, new: str, says: str) -> None:
    sweep.write_text(SWEEP.replace(old, new))
    assert says in refused(warm.run(["pamrig", "run", f"{sweep}", "--out", "out"], tmp_path))
    assert not (tmp_path / "out").exists()


def test_a_model_that_is_missing_is_one_line(sweep: Path, rig: Path, tmp_path: Path, warm: Warm) -> None:
    rig.write_text(rig.read_text().replace("simulated.yaml", "simulatd.yaml"))
    said = refused(warm.run(["pamrig", "run", f"{sweep}", "--rig", f"{rig}", "--out", "out"], tmp_path))
    assert "devices.main.model: " in said
    assert "simulatd.yaml; did you mean " in said


def test_nothing_is_ever_overwritten(sweep: Path, tmp_path: Path, warm: Warm) -> None:
    for name, says in [
        ("sine_2hz_0.10mpa.mcap", "exists already"),
        ("sine_2hz_0.10mpa.mcap.partial", "an unfinished record lies there"),
    ]:
        folder = tmp_path / name
        folder.mkdir()
        (folder / name).write_text("precious")
        assert says in refused(warm.run(["pamrig", "run", f"{sweep}", "--clock", "virtual", "--out", name], tmp_path))
        assert [(p.name, p.read_text()) for p in folder.iterdir()] == [(name, "precious")]


# real-time permission


def without_privileges() -> None:
    """Take CAP_SYS_NICE and CAP_IPC_LOCK away from what is executed next; a user who is not root has neither."""
    import ctypes

    libc, drop_from_bounding_set = ctypes.CDLL(None), 24
    for capability in (23, 14):
        libc.prctl(drop_from_bounding_set, capability, 0, 0, 0)
    resource.setrlimit(resource.RLIMIT_RTPRIO, (0, 0))
    resource.setrlimit(resource.RLIMIT_MEMLOCK, (65536, 65536))


@pytest.mark.real_time
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

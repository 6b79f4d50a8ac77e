"""Streams that are closed or full, and Ctrl-C while a process is being started: a fitting status, never a traceback."""

import multiprocessing
import os
import signal
import subprocess
import sys
from multiprocessing.connection import Connection
from pathlib import Path

import pytest
from support.records.made_logs import made_log
from support.run_command import PAMRIG

from rig.service.processes import start_process


def shell(command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["bash", "-c", f"set -o pipefail; {command}"], capture_output=True, text=True, timeout=60, check=False
    )


@pytest.mark.parametrize("arguments", ["gap effects", "gap effects --json -", "--help"])
@pytest.mark.parametrize("reader", ["| true", ">&-"])
def test_a_reader_that_has_seen_enough_is_no_failure(arguments: str, reader: str) -> None:
    done = shell(f"{PAMRIG} {arguments} {reader}")
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr


def test_a_full_output_is_one_line_and_status_2() -> None:
    done = shell(f"{PAMRIG} gap effects > /dev/full")
    assert done.returncode == 2
    assert done.stderr == "pamrig: the system: No space left on device\n"


def test_json_into_a_folder_is_refused_for_what_it_is(tmp_path: Path) -> None:
    done = shell(f"{PAMRIG} gap effects --json {tmp_path}")
    assert done.returncode == 2
    assert done.stderr == f"pamrig: {tmp_path}: cannot be written: it is a folder\n"


def tell_mask(pipe: Connection) -> None:
    pipe.send(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ()))


def test_ctrl_c_does_not_reach_a_process_that_is_being_started() -> None:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=tell_mask, args=(theirs,))
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    start_process(process)
    assert ours.poll(30)
    assert ours.recv() is True
    process.join()
    assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) == before


@pytest.mark.parametrize("package", ["click", "rig.cli.commands", "rig.errors", "rig.cli.runs.run", "rig.app.compose"])
def test_ctrl_c_while_pamrig_is_still_importing_ends_it_quietly(package: str) -> None:
    code = f"""
import sys

class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == {package!r}:
            raise KeyboardInterrupt

sys.meta_path.insert(0, Interrupting())
sys.argv = ["pamrig", "run", "quick", "--clock", "virtual"]
from rig.cli.main import main
main()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 130
    assert done.stderr.strip() in ("", "pamrig: interrupted")


def test_ctrl_c_before_anything_of_pamrig_is_imported_is_no_traceback() -> None:
    """What main.py imported first took some ten milliseconds, in which Python's own answer was a traceback."""
    code = """
import os, signal, sys

class Striking:
    def find_spec(self, name, path=None, target=None):
        if name in ("atexit", "threading", "time", "rig.cli.ctrl_c"):
            os.kill(os.getpid(), signal.SIGINT)

for name in ("atexit", "threading", "time"):  # a plain interpreter has not imported them yet
    sys.modules.pop(name, None)
signal.signal(signal.SIGINT, signal.default_int_handler)  # whoever runs the tests may have had it ignored
sys.meta_path.insert(0, Striking())
from rig.cli.main import main
sys.argv = ["pamrig", "completion", "bash"]
main()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (130, "")


DIES = """
    class Dying:
        def __del__(self):
            raise KeyboardInterrupt
    Dying()
    while True:
        pass
"""
STRIKES = {
    "in a destructor": DIES,
    "in a destructor, on a machine that then stands still": f"""
    started = threading.Thread.start

    def slowly(thread):
        started(thread)
        time.sleep(0.05)

    threading.Thread.start = slowly
{DIES}""",
    "in code made from text": """
    exec("raise KeyboardInterrupt")
""",
}


def test_a_sign_that_the_encoding_has_not_is_spelled_out(tmp_path: Path) -> None:
    """It ended the command in a traceback, with its answer."""
    made_log(tmp_path / "Ω.mcap")
    call = [PAMRIG, "log", "check", str(tmp_path)]
    env = os.environ | {"PYTHONIOENCODING": "latin-1"}
    done = subprocess.run(call, env=env, capture_output=True, timeout=60, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, f"{tmp_path}/\\u03a9.mcap: ok\n".encode(), b"")


@pytest.mark.real_time
@pytest.mark.parametrize("where", list(STRIKES))
def test_ctrl_c_is_heard_wherever_it_strikes(where: str, tmp_path: Path) -> None:
    (tmp_path / "struck.py").write_text(f"""
import signal, sys, threading, time
from rig.cli.completion import completion
from rig.cli.main import main

signal.signal(signal.SIGINT, signal.default_int_handler)  # whoever runs the tests may have had it ignored

def strike(**_):
{STRIKES[where]}

completion.callback = strike
sys.argv[1:] = ["completion", "bash"]
main()
""")
    call = [sys.executable, "-m", "struck"]
    done = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (130, "pamrig: interrupted\n")


ENDING = {
    "while something is still being ended": ("atexit.register(os.kill, os.getpid(), signal.SIGINT)", 130),
    "when nothing is left but to forget": ("sys.last = Last()", 0),
}


@pytest.mark.real_time
@pytest.mark.parametrize("moment", list(ENDING))
def test_ctrl_c_while_the_interpreter_ends_is_quiet(moment: str) -> None:
    strike, status = ENDING[moment]
    code = f"""
import atexit, os, signal, sys
from rig.cli.completion import completion
from rig.cli.main import main

class Last:
    def __del__(self, kill=os.kill, process=os.getpid(), number=signal.SIGINT):
        kill(process, number)

def strike(**_):
    {strike}

completion.callback = strike
sys.argv[1:] = ["completion", "bash"]
main()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (status, "")


def ended_by(
    error: BaseException, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> tuple[object, str]:
    """Status and error output of a command whose work ends in this error."""
    from rig.cli.commands import main
    from rig.cli.completion import completion

    def work(**_: object) -> None:
        raise error

    monkeypatch.setattr(completion, "callback", work)
    monkeypatch.setattr(sys, "argv", ["pamrig", "completion", "bash"])
    with pytest.raises(SystemExit) as ended:
        main()
    return ended.value.code, capsys.readouterr().err


def test_ctrl_c_during_the_work_is_one_line_and_status_130(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert ended_by(KeyboardInterrupt(), monkeypatch, capsys) == (130, "pamrig: interrupted\n")


@pytest.mark.parametrize(
    "error",
    [
        MemoryError("Unable to allocate 3.2 GiB for an array"),
        ImportError("_ufuncs.so: failed to map segment from shared object"),
        OSError("Could not find/load shared object file 'libllvmlite.so': libllvmlite.so: failed to map segment"),
        RuntimeError("can't start new thread"),
    ],
)
def test_a_command_that_gets_no_memory_says_so_in_one_line(
    error: Exception, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    said = "pamrig: not enough memory for this command (`ulimit -v`, or a limit of its container or service?)\n"
    assert ended_by(error, monkeypatch, capsys) == (2, said)

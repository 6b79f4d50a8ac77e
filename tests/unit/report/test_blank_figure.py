"""What somebody keeps as settings for his own plots changes no figure of a command, and ends none in a traceback."""

import os
import subprocess
from pathlib import Path

import pytest
from support.records.made_logs import made_log
from support.run_command import PAMRIG

USETEX = b"text.usetex: True\nfigure.figsize: 1, 1\n"
"""Of somebody who writes papers: without LaTeX each text is an error, with it `_` is one."""
NO_TEXT = b"\xff\xfe"


def plot(tmp_path: Path, backend: str = "agg") -> subprocess.CompletedProcess[str]:
    made_log(tmp_path / "a.mcap")
    call = [PAMRIG, "log", "plot", "a.mcap", "-o", "a.svg"]
    env = os.environ | {"MPLBACKEND": backend}
    return subprocess.run(call, cwd=tmp_path, env=env, capture_output=True, text=True, timeout=120, check=False)


@pytest.mark.parametrize(("backend", "settings"), [("none_of_them", b""), ("agg", USETEX)], ids=["backend", "usetex"])
def test_settings_of_somebodys_own_plots_are_for_those(tmp_path: Path, backend: str, settings: bytes) -> None:
    (tmp_path / "matplotlibrc").write_bytes(settings)
    done = plot(tmp_path, backend)
    assert (done.returncode, done.stdout, done.stderr) == (0, "a.svg\n", "")
    assert b'width="864pt"' in (tmp_path / "a.svg").read_bytes()


def test_settings_that_are_no_text_are_told_in_one_line(tmp_path: Path) -> None:
    """matplotlib reads a file of the current folder whatever it is told."""
    (tmp_path / "matplotlibrc").write_bytes(NO_TEXT)
    done = plot(tmp_path)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert done.stderr.splitlines()[-1].startswith("pamrig: no figure can be drawn: matplotlib does not load: ")

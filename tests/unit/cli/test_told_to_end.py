"""A command that is told to end by SIGTERM, or by its terminal that closes, leaves nothing half written behind."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from support.records.made_logs import made_content

from rig.log import exchange
from rig.log.log_files import SUFFIXES, holds_logs
from rig.outputs import OutputKind, writing

STRUCK = """
import os, signal, sys
from pathlib import Path
from rig.cli.completion import completion
from rig.cli.main import main
from rig.outputs import OutputKind, writing

signal.signal(signal.SIGHUP, signal.{before})  # whoever runs the tests may have had these ignored
signal.signal(signal.SIGINT, signal.default_int_handler)

def strike(**_):
    with writing(Path("out/x.json"), OutputKind.JSON) as part:
        part.write_text("[1]")
        os.kill(os.getpid(), signal.{sent})

completion.callback = strike
sys.argv[1:] = ["completion", "bash"]
main()
"""


def struck(folder: Path, sent: str, before: str = "SIG_DFL") -> tuple[int, str, list[str]]:
    """A command that gets that signal with its output half written: exit status, stderr, and what is in the folder."""
    call = [sys.executable, "-c", STRUCK.format(sent=sent, before=before)]
    done = subprocess.run(call, cwd=folder, capture_output=True, text=True, timeout=60, check=False)
    return done.returncode, done.stderr, [path.name for path in (folder / "out").iterdir()]


@pytest.mark.parametrize("sent", ["SIGTERM", "SIGHUP", "SIGINT"])
def test_a_command_that_is_told_to_end_leaves_nothing_half_written(tmp_path: Path, sent: str) -> None:
    assert struck(tmp_path, sent) == (130, "pamrig: interrupted\n", [])


def test_under_nohup_a_closed_terminal_ends_nothing(tmp_path: Path) -> None:
    assert struck(tmp_path, "SIGHUP", "SIG_IGN") == (0, "", ["x.json"])


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_what_a_killed_command_would_leave_is_no_log_of_its_folder(tmp_path: Path, suffix: str) -> None:
    with writing(tmp_path / f"x{suffix}", OutputKind.RECORDING) as part:
        part.write_text("t_s,dp_cmd_mpa\n")
        assert not holds_logs(tmp_path)
    assert holds_logs(tmp_path)


@pytest.mark.parametrize("kind", exchange.SUFFIXES)
def test_an_interrupted_export_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "link", interrupted)
    with pytest.raises(KeyboardInterrupt):
        exchange.export(made_content(20), tmp_path / f"x{exchange.SUFFIXES[kind]}", kind)
    assert not list(tmp_path.iterdir())

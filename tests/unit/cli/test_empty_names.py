"""An empty name of a file or folder, as a shell makes of a variable without a value, is no folder."""

from pathlib import Path

import pytest
from click.testing import CliRunner
from support.records.made_logs import made_log

from rig.cli.commands import cli


@pytest.fixture(autouse=True)
def among_records(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, of which an answer would be."""
    made_log(tmp_path / "run.mcap", 400)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    "call",
    [
        ["log", "info", ""],
        ["log", "check", "run.mcap", ""],
        ["validate", "model.yaml", ""],
        ["identify", "", "-o", "model.yaml"],
        ["identify", "run.mcap", "-o", ""],
        ["gap", "diagnose", "--model", "model.yaml", "--log", "run.mcap", "--baseline", ""],
        ["gap", "diagnose", "--model", "model.yaml", "--log="],
        ["run", "quick", "-o", "", "--clock", "virtual"],
        ["daemon", "--state", ""],
        ["status", "--json", ""],
    ],
    ids=" ".join,
)
def test_it_is_refused(call: list[str], among_records: Path) -> None:
    """It was the current folder, and the answer was of whatever lay there and below."""
    result = CliRunner().invoke(cli, call)
    assert (result.exit_code, result.stdout) == (2, "")
    assert "an empty name; `.` is the current folder" in result.stderr
    assert [file.name for file in among_records.iterdir()] == ["run.mcap"]


def test_the_current_folder_can_be_named() -> None:
    assert CliRunner().invoke(cli, ["log", "info", "."]).exit_code == 0

"""`pamrig rig new` and `rig check`, and completion in the shell: real processes, as a user calls them."""

import json
import os
import re
import subprocess
from pathlib import Path

import click
import pytest
from click.testing import CliRunner
from support.run_command import PAMRIG

from rig.app.compose import load
from rig.app.devices.new_rig import PATTERNS
from rig.cli.commands import COMMANDS, cli
from rig.cli.completion import OURS, SUFFIXES, WRITTEN, with_files
from rig.errors import ConfigError
from rig.outputs import Kind


def called(*words: object) -> dict[str, object]:
    result = CliRunner().invoke(cli, [*map(str, words), "--json", "-"], catch_exceptions=False)
    assert result.exit_code == 0
    found: dict[str, object] = json.loads(result.stdout[result.stdout.index("{\n") :])
    return found


@pytest.mark.parametrize("pattern", PATTERNS)
def test_every_pattern_becomes_a_rig_that_the_check_passes(tmp_path: Path, pattern: str) -> None:
    made = tmp_path / "sub" / "mine.yaml"
    called("rig", "new", "--like", pattern, "--yes", "--set", "period of the loop=10", "-o", made)
    assert called("rig", "check", made)["ok"] is True
    assert load(made).name == "mine"
    assert load(made).period_ns == 10_000_000
    text = made.read_text()
    assert not re.search(r"\.\./\S*(models|rigs|modbus)/", text)  # pamrig's own files by name: they move with updates


def test_questions_are_answered_on_the_terminal(tmp_path: Path) -> None:
    made = tmp_path / "mine.yaml"
    answers = ["simulated", "bench 3", "", "0.01", "0.4", "0.15", "0.15", "-45", "45"]
    done = CliRunner().invoke(cli, ["rig", "new", "-o", str(made)], input="\n".join(answers) + "\n" * 20)
    assert done.exit_code == 0, done.output
    rig = load(made)
    assert rig.name == "bench 3"
    assert rig.limits.pressure_mpa == (0.01, 0.4)
    assert (rig.safe.p1_mpa, rig.limits.angle_deg) == (0.15, (-45.0, 45.0))


def test_an_answer_to_nothing_is_said_before_anything_is_asked(tmp_path: Path) -> None:
    call = ["rig", "new", "--like", "simulated", "--set", "nonsense=1", "-o", str(tmp_path / "mine.yaml")]
    done = CliRunner().invoke(cli, call)
    assert isinstance(done.exception, ConfigError)
    assert done.output == ""


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--set", "safe pressure of muscle 1=0.9"], "safe.p1_mpa: 0.9 MPa is outside"),
        (["--set", "period of the loop=soon"], "expected a number"),
        (
            ["--set", "nonsense=1"],
            "--set nonsense: nothing is asked by that name; allowed: highest angle, highest press",
        ),
        (["--set", "period of the lop=5"], "did you mean 'period of the loop'"),
        (["--set", "name"], "--set name: expected QUESTION=ANSWER, for example --set name=mine"),
        (["--set", "name= "], "expected QUESTION=ANSWER"),
        (["--like", "simulatd"], "did you mean 'simulated'"),
    ],
)
def test_an_answer_that_makes_no_rig_writes_nothing(tmp_path: Path, words: list[str], said: str) -> None:
    made = tmp_path / "mine.yaml"
    with pytest.raises(ConfigError, match=said):
        cli.main(["rig", "new", "--yes", *words, "-o", str(made)], standalone_mode=False)
    assert list(tmp_path.iterdir()) == []


def completed(line: str, folder: Path) -> set[str]:
    words = line.split(" ")
    asked = {"COMP_WORDS": line, "COMP_CWORD": str(len(words) - 1), "_PAMRIG_COMPLETE": "bash_complete"}
    done = subprocess.run([PAMRIG], env=os.environ | asked, cwd=folder, capture_output=True, text=True, check=True)
    return {one.partition(",")[2] for one in done.stdout.splitlines()}


def test_files_are_completed_by_what_an_argument_takes(tmp_path: Path) -> None:
    for name in ("a.mcap", "a.csv.gz", "a.yaml", "a.txt", ".hidden.mcap"):
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "apart").mkdir()
    assert completed("pamrig log info a", tmp_path) == {"a.mcap", "a.csv.gz", "apart/"}
    assert completed("pamrig identify a.mcap -o a", tmp_path) == {"a.yaml", "apart/"}
    assert completed("pamrig run pa", tmp_path) == {"paper", "paper_fig1"}
    assert completed("pamrig rig ch", tmp_path) == {"check"}
    assert "--mapping" in completed("pamrig log import --", tmp_path)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_each_shell_gets_its_script(shell: str) -> None:
    done = CliRunner().invoke(cli, ["completion", shell])
    assert done.exit_code == 0
    assert "_PAMRIG_COMPLETE" in done.output


def every_command(command: click.Command) -> list[click.Command]:
    below = command.commands.values() if isinstance(command, click.Group) else ()
    return [command, *(found for one in below for found in every_command(one))]


def test_every_parameter_that_takes_a_file_says_which() -> None:
    assert set(WRITTEN) == set(Kind)
    assert set(OURS) <= set(SUFFIXES)
    context = click.Context(cli)
    read = {
        param.name
        for name in COMMANDS
        for one in every_command(with_files(cli.get_command(context, name) or cli))
        for param in one.params
        if isinstance(param.type, click.Path) and param.type.file_okay
    }
    assert read <= set(SUFFIXES)

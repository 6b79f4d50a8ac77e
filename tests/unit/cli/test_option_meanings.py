"""An option means one thing wherever it stands, and one thing is asked for by one option."""

from collections import defaultdict
from pathlib import Path

import click
import pytest
from click.testing import CliRunner
from support.click_tree import parameters

from rig.cli.commands import cli
from rig.cli.outputs import Output
from rig.outputs import OutputKind

MODEL = "configs/models/simulated.yaml"
ASKED_BY = {
    OutputKind.JSON: {"--json"},
    OutputKind.PAGE: {"--html"},
    OutputKind.FIGURE: {"--figure", "-o"},
    OutputKind.FOLDER: {"--figures", "-o"},
}
"""What is written -> the options by which that is asked for; the rest of what is written is a command's -o."""
BESIDE = {"log plot"}
"""Where a figure is all that a command makes, and its -o."""


def kind(option: click.Option) -> str:
    """What an option takes: nothing, a number, one of some words, a file of some kind, or a text of some form."""
    if option.is_flag:
        return "nothing"
    if isinstance(option.type, Output):
        return option.type.kind.value
    if isinstance(option.type, click.Choice):
        return "a word"
    if isinstance(option.type, click.Path):
        return f"a path, {option.metavar}"
    return f"a {option.type.name}" if option.metavar is None else option.metavar


def writes(option: click.Option) -> OutputKind | None:
    return option.type.kind if isinstance(option.type, Output) else None


ALL = [(name, param) for name, param in parameters(cli) if isinstance(param, click.Option)]


def test_an_option_takes_the_same_wherever_it_stands() -> None:
    taken: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    for command, option in ALL:
        for name in set(option.opts) - {"-o", "--output", "--out"}:
            taken[name][kind(option)].append(command)
    assert {name: dict(kinds) for name, kinds in taken.items() if len(kinds) > 1} == {}


@pytest.mark.parametrize("wanted", ASKED_BY)
def test_what_is_written_is_asked_for_by_one_name(wanted: OutputKind) -> None:
    asking = [(command, option.opts[0]) for command, option in ALL if writes(option) is wanted]
    assert {name for _, name in asking} == ASKED_BY[wanted]
    if wanted is OutputKind.FIGURE:
        assert {command for command, name in asking if name == "-o"} == BESIDE


def test_an_output_says_whether_it_is_a_file_or_a_folder() -> None:
    for command, option in ALL:
        if not isinstance(option.type, Output):
            continue
        told = "OUT" if option.type.or_folder else "DIR" if option.type.kind is OutputKind.FOLDER else None
        assert told is None or option.metavar == told, (command, option.opts)
        assert told is not None or option.metavar not in ("OUT", "DIR"), (command, option.opts)


def test_a_model_is_named_by_its_option() -> None:
    """`pamrig validate MODEL.yaml LOG...` alone has it as an argument: it is called so everywhere."""
    named = {command for command, option in ALL if "--model" in option.opts}
    gap = {f"gap {name}" for name in ("capability", "design", "diagnose", "history", "hunt")}
    assert named == {"simulate", "replay", "track", "tune", *gap}


@pytest.mark.parametrize("words", ["tune", "gap capability", "gap design -o out.yaml"])
@pytest.mark.parametrize("given", [(), (MODEL, "--model", MODEL)])
def test_one_model_is_named(words: str, given: tuple[str, ...]) -> None:
    done = CliRunner().invoke(cli, [*words.split(), *given])
    assert done.exit_code == 2
    assert "name the simulator: --model MODEL.yaml" in done.output


@pytest.mark.parametrize(
    ("words", "option"),
    [
        ("identify x.mcap -o m.yaml --start simulated --p0 0.3", "--p0"),
        ("identify x.mcap -o m.yaml --start simulated --kind bw", "--kind"),
        ("identify x.mcap -o m.yaml --start simulated --no-free-offset", "--free-offset"),
        ("simulate quick --model simulated -o out --family bellows", "--family"),
        ("simulate quick --model simulated -o out --session 3", "--session"),
        ("simulate quick --plant 1 -o out --input pressure", "--input"),
        ("gap hunt --model simulated --daemon --seed 3", "--seed"),
        ("gap hunt --model simulated --daemon --clock virtual", "--clock"),
        ("gap hunt --model simulated --socket s", "--socket"),
        ("gap check score folder --labels l.json --experiments 1", "--experiments"),
        ("devices probe --step-mpa 0.05", "--step-mpa"),
        ("devices calibrate angle -o c.yaml --levels 0.1,0.2", "--levels"),
        ("devices calibrate --points p.yaml -o c.yaml --settle 3", "--settle"),
    ],
)
def test_an_option_that_would_be_passed_over_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: str, option: str
) -> None:
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(cli, words.split())
    assert done.exit_code == 2
    assert f"Error: {option}: " in done.output


def test_names_of_before_are_understood_and_in_no_help(tmp_path: Path) -> None:
    words = ["tune", MODEL, "--reference", "tracking", "-o", str(tmp_path / "tuned.yaml")]
    done = CliRunner().invoke(cli, words)
    assert done.exit_code == 0, done.output
    assert (tmp_path / "tuned.yaml").exists()
    said = CliRunner().invoke(cli, ["tune", "--help"]).output
    assert "--reference" not in said
    assert "Usage: cli tune [OPTIONS]\n" in said

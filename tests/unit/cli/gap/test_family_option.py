"""Wherever a plant family is named it is one of those that there are; nobody waits for numpy to be told so."""

import subprocess
import sys
from collections.abc import Iterator

import click
import pytest
from click.testing import CliRunner

from hil.reference.names import NAMES
from rig.cli.commands import cli


def commands(group: click.Group, context: click.Context, path: str = "") -> Iterator[tuple[str, click.Command]]:
    """Every command of the command line, by how it is called."""
    for name in group.list_commands(context):
        found = group.get_command(context, name)
        assert found is not None
        called = f"{path} {name}".strip()
        yield called, found
        if isinstance(found, click.Group):
            yield from commands(found, context, called)


ASKED = {
    f"{called} {option.opts[0]}": option
    for called, command in commands(cli, click.Context(cli))
    for option in command.params
    if option.opts[0] in ("--family", "--leave-out")
}


@pytest.mark.parametrize("called", ASKED)
def test_the_choice_is_the_families(called: str) -> None:
    choice = ASKED[called].type
    assert isinstance(choice, click.Choice)
    assert tuple(name for name in choice.choices if name != "none") == NAMES
    assert ("none" in choice.choices) == (called == "gap design --family")


def test_it_is_asked_in_every_command_that_has_plants() -> None:
    named = {called.partition(" --")[0] for called in ASKED}
    assert {"simulate", "gap calibrate", "gap design", "gap check", "gap study odds", "gap study sizes"} <= named


@pytest.mark.parametrize(
    "words",
    ["gap design configs/models/simulated.yaml -o x.yaml --family", "simulate quick -o x.mcap --plant 1 --family"],
)
def test_another_name_is_refused_with_those_that_there_are(words: str) -> None:
    done = CliRunner().invoke(cli, [*words.split(), "piston"])
    assert done.exit_code == 2
    assert all(name in done.output for name in ("piston", *NAMES))


def test_the_names_bring_no_plant_and_no_numpy() -> None:
    script = "import sys, rig.cli.common; print('numpy' in sys.modules, 'hil.reference.families' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert done.stdout.split() == ["False", "False"]

"""Wherever a plant family is named it is one of those that there are; nobody waits for numpy to be told so."""

import subprocess
import sys

import click
import pytest
from click.testing import CliRunner
from support.click_tree import parameters

from hil.reference.names import NAMES
from rig.cli.commands import cli

ASKED = {
    f"{called} {option.opts[0]}": option
    for called, option in parameters(cli)
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

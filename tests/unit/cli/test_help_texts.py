"""Help texts are whole sentences, and one option means one thing wherever it stands."""

import re

import click
import pytest
from support.click_tree import commands

from rig.cli.commands import cli
from rig.gap.answer.words.effects import EFFECT_WORDS

CALLED = {
    "--rig": "RIG.yaml",
    "--model": "MODEL.yaml",
    "--sweep": "SWEEP.yaml",
    "model": "MODEL.yaml",
    "logs": "LOG...",
}
"""Option or argument that takes a file -> what it is called in the help."""
OUTPUT = {"-o", "--output", "--out"}
BEGINS_LIKE_A_SENTENCE = re.compile(r"[A-Z0-9]")
ENDS_LIKE_ONE = re.compile(r"[.:](\s*\[[^]]*\])?$")


def is_sentence(text: str | None) -> bool:
    shown = " ".join((text or "").split())
    return bool(BEGINS_LIKE_A_SENTENCE.match(shown) and ENDS_LIKE_ONE.search(shown))


ALL = dict(commands(cli, "pamrig"))


@pytest.mark.parametrize("name", ALL)
def test_what_help_says_are_sentences(name: str) -> None:
    command = ALL[name]
    assert is_sentence(command.help), command.help
    options = [param for param in command.params if isinstance(param, click.Option)]
    assert [(option.opts, option.help) for option in options if not is_sentence(option.help)] == []


@pytest.mark.parametrize("name", [name for name, command in ALL.items() if isinstance(command, click.Group)])
def test_the_list_of_a_group_cuts_no_sentence(name: str) -> None:
    context = click.Context(ALL[name], info_name=name, terminal_width=80, max_content_width=80)
    _, _, listed = ALL[name].get_help(context).partition("Commands:")
    assert listed
    assert [line for line in listed.splitlines() if line.endswith("...")] == []


def test_output_has_the_same_names_everywhere() -> None:
    named = [OUTPUT & set(param.opts) for command in ALL.values() for param in command.params]
    assert {frozenset(names) for names in named if names} == {frozenset(OUTPUT)}


def test_a_file_is_called_the_same_in_every_command() -> None:
    params = [param for command in ALL.values() for param in command.params if isinstance(param.type, click.Path)]
    files = {(param.opts[0], param.metavar) for param in params if param.opts[0] in CALLED}
    assert files == set(CALLED.items())


def test_what_a_group_is_for_stands_first() -> None:
    gap = ALL["pamrig gap"]
    assert isinstance(gap, click.Group)
    assert gap.list_commands(click.Context(gap))[0] == "diagnose"


def test_what_an_answer_tells_to_call_is_a_command() -> None:
    told = [text for one in EFFECT_WORDS.values() for text in (one.reasons, one.look_at)]
    named = {found for text in told for found in re.findall(r"pamrig (?:[a-z]+ ?){1,2}", text)}
    assert named
    assert {found.strip() for found in named} <= set(ALL)


@pytest.mark.parametrize("text", [None, "", "no capital.", "No end"])
def test_what_is_no_sentence_is_found(text: str | None) -> None:
    assert not is_sentence(text)

"""Help texts are whole sentences, and one option means one thing wherever it stands."""

import re
from collections.abc import Iterator

import click
import pytest

from rig.cli.commands import cli

OUTPUT = {"-o", "--output", "--out"}
BEGINS_LIKE_A_SENTENCE = re.compile(r"[A-Z0-9]")
ENDS_LIKE_ONE = re.compile(r"[.:](\s*\[[^]]*\])?$")


def commands(command: click.Command, name: str = "pamrig") -> Iterator[tuple[str, click.Command]]:
    yield name, command
    if isinstance(command, click.Group):
        context = click.Context(command)
        for item in command.list_commands(context):
            sub = command.get_command(context, item)
            assert sub is not None
            yield from commands(sub, f"{name} {item}")


def is_sentence(text: str | None) -> bool:
    shown = " ".join((text or "").split())
    return bool(BEGINS_LIKE_A_SENTENCE.match(shown) and ENDS_LIKE_ONE.search(shown))


ALL = dict(commands(cli))


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


@pytest.mark.parametrize("name", ALL)
def test_output_has_the_same_names_everywhere(name: str) -> None:
    for param in ALL[name].params:
        named = OUTPUT & set(param.opts)
        assert not named or named == OUTPUT


@pytest.mark.parametrize("text", [None, "", "no capital.", "No end"])
def test_what_is_no_sentence_is_found(text: str | None) -> None:
    assert not is_sentence(text)

"""`pamrig gap check` is a blind check and nothing else; studies of the method have a group of their own."""

import click

from rig.cli.gap.group import gap


def steps(name: str) -> list[str]:
    """The commands of a group of `pamrig gap`."""
    group = gap.commands[name]
    assert isinstance(group, click.Group)
    return list(group.commands)


def test_a_check_has_its_steps_and_what_is_made_of_scored_ones() -> None:
    assert steps("check") == ["make", "answer", "score", "merge", "compare"]


def test_a_study_stands_in_one_place() -> None:
    assert steps("study") == [
        "sizes",
        "absorbed",
        "sensitivity",
        "intervals",
        "odds",
        "laws",
        "usual",
        "noise",
        "temperature",
    ]

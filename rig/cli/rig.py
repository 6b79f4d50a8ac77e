"""`pamrig rig`: a rig's YAML, made and checked."""

from pathlib import Path
from typing import Any

import click

from rig.app.terminal import console, listing, styled
from rig.cli.common import emit, json_option
from rig.cli.outputs import Group, output_option
from rig.number_text import counted
from rig.outputs import OutputKind


@click.group(name="rig", cls=Group)
def rig() -> None:
    """Make a rig's YAML, and check one."""


@rig.command(short_help="Make a rig's YAML.")
@click.option("--like", metavar="PATTERN", help="Which of pamrig's own rigs it is like; asked for unless given.")
@click.option(
    "--set",
    "given",
    multiple=True,
    metavar="QUESTION=ANSWER",
    help="An answer beforehand: name=mine, or 'period of the loop=10'. Repeatable.",
)
@click.option("--yes", is_flag=True, help="Take the default of whatever is not given; nothing is asked.")
@output_option(OutputKind.RIG, "Where the YAML goes.", required=True, metavar="RIG.yaml")
@json_option
def new(like: str | None, given: tuple[str, ...], yes: bool, output: Path, json_to: str | None) -> None:
    """Ask what is there (devices, ranges, safe pressures) and write the YAML of a rig that `pamrig rig check` passes.

    A question's short form is its words before the comma. Nothing is opened and nothing moves.
    """
    from rig.app.devices.new_rig import PATTERNS, filled, questions_of, short_form, write_rig
    from rig.config import suggest
    from rig.errors import ConfigError

    if output.is_file():  # by now it may hold what was found out at the rig
        raise ConfigError(f"{output}: exists already; name another file, or remove that one first")
    answers = _answers(given)
    pattern = like or ("simulated" if yes else _chosen(PATTERNS))
    if pattern not in PATTERNS:
        raise ConfigError(f"--like: unknown pattern {pattern!r}; {suggest(pattern, list(PATTERNS))}")

    questions = questions_of(pattern)
    for unasked in answers.keys() - questions:
        raise ConfigError(f"--set {unasked}: nothing is asked by that name; {suggest(unasked, questions)}")

    def ask(question: str, usual: Any) -> Any:
        if (short := short_form(question)) in answers:
            return _as(answers[short], usual, short)
        return usual if yes else click.prompt(question, default=usual, type=type(usual))

    raw = filled(pattern, output, ask)
    made = write_rig(raw, output)
    console(json_to).print(
        f"{output}: {made.name}; `pamrig rig check {output}`, then `pamrig devices probe --rig {output}`"
    )
    emit({"file": str(output), "rig": made.name, "pattern": pattern}, json_to)


@rig.command(short_help="Check a rig's YAML.")
@click.argument("rig_path", metavar="RIG.yaml", type=click.Path(path_type=Path))
@json_option
def check(rig_path: Path, json_to: str | None) -> None:
    """Is RIG.yaml a rig: keys, ranges, roles, devices' settings and wiring, files it names? Nothing is opened.

    Exit status 2 with one line when it is not; what an operator should know is said as a warning.
    """
    from rig.app import compose, inventory

    found = inventory.inventory(compose.load(rig_path))
    screen = console(json_to)
    screen.print(
        f"{rig_path}: ok: {found['rig']}, {found['period_ms']:g} ms, {counted(len(found['devices']), 'device')}"
    )
    for warning in found["warnings"]:
        screen.print(styled(("warning:", "yellow"), f" {warning}"))
    emit({"file": str(rig_path), "ok": True, "rig": found["rig"], "warnings": found["warnings"]}, json_to)


def _chosen(patterns: dict[str, str]) -> str:
    table = listing("like", "what is there")
    for name, what in patterns.items():
        table.add_row(name, what)
    console(None).print(table)
    answer: str = click.prompt("which is it like", default="simulated", type=click.Choice(list(patterns)))
    return answer


def _answers(given: tuple[str, ...]) -> dict[str, str]:
    from rig.errors import ConfigError

    found = {}
    for text in given:
        question, equals, answer = text.partition("=")
        if not (equals and question.strip() and answer.strip()):
            raise ConfigError(f"--set {text}: expected QUESTION=ANSWER, for example --set name=mine")
        found[question.strip()] = answer
    return found


def _as(text: str, usual: Any, question: str) -> Any:
    """An answer of the type of the usual one."""
    from rig.errors import ConfigError

    try:
        return type(usual)(text)
    except ValueError:
        raise ConfigError(f"--set {question}={text}: expected a number like {usual}") from None

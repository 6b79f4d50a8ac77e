"""`pamrig gap check`: the blind check, as a whole or in its three steps, and scored checks together."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rig.app.terminal import console
from rig.cli.common import emit, json_option
from rig.cli.gap.check_options import (
    Drawn,
    dask_option,
    drawn_options,
    experiments_option,
    folder_argument,
    former_source_options,
)
from rig.cli.gap.options import html_option, page_option, path_type, workers_option
from rig.cli.outputs import Group, options_behind_the_step, output_option, refuse_options, write_errors_last
from rig.number_text import counted
from rig.outputs import OutputKind

if TYPE_CHECKING:
    from rig.blind_check.folder import CheckFolder
    from rig.blind_check.source import Source


@click.group(cls=Group, invoke_without_command=True, short_help="The blind check of the diagnosis.")
@drawn_options
@output_option(
    OutputKind.FOLDER,
    "Folder of the check; one that is there is resumed. Default: a new one under logs/.",
    metavar="DIR",
)
@click.option("--keep", is_flag=True, help="Keep the questions' records after they are scored.")
@experiments_option
@html_option
@json_option
@click.pass_context
def check(
    context: click.Context,
    drawn: Drawn,
    output: Path | None,
    keep: bool,
    experiments: int,
    html_to: Path | None,
    json_to: str | None,
) -> None:
    """Diagnose cases whose labels are withheld, then open the labels and score.

    The hash of the labels is printed first. Without a step, all three are done: make, answer, score.
    """
    if context.invoked_subcommand is not None:
        options_behind_the_step(context)
        return
    import time
    from functools import partial

    from rig.app.gap.blind_checking import spread
    from rig.app.runs.record_folders import new_folder
    from rig.blind_check.check import make_answer_score, result_of
    from rig.blind_check.folder import CheckFolder
    from rig.blind_check.generate import units

    begun, folder = time.monotonic(), CheckFolder((output or new_folder("check")).resolve())
    source = _sealed(folder, drawn, json_to)
    work = partial(make_answer_score, keep=keep, rounds=experiments)
    spread(work, units(source, folder), drawn.cases, "cases", drawn.dask, drawn.workers)
    _report(folder, result_of(folder) | {"seconds_of_this_run": time.monotonic() - begun}, html_to, json_to)


@check.command(short_help="Draw and seal the labels, and write the questions.")
@folder_argument
@drawn_options
def make(folder: Path, drawn: Drawn) -> None:
    """Draw and seal the labels, then write the questions into FOLDER.

    Whoever answers gets sealed.json and the folder questions; labels and key stay in the folder maker.
    """
    from rig.app.gap.blind_checking import spread
    from rig.blind_check.folder import CheckFolder
    from rig.blind_check.generate import make_unit, units

    place = CheckFolder(folder)
    work = units(_sealed(place, drawn, None), place)
    spread(make_unit, work, len(work), "units", drawn.dask, drawn.workers)
    console().print(f"{folder}: {drawn.cases} questions")


@check.command(short_help="Answer the questions, each in a process alone.")
@folder_argument
@dask_option
@workers_option
def answer(folder: Path, dask: str | None, workers: int | None) -> None:
    """Answer the questions in FOLDER, each in a process that sees nothing but them.

    A question of your own is a folder questions/NAME with records/, baselines/day_1/ ... and model.yaml.
    """
    from functools import partial

    from rig.app.gap.blind_checking import questions_in, spread
    from rig.blind_check.check import CHUNK, answer_chunk
    from rig.blind_check.folder import CheckFolder

    place = CheckFolder(folder)
    tokens = questions_in(place)
    chunks = [tokens[start : start + CHUNK] for start in range(0, len(tokens), CHUNK)]
    spread(partial(answer_chunk, place), chunks, len(tokens), "answers", dask, workers)
    console().print(f"{folder}: {counted(len(tokens), 'answer')}")


@check.command(short_help="Open the labels and score the answers.")
@folder_argument
@click.option(
    "--labels",
    type=click.Path(path_type=Path),
    metavar="LABELS.json",
    help="Labels of your own records as JSON, in place of sealed ones.",
)
@experiments_option
@former_source_options
@dask_option
@workers_option
@html_option
@json_option
def score(
    folder: Path, labels: Path | None, experiments: int, dask: str | None, workers: int | None, html_to: Path | None,
    json_to: str | None,
) -> None:  # fmt: skip
    """Open the labels of FOLDER and score its answers; recommended experiments are carried out first."""
    from functools import partial

    from rig.app.gap.blind_checking import source_of_labels, spread
    from rig.blind_check.check import result_of, score_unit
    from rig.blind_check.folder import CheckFolder
    from rig.blind_check.generate import units
    from rig.blind_check.user_labels import score_own

    place = CheckFolder(folder)
    if labels is not None:
        refuse_options(("experiments", "dask", "workers"), "goes with sealed labels; --labels carries out nothing")
        _report(place, score_own(place, labels), html_to, json_to)
        return
    work = units(source_of_labels(place), place)
    spread(
        partial(score_unit, rounds=experiments), work, sum(len(unit.tokens) for unit in work), "cases", dask, workers
    )
    _report(place, result_of(place), html_to, json_to)


@check.command(short_help="Count several scored checks as one.")
@click.argument("folders", nargs=-1, required=True, type=path_type)
@click.option("--unfinished", is_flag=True, help="Count what is scored so far of checks that were stopped.")
@html_option
@json_option
def merge(folders: tuple[Path, ...], unfinished: bool, html_to: Path | None, json_to: str | None) -> None:
    """Count several scored checks as one; each is named with its seed and hash. A .md is the page of results."""
    from rig.blind_check.check import result_of_all
    from rig.blind_check.folder import CheckFolder
    from rig.report.check_page import check_table, write_page

    result = result_of_all([CheckFolder(folder) for folder in folders], unfinished)
    if html_to is not None:
        with write_errors_last():
            write_page(result, html_to)
    console(json_to).print(check_table(result))
    emit(result, json_to)


@check.command(short_help="Two scored checks of the same cases side by side.")
@click.argument("first", type=path_type)
@click.argument("other", type=path_type)
@page_option
@json_option
def compare(first: Path, other: Path, html_to: Path | None, json_to: str | None) -> None:
    """Two scored checks of the same cases beside each other: of two methods, or of two sessions (--sweep)."""
    from rig.blind_check.folder import CheckFolder
    from rig.blind_check.paired import compared
    from rig.outputs import write_text
    from rig.report.check_pairs import pairs_page, pairs_table

    found = compared(CheckFolder(first), CheckFolder(other))
    if html_to is not None:
        with write_errors_last():
            write_text(html_to, pairs_page(found), OutputKind.PAGE)
    console(json_to).print(pairs_table(found))
    emit(found.to_json(), json_to)


def _sealed(folder: "CheckFolder", drawn: Drawn, json_to: str | None) -> "Source":
    """The generator of the cases; the hash of their labels is printed before anything is computed."""
    from rig.app.gap.blind_checking import seal, source_and_modes

    source, modes = source_and_modes(
        drawn.records, drawn.development, drawn.families, drawn.modes, drawn.sweep, drawn.own_zero
    )
    sha256 = seal(source, folder, drawn.cases, drawn.seed, modes, not drawn.no_angle, drawn.priors)
    terminal = console(json_to)
    terminal.print(f"sealed labels, SHA-256: {sha256}")
    terminal.print(f"folder: {folder.root}")
    return source


def _report(folder: "CheckFolder", result: dict[str, Any], html_to: Path | None, json_to: str | None) -> None:
    """Keep the result, write the page, print the table."""
    from rig.blind_check.check import write_result
    from rig.report.check_page import check_table, write_page

    kept = write_result(folder, result)
    page = html_to or folder.root / "result.html"
    terminal = console(json_to)
    terminal.print(check_table(result))
    terminal.print(str(kept))
    with write_errors_last():
        write_page(result, page)
        terminal.print(str(page))
    emit(result, json_to)

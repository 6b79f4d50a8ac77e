"""`pamrig gap check`: the blind check, as a whole or in its three steps."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rig.app.terminal import console
from rig.blind_check.modes import ROUNDS
from rig.cli.common import emit, json_option
from rig.cli.outputs import Group, Output, output_option
from rig.outputs import Kind

if TYPE_CHECKING:
    from rig.blind_check.folder import CheckFolder

_place = click.Path(path_type=Path, resolve_path=True)
"""Made absolute here: whoever answers works in another folder than the caller."""
_folder = click.argument("folder", type=_place)
_cases = click.option("--cases", type=click.IntRange(4, 100_000), default=40, show_default=True, help="How many cases.")
_seed = click.option(
    "--seed", type=click.IntRange(0), help="Seed of the labels; default: a secret one, told after the score."
)
_development = click.option("--development", is_flag=True, help="Development cases: never the same as any scored ones.")
_families = click.option(
    "--family",
    "families",
    multiple=True,
    type=click.Choice(("mckibben", "fluidic", "pleated")),
    help="Plants of this family only. Repeatable.",
)
_records = click.option(
    "--records",
    type=_place,
    metavar="FOLDER",
    help="Put effects of sensor and time base into these records (folders: a session each) in place of a plant's.",
)
_modes = click.option(
    "--modes",
    multiple=True,
    type=click.Choice(("days", "one_day", "fingerprint", "simulator", "withheld", "beside")),
    help="Ask these ways only. Repeatable.",
)
_priors = click.option(
    "--priors",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    metavar="FILE",
    help="Answer by these levels, which `pamrig gap calibrate` wrote, in place of the shipped ones.",
)
_no_angle = click.option("--no-angle", is_flag=True, help="Do not ask from the angle alone.")
_dask = click.option(
    "--dask", metavar="ADDRESS", help="Use the Dask cluster at ADDRESS; its workers must see the same folder."
)
_workers = click.option("--workers", type=click.IntRange(1), help="Local processes; default: one a core.")
_experiments = click.option(
    "--experiments",
    type=click.IntRange(0, ROUNDS),
    default=ROUNDS,
    show_default=True,
    help="How many recommended experiments each answer may ask for, one after the other.",
)
_sweep = click.option(
    "--sweep",
    type=click.Path(path_type=Path),
    metavar="SWEEP.yaml",
    help="Record every day under this session, in place of excitations drawn for each unit.",
)
_html = click.option(
    "--html", "html_to", type=Output(Kind.PAGE), metavar="FILE", help="Write the page to FILE; a .md gets its tables."
)


@click.group(cls=Group, invoke_without_command=True, short_help="The blind check of the diagnosis.")
@_cases
@_seed
@_development
@_families
@_records
@_modes
@_sweep
@_no_angle
@_priors
@_dask
@_workers
@output_option(
    Kind.FOLDER, "Folder of the check; one that is there is resumed. Default: a new one under logs/.", metavar="DIR"
)
@click.option("--keep", is_flag=True, help="Keep the questions' records after they are scored.")
@_experiments
@_html
@json_option
@click.pass_context
def check(
    context: click.Context, cases: int, seed: int | None, development: bool, families: tuple[str, ...],
    records: Path | None, modes: tuple[str, ...], sweep: Path | None, no_angle: bool, priors: Path | None,
    dask: str | None, workers: int | None, output: Path | None, keep: bool,
    experiments: int, html_to: Path | None, json_to: str | None,
) -> None:  # fmt: skip
    """Diagnose cases whose labels are withheld, then open the labels and score.

    The hash of the labels is printed first. Without a step, all three are done: make, answer, score.
    """
    if context.invoked_subcommand is not None:
        return
    import time
    from functools import partial

    from rig.app.gap.blind_checking import new_folder, source_and_modes, spread
    from rig.blind_check.check import make_answer_score, result_of
    from rig.blind_check.folder import CheckFolder
    from rig.blind_check.generate import units

    begun, (source, modes) = time.monotonic(), source_and_modes(records, development, families, modes, sweep)
    folder = CheckFolder(output.resolve() if output else new_folder())
    _sealed(source, folder, cases, seed, modes, json_to, no_angle, priors)
    spread(
        partial(make_answer_score, keep=keep, rounds=experiments), units(source, folder), cases, "cases", dask, workers
    )
    _report(folder, result_of(folder) | {"seconds_of_this_run": time.monotonic() - begun}, html_to, json_to)


@check.command()
@_folder
@_cases
@_seed
@_development
@_families
@_records
@_modes
@_sweep
@_no_angle
@_priors
@_dask
@_workers
def make(
    folder: Path, cases: int, seed: int | None, development: bool, families: tuple[str, ...],
    records: Path | None, modes: tuple[str, ...], sweep: Path | None, no_angle: bool, priors: Path | None,
    dask: str | None, workers: int | None,
) -> None:  # fmt: skip
    """Draw and seal the labels, then write the questions into FOLDER.

    Whoever answers gets sealed.json and the folder questions; labels and key stay in the folder maker.
    """
    from rig.app.gap.blind_checking import source_and_modes, spread
    from rig.blind_check.folder import CheckFolder
    from rig.blind_check.generate import make_unit, units

    (source, modes), place = source_and_modes(records, development, families, modes, sweep), CheckFolder(folder)
    _sealed(source, place, cases, seed, modes, None, no_angle, priors)
    work = units(source, place)
    spread(make_unit, work, len(work), "units", dask, workers)
    console().print(f"{folder}: {cases} questions")


@check.command()
@_folder
@_dask
@_workers
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
    console().print(f"{folder}: {len(tokens)} answers")


@check.command()
@_folder
@click.option(
    "--labels", type=click.Path(path_type=Path), help="Labels of your own records as JSON, in place of sealed ones."
)
@_development
@_experiments
@_records
@_dask
@_workers
@_html
@json_option
def score(
    folder: Path, labels: Path | None, development: bool, records: Path | None, experiments: int,
    dask: str | None, workers: int | None, html_to: Path | None,
    json_to: str | None
) -> None:  # fmt: skip
    """Open the labels of FOLDER and score its answers; recommended experiments are carried out first."""
    from functools import partial

    from rig.app.gap.blind_checking import source_and_modes, spread
    from rig.blind_check.check import result_of, score_unit
    from rig.blind_check.folder import CheckFolder
    from rig.blind_check.generate import units
    from rig.blind_check.user_labels import score_own

    place = CheckFolder(folder)
    if labels is not None:
        _report(place, score_own(place, labels), html_to, json_to)
        return
    work = units(source_and_modes(records, development)[0], place)
    spread(
        partial(score_unit, rounds=experiments), work, sum(len(unit.tokens) for unit in work), "cases", dask, workers
    )
    _report(place, result_of(place), html_to, json_to)


@check.command()
@click.argument("folders", nargs=-1, required=True, type=_place)
@click.option("--unfinished", is_flag=True, help="Count what is scored so far of checks that were stopped.")
@_html
@json_option
def merge(folders: tuple[Path, ...], unfinished: bool, html_to: Path | None, json_to: str | None) -> None:
    """Count several scored checks as one; each is named with its seed and hash. A .md is the page of results."""
    from rig.blind_check.check import result_of_all
    from rig.blind_check.folder import CheckFolder
    from rig.report.check_page import check_table, write_page

    result = result_of_all([CheckFolder(folder) for folder in folders], unfinished)
    if html_to is not None:
        write_page(result, html_to)
    console(json_to).print(check_table(result))
    emit(result, json_to)


@check.command()
@click.argument("first", type=_place)
@click.argument("other", type=_place)
@click.option(
    "-o", "--output", "--out", "html_to", type=Output(Kind.PAGE), metavar="FILE.md", help="The table as a page."
)
@json_option
def compare(first: Path, other: Path, html_to: Path | None, json_to: str | None) -> None:
    """Two scored checks of the same cases beside each other: of two methods, or of two sessions (--sweep)."""
    from rig.blind_check.folder import CheckFolder
    from rig.blind_check.paired import compared
    from rig.outputs import write_text
    from rig.report.check_pairs import pairs_page, pairs_table

    found = compared(CheckFolder(first), CheckFolder(other))
    if html_to is not None:
        write_text(html_to, pairs_page(found), Kind.PAGE)
    console(json_to).print(pairs_table(found))
    emit(found, json_to)


@check.command()
@_families
@click.option("--units", type=click.IntRange(1), default=1, show_default=True, help="Units of each family.")
@click.option("--seed", type=click.IntRange(0), default=440001, show_default=True, help="Number of the first unit.")
@click.option(
    "--reference",
    type=click.Choice(("session", "fingerprint")),
    default="session",
    show_default=True,
    help="What stands for the healthy rig: one earlier day, or the fingerprint of one.",
)
@_workers
@click.option(
    "-o", "--output", "--out", "html_to", type=Output(Kind.PAGE), metavar="FILE.md", help="The table as a page."
)
@json_option
def sizes(
    families: tuple[str, ...], units: int, seed: int, reference: str, workers: int | None, html_to: Path | None,
    json_to: str | None,
) -> None:  # fmt: skip
    """The smallest sizes that `pamrig gap capability` says would be seen, beside those from which effects are found on
    plants of the families."""
    from dataclasses import asdict
    from datetime import date

    from rig.app.gap.levels import known_families
    from rig.app.gap.smallest_sizes import compare_sizes, rows_of, sizes_page
    from rig.app.terminal import progress
    from rig.outputs import write_text

    known = known_families(families)
    with progress("units", units * len(known)) as update:
        found = compare_sizes(known, seed, units, reference, workers, lambda done: update(done, f"{done} units"))
    asked = f"Written by `pamrig gap check sizes` on {date.today().isoformat()}: {units} unit(s) of {', '.join(known)}."
    page = sizes_page(rows_of(found), reference, asked)
    if html_to is not None:
        write_text(html_to, page, Kind.PAGE)
    console(json_to).print(page)
    emit({"reference": reference, "found": [asdict(one) for one in found]}, json_to)


@check.command()
@click.option("--units", type=click.IntRange(1), default=2, show_default=True, help="Units of each family.")
@click.option("--seed", type=click.IntRange(0), default=401, show_default=True, help="Seed of the development units.")
@_workers
@json_option
def absorbed(units: int, seed: int, workers: int | None, json_to: str | None) -> None:
    """How much of each effect a fit of the simulator's own parameters swallows, on development units.

    Effects from half on are counted apart in the modes of a simulator; the list is declared before any check.
    """
    from rich.table import Table

    from rig.app.gap.absorbed import swallowed, table
    from rig.app.terminal import progress
    from rig.blind_check.score import ABSORBED, SWALLOWED

    with progress("units", 2 * units) as update:
        found = swallowed(seed, units, workers, lambda done: update(done, f"{done} units"))
    shown, rows = Table("effect", "swallowed, median", "units", "declared absorbed"), list(table(found))
    for effect, share, count in rows:
        declared = "yes" if effect in ABSORBED else "no"
        shown.add_row(effect, "-" if share is None else f"{100 * share:.0f} %", str(count), declared)
    console(json_to).print(shown)
    effects = {effect: {"share": share, "units": count} for effect, share, count in rows}
    emit({"seed": seed, "from": SWALLOWED, "effects": effects, "declared": sorted(ABSORBED)}, json_to)


@check.command()
@click.option("--cases", type=click.IntRange(1), default=8, show_default=True, help="Development cases a family.")
@click.option("--seed", type=click.IntRange(0), default=402, show_default=True, help="Seed of the development cases.")
@_families
@_workers
@_html
@json_option
def sensitivity(
    cases: int, seed: int, families: tuple[str, ...], workers: int | None, html_to: Path | None, json_to: str | None
) -> None:
    """Halve and double each number that decides in the likelihood, and count which answers move.

    On development cases; a .md as page is a table in Markdown.
    """
    from dataclasses import asdict

    from rig.app.gap import sensitivity as numbers
    from rig.app.gap.sensitivity_page import as_markdown
    from rig.app.terminal import progress
    from rig.outputs import write_text

    asked = numbers.Asked(families or ("mckibben", "fluidic", "pleated"), seed, cases)
    total = len(numbers.FACTORS) * len(numbers.numbers())
    with progress("numbers", total) as update:
        base, moved = numbers.sensitivity(asked, workers, lambda done: update(done, f"{done} of {total}"))
    page = as_markdown(asked, base, moved, numbers.deciding())
    if html_to is not None:
        write_text(html_to, page, Kind.PAGE)
    console(json_to).print(page, markup=False)
    emit(
        {"cases": len(base), "right": sum(one.right for one in base), "moved": [asdict(one) for one in moved]}, json_to
    )


def _sealed(
    source: Any,
    folder: "CheckFolder",
    cases: int,
    seed: int | None,
    modes: Sequence[str],
    json_to: str | None,
    no_angle: bool,
    priors: Path | None,
) -> None:
    """The hash of the labels, printed before anything is computed."""
    from rig.app.gap.blind_checking import seal

    sha256 = seal(source, folder, cases, seed, modes, not no_angle, priors)
    terminal = console(json_to)
    terminal.print(f"sealed labels, SHA-256: {sha256}")
    terminal.print(f"folder: {folder.root}")


def _report(folder: "CheckFolder", result: dict[str, Any], html_to: Path | None, json_to: str | None) -> None:
    """Keep the result, write the page, print the table."""
    from rig.blind_check.check import write_result
    from rig.report.check_page import check_table, write_page

    kept = write_result(folder, result)
    page = html_to or folder.root / "result.html"
    write_page(result, page)
    terminal = console(json_to)
    terminal.print(check_table(result))
    terminal.print(f"{kept}\n{page}")
    emit(result, json_to)

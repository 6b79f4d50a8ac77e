"""`pamrig gap study`: what builders of the diagnosis ask of it. Its own numbers on simulated plants (sizes, absorbed,
sensitivity), what is fitted on these (laws, noise, usual), and what is fitted to scored checks of development cases
(odds, temperature, intervals)."""

from collections.abc import Callable
from math import exp
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from rig.app.terminal import console
from rig.cli.common import emit, json_option, left_out_option, with_options
from rig.cli.gap.options import families_option, html_option, page_option, path_type, workers_option
from rig.cli.outputs import Group, output_option, write_errors_last
from rig.outputs import OutputKind

if TYPE_CHECKING:
    from rig.app.gap.calibrating import FittingPlan
    from rig.gap.priors import Fitted

F = TypeVar("F")
SHOWN_LAWS = 4
"""Laws of which the terminal says how rough they are: the roughest."""


@click.group(cls=Group, short_help="Studies of the diagnosis itself, for who builds on it.")
def study() -> None:
    """What the diagnosis is worth, number by number, and what is fitted to its own checks.

    Nothing here diagnoses a rig or draws a blind check; `pamrig gap check` does that.
    """


@study.command(short_help="Smallest sizes, predicted and found.")
@families_option
@click.option("--units", type=click.IntRange(1), default=1, show_default=True, help="Units of each family.")
@click.option("--seed", type=click.IntRange(0), default=440001, show_default=True, help="Number of the first unit.")
@click.option(
    "--reference",
    type=click.Choice(("session", "fingerprint")),
    default="session",
    show_default=True,
    help="What stands for the healthy rig: one earlier day, or the fingerprint of one.",
)
@workers_option
@page_option
@json_option
def sizes(
    families: tuple[str, ...], units: int, seed: int, reference: str, workers: int | None, html_to: Path | None,
    json_to: str | None,
) -> None:  # fmt: skip
    """Compare the smallest sizes that `pamrig gap capability` predicts with those from which on effects are found on
    simulated plants."""
    from dataclasses import asdict
    from datetime import date

    from rig.app.gap.calibrating import known_families
    from rig.app.gap.study.smallest_sizes import compare_sizes, rows_of, sizes_page
    from rig.app.terminal import progress
    from rig.outputs import write_text

    known = known_families(families)
    with progress("units", units * len(known)) as update:
        found = compare_sizes(known, seed, units, reference, workers, lambda done: update(done, f"{done} units"))
    asked = f"Written by `pamrig gap study sizes` on {date.today().isoformat()}: {units} unit(s) of {', '.join(known)}."
    page = sizes_page(rows_of(found), reference, asked)
    if html_to is not None:
        with write_errors_last():
            write_text(html_to, page, OutputKind.PAGE)
    console(json_to).print(page)
    emit({"reference": reference, "found": [asdict(one) for one in found]}, json_to)


@study.command(short_help="What fitting the simulator again absorbs.")
@click.option("--units", type=click.IntRange(1), default=2, show_default=True, help="Units of each family.")
@click.option("--seed", type=click.IntRange(0), default=401, show_default=True, help="Seed of the development units.")
@workers_option
@json_option
def absorbed(units: int, seed: int, workers: int | None, json_to: str | None) -> None:
    """How much of each effect is absorbed when the simulator's own parameters are fitted again, on development units.

    Effects of which half or more is absorbed are counted apart where the diagnosis is given a simulator alone; the list
    is declared before any check.
    """
    from rich.table import Table

    from rig.app.gap.calibrating import known_families
    from rig.app.gap.study.absorbed import absorbed_shares, table
    from rig.app.terminal import progress
    from rig.blind_check.score import ABSORBED
    from rig.gap.answer.settings import ABSORBED_SHARE

    with progress("units", len(known_families(())) * units) as update:
        found = absorbed_shares(seed, units, workers, lambda done: update(done, f"{done} units"))
    shown, rows = Table("effect", "absorbed, median", "units", "declared absorbed"), list(table(found))
    for effect, share, count in rows:
        declared = "yes" if effect in ABSORBED else "no"
        shown.add_row(effect, "-" if share is None else f"{100 * share:.0f} %", str(count), declared)
    console(json_to).print(shown)
    effects = {effect: {"share": share, "units": count} for effect, share, count in rows}
    emit({"seed": seed, "from": ABSORBED_SHARE, "effects": effects, "declared": sorted(ABSORBED)}, json_to)


@study.command(short_help="Halve and double each number that decides.")
@click.option("--cases", type=click.IntRange(1), default=8, show_default=True, help="Development cases a family.")
@click.option("--seed", type=click.IntRange(0), default=402, show_default=True, help="Seed of the development cases.")
@families_option
@workers_option
@html_option
@json_option
def sensitivity(
    cases: int, seed: int, families: tuple[str, ...], workers: int | None, html_to: Path | None, json_to: str | None
) -> None:
    """Halve and double each number that decides in the likelihood, and count which answers move.

    On development cases; a .md as page is a table in Markdown.
    """
    from dataclasses import asdict

    from rig.app.gap.calibrating import known_families
    from rig.app.gap.study import sensitivity as numbers
    from rig.app.gap.study.sensitivity_page import as_markdown
    from rig.app.terminal import progress
    from rig.outputs import write_text

    asked = numbers.DevelopmentCases(known_families(families), seed, cases)
    total = len(numbers.FACTORS) * len(numbers.numbers())
    with progress("numbers", total) as update:
        base, moved = numbers.sensitivity(asked, workers, lambda done: update(done, f"{done} of {total}"))
    page = as_markdown(asked, base, moved, numbers.deciding())
    if html_to is not None:
        with write_errors_last():
            write_text(html_to, page, OutputKind.PAGE)
    console(json_to).print(page, markup=False)
    emit(
        {"cases": len(base), "right": sum(one.right for one in base), "moved": [asdict(one) for one in moved]}, json_to
    )


priors_option = click.option(
    "--priors",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    metavar="FILE",
    help="Levels to go on from, in place of the shipped ones.",
)


def _fitted_on_checks(command: Callable[..., None]) -> Callable[..., None]:
    """The options of a command that fits to scored checks of development cases."""
    options = (
        click.argument("folders", nargs=-1, required=True, type=path_type),
        priors_option,
        left_out_option("Families whose cases do not count. Repeatable."),
        output_option(OutputKind.LEVELS, "Where the levels go.", required=True, metavar="FILE.yaml"),
        json_option,
    )
    return with_options(command, options)


def _fitted_on_plants(command: Callable[..., None]) -> Callable[..., None]:
    """The options of a command that fits to healthy days of simulated plants."""
    options = (
        families_option,
        left_out_option("Families to leave out, to be judged by them. Repeatable."),
        click.option("--units", type=click.IntRange(1), default=4, show_default=True, help="Units of each family."),
        click.option(
            "--seed", type=click.IntRange(0), default=302, show_default=True, help="Seed of the development units."
        ),
        priors_option,
        workers_option,
        output_option(OutputKind.LEVELS, "Where the levels go.", required=True, metavar="FILE.yaml"),
        json_option,
    )
    return with_options(command, options)


def _fit_on_plants(
    fit: "Callable[[Fitted, FittingPlan, Callable[[int], None]], tuple[Fitted, F]]", output: Path,
    families: tuple[str, ...], left_out: tuple[str, ...], units: int, seed: int, priors: Path | None,
    workers: int | None,
) -> F:  # fmt: skip
    """What is fitted by those options, after it is written with the levels to `output`."""
    from rig.app.gap.calibrating import FittingPlan, known_families, write
    from rig.app.terminal import progress
    from rig.gap.priors import PRIORS, fitted

    plan = FittingPlan(known_families(families, left_out), units, seed, workers)
    total = units * len(plan.families)
    with progress("rigs", total) as update:
        levels, found = fit(fitted(priors or PRIORS), plan, lambda done: update(done, f"{done} of {total}"))
    with write_errors_last():
        write(levels, output)
    return found


@study.command(short_help="Fit intervals of sizes, and of what is left of a gap.")
@_fitted_on_checks
def intervals(
    folders: tuple[Path, ...], priors: Path | None, left_out: tuple[str, ...], output: Path, json_to: str | None
) -> None:
    """Fit the intervals of what is left of a gap on further records, and of the sizes of effects, from scored checks of
    development cases, and write them with the priors.

    The checks must have been answered by the same priors: those shipped, or of --priors.
    """
    from rig.app.gap.calibrating import write
    from rig.app.gap.study.fitted_checks import to_fit
    from rig.app.gap.study.intervals import with_intervals
    from rig.config import unstructure

    levels, checks = to_fit(folders, priors, left_out)
    found = with_intervals(levels, checks, left_out)
    with write_errors_last():
        write(found, output)
    spread = found.prediction
    console(json_to).print(
        f"{output}: from {spread.below:.2g} below to {spread.above:.2g} above, by {spread.cases} answers"
    )
    for reference, reach in found.reaches.items():
        console(json_to).print(
            f"sizes, {reference}: {reach.deviations:.2g} standard deviations of the likelihood and of "
            f"{reach.law:g} times its law's usual error, by {reach.cases} answers"
        )
    emit(unstructure(found.prediction) | {"sizes": unstructure(found.reaches)}, json_to)


@study.command(short_help="Fit the prior odds of no cause, unknown ones, two together, and a healthy rig.")
@click.option(
    "--odds",
    "only",
    multiple=True,
    type=click.Choice(("none", "unknown", "together", "healthy")),
    help="Fit these odds and keep the others. Repeatable.",
)
@_fitted_on_checks
def odds(
    folders: tuple[Path, ...], priors: Path | None, left_out: tuple[str, ...], output: Path, only: tuple[str, ...],
    json_to: str | None,
) -> None:  # fmt: skip
    """Fit the prior odds of no cause, of something unknown, of causes ahead of the monitors and behind them together,
    and of a healthy rig, beside each reference, from scored checks of development cases, and write them with the
    levels.

    The checks must have been answered by the same odds: those shipped, or of --priors.
    """
    from rig.app.gap.calibrating import write
    from rig.app.gap.study.fitted_checks import to_fit
    from rig.app.gap.study.odds import with_odds
    from rig.config import unstructure

    levels, checks = to_fit(folders, priors, left_out)
    levels, fits = with_odds(levels, checks, left_out, only)
    with write_errors_last():
        write(levels, output)
    for name, fit in fits.items():
        console(json_to).print(
            f"{name}: no cause {fit.odds.none:.2g} nats, something unknown {fit.odds.unknown:.2g}, two together "
            f"{fit.odds.together:.2g}, a healthy rig {fit.odds.healthy:.2g}, by {fit.factors} factors; the truth is "
            f"likelier by {fit.gained:.2g} nats each"
        )
    emit(unstructure(fits), json_to)


@study.command(short_help="Fit how rough the effects' laws are.")
@click.option(
    "--effect",
    "effects",
    multiple=True,
    metavar="NAME",
    help="Fit the laws of this effect and keep the others. Repeatable.",
)
@_fitted_on_plants
def laws(output: Path, json_to: str | None, effects: tuple[str, ...], **asked: Any) -> None:
    """Fit how rough each effect's law is where a plant acts by another, and how rough the description of a rig is in
    what an effect's pressures do to the angle, on simulated plants, and write both with the levels.

    Each effect of a plant is put onto a healthy day of its own; what the library's best law leaves of it is its error.
    """
    from functools import partial

    from rig.app.gap.study.laws import with_laws
    from rig.gap.possible_effects import named_effects

    named = sorted(named_effects(effects, "--effect"))
    found = _fit_on_plants(partial(with_laws, effects=named), output, **asked)
    roughest = sorted(found, key=lambda name: -found[name])[:SHOWN_LAWS]
    console(json_to).print(
        f"{output}: the errors of {len(found)} effects' laws; most {', '.join(f'{n} {found[n]:.2g}' for n in roughest)}"
    )
    emit(found, json_to)


@study.command(short_help="Fit what simulators usually lack of healthy rigs.")
@_fitted_on_plants
def usual(output: Path, json_to: str | None, **asked: Any) -> None:
    """Fit how much of which effects a simulator usually lacks of a healthy rig (regulators that hold a little, some
    mass), on simulated plants, and write it with the levels.

    As much of them is no gap where nothing but a simulator stands for the rig.
    """
    from rig.app.gap.study.usual import with_usual
    from rig.config import unstructure

    found = _fit_on_plants(with_usual, output, **asked)
    each = [] if found is None else [f"{effect} {scale:.2g}" for effect, scale in found.scales.items()]
    console(json_to).print(f"{output}: {', '.join(each) or 'nothing'} (floors of the angle, rms)")
    emit({} if found is None else unstructure(found), json_to)


@study.command(short_help="Fit the noise that healthy rigs usually have.")
@_fitted_on_plants
def noise(output: Path, json_to: str | None, **asked: Any) -> None:
    """Fit how much broadband noise the angle of a healthy rig usually has, on simulated plants, and write it with the
    levels.

    A simulator tells of none: louder noise than that is something that it lacks.
    """
    from rig.app.gap.study.noise import with_noise
    from rig.config import unstructure

    found = _fit_on_plants(with_noise, output, **asked)
    console(json_to).print(
        f"{output}: {100 * found.share:.2g} % of the angle's span, at least of {found.span_deg:.2g} deg, to within a "
        f"factor of {exp(found.spread):.2g}"
    )
    emit(unstructure(found), json_to)


@study.command(short_help="Fit how sure names are.")
@_fitted_on_checks
def temperature(
    folders: tuple[Path, ...], priors: Path | None, left_out: tuple[str, ...], output: Path, json_to: str | None
) -> None:
    """Fit how far the evidence between effects is believed, from scored checks of development cases of plant families
    on which the levels that answered them were not fitted, and write it with the priors.

    The checks must have been answered at the temperature of the priors: those shipped, or of --priors.
    """
    from rig.app.gap.calibrating import write
    from rig.app.gap.study.fitted_checks import to_fit
    from rig.app.gap.study.temperature import with_temperature
    from rig.config import unstructure

    levels, checks = to_fit(folders, priors, left_out)
    levels, fit = with_temperature(levels, checks, left_out)
    with write_errors_last():
        write(levels, output)
    console(json_to).print(
        f"{output}: a temperature of {fit.temperature:.2g}, by {fit.factors} factors; true names are likelier by "
        f"{fit.gained:.2g} nats each, and {fit.held:.0%} of the sets hold them (before {fit.held_before:.0%})"
    )
    emit(unstructure(fit), json_to)

"""`pamrig gap effects` and `pamrig gap calibrate`: what the method knows, and how its priors are fitted."""

from pathlib import Path

import click

from rig.app.terminal import console, listing, progress
from rig.cli.common import emit, family_option, json_option, left_out_option
from rig.cli.gap.options import workers_option
from rig.cli.outputs import Command, output_option, write_errors_last
from rig.outputs import OutputKind


@click.command(cls=Command, short_help="Fit the priors of the method on simulated plants.")
@output_option(OutputKind.LEVELS, "Where the fitted levels go.", required=True, metavar="FILE")
@family_option("Plant families to fit on; default: all but the one that judges. Repeatable.")
@left_out_option("Families to leave out, to be judged by the levels. Repeatable.")
@click.option("--units", type=click.IntRange(2, 200), default=10, show_default=True, help="Rigs of each family.")
@click.option("--seed", type=click.IntRange(0), default=301, show_default=True, help="Seed of the development rigs.")
@workers_option
@json_option
def calibrate(
    output: Path, families: tuple[str, ...], left_out: tuple[str, ...], units: int, seed: int, workers: int | None,
    json_to: str | None,
) -> None:  # fmt: skip
    """Fit how much healthy days of simulated plants differ from each reference, which decides what counts as a gap.

    The file takes the place of rig/gap/priors.yaml once a blind check on other seeds and families has shown that it is
    better.
    """
    from rig.app.gap.calibrating import STEPS, FittingPlan, calibrate, known_families, write
    from rig.config import unstructure

    plan = FittingPlan(known_families(families, left_out), units, seed, workers)
    total = STEPS * units * len(plan.families)
    with progress("fitting", total) as update:
        found = calibrate(plan, lambda done: update(done, f"{done} of {total}"))
    with write_errors_last():
        write(found, output)
    console(json_to).print(f"{output}: levels of {', '.join(found.levels)}, from {found.provenance.units} rigs")
    emit(unstructure(found), json_to)


@click.command(cls=Command, short_help="The library of effects.")
@json_option
def effects(json_to: str | None) -> None:
    """List every effect: where it lies, its numbers with bounds, what it looks like, what it may be mistaken for."""
    from rig.app.gap.effects import report_effects, sizes_of
    from rig.gap.hypotheses.library import LIBRARY, alike

    table = listing("effect", "stage", "numbers", "looks like", "angle alone: like", "with pressures: like")
    for name, effect in LIBRARY.items():
        numbers = ", ".join(f"{number.name} {number.low:g}..{number.high:g}" for number in sizes_of(effect))
        likes = (", ".join(alike(name, pressures)) for pressures in (False, True))
        table.add_row(name, effect.stage, numbers, effect.looks_like, *likes)
    console(json_to).print(table)
    emit(report_effects(), json_to)

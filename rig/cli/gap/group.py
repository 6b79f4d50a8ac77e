"""`pamrig gap`: diagnose the gap between simulator and rig, list the effects, and the blind check."""

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rig.app.terminal import console, listing, progress, styled
from rig.cli.common import emit, json_option
from rig.cli.gap.check import check
from rig.cli.gap.history import history
from rig.cli.gap.hunt import hunt
from rig.cli.gap.options import angle_alone_option, baseline_option, reference_option
from rig.cli.gap.plan import capability, design
from rig.cli.outputs import Group, Output, output_option
from rig.outputs import Kind

if TYPE_CHECKING:
    from rig.gap.answer.result import Diagnosis

_path = click.Path(path_type=Path)


@click.group(cls=Group)
def gap() -> None:
    """Where the gap between simulator and rig lies, which effect causes it, how far it shrinks."""


for _command in (check, capability, design, hunt, history):
    gap.add_command(_command)


@gap.command(short_help="What the simulator lacks, or what has changed.")
@click.option("--model", "model", required=True, type=_path, metavar="MODEL.yaml", help="The simulator.")
@click.option(
    "--log",
    "logs",
    required=True,
    multiple=True,
    type=_path,
    metavar="LOG",
    help="Records of the rig as it is now: files or folders.",
)
@baseline_option(
    "Records of one earlier day, or a folder of such folders; repeat for more days. `model`: the logs it was "
    "identified from."
)
@reference_option(
    "What stands for the rig without a gap; auto takes the best there is. simulator: the model was made for "
    "another rig of the build, or from data sheets."
)
@click.option(
    "--html",
    "html_to",
    type=Output(Kind.PAGE),
    metavar="FILE",
    help="Write the report as one HTML page; with several days an overview, and beside it a page a day.",
)
@click.option(
    "--augmented-model",
    "augmented_to",
    type=Output(Kind.MODEL),
    metavar="FILE",
    help="Write the simulator with the causes.",
)
@click.option(
    "--retuned",
    "retuned_to",
    type=Output(Kind.MODEL),
    metavar="FILE",
    help="Write the simulator fitted again to these records.",
)
@click.option(
    "--next-experiment", "next_to", type=Output(Kind.SWEEP), metavar="FILE", help="Write the recommended sweep, if any."
)
@click.option(
    "--tracking",
    "tracking",
    type=_path,
    metavar="REFERENCE.yaml",
    help="Also say how much closer `pamrig track` would follow with these gains when its feed-forward has the causes.",
)
@angle_alone_option
@click.option(
    "--rig", "rig", type=_path, metavar="RIG.yaml", help="The rig: its `effects` say what can be wrong with it at all."
)
@click.option("--effect", "effects", multiple=True, metavar="NAME", help="Limit the library to these effects.")
@click.option("--workers", type=click.IntRange(1), help="With several days: local processes; default: one a core.")
@click.option(
    "--dask", metavar="ADDRESS", help="With several days: the Dask cluster at ADDRESS, which must see the same files."
)
@json_option
def diagnose(
    logs: tuple[Path, ...], workers: int | None, dask: str | None, json_to: str | None, **options: Any
) -> None:
    """Say what MODEL lacks to follow LOG, the records of the rig as it is now; or, with BASELINE, what has changed
    since those days.

    A folder of several days as LOG gives one diagnosis a day, side by side.
    """
    from rig.app.gap.baselines import check_apart, described, odd_days, read_sessions
    from rig.app.gap.diagnosing import (
        DiagnosisOptions,
        cases_of,
        check_effects,
        diagnose_campaign,
        diagnose_case,
        report,
        without_next,
        write_overview,
    )

    check_effects(options["effects"])
    chosen, cases = DiagnosisOptions(**options, command=shlex.join(["pamrig", *sys.argv[1:]])), cases_of(logs)
    check_apart(logs, chosen.baselines)
    days = read_sessions(chosen.baselines, chosen.model)
    if len(cases) == 1:
        with progress("diagnosing"):
            made = [diagnose_case(chosen, cases[0], days)]
    else:
        made = list(diagnose_campaign(chosen, cases, dask, workers))
    results = {case.name: diagnosis for case, diagnosis in made}
    results = {case.name: results[case.name] for case in cases}
    for name, diagnosis in results.items():
        _show(diagnosis, name, json_to)
    odd = odd_days(days)
    for line in (*described(days, odd), *without_next(chosen, results)):
        console(json_to).print(line)
    write_overview(chosen, results, days)
    emit(report(results, days, odd), json_to)


@gap.command(short_help="Fit the priors of the method on simulated plants.")
@output_option(Kind.LEVELS, "Where the fitted levels go.", required=True, metavar="FILE")
@click.option(
    "--family", "families", multiple=True, metavar="NAME", help="Plant families to fit on; default: all there are."
)
@click.option(
    "--leave-out", "left_out", multiple=True, metavar="NAME", help="Families to leave out, to be judged by the levels."
)
@click.option("--units", type=click.IntRange(2, 200), default=10, show_default=True, help="Rigs of each family.")
@click.option("--seed", type=click.IntRange(0), default=301, show_default=True, help="Of the development rigs.")
@click.option("--workers", type=click.IntRange(1), help="Processes; default: one a core.")
@json_option
def calibrate(
    output: Path, families: tuple[str, ...], left_out: tuple[str, ...], units: int, seed: int, workers: int | None,
    json_to: str | None,
) -> None:  # fmt: skip
    """Fit how much healthy days of simulated plants differ from each reference: the levels that decide what counts as a
    gap.

    The file takes the place of rig/gap/priors.yaml once a blind check on other seeds and families has shown that it is
    better.
    """
    from rig.app.gap.levels import Plan, calibrate, known_families, write
    from rig.config import unstructure

    plan = Plan(known_families(families, left_out), units, seed, workers)
    total = 2 * units * len(plan.families)
    with progress("fitting", total) as update:
        found = calibrate(plan, lambda done: update(done, f"{done} of {total}"))
    write(found, output)
    console(json_to).print(f"{output}: levels of {', '.join(found.levels)}, from {found.provenance.units} rigs")
    emit(unstructure(found), json_to)


@gap.command(short_help="The library of effects.")
@json_option
def effects(json_to: str | None) -> None:
    """List every effect: where it lies, its numbers with bounds, what it looks like, what it may be mistaken for."""
    from rig.gap.hypotheses.library import LIBRARY, alike
    from rig.model.effect_stages import EFFECT_STAGES

    table = listing("effect", "stage", "numbers", "looks like", "angle alone: like", "with pressures: like")
    report = {}
    for effect in LIBRARY.values():
        known = EFFECT_STAGES[effect.laws[0].stage]
        names = {name for law in effect.laws if law.stage == effect.laws[0].stage for name in law.free}
        numbers = [number for number in known.numbers if number.name in names]
        report[effect.name] = {
            "stage": effect.stage,
            "looks_like": effect.looks_like,
            "alike_angle_only": alike(effect.name, False),
            "alike_with_pressures": alike(effect.name, True),
            "parameters": {
                number.name: {
                    "unit": number.unit,
                    "low": number.low,
                    "high": number.high,
                    "neutral": number.neutral,
                    "meaning": number.meaning,
                }
                for number in known.numbers
            },
        }
        shown = ", ".join(f"{number.name} {number.low:g}..{number.high:g}" for number in numbers)
        table.add_row(
            effect.name,
            effect.stage,
            shown,
            effect.looks_like,
            ", ".join(alike(effect.name, False)),
            ", ".join(alike(effect.name, True)),
        )
    console(json_to).print(table)
    emit({"effects": report}, json_to)


def _show(diagnosis: "Diagnosis", name: str | None, json_to: str | None) -> None:
    """The summary for a person."""
    from rig.gap.answer.words import answers, chain_rows
    from rig.own_units import speaker

    out, say = console(json_to), speaker(diagnosis.channels)
    if name:
        out.print(name, style="bold")
    for question, answer in answers(diagnosis).items():
        out.print(styled((question, "bold"), f"  {say(answer)}"))
    if rows := chain_rows(diagnosis):
        stages = listing("stage", "share of the gap", "found there")
        for row in rows:
            stages.add_row(*row)
        out.print(stages)
    if diagnosis.ranking:
        table = listing("alone", "stage", "judged on", "explains", "probability")
        for line in diagnosis.ranking[:6]:
            table.add_row(
                line.effect,
                line.stage,
                say(line.side),
                f"{100 * line.explained_fraction:.0f} %",
                f"{line.probability:.2f}",
            )
        out.print(table)
    for note in diagnosis.notes:
        out.print(f"note: {say(note)}")

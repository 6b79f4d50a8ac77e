"""`pamrig gap diagnose`: where the gap between simulator and rig lies, and why."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rig.app.terminal import console, listing, progress, styled
from rig.cli.common import as_called, emit, json_option
from rig.cli.gap.options import angle_alone_option, baseline_option, reference_option
from rig.cli.outputs import Command, Output
from rig.outputs import OutputKind

if TYPE_CHECKING:
    from rig.gap.answer.result import Diagnosis

_path = click.Path(path_type=Path)


@click.command(cls=Command, short_help="What the simulator lacks, or what has changed.")
@click.option("--model", "model", required=True, type=_path, metavar="MODEL.yaml", help="The simulator.")
@click.option(
    "--log",
    "logs",
    required=True,
    multiple=True,
    type=_path,
    metavar="LOG",
    help="Records of the rig as it is now: a file or a folder; repeat for more.",
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
    type=Output(OutputKind.PAGE),
    metavar="FILE",
    help="Write the report as one HTML page; with several days an overview, and beside it a page a day.",
)
@click.option(
    "--augmented-model",
    "augmented_to",
    type=Output(OutputKind.MODEL),
    metavar="FILE",
    help="Write the simulator with the causes.",
)
@click.option(
    "--retuned",
    "retuned_to",
    type=Output(OutputKind.MODEL),
    metavar="FILE",
    help="Write the simulator fitted again to these records.",
)
@click.option(
    "--next-experiment",
    "next_to",
    type=Output(OutputKind.SWEEP),
    metavar="FILE",
    help="Write the recommended sweep, if any.",
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
    "--rig",
    "rig",
    type=_path,
    metavar="RIG.yaml",
    help="The rig: its `effects` say what can be wrong with it at all, its limits bound the recommended sweep.",
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
    from rig.app.gap.baselines import check_no_own_baseline, earlier_days
    from rig.app.gap.campaign import diagnose_campaign, diagnose_only, report
    from rig.app.gap.diagnosis_files import check_files_of_days, without_next, write_overview
    from rig.app.gap.diagnosis_options import DiagnosisOptions, cases_of
    from rig.app.gap.effects import check_effects

    check_effects(options["effects"])
    chosen, cases = DiagnosisOptions(**options, command=as_called()), cases_of(logs)
    check_no_own_baseline(logs, chosen.baselines)
    check_files_of_days(chosen, cases)
    with progress("reading the earlier days"):
        days = earlier_days(chosen.baselines, chosen.model, every=chosen.every_day)
    if len(cases) == 1:
        campaign = diagnose_only(chosen, cases[0], days.days)
    else:
        campaign = diagnose_campaign(chosen, cases, dask, workers)
    results = campaign.diagnoses
    for note in days.odd.values():  # first: what is compared with decides every answer
        console(json_to).print(styled(("note", "yellow"), f": {note}"))
    for name, diagnosis in results.items():
        _show(diagnosis, name, json_to)
    for line in (*days.listed(), *without_next(chosen, results)):
        console(json_to).print(line)
    write_overview(chosen, results, days.days)  # behind the text: a disk that takes no file takes no answer away
    emit(report(results, days), json_to)
    campaign.complain()


def _show(diagnosis: "Diagnosis", name: str | None, json_to: str | None) -> None:
    """The summary for a person."""
    from rig.gap.answer.words.notes import folded
    from rig.gap.answer.words.sentences import answers
    from rig.gap.answer.words.shares import BY_CAUSES, shares_along
    from rig.gap.answer.words.stages import chain_rows, stage_name
    from rig.own_units import speaker

    out, say = console(json_to), speaker(diagnosis.channels)
    if name:
        out.print(name, style="bold")
    for question, answer in answers(diagnosis).items():
        out.print(styled((question, "bold"), f"  {say(answer)}"))
    if rows := chain_rows(diagnosis):
        stages = listing("stage", BY_CAUSES, "found there")
        for row in rows:
            stages.add_row(*row)
        out.print(stages)
        out.print(say(shares_along(diagnosis)))
    if diagnosis.ranking:
        table = listing("alone", "stage", "judged on", "explains", "probability")
        for line in diagnosis.ranking[:6]:
            table.add_row(
                line.effect,
                stage_name(line.stage, diagnosis.channels),
                say(line.judged_on),
                f"{100 * line.explained_fraction:.0f} %",
                f"{line.probability:.2f}",
            )
        out.print(table)
    for note in folded(diagnosis.notes):
        if note in diagnosis.doubts:  # stands above
            continue
        out.print(f"note: {say(note)}")

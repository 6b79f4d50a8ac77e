"""`pamrig gap history`: the same diagnosis over many days."""

from pathlib import Path

import click

from rig.app.terminal import console, listing
from rig.cli.common import as_called, emit, json_option
from rig.cli.gap.options import angle_alone_option, baseline_option, reference_option, workers_option
from rig.cli.outputs import FORMERLY_OUTPUT, Command, figure_option, write_errors_last
from rig.report.shown_text import in_one_line

_path = click.Path(path_type=Path)


@click.command(cls=Command, short_help="Diagnose many days, and say what changed when.")
@click.argument("folder", type=_path)
@click.option("--model", required=True, type=_path, metavar="MODEL.yaml", help="The simulator.")
@baseline_option("Records of one healthy day outside FOLDER; repeat for more days.")
@reference_option()
@angle_alone_option
@workers_option
@figure_option("PNG, SVG or PDF: gap, floor and what was named over the days.", former=FORMERLY_OUTPUT)
@json_option
def history(
    folder: Path,
    model: Path,
    baselines: tuple[Path, ...],
    every_day: bool,
    reference: str,
    no_pressures: bool,
    workers: int | None,
    figure: Path | None,
    json_to: str | None,
) -> None:
    """Diagnose every day in FOLDER, which holds a folder of records for each, and say when the gap changed, when a
    cause appeared, and how it grows."""
    from rig.app.gap.baselines import check_no_own_baseline, earlier_days
    from rig.app.gap.diagnosis_options import DiagnosisOptions, cases_of
    from rig.app.gap.history import draw_history, history_days, history_report
    from rig.gap.history.sentences import history_sentences
    from rig.gap.history.trends import look_back
    from rig.own_units import speaker

    check_no_own_baseline([folder], baselines)
    options = DiagnosisOptions(
        model,
        baselines,
        every_day=every_day,
        no_pressures=no_pressures,
        reference=reference,
        command=as_called(),
    )
    days, campaign = history_days(options, cases_of((folder,)), workers)
    found = look_back(days)
    out, say = console(json_to), speaker(found.channels)
    for line in earlier_days(baselines, model, every=every_day).lines():
        out.print(line)
    table = listing("day", "gap", "usual", "verdict", "causes")
    for day in found.days:
        causes = ", ".join(
            f"{name} {size.value:.2g}{'' if size.unit == '1' else f' {size.unit}'}" for name, size in day.sizes.items()
        )
        gap, floor = say(f"{day.gap_deg:.2g} deg"), say(f"{day.floor_deg:.2g} deg")
        table.add_row(day.name, gap, floor, day.verdict, say(causes) or "-")
    out.print(table)
    for day in found.days:
        for heading, text in day.said.items():
            out.print(in_one_line(f"{day.name}: {heading.lower()}: {text}"), markup=False)
    for line in history_sentences(found):
        out.print(in_one_line(say(line)))
    if figure is not None:
        with write_errors_last():
            draw_history(found, figure)
    emit(history_report(found), json_to)
    campaign.complain()

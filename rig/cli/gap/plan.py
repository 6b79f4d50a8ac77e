"""`pamrig gap capability` and `pamrig gap design`: what a rig can tell, and the session that tells most."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from hil.reference.names import DESIGNED_FOR
from rig.app.terminal import console, listing, progress
from rig.cli.common import Number, emit, family_option, json_option, model_option
from rig.cli.gap.options import baseline_option, reference_option
from rig.cli.outputs import FORMERLY_OUTPUT, Command, figure_option, output_option, write_errors_last
from rig.outputs import OutputKind

if TYPE_CHECKING:
    from rig.channels import Channels
    from rig.gap.plan.capability import Capability

_path = click.Path(path_type=Path)
_baseline = baseline_option("Records of one earlier day of the rig; repeat for more days.")
_reference = reference_option("What will stand for the rig without a gap, as in `pamrig gap diagnose`.")
_rig = click.option("--rig", type=_path, metavar="RIG.yaml", help="The rig's YAML, for its limits.")
_no_pressures = click.option("--no-pressures", is_flag=True, help="As if the regulators' monitors were not recorded.")


@click.command(cls=Command, short_help="How small an effect this rig would show, and name.")
@model_option
@_baseline
@click.option(
    "--sweep",
    "sweeps",
    multiple=True,
    type=_path,
    metavar="SWEEP.yaml",
    help="The sweep that will be recorded; repeat to compare several.  [default: gap]",
)
@_reference
@_rig
@_no_pressures
@figure_option(
    "PNG, SVG or PDF: the matrix of which effects can be told apart, of the first sweep.", former=FORMERLY_OUTPUT
)
@json_option
def capability(
    model: Path,
    baselines: tuple[Path, ...],
    every_day: bool,
    sweeps: tuple[Path, ...],
    reference: str,
    rig: Path | None,
    no_pressures: bool,
    figure: Path | None,
    json_to: str | None,
) -> None:
    """Say, before anything is wrong, how small an effect on MODEL's rig would be detected, from which size on it would
    be named, and which effects could not be told apart."""
    from rig.app.gap.baselines import earlier_days
    from rig.app.gap.known_rigs import Asked
    from rig.app.gap.planning import capability_of, report_capability

    with progress("computing"):
        days = earlier_days(baselines, model, every=every_day)
        found = capability_of(Asked(model, baselines, every_day, reference, rig, not no_pressures), sweeps, days)
    hint = "" if baselines else "; --baseline DAY shows far smaller effects"
    console(json_to).print(f"compared with: {found.kind.value}{hint}")
    for line in days.lines():
        console(json_to).print(line)
    for note in found.notes:
        console(json_to).print(f"left out, as by a diagnosis: {note}")
    for name, one in found.sweeps.items():
        _show(name, one, found.channels, json_to)
    if figure is not None:
        from rig.report.log_figures import save
        from rig.report.plan_figures import matrix_figure

        name, first = next(iter(found.sweeps.items()))
        with write_errors_last():
            save(matrix_figure(name, first), figure)
    emit(report_capability(found), json_to)


def _show(name: str, one: "Capability", channels: "Channels", json_to: str | None) -> None:
    from rig.app.gap.planning import beside_sheet, best_of, none_alike, rivals_of, size_text

    out = console(json_to)
    out.print(f"Records of the sweep {name}, at a false-alarm rate of 1 %:", style="bold")
    sheets = ["data sheet"] if channels.has_valves else []
    table = listing("effect", "seen from", "named from", "hardest to tell from", *sheets)
    for ability in best_of(one.abilities):
        sizes = (size_text(ability, size, channels) for size in (ability.detectable, ability.nameable))
        sheet = [beside_sheet(ability, channels)] if sheets else []
        table.add_row(ability.effect, *sizes, ability.rival or "-", *sheet)
    out.print(table)
    rivals = rivals_of(one.confusable)
    if not rivals:
        out.print(none_alike(one))
        return
    apart = listing("not told apart at usual sizes", "from")
    for effect, others in rivals.items():
        apart.add_row(effect, ", ".join(others))
    out.print(apart)


@click.command(cls=Command, short_help="The session of records that tells most.")
@model_option
@click.option(
    "--minutes",
    type=Number(0.25, 120.0),
    default=2.5,
    show_default=True,
    help="How long the session may take on the rig.",
)
@_baseline
@_reference
@_rig
@family_option(
    f"Design for units of this plant family as well. Repeatable.  [default: {', '.join(DESIGNED_FOR)}]",
    none=True,
)
@output_option(OutputKind.SWEEP, "Where the sweep goes.", required=True, metavar="SWEEP.yaml")
@json_option
def design(
    model: Path,
    minutes: float,
    baselines: tuple[Path, ...],
    every_day: bool,
    reference: str,
    rig: Path | None,
    families: tuple[str, ...],
    output: Path,
    json_to: str | None,
) -> None:
    """Choose the session of records that tells the effects apart best on MODEL's rig, within the rig's limits, and
    write it as a sweep for `pamrig run`."""
    from rig.app.gap.baselines import earlier_days
    from rig.app.gap.known_rigs import Asked
    from rig.app.gap.planning import design_session
    from rig.outputs import write_text

    with progress("designing", 1.0) as update:
        days = earlier_days(baselines, model, every=every_day)
        asked = Asked(model, baselines, every_day, reference, rig)
        found = design_session(asked, 60.0 * minutes, families, update, days)
    with write_errors_last():
        write_text(output, found.text(output.stem), OutputKind.SWEEP)
    power, default = found.design.power, found.default
    out = console(json_to)
    for line in days.lines():
        out.print(line)
    table = listing("session", "minutes", "effects seen", "pairs told apart")
    for name, one, seconds in ((str(output), power, found.design.seconds), ("gap", default, found.default_s)):
        table.add_row(name, f"{seconds / 60:.1f}", f"{100 * one.seen:.0f} %", f"{100 * one.parted:.0f} %")
    out.print(table)
    emit(
        {
            "sweep": str(output),
            "minutes": found.design.seconds / 60,
            "seen": power.seen,
            "parted": power.parted,
            "usual": {"sweep": "gap", "minutes": found.default_s / 60, "seen": default.seen, "parted": default.parted},
            "rigs": found.rigs,
        },
        json_to,
    )

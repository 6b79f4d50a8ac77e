"""`pamrig track` and `pamrig tune`: follow an angle in closed loop, and find gains for that."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rig.app.terminal import console, listing
from rig.cli.common import Number, clock_option, emit, force_option, json_option, model_option, rig_option
from rig.cli.outputs import Command, Renamed, figure_option, output_option, write_errors_last
from rig.outputs import OutputKind
from rig.report.shown_text import in_lines

if TYPE_CHECKING:
    from rig.app.runs.tracking import PreparedTracking, Tracked
    from rig.control.tuning import Tuned

_path = click.Path(path_type=Path)


@click.command(cls=Command)
@click.argument("reference", type=_path)
@rig_option("Rig to run on; default: the simulated rig.")
@click.option("--model", "model", type=_path, metavar="MODEL.yaml", help="The simulator, for feed-forward and gains.")
@click.option(
    "--augmented",
    "augmented",
    type=_path,
    metavar="MODEL.yaml",
    help="The simulator with the causes added; default: MODEL itself, where it holds effects.",
)
@click.option(
    "--feedforward",
    "kinds",
    multiple=True,
    type=click.Choice(["none", "model", "augmented"]),
    help="What goes before the feedback: nothing (none), the inverse of MODEL without added effects (model), or with "
    "them (augmented). Repeat to compare. Default: augmented where --augmented is given, else model where one is, "
    "else none.",
)
@output_option(OutputKind.FOLDER, "Folder for the records; default: a new one under logs/.", metavar="DIR")
@figure_option("PNG, SVG or PDF: angle, reference, error and command.")
@clock_option
@click.option("--seed", type=click.IntRange(0), help="Seed of the simulated rig's noise.")
@force_option("Run")
@json_option
def track(
    reference: Path,
    rig_path: Path | None,
    kinds: tuple[str, ...],
    output: Path | None,
    figure: Path | None,
    clock: str,
    seed: int | None,
    force: bool,
    json_to: str | None,
    **models: Path | None,
) -> None:
    """Follow the angles of REFERENCE in closed loop: feed-forward and PI on the measured angle. One MCAP file a record.

    REFERENCE is a sweep whose records have an `amplitude_deg`, with its gains under `closed_loop`, or the name of one
    that comes with pamrig (tracking). Without gains they are tuned from MODEL. Before anything moves the reference is
    checked against the envelope; what cannot be followed is refused, with what can.
    """
    from rig.app import compose, inventory
    from rig.app.runs import record_folders, runner, tracking
    from rig.app.terminal import progress
    from rig.cli.runs.run_table import summary

    rig = compose.load(rig_path)
    if clock == "virtual":
        compose.allow_virtual(rig)
    for line in inventory.warnings(rig):
        click.echo(f"pamrig: warning: {in_lines(line)}", err=True)
    chosen = kinds or (next((kind for kind in ("augmented", "model") if models[kind] is not None), "none"),)
    options = tracking.TrackOptions(reference, kinds=tuple(tracking.FeedForwardKind(kind) for kind in chosen), **models)
    with progress("computing the feed-forward", None):
        prepared = tracking.prepare(options, rig)
    _tell_gains(prepared, json_to)
    result, tracked = tracking.follow(
        prepared,
        runner.RunOptions(
            out=output or record_folders.made_folder(prepared.name), virtual=clock == "virtual", seed=seed, force=force
        ),
    )
    summary(result, json_to)
    _show(tracked, json_to)
    if figure is not None and tracked:
        with write_errors_last():
            _draw(tracked, figure)
    runs = {str(one.file): one.to_json() for one in tracked}
    plain = result.to_json()
    emit(plain | {"runs": [runs.get(run["file"], run) for run in plain["runs"]], "gains": _gains(prepared)}, json_to)
    result.judge()


@click.command(cls=Command)
@model_option
@rig_option("Rig whose period and envelope hold; default: the simulated rig.")
@click.option(
    "--p0",
    "p0_mpa",
    type=Number(0.01, 1.0),
    help="Rest pressure in MPa; default: all of REFERENCE, else the model's.",
)
@click.option(
    "--sensitivity",
    type=Number(1.05, 4.0),
    help="Upper bound of the maximum sensitivity Ms, 1.2 (careful) to 2 (brisk); default 1.6.",
)
@click.option(
    "--off",
    type=Number(0.0, 1.0),
    help="Relative error of the model's gain and lag to be robust against; default 0.2.",
)
@click.option(
    "--later",
    "later_s",
    type=Number(0.0, 1.0),
    help="Delay, s, beyond the model's to be robust against; default 0.04.",
)
@click.option(
    "--tracking",
    cls=Renamed,
    former=("--reference",),
    type=_path,
    metavar="REFERENCE.yaml",
    help="A reference of `pamrig track` whose gains are to be replaced; needs -o.",
)
@output_option(OutputKind.SWEEP, "With --tracking: the same with these gains.", metavar="FILE")
@json_option
def tune(
    model: Path,
    rig_path: Path | None,
    p0_mpa: float | None,
    sensitivity: float | None,
    off: float | None,
    later_s: float | None,
    tracking: Path | None,
    output: Path | None,
    json_to: str | None,
) -> None:
    """PI gains for `pamrig track` from MODEL, with stated margins; nothing is tried on the rig."""
    from rig.app import compose, shipped
    from rig.app.runs.tracking import rests_of, tune_for, write_gains
    from rig.app.terminal import progress
    from rig.model.parameters import load_model

    if (tracking is None) != (output is None):
        raise click.UsageError("--tracking and -o go together")
    rig, loaded = compose.load(rig_path), load_model(shipped.find_config(model, "models"))
    place = None if tracking is None else shipped.find_config(tracking, "references")
    rests = (loaded.p0_mpa,) if place is None else rests_of(place)
    rests = rests if p0_mpa is None else (p0_mpa,)
    with progress("tuning", None):
        found = tune_for(loaded, rests, rig.period_ns, sensitivity=sensitivity, off=off, later_s=later_s)
    _tell_tuned(found, json_to)
    if place is not None and output is not None:
        with write_errors_last():
            write_gains(place, found.gains, output)
    emit(tuned_json(found), json_to)


def tuned_json(found: "Tuned") -> dict[str, Any]:
    """Gains and margins."""
    from dataclasses import asdict

    return {"closed_loop": asdict(found.gains), "margins": asdict(found.nominal), "margins_off": asdict(found.worst)}


def _gains(prepared: "PreparedTracking") -> dict[str, Any]:
    from dataclasses import asdict

    return asdict(prepared.gains) if prepared.tuned is None else tuned_json(prepared.tuned)


def _tell_gains(prepared: "PreparedTracking", json_to: str | None) -> None:
    if prepared.tuned is not None:
        console(json_to).print("no closed_loop in the reference: gains from the model")
        _tell_tuned(prepared.tuned, json_to)


def _tell_tuned(found: "Tuned", json_to: str | None) -> None:
    gains, out = found.gains, console(json_to)
    out.print(
        f"closed_loop: {{kp_mpa_per_deg: {gains.kp_mpa_per_deg:g}, ki_mpa_per_deg_s: {gains.ki_mpa_per_deg_s:g}}}"
    )
    out.print(f"on the model: {found.nominal}")
    out.print(f"with gain and lag off, and later: {found.worst}")


def _show(tracked: "list[Tracked]", json_to: str | None) -> None:
    table = listing("reference", "feed-forward", "RMSE deg", "max deg", "lag ms", "dp rms MPa", "MPa/s", "inverse deg")
    for one in tracked:
        score, expected = one.score, one.expected
        table.add_row(
            one.reference, one.feedforward.value, f"{score.rmse_deg:.3f}", f"{score.max_deg:.2f}",
            f"{1e3 * score.lag_s:+.1f}", f"{score.effort_mpa:.3f}", f"{score.travel_mpa_s:.2f}",
            "-" if expected is None else f"{expected.residual_rms_deg:.3f}",
        )  # fmt: skip
    console(json_to).print(table)


def _draw(tracked: "list[Tracked]", figure: Path) -> None:
    from rig.app.runs.tracking import followed_record
    from rig.report.log_figures import save
    from rig.report.tracking_figures import tracking_figure

    save(
        tracking_figure([(one.reference, one.feedforward.value, followed_record(one.file)) for one in tracked]), figure
    )

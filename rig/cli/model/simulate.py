"""`pamrig simulate`: what the simulator says under the commands of a sweep or of logs."""

from pathlib import Path

import click

from rig.app.terminal import console
from rig.cli.common import emit, family_option, json_option
from rig.cli.outputs import Command, figure_option, output_option, refuse_options, write_errors_last
from rig.number_text import counted
from rig.outputs import OutputKind


@click.command(cls=Command)
@click.argument("commands", type=click.Path(path_type=Path), metavar="SWEEP.yaml|LOG")
@click.option("--model", "model_path", type=click.Path(path_type=Path), metavar="MODEL.yaml", help="The simulator.")
@click.option(
    "--plant",
    type=click.IntRange(0),
    metavar="UNIT",
    help="Instead of a model: a rig of simulated physics, by its number; each number is another rig of one build.",
)
@family_option("The build of that rig.", several=False, default="mckibben")
@click.option(
    "--session",
    default=1,
    show_default=True,
    type=click.IntRange(0),
    help="The day on that rig; it drifts a little from day to day.",
)
@output_option(
    OutputKind.RECORDING, "File, or a folder for several records.", or_folder=True, required=True, metavar="OUT"
)
@click.option(
    "--input",
    "drive",
    type=click.Choice(("command", "pressure")),
    default="command",
    show_default=True,
    help="What drives the muscles: the commands of LOG, or the pressures measured in it, without their noise.",
)
@figure_option("PNG, SVG or PDF: all loops in one, as in Fig. 1 of the paper.", former=("--loops",))
@json_option
def simulate(
    commands: Path,
    model_path: Path | None,
    plant: int | None,
    family: str,
    session: int,
    output: Path,
    drive: str,
    figure: Path | None,
    json_to: str | None,
) -> None:
    """What MODEL says under the commands of a sweep or of a LOG: the angle, and the pressures if it has regulators.

    MODEL may hold added effects, as `pamrig gap diagnose --augmented-model` writes them. Several records go into the
    folder OUT, one file each. With --plant the records come from a simulation of the physics that shares no law with
    the models: something to identify that is not a Bouc-Wen model.
    """
    from rig.app.model.simulating import by_model, by_plant, simulate_all
    from rig.own_units import own_text

    if model_path is not None and plant is None:
        refuse_options(("family", "session"), "goes with --plant")
        simulator = by_model(model_path, from_pressures=drive == "pressure")
    elif plant is not None and model_path is None:
        refuse_options(("drive",), "goes with --model; a plant is driven by the commands")
        simulator = by_plant(family, plant, session)
    else:
        raise click.UsageError("name either a --model or a --plant")
    runs = list(simulate_all(commands, simulator, output))
    terminal = console(json_to)
    for run in runs:
        off = "" if run.rmse_deg is None else own_text(f"{run.rmse_deg:.3f} deg", run.record.channels)
        compared = off and f", RMSE against the recording {off}"
        terminal.print(f"{run.file}: {counted(len(run.record), 'tick')}{compared}")
    if figure is not None:
        from rig.report.fit_figures import loops_figure
        from rig.report.log_figures import save

        with write_errors_last():
            save(loops_figure(output.name, [run.record for run in runs]), figure)
            terminal.print(f"loops: {figure}")
    emit({"runs": [run.to_json() for run in runs]}, json_to)

"""`pamrig replay`: recorded commands once more, tick by tick, and how far the answer differs."""

from pathlib import Path

import click

from rig.app.terminal import console
from rig.cli.common import Number, emit, force_option, json_option, rig_option
from rig.cli.outputs import Command, figure_option, output_option
from rig.number_text import counted
from rig.outputs import OutputKind


@click.command(cls=Command)
@click.argument("log", type=click.Path(path_type=Path))
@click.option(
    "--model",
    "model_path",
    type=click.Path(path_type=Path),
    metavar="MODEL.yaml",
    help="Model of the simulated rig, instead of its own.",
)
@rig_option("Rig to replay on; default: the simulated rig.")
@output_option(
    OutputKind.RECORDING, "OUT.mcap, or a folder; default: a new folder under logs/.", or_folder=True, metavar="OUT"
)
@click.option(
    "--clock", type=click.Choice(["real", "virtual"]), help="Default: virtual on a simulated rig, real on a real one."
)
@click.option(
    "--seed", type=click.IntRange(0), help="Seed of the simulated rig's noise; default: that of the recording."
)
@click.option("--p0", "p0_mpa", type=Number(0.0, 1.0), help="Rest pressure in MPa, for logs that hold only p1 - p2.")
@click.option(
    "--resample", is_flag=True, help="Hold each recorded command on the rig's grid when its period is another."
)
@click.option(
    "--gate",
    type=click.Path(path_type=Path),
    metavar="GATE.yaml",
    help="YAML of tolerances, one a field; exit status 1 when one is exceeded.",
)
@figure_option("PNG, SVG or PDF; a folder for several; default: beside the log of the replay, as SVG.", or_folder=True)
@force_option("Replay")
@json_option
def replay(
    log: Path,
    model_path: Path | None,
    rig_path: Path | None,
    output: Path | None,
    clock: str | None,
    seed: int | None,
    p0_mpa: float | None,
    resample: bool,
    gate: Path | None,
    figure: Path | None,
    force: bool,
    json_to: str | None,
) -> None:
    """Send the recorded commands of LOG again, through the same loop and guard as a run, and compare with the
    recording.

    The comparison stands in the new log (channel /rig/replay and its facts), as a figure beside it, and here.
    """
    from rig.app.runs import replaying
    from rig.errors import CheckFailed
    from rig.own_units import own_text

    job = replaying.prepare(log, rig_path, model_path, p0_mpa, resample)
    options = replaying.ReplayOptions(output, clock, seed, force, figure, replaying.load_gate(gate) if gate else None)
    terminal, done = console(json_to), []
    for item in replaying.replay_all(job, options):
        done.append(item)
        facts = item.comparison
        off = own_text(f"RMSE {facts['rmse_deg']:.4g} deg, largest {facts['max_deg']:.4g} deg", item.channels)
        terminal.print(f"{item.file}: {off} over {counted(facts['compared_ticks'], 'tick')}")
        terminal.print(f"  {item.figure}")
        for finding in item.departures:
            terminal.print(f"  {finding}")
    if left := len(job.recordings) - len(done):
        terminal.print(f"not replayed, for the rig was stopped: {left} of {len(job.recordings)} recordings")
    emit({"runs": [item.to_json() for item in done]}, json_to)
    for item in done:
        item.outcome.judge()
    moved = sum(bool(item.departures) for item in done)
    if moved:
        raise CheckFailed(f"{moved} of {counted(len(done), 'replay')} left the gate's tolerances")

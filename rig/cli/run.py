"""`pamrig run`: the experiment of a sweep on a rig, recorded."""

from pathlib import Path

import click

from rig.app.terminal import visible
from rig.cli.common import emit, json_option
from rig.cli.outputs import Command, output_option
from rig.outputs import Kind


@click.command(cls=Command)
@click.argument("sweep", type=click.Path(path_type=Path))
@click.option("--rig", "rig_path", type=click.Path(path_type=Path), help="Rig to run on; default: the simulated rig.")
@output_option(Kind.FOLDER, "Folder for the records; default: a new one under logs/.", metavar="DIR")
@click.option(
    "--clock",
    type=click.Choice(["real", "virtual"]),
    default="real",
    show_default=True,
    help="Virtual: as fast as it can.",
)
@click.option("--seed", type=click.IntRange(0), help="Seed of the simulated rig's noise.")
@click.option(
    "--force",
    is_flag=True,
    help="Run on real hardware although real-time measures were denied, or the watchdog of a device takes too long.",
)
@json_option
def run(
    sweep: Path,
    rig_path: Path | None,
    output: Path | None,
    clock: str,
    seed: int | None,
    force: bool,
    json_to: str | None,
) -> None:
    """Run SWEEP: settle at P0, zero the angle, ramp in, sweep, ramp out, safe state. One MCAP file a record.

    SWEEP is a YAML file, or the name of one that comes with pamrig (paper, quick, identify, gap, cocontraction).
    Ctrl-C ramps down and finishes the file; a second Ctrl-C writes the safe state at once.
    """
    from rig.app import compose, inventory, runner
    from rig.cli.runs import summary
    from rig.errors import RigError
    from rig.excite.envelope import check
    from rig.excite.experiment import expand, load_sweep
    from rig.service.run_setup import program_of

    sweep = compose.find_config(sweep, "sweeps")
    rig = compose.load(rig_path)
    if clock == "virtual" and not compose.is_simulated(rig):
        raise RigError(f"{rig.path}: a real rig runs in real time; --clock virtual needs a simulated one")
    for line in inventory.warnings(rig):
        click.echo(f"pamrig: warning: {visible(line)}", err=True)
    plan = load_sweep(sweep)
    plans = expand(plan, rig.period_ns)
    for item in plans:
        check(item, rig.limits, rig.period_ns)
    runs = [runner.Planned(item.name, program_of(item, number), item.facts) for number, item in enumerate(plans, 1)]
    options = runner.RunOptions(
        out=output or runner.new_folder(plan.name),
        virtual=clock == "virtual",
        seed=seed,
        force=force,
        attachments={"sweep.yaml": sweep.read_bytes()},
    )
    result = runner.carry_out(rig, runs, options)
    summary(result, json_to)
    emit(result.to_json(), json_to)
    result.judge()

"""`pamrig run`: the experiment of a sweep on a rig, recorded."""

from pathlib import Path

import click

from rig.cli.common import clock_option, emit, force_option, json_option, rig_option
from rig.cli.outputs import Command, output_option
from rig.outputs import OutputKind
from rig.report.shown_text import in_lines


@click.command(cls=Command)
@click.argument("sweep", type=click.Path(path_type=Path))
@rig_option("Rig to run on; default: the simulated rig.")
@output_option(OutputKind.FOLDER, "Folder for the records; default: a new one under logs/.", metavar="DIR")
@clock_option
@click.option("--seed", type=click.IntRange(0), help="Seed of the simulated rig's noise.")
@force_option("Run")
@click.option("--tag", "tags", multiple=True, metavar="NAME=VALUE", help="Goes into every record: muscle, load, who.")
@click.option("--note", metavar="TEXT", help="Why this session: goes into every record.")
@json_option
def run(
    sweep: Path,
    rig_path: Path | None,
    output: Path | None,
    clock: str,
    seed: int | None,
    force: bool,
    tags: tuple[str, ...],
    note: str | None,
    json_to: str | None,
) -> None:
    """Run SWEEP: settle at P0, zero the angle, ramp in, sweep, ramp out, safe state. One MCAP file a record.

    SWEEP is a YAML file, or the name of one that comes with pamrig (paper, quick, identify, gap, cocontraction).
    Ctrl-C ramps down and finishes the file; a second Ctrl-C writes the safe state at once.
    """
    from rig.app import compose, inventory
    from rig.app.runs.sweeping import SweepOptions, run_sweep
    from rig.cli.runs.run_table import summary
    from rig.tags import check_note, parse_tags, tagged

    rig = compose.load(rig_path)
    for line in inventory.warnings(rig):
        click.echo(f"pamrig: warning: {in_lines(line)}", err=True)
    facts = tagged(rig.own_facts, parse_tags(tags, "--tag"), check_note(note, "--note"))
    result = run_sweep(sweep, rig, SweepOptions(output, clock == "virtual", seed, force, facts))
    summary(result, json_to)
    emit(result.to_json(), json_to)
    result.judge()

"""`pamrig devices`: what is configured, does it answer and how fast, and what do its readings mean."""

from pathlib import Path

import click

from rig.app.terminal import console, progress, styled
from rig.cli.common import Number, emit, json_option
from rig.cli.outputs import Group, output_option, refuse_options
from rig.outputs import OutputKind

_RIG = click.option(
    "--rig",
    "rig_path",
    type=click.Path(path_type=Path),
    metavar="RIG.yaml",
    help="Rig to look at; default: the simulated rig.",
)

_FORCE = click.option(
    "--force", is_flag=True, help="Move the rig although the watchdog of a device takes longer than safe.watchdog_s."
)


@click.group(cls=Group)
def devices() -> None:
    """List, probe and calibrate devices."""


@devices.command("list", short_help="What the rig's YAML says.")
@_RIG
@json_option
def list_devices(rig_path: Path | None, json_to: str | None) -> None:
    """What the rig's YAML says: devices, roles, calibrations and their age. Nothing is opened."""
    from rig.app import compose, inventory

    rig = compose.load(rig_path)
    found = inventory.inventory(rig)
    screen = console(json_to)
    screen.print(inventory.table(found))
    for warning in found["warnings"]:
        screen.print(styled(("warning:", "yellow"), f" {warning}"))
    emit(found, json_to)


@devices.command(short_help="Do the devices answer, and how fast?")
@_RIG
@click.option("--ticks", type=click.IntRange(20, 100_000), default=400, show_default=True, help="Reads to time.")
@click.option("--step", is_flag=True, help="Also step each valve alone and see which monitor moves. MOVES THE RIG.")
@click.option("--step-mpa", type=Number(0.005, 0.1), default=0.03, show_default=True, help="Size of that step.")
@click.option("--settle", type=Number(0.1, 30.0), default=1.0, show_default=True, help="Seconds to wait after a step.")
@click.option("--yes", is_flag=True, help="Do not ask before moving the rig.")
@_FORCE
@json_option
def probe(
    rig_path: Path | None, ticks: int, step: bool, step_mpa: float, settle: float, yes: bool, force: bool,
    json_to: str | None,
) -> None:  # fmt: skip
    """Does each device answer, how fast, and can it hold the period? Moves nothing unless --step is given.

    Exit status 1 when a device does not answer, cannot hold the period, or its wiring is not as the config says.
    """
    from rig.app import compose, inventory
    from rig.app.devices import probing

    if not step:
        refuse_options(("step_mpa", "settle"), "goes with --step, which moves the rig")
    rig = compose.load(rig_path)
    screen = console(json_to)
    if step:
        probing.check_step(rig, step_mpa)
    if step and not yes:
        inventory.ask_to_move(rig, f"steps each valve by {step_mpa:g} MPa")
    with progress("probing", ticks * len(rig.devices)) as update:
        found = probing.probe(rig, ticks, update)
        if step and probing.clear_trips(rig, found):
            screen.print("a watchdog had tripped: the safe state was written, which starts it anew")
            found = probing.probe(rig, ticks, update)
    if step and not found.findings:
        found = probing.stepped(rig, found, step_mpa, settle, force=force)
    screen.print(probing.table(found))
    screen.print("\n".join([*probing.moved(found), *probing.facts(found)]))
    for warning in found.warnings:
        screen.print(styled(("warning:", "yellow"), f" {warning}"))
    for finding in found.findings[1:]:
        screen.print(finding)
    emit(found.to_json(), json_to)
    probing.judge(found.findings)


@devices.command(short_help="Calibrate potentiometer or regulators.")
@click.argument("what", type=click.Choice(["angle", "pressures"]), required=False)
@_RIG
@click.option(
    "--points",
    type=click.Path(path_type=Path),
    metavar="POINTS.yaml",
    help="Take the points from this YAML file; nothing is opened.",
)
@output_option(
    OutputKind.CALIBRATION, "Calibration file to write; other roles in it stay.", required=True, metavar="FILE.yaml"
)
@click.option(
    "--form",
    type=click.Choice(["linear", "pieces"]),
    default="linear",
    show_default=True,
    help="A straight line, or pieces of one between the points.",
)
@click.option(
    "--reference-uncertainty",
    type=Number(0.0),
    default=0.0,
    help="Standard uncertainty (k = 1) of the gauge, MPa, or the protractor, deg.",
)
@click.option(
    "--reference-v",
    type=Number(0.1, 30.0),
    help="Excitation of the potentiometer when the rig does not read it.",
)
@click.option(
    "--serial",
    "serials",
    multiple=True,
    metavar="PART=NUMBER",
    help="Serial number of a part or an instrument; repeatable.",
)
@click.option(
    "--levels",
    default="0.05,0.15,0.25,0.35,0.45,0.35,0.25,0.15,0.05",
    show_default=True,
    help="Pressures to visit, MPa.",
)
@click.option("--settle", type=Number(0.1, 60.0), default=2.0, show_default=True, help="Seconds to wait at each point.")
@click.option("--yes", is_flag=True, help="Do not ask before moving the rig.")
@_FORCE
@json_option
def calibrate(
    what: str | None, rig_path: Path | None, points: Path | None, output: Path, form: str, reference_uncertainty: float,
    reference_v: float | None, serials: tuple[str, ...], levels: str, settle: float, yes: bool, force: bool,
    json_to: str | None,
) -> None:  # fmt: skip
    """Calibrate the potentiometer (angle) or regulators and monitors (pressures), guided on the terminal or from
    --points FILE.

    Guided, `angle` moves nothing: you turn the joint. `pressures` MOVES THE RIG through --levels, both muscles alike;
    you read a gauge.
    """
    from rig.app import compose, inventory
    from rig.app.devices import calibrating
    from rig.errors import RigError

    if (what is None) == (points is None):
        raise RigError("devices calibrate: say either what to calibrate (angle, pressures) or give --points FILE")
    if what != "pressures":
        refuse_options(("levels", "settle"), "goes with `pamrig devices calibrate pressures`, which moves the rig")
    options = calibrating.CalibrationOptions(
        form, reference_uncertainty, calibrating.parse_serials(serials), settle, reference_v, force
    )
    calibrating.kept_in(output)
    typed: calibrating.Typed = {}
    rig = compose.load(rig_path) if rig_path or points is None else None
    with calibrating.not_lost(output, typed, options):
        if points is not None:
            measured = calibrating.read_points(points)
        else:
            assert rig is not None
            if what == "angle":
                calibrating.guided_angle(rig, options, typed)
            else:
                visits = calibrating.parse_levels(levels, rig)
                if not yes:
                    inventory.ask_to_move(rig, f"brings both muscles to {max(visits):g} MPa")
                calibrating.guided_pressures(rig, visits, options, typed)
            measured = calibrating.measured(typed, options)
        result = calibrating.write(output, measured, str(points or "the points"), rig)
    console(json_to).print(calibrating.table(result))
    emit(result, json_to)

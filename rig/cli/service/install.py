"""`pamrig service`: install the daemon as a system service, take it away again, and write the safe state without it."""

from pathlib import Path

import click

from rig.app.terminal import console
from rig.cli.common import F, rig_option
from rig.cli.outputs import Group
from rig.errors import RigError


@click.group(cls=Group)
def service() -> None:
    """Install pamrig as a system service."""


def _init_option(command: F) -> F:
    text = "Default: systemd where it runs, else System V (NI Linux Real-Time)."
    return click.option("--init", "init", type=click.Choice(["systemd", "sysv"]), help=text)(command)


@service.command(short_help="Install and start the daemon as a service.")
@rig_option("Rig to serve; default: the simulated rig.")
@_init_option
@click.option(
    "--root",
    type=click.Path(path_type=Path),
    default=Path("/"),
    metavar="DIR",
    help="Install below another root, without starting anything.",
)
@click.option("--dry-run", is_flag=True, help="Only say what would be done.")
def install(rig_path: Path | None, init: str | None, root: Path, dry_run: bool) -> None:
    """Install, enable and start the daemon as a service of this machine. Says each thing it does; needs root."""
    from rig.app import compose, installing, shipped
    from rig.service.settings import load_settings

    found = installing.init_of(init)
    rig = compose.load(rig_path)
    config = root / installing.SETTINGS.relative_to("/")
    settings = load_settings(config if config.exists() else shipped.configs() / "daemon.yaml")
    target = root / found.target.relative_to("/")
    folders = installing.written_to(settings)
    text = installing.render(found, installing.program(), rig.path.absolute(), installing.SETTINGS, folders)
    say = console().print
    say(f"settings: {config}" + (" (kept as it is)" if config.exists() else " (written, with a comment for each key)"))
    say(f"service:  {target}, for the rig {rig.name} ({rig.path.absolute()})")
    commands = installing.after_install(found, settings) if root == Path("/") else []
    for command in commands:
        say(f"runs:     {' '.join(command)}")
    if dry_run:
        return
    if not config.exists():
        installing.write(config, (shipped.configs() / "daemon.yaml").read_text(encoding="utf-8"), 0o644)
    installing.write(target, text, found.mode)
    for command in commands:
        installing.run(command)
    say("done: the rig is disarmed; `pamrig status`, then `pamrig arm` and `pamrig start SWEEP.yaml`")


@service.command(short_help="Take the service away.")
@_init_option
@click.option(
    "--root", type=click.Path(path_type=Path), default=Path("/"), metavar="DIR", help="Take it away below another root."
)
def uninstall(init: str | None, root: Path) -> None:
    """Stop the service and take it away; settings, logs and black boxes stay."""
    from rig.app import installing

    found = installing.init_of(init)
    target = root / found.target.relative_to("/")
    if not target.exists():
        raise RigError(f"{target}: is not there; nothing to take away")
    if root == Path("/"):
        installing.run(found.end)
    target.unlink()
    console().print(f"taken away: {target}; {installing.SETTINGS}, logs and black boxes stay")


@service.command(short_help="Write the safe state from here.")
@rig_option("Default: the simulated rig.")
def safe(rig_path: Path | None) -> None:
    """Write the safe state to the rig's device from here, whoever else has it. What systemd does after the daemon has
    ended."""
    from rig.app import compose, supervise
    from rig.realtime.safe_report import Outcome

    rig = compose.load(rig_path)
    if not compose.outlives_the_loop(rig):
        console().print(f"{rig.name}: nothing to write: its plant lives in the loop's process, and ends with it")
        return
    outcome = supervise.make_safe(rig)
    seen = "seen at the device" if outcome is Outcome.SEEN else "not confirmed: the device has not been read back"
    console().print(f"{rig.name}: safe, {rig.safe.p1_mpa:g} and {rig.safe.p2_mpa:g} MPa, {seen}")

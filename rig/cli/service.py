"""`pamrig service`: install the daemon as a system service, take it away again, and write the safe state without it."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Final

import click

from rig.app.terminal import console
from rig.cli.common import F
from rig.errors import DeviceError, RigError

TARGETS: Final = {"systemd": Path("/etc/systemd/system/pamrig.service"), "sysv": Path("/etc/init.d/pamrig")}
_TEMPLATES: Final = {"systemd": "systemd/pamrig.service", "sysv": "sysvinit/pamrig"}
_SETTINGS: Final = Path("/etc/pamrig/daemon.yaml")


@click.group()
def service() -> None:
    """Install pamrig as a system service."""


def _init_option(command: F) -> F:
    text = "Default: systemd where it runs, else System V (NI Linux Real-Time)."
    return click.option("--init", "init", type=click.Choice(list(TARGETS)), help=text)(command)


@service.command()
@click.option("--rig", "rig_path", type=click.Path(path_type=Path), help="Rig to keep; default: the simulated rig.")
@_init_option
@click.option(
    "--root", type=click.Path(path_type=Path), default=Path("/"), help="Install below another root, without starting anything."
)
@click.option("--dry-run", is_flag=True, help="Only say what would be done.")
def install(rig_path: Path | None, init: str | None, root: Path, dry_run: bool) -> None:
    """Install, enable and start the daemon as a service of this machine. Says each thing it does; needs root."""
    from rig.app import compose
    from rig.service.settings import load_settings

    kind = init or running_init()
    rig = compose.load(rig_path)
    config = root / _SETTINGS.relative_to("/")
    settings = load_settings(config if config.exists() else compose.configs() / "daemon.yaml")
    target = root / TARGETS[kind].relative_to("/")
    text = render(kind, program(), rig.path.absolute(), _SETTINGS, settings.logs)
    say = console().print
    say(f"settings: {config}" + (" (kept as it is)" if config.exists() else " (written, with a comment for each key)"))
    say(f"service:  {target}, for the rig {rig.name} ({rig.path.absolute()})")
    commands = after_install(kind, settings.group, settings.logs) if root == Path("/") else []
    for command in commands:
        say(f"runs:     {' '.join(command)}")
    if dry_run:
        return
    _write(config, None if config.exists() else (compose.configs() / "daemon.yaml").read_text(encoding="utf-8"), 0o644)
    _write(target, text, 0o755 if kind == "sysv" else 0o644)
    for command in commands:
        _run(command)
    say("done: the rig is disarmed; `pamrig status`, then `pamrig arm` and `pamrig start SWEEP.yaml`")


@service.command()
@_init_option
@click.option("--root", type=click.Path(path_type=Path), default=Path("/"), help="Take it away below another root.")
def uninstall(init: str | None, root: Path) -> None:
    """Stop the service and take it away; settings, logs and black boxes stay."""
    kind = init or running_init()
    target = root / TARGETS[kind].relative_to("/")
    if not target.exists():
        raise RigError(f"{target}: is not there; nothing to take away")
    if root == Path("/"):
        _run(["systemctl", "disable", "--now", "pamrig"] if kind == "systemd" else [str(target), "stop"])
    target.unlink()
    console().print(f"taken away: {target}; {_SETTINGS}, logs and black boxes stay")


@service.command()
@click.option("--rig", "rig_path", type=click.Path(path_type=Path), help="Default: the simulated rig.")
def safe(rig_path: Path | None) -> None:
    """Write the safe state to the rig's device from here, whoever else has it. What systemd does after the daemon has ended."""
    from rig.app import compose
    from rig.realtime.clock import MonotonicClock
    from rig.realtime.safe_state import Outcome, SecondPath, look

    rig = compose.load(rig_path)
    if not compose.outlives_the_loop(rig):
        console().print(f"{rig.name}: nothing to write: its plant lives in the loop's process, and ends with it")
        return
    path = SecondPath.of(compose.make_device(rig, MonotonicClock()))
    try:
        path.safe()
    except DeviceError as error:
        raise RigError(f"{rig.name}: the safe state could not be written: {error}") from None
    outcome = look(path)
    if outcome is Outcome.FAILED:
        raise RigError(f"{rig.name}: NOT SAFE: the safe state was written, but the device holds something else; who else writes?")
    seen = "seen at the device" if outcome is Outcome.SEEN else "not confirmed: the device has not been read back"
    console().print(f"{rig.name}: safe, {rig.safe.p1_mpa:g} and {rig.safe.p2_mpa:g} MPa, {seen}")


def running_init() -> str:
    """What starts services on this machine."""
    return "systemd" if Path("/run/systemd/system").is_dir() else "sysv"


def program() -> str:
    """How the service calls pamrig: the command beside this Python, or on the path."""
    beside = Path(sys.executable).with_name("pamrig")
    found = str(beside) if beside.exists() else shutil.which("pamrig")
    if found is None:
        raise RigError("the command pamrig is not installed beside this Python; pip install pamrig")
    return found


def render(kind: str, pamrig: str, rig: Path, config: Path, logs: Path) -> str:
    """The unit or script with its places filled in."""
    from rig.app import compose

    text = (compose.configs() / _TEMPLATES[kind]).read_text(encoding="utf-8")
    for place, value in {"pamrig": pamrig, "rig": rig, "config": config, "logs": logs}.items():
        text = text.replace(f"{{{place}}}", str(value))
    return text


def after_install(kind: str, group: str, logs: Path) -> list[list[str]]:
    """The commands that make the service known and start it."""
    first = [["groupadd", "--force", group]] if group else []
    first.append(["mkdir", "-p", str(logs)])
    if kind == "systemd":
        return [*first, ["systemctl", "daemon-reload"], ["systemctl", "enable", "--now", "pamrig"]]
    return [*first, ["update-rc.d", "pamrig", "defaults"], [str(TARGETS["sysv"]), "start"]]


def _write(path: Path, text: str | None, mode: int) -> None:
    if text is None:
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        path.chmod(mode)
    except OSError as error:
        hint = "; call it as root" if os.geteuid() else ""
        raise RigError(f"{path}: cannot be written: {error.strerror}{hint}") from None


def _run(command: list[str]) -> None:
    try:
        subprocess.run(command, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        raise RigError(f"{' '.join(command)}: failed: {error}") from None

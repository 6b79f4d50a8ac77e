"""Installing the daemon as a service of this machine: which init, which file, which commands."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Final

from rig.app import shipped
from rig.errors import RigError

TARGETS: Final = {"systemd": Path("/etc/systemd/system/pamrig.service"), "sysv": Path("/etc/init.d/pamrig")}
_TEMPLATES: Final = {"systemd": "systemd/pamrig.service", "sysv": "sysvinit/pamrig"}
SETTINGS: Final = Path("/etc/pamrig/daemon.yaml")


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
    text = (shipped.configs() / _TEMPLATES[kind]).read_text(encoding="utf-8")
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


def write(path: Path, text: str, mode: int) -> None:
    """Write a file of the service; RigError, with a hint at root, when it cannot be."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        path.chmod(mode)
    except OSError as error:
        hint = "; call it as root" if os.geteuid() else ""
        raise RigError(f"{path}: cannot be written: {error.strerror}{hint}") from None


def run(command: list[str]) -> None:
    """Run one of `after_install`; RigError when it fails."""
    try:
        subprocess.run(command, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        raise RigError(f"{' '.join(command)}: failed: {error}") from None

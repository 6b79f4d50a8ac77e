"""Installing the daemon as a service of this machine: which init, which file, which commands."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rig.app import shipped
from rig.errors import RigError
from rig.service.settings import DaemonSettings

SETTINGS: Final = Path("/etc/pamrig/daemon.yaml")


@dataclass(frozen=True)
class Init:
    """What starts services on a machine."""

    target: Path
    """The service's file."""
    template: str
    """Below the shipped configs."""
    mode: int
    """Of the file."""
    begin: tuple[tuple[str, ...], ...]
    """Commands that make the service known and start it."""
    end: tuple[str, ...]
    """The command that stops it for good."""


SYSTEMD: Final = Init(
    Path("/etc/systemd/system/pamrig.service"),
    "systemd/pamrig.service",
    0o644,
    (("systemctl", "daemon-reload"), ("systemctl", "enable", "--now", "pamrig")),
    ("systemctl", "disable", "--now", "pamrig"),
)
SYSV: Final = Init(
    Path("/etc/init.d/pamrig"),
    "sysvinit/pamrig",
    0o755,
    (("update-rc.d", "pamrig", "defaults"), ("/etc/init.d/pamrig", "start")),
    ("/etc/init.d/pamrig", "stop"),
)
INITS: Final = {"systemd": SYSTEMD, "sysv": SYSV}


def init_of(name: str | None) -> Init:
    """By its name, or what runs on this machine."""
    if name is not None:
        return INITS[name]
    return SYSTEMD if Path("/run/systemd/system").is_dir() else SYSV


def program() -> str:
    """How the service calls pamrig: the command beside this Python, or on the path."""
    beside = Path(sys.executable).with_name("pamrig")
    found = str(beside) if beside.exists() else shutil.which("pamrig")
    if found is None:
        raise RigError("the command pamrig is not installed beside this Python; pip install pamrig")
    return found


def written_to(settings: DaemonSettings) -> list[Path]:
    """The folders that the daemon writes to, as the service finds them, which starts in `/`: the records first."""
    beside = [] if settings.metrics is None else [settings.metrics.parent]
    return [Path("/") / folder for folder in (settings.logs, settings.state, *beside)]


def render(init: Init, pamrig: str, rig: Path, config: Path, folders: Sequence[Path]) -> str:
    """The unit or script with its places filled in; `folders` are those that the daemon writes to."""
    text = (shipped.configs() / init.template).read_text(encoding="utf-8")
    places: dict[str, Sequence[object]] = {"pamrig": [pamrig], "rig": [rig], "config": [config], "folders": folders}
    spelt: dict[str, str] = {}
    for place, values in places.items():
        words = dict.fromkeys(_word(init, str(value), called=place != "folders") for value in values)
        spelt[place] = " ".join(words)
    return re.sub(r"\{(\w+)\}", lambda found: spelt[found[1]], text)  # at once: a place may be called {rig}


def _word(init: Init, place: str, *, called: bool) -> str:
    """A place as the unit or script has it; RigError for one that neither can be told of."""
    if not place.isprintable():
        raise RigError(f"{place!a}: a service cannot be told of a place with such a character in its name")
    return _of_a_unit(place, called=called) if init is SYSTEMD else shlex.quote(place)


def _of_a_unit(place: str, *, called: bool) -> str:
    """As systemd reads it as one word (systemd.service, "Command lines", and systemd.unit, "Specifiers"); `called`: in
    a command, where variables are put in."""
    if re.fullmatch(r"[\w@+=:,./-]+", place):
        return place
    escaped = place.replace("\\", "\\\\").replace('"', '\\"').replace("%", "%%")
    return f'"{escaped.replace("$", "$$") if called else escaped}"'


def after_install(init: Init, settings: DaemonSettings) -> list[list[str]]:
    """The commands that make the service known and start it: a folder that is not there ends a unit of systemd before
    the daemon could make it."""
    group = [["groupadd", "--force", settings.group]] if settings.group else []
    return [*group, ["mkdir", "-p", *map(str, written_to(settings))], *map(list, init.begin)]


def write(path: Path, text: str, mode: int) -> None:
    """Write a file of the service; RigError, with a hint at root, when it cannot be."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        fresh = path.with_name(f".{path.name}.new")
        fresh.write_text(text, encoding="utf-8")
        fresh.chmod(mode)
        fresh.replace(path)
    except OSError as error:
        hint = "; call it as root" if os.geteuid() else ""
        raise RigError(f"{path}: cannot be written: {error.strerror}{hint}") from None


def run(command: Sequence[str]) -> None:
    """Run one of `after_install`; RigError when it fails."""
    try:
        subprocess.run(command, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        raise RigError(f"{' '.join(command)}: failed: {error}") from None

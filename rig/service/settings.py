"""The YAML of the daemon: where it keeps things, how long, and who may look. Every key has a default that suits a
desk."""

import os
from dataclasses import dataclass, field
from pathlib import Path

from rig.config import load
from rig.errors import ConfigError, RigError
from rig.fields import bounded
from rig.service.places import default_socket
from rig.service.retention import Policy


def default_state_folder() -> Path:
    """Where queue and black boxes lie: /var/lib/pamrig for root, else the user's state folder."""
    if os.getuid() == 0:
        return Path("/var/lib/pamrig")
    home = os.environ.get("XDG_STATE_HOME")
    return (Path(home) if home else Path.home() / ".local" / "state") / "pamrig"


@dataclass(frozen=True)
class Live:
    """The live view for Foxglove; needs the extra `live`."""

    port: int = bounded(0, 65535, default=0)
    """WebSocket port on this machine's loopback; 0: off. From elsewhere: an SSH tunnel."""


@dataclass(frozen=True)
class View:
    """The control protocol over TCP, for looking only."""

    host: str = "127.0.0.1"
    port: int = bounded(0, 65535, default=0)
    """0: off."""
    token_file: Path | None = None
    """A file with the token that each request must carry; needed as soon as there is a port."""


@dataclass(frozen=True)
class DaemonSettings:
    """Everything that can be set beside the rig."""

    socket: Path = field(default_factory=default_socket)
    group: str = ""
    """Members of this group may command the rig; empty: only the daemon's own user."""
    logs: Path = Path("logs")
    state: Path = field(default_factory=default_state_folder)
    keep_gb: float | None = bounded(0.01, 1e6, "GB", default=None)
    """When the daemon's own records are more, its oldest go, announced a day before (retention.py); None: they all
    stay."""
    keep_days: float | None = bounded(0.01, 36500.0, "d", default=None)
    """The daemon's own records that are older go, announced a day before; None: they all stay."""
    spare_gb: float = bounded(0.0, 1e6, "GB", default=0.2)
    """With less free space than this no sweep is started."""
    metrics: Path | None = None
    """A .prom file for node_exporter's textfile collector; needs the extra `metrics`."""
    force: bool = False
    """Command real hardware although real-time measures were denied, or its own watchdog takes longer than
    `safe.watchdog_s`."""
    live: Live = field(default_factory=Live)
    view: View = field(default_factory=View)

    @property
    def ledger(self) -> Path:
        """Where the daemon writes down which records it made."""
        return self.state / "records.jsonl"

    @property
    def retention(self) -> Policy:
        """What may make room for new records."""
        keep_bytes = None if self.keep_gb is None else int(self.keep_gb * 1e9)
        return Policy(keep_bytes, None if self.keep_days is None else self.keep_days * 86400)


def load_settings(path: Path | None) -> DaemonSettings:
    """The settings at `path`, or the defaults; ConfigError when they do not fit together."""
    settings = load(path, DaemonSettings) if path else DaemonSettings()
    if settings.view.port and settings.view.token_file is None:
        raise ConfigError(
            f"{path}: view.token_file: needed with view.port: nobody may look over the network without a token"
        )
    return settings


def make_folder(folder: Path) -> None:
    """A folder of the daemon's, made if it is not there; RigError when nothing can be written to it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RigError(f"{folder}: cannot be made: {error.strerror}") from None
    if not os.access(folder, os.W_OK):
        raise RigError(f"{folder}: cannot be written to")


def read_token(file: Path) -> str:
    """The token that a remote viewer must show; RigError when it cannot be read or is too short."""
    try:
        token = file.read_text(encoding="utf-8").strip()
    except OSError as error:
        raise RigError(f"{file}: the token cannot be read: {error.strerror}") from None
    if len(token) < 16:
        raise RigError(f"{file}: a token has at least 16 characters; make one with `openssl rand -hex 16`")
    return token

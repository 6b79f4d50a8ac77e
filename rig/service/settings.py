"""The YAML of the daemon: where it keeps things, how long, and who may look. Every key has a default that suits a
desk."""

import ipaddress
import os
from dataclasses import dataclass, field, fields, is_dataclass, replace
from pathlib import Path
from typing import Any, Final, Self

from rig.config import read_text, read_yaml, shown, structure
from rig.errors import ConfigError, RigError
from rig.fields import bounded
from rig.service.connections import socket_access
from rig.service.connections.socket_access import default_socket
from rig.service.records.retention import Policy

_MOST_TOKEN_BYTES: Final = 4096
LEAST_TOKEN_CHARACTERS: Final = 16
"""64 bits where they are hexadecimal: more than anybody guesses in the time that the page leaves between two wrong
ones."""


def default_state_folder() -> Path:
    """Where queue and black boxes lie: /var/lib/pamrig for root, else the user's state folder; for one without a home,
    as in a container, beside the logs."""
    if os.getuid() == 0:
        return Path("/var/lib/pamrig")
    if home := os.environ.get("XDG_STATE_HOME"):
        return Path(home) / "pamrig"
    try:
        return Path.home() / ".local" / "state" / "pamrig"
    except RuntimeError:
        return Path("pamrig-state")


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
class Web:
    """The operator's page; needs the extra `web`. `web: false` in the daemon's settings is short for `web: {on:
    false}`."""

    on: bool = True
    host: str = "127.0.0.1"
    """Address to listen at. Any but this machine's loopback needs `token_file`."""
    port: int | None = bounded(1, 65535, default=None)
    """None: 8420, or any free one when that is taken."""
    token_file: Path | None = None
    """A file with the token that everybody must show who does not sit at this machine."""
    names: list[str] = field(default_factory=list)
    """Further names of this machine by which a browser may call it, beside its own and its addresses."""
    sweeps: list[Path] = field(default_factory=list)
    """Folders of sweeps that can be started from the page, beside those that come with pamrig."""
    model: Path | None = None
    """The simulator whose angle is drawn beside the rig's; None: a simulated rig's own."""

    @property
    def local(self) -> bool:
        """Only this machine can reach it."""
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return self.host == "localhost"


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
    """The daemon's own records go once it has run for longer since, announced a day before; None: they all stay."""
    spare_gb: float = bounded(0.0, 1e6, "GB", default=0.2)
    """With less free space than this no sweep is started."""
    metrics: Path | None = None
    """A .prom file for node_exporter's textfile collector; needs the extra `metrics`."""
    force: bool = False
    """Command real hardware although real-time measures were denied, or its own watchdog takes longer than
    `safe.watchdog_s`."""
    live: Live = field(default_factory=Live)
    view: View = field(default_factory=View)
    web: Web = field(default_factory=Web)

    def in_place(self) -> Self:
        """The same with files and folders that are found from anywhere: the one that the daemon was started in may be
        removed under it, and a name is relative to nothing then."""
        placed: Self = _in_place(self)
        return placed

    @property
    def ledger(self) -> Path:
        """Where the daemon writes down which records it made."""
        return self.state / "records.jsonl"

    @property
    def operating_time(self) -> Path:
        """Where the daemon keeps how long it has run."""
        return self.state / "operating_time.json"

    @property
    def retention(self) -> Policy:
        """What may make room for new records."""
        keep_bytes = None if self.keep_gb is None else int(self.keep_gb * 1e9)
        return Policy(keep_bytes, None if self.keep_days is None else self.keep_days * 86400)


def _in_place(setting: Any) -> Any:
    """A setting, or a group of them, with every path absolute."""
    if isinstance(setting, Path):
        return setting.absolute()
    if isinstance(setting, list):
        return [_in_place(each) for each in setting]
    if is_dataclass(setting) and not isinstance(setting, type):
        return replace(setting, **{each.name: _in_place(getattr(setting, each.name)) for each in fields(setting)})
    return setting


def load_settings(path: Path | None) -> DaemonSettings:
    """The settings at `path`, or the defaults; ConfigError when they do not fit together."""
    settings = structure(_spelt_out(read_yaml(path)), DaemonSettings, str(path)) if path else DaemonSettings()
    if settings.view.port and settings.view.token_file is None:
        raise ConfigError(
            f"{path}: view.token_file: needed with view.port: nobody may look over the network without a token"
        )
    check_web(settings.web, f"{path}: web")
    return settings


def _spelt_out(raw: object) -> object:
    """`web: false` as the mapping that it stands for."""
    if isinstance(raw, dict) and isinstance(raw.get("web"), bool):
        return raw | {"web": {"on": raw["web"]}}
    return raw


def check_web(web: Web, where: str) -> None:
    """ConfigError for a page that the network could reach without a token."""
    if web.on and not web.local and web.token_file is None:
        raise ConfigError(
            f"{where}.token_file: needed with the host {shown(web.host)}: nobody may come over the network without a "
            "token"
        )


def parse_web(text: str, web: Web) -> Web:
    """What `--web` says over the settings: HOST:PORT, or off. ConfigError, one line, for anything else."""
    if text == "off":
        return replace(web, on=False)
    host, _, port = text.rpartition(":")
    if not host or not (port.isascii() and port.isdigit()) or not 1 <= int(port) <= 65535:
        raise ConfigError(f"--web: {shown(text)}: expected HOST:PORT with a port in 1 .. 65535, or off")
    changed = replace(web, on=True, host=host.strip("[]"), port=int(port))
    check_web(changed, "--web: web")
    return changed


def make_daemon_folder(folder: Path, mode: int = 0o777) -> None:
    """A folder of the daemon's, made if it is not there, with that mode at most; RigError when nothing can be written
    to it."""
    try:
        folder.mkdir(mode, parents=True, exist_ok=True)
    except OSError as error:
        raise RigError(f"{folder}: cannot be made: {error.strerror}{socket_access.owned_by(folder)}") from None
    if not os.access(folder, os.W_OK):
        raise RigError(f"{folder}: cannot be written to{socket_access.owned_by(folder)}")


def read_token(file: Path) -> str:
    """The token that a remote viewer must show; RigError when it cannot be read or is too short."""
    try:
        token = read_text(file, _MOST_TOKEN_BYTES).strip()
    except ConfigError as error:
        raise RigError(f"the token cannot be read: {error}") from None
    if len(token) < LEAST_TOKEN_CHARACTERS:
        raise RigError(
            f"{file}: a token has at least {LEAST_TOKEN_CHARACTERS} characters; make one with `openssl rand -hex 16`"
        )
    return token

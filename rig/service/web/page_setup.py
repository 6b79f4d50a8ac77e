"""What the daemon tells the page's process when it starts it: plain data."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rig.rig_config import RigConfig

PAGE_BACKLOG: Final = 1024
"""Connections that wait to be taken: who finds no place there tries again after a second only."""


@dataclass(frozen=True)
class PageSetup:
    """Everything in it can be pickled."""

    socket: Path
    """The daemon's, at which the page is a client like any other."""
    rig: RigConfig
    simulated: bool
    """Nothing real moves."""
    logs: Path
    state: Path
    """The daemon's state folder; diagnoses of the page lie below it."""
    local: bool
    """Only this machine reaches the page: who comes is known by the user who owns the connection."""
    group: str = ""
    """Members of this group may command, beside the daemon's own user and root."""
    sweeps: tuple[Path, ...] = ()
    """Folders whose sweeps may be started."""
    models: tuple[Path, ...] = ()
    """Folders whose models may be diagnosed with."""
    simulator: Path | None = None
    """Model whose angle is drawn beside the rig's."""
    names: tuple[str, ...] = ()
    """Names of this machine by which a browser may call it, beside its own and its addresses."""
    token: str = ""
    """What everybody must show when the page is not local."""
    key: bytes = b""
    """Signs the visitors' cookies."""
    epoch_s: float = 0.0
    """The machine's date less its monotonic clock when the page was opened (s): by their sum, which nobody turns,
    logins grow old."""

"""What the roof gives a daemon's sessions."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rig.rig_config import RigConfig
from rig.service.session.session import LoopEntry, Watching


@dataclass(frozen=True)
class SessionParts:
    """What the roof gives: the rig, and how its processes are made."""

    rig: RigConfig
    loop: LoopEntry
    watching: Watching | None
    """Who stands above the loop, and this process's own way to the device."""
    simulated: bool
    virtual: bool = False
    warnings: Callable[[], list[str]] = list
    """What is to be said of the rig's calibrations today."""
    sweeps: tuple[Path, ...] = ()
    """Folders of sweeps, and of models, that come with pamrig: what the page offers."""
    models: tuple[Path, ...] = ()
    simulator: Path | None = None
    """A simulated rig's own model."""
    driver: Callable[[], str] = str
    """Who drives what the rig is wired to, in words; empty when nobody does."""

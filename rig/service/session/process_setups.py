"""What the processes of loop and watchers are told when they start; everything in it can be pickled.

Apart from the session that tells them: a new process loads this, and not the whole of who commands.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rig.realtime.safe_report import Writer


@dataclass(frozen=True)
class LoopSetup:
    """What the loop's process is told when it starts; everything in it can be pickled."""

    session: int
    ring: Path
    mailbox: Path
    rig: Any
    """A RigConfig; the roof knows what to do with it."""
    virtual: bool = False
    seed: int | None = None
    script: tuple[int, ...] | None = None
    """Numbers of the runs to carry out one after the other; None: obey the mailbox."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Further options of the caller for the roof, for example a model that replaces the rig's."""


@dataclass(frozen=True)
class WatcherSetup:
    """What a watcher's process is told; everything in it can be pickled."""

    writer: Writer
    session: int
    ring: Path
    block: Path
    pid: int
    """The process that writes set-points."""
    rig: Any
    """A RigConfig; the roof knows what to do with it."""
    options: Mapping[str, Any]
    patience_ns: int | None = None
    """Silence after which the process is taken for stopped; None: by the rig's limits."""
    speaks: bool = False
    """Say on stderr what was done, for a command whose own process is ended by it."""

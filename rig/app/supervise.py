"""What the session of a rig has from the roof: who watches it, the safe state by hand, the parts of the daemon's."""

import functools
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from rig.app import compose, shipped, wire_locks
from rig.app.heir_process import heir_process
from rig.app.loop_process import loop_process
from rig.app.watcher_process import outside, watcher_process
from rig.errors import DeviceError, RigError
from rig.realtime.safe_report import Outcome, Writer
from rig.realtime.safe_state import SecondPath, insist
from rig.rig_config import RigConfig
from rig.service.session.heir import Heir
from rig.service.session.session import Watching
from rig.service.session.session_parts import SessionParts

_INSIST_S: Final = 2.0
"""For somebody who writes the safe state by hand; a slow wire confirms within tenths of a second."""


def watching(rig: RigConfig, wires: Callable[[], Sequence[str]] | None = None) -> Watching:
    """Who watches a session of this rig. `wires`: their names, if they are not to be looked up now."""
    writers = (Writer.SUPERVISOR, Writer.GUARDIAN)
    if not compose.outlives_the_loop(rig):
        return Watching(watcher_process, writers, None)
    if wires is None:
        found = compose.wires_of(rig)
        wires = lambda: found  # noqa: E731
    return Watching(watcher_process, writers, lambda: second_path(rig, wires), lambda: Heir(heir_process, rig))


def second_path(rig: RigConfig, wires: Callable[[], Sequence[str]]) -> SecondPath:
    """This process's own way to the rig's device, made when it is used: what goes wrong then is a failed attempt and
    not the end."""
    path = functools.cache(lambda: SecondPath.of(outside(rig)))
    return SecondPath(
        lambda: path().safe(),
        lambda: path().holds_safe(),
        lambda: path().close(),
        lambda: wire_locks.making_safe(wires(), os.getpid(), watcher=False),
    )


def make_safe(rig: RigConfig) -> Outcome:
    """Write the safe state by this process's own way, whoever else has the rig; RigError when the device does not take
    it, or when another process goes on to write its own set-points."""
    path = SecondPath.of(outside(rig))
    try:
        outcome = insist(path, _INSIST_S)
        if other := wire_locks.who_drives(compose.wires_of(rig)):
            done = "was written, but" if outcome >= Outcome.WRITTEN else "does not stand there, and"
            raise RigError(
                f"{rig.name}: NOT SAFE: the safe state {done} {other}, which writes its own set-points: stop it there "
                "(Ctrl-C, or `pamrig estop`)"
            )
        if outcome >= Outcome.WRITTEN:
            return outcome
        path.safe()  # for its words
    except DeviceError as error:
        raise RigError(f"{rig.name}: the safe state could not be written: {error}") from None
    finally:
        path.close()
    raise RigError(
        f"{rig.name}: NOT SAFE: the safe state was written, but the device holds something else; who else writes?"
    )


def parts_of(rig: RigConfig, *, virtual: bool = False) -> SessionParts:
    """What the daemon's session monitor needs to make the processes of this rig. A virtual rig moves nothing and has no
    supervisor."""
    wires = functools.cache(lambda: compose.wires_of(rig))
    return SessionParts(
        rig=rig,
        loop=loop_process,
        watching=None if virtual else watching(rig, wires),
        simulated=compose.is_simulated(rig),
        virtual=virtual,
        warnings=lambda: _warnings(rig),
        sweeps=(shipped.configs() / "sweeps",),
        models=(shipped.configs() / "models",),
        simulator=_own_model(rig) if compose.is_simulated(rig) else None,
        # its own loop, which holds the wires in its name, is not meant
        driver=lambda: wire_locks.who_drives(wires(), os.getpid()),
    )


def _own_model(rig: RigConfig) -> Path | None:
    """The model of the first device that has one."""
    settings = (compose.device_settings(entry, rig, {})[1] for entry in rig.devices)
    return next((model for each in settings if isinstance(model := getattr(each, "model", None), Path)), None)


def _warnings(rig: RigConfig) -> list[str]:
    from rig.app import inventory

    return inventory.warnings(rig)

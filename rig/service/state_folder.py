"""The daemon's state folder as this daemon has it: its locks, and whether it is still at its place.

Somebody may move it away or remove it under a daemon that runs, and another daemon may make its own there. By name
alone the one would write its queue and its ledger over those of the other.
"""

import contextlib
import logging
import os
import threading
from pathlib import Path
from typing import Final

from rig.errors import RigError
from rig.service.connections import socket_access
from rig.service.records.durable_file import DurableFile
from rig.service.settings import make_daemon_folder

_LOG: Final = logging.getLogger("pamrig")


class StateFolder:
    """Made where it is missing, and one daemon's at a time. Any thread may call."""

    def __init__(self, path: Path) -> None:
        """StateError when another daemon has it, RigError when it cannot be had."""
        self._path = path
        self._taking = threading.Lock()
        self._lost = False
        self._descriptors = self._take()

    def _take(self) -> list[int]:
        """Its locks and, last, the folder itself, whose number is given to no other as long as it is open."""
        make_daemon_folder(self._path, socket_access.OWN_MODE)
        socket_access.keep_others_from(self._path, "the daemon's queue and ledger")
        taken = (
            f"{self._path}: another daemon is running with this state folder; see `pamrig status`, or "
            "give another by --state"
        )
        with contextlib.ExitStack() as given_up:
            held = [socket_access.take_lock(self._path / "daemon.lock", taken)]
            given_up.callback(_close, held)
            if (folder_lock := socket_access.lock_folder(self._path, taken)) is not None:
                held.append(folder_lock)
            held.append(os.open(self._path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC))
            given_up.pop_all()
        return held

    def file(self, path: Path) -> DurableFile:
        """A file in it, which is written only while it is this daemon's."""
        return DurableFile(path, self.check)

    def check(self) -> None:
        """To be asked before each write. RigError when what lies at its place is not the folder that this daemon has;
        one that was removed is made anew, as far as that goes."""
        with self._taking:
            folder, former = self._descriptors[-1], self._descriptors
            with contextlib.suppress(OSError):
                if os.path.samestat(os.stat(self._path), os.fstat(folder)):
                    return
            if os.fstat(folder).st_nlink:
                raise RigError(
                    f"{self._path}: the daemon's state folder was moved, or its disk taken away; put it back: until "
                    "then queue and ledger are kept nowhere"
                )
            try:
                self._descriptors = self._take()
            except (RigError, OSError) as error:
                raise RigError(f"the daemon's state folder was removed, and cannot be made anew: {error}") from None
            _close(former)
            self._lost = True  # for `came_back`
            _LOG.warning("%s: the state folder was removed; another is there now", self._path)

    def came_back(self) -> bool:
        """Whether it is there again after it was not, so that what is to be kept must be written again; to be asked
        now and then. That it is not there is told once."""
        try:
            self.check()
        except RigError as error:
            if not self._lost:
                _LOG.error("%s", error)
            self._lost = True
            return False
        lost, self._lost = self._lost, False
        return lost

    def close(self) -> None:
        """Another daemon may have it."""
        _close(self._descriptors)


def _close(descriptors: list[int]) -> None:
    for descriptor in descriptors:
        os.close(descriptor)

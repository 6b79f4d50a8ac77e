"""How much room there is for records, asked aside: a disk on another machine may not answer, and whoever asks it stands
still with it. An emergency stop is answered where the room is told.
"""

import asyncio
import shutil
from pathlib import Path
from typing import Final

from rig.service.aside import aside

DISK_LOOK_S: Final = 0.5
"""From one look to the next."""
DISK_SILENCE_S: Final = 2.0
"""A disk that takes longer to say how much room it has does not answer."""


class FreeSpace:
    """The room in one folder, as it was seen last."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.gb = self._look()
        """None: the folder is gone."""
        self._asked: asyncio.Future[float | None] | None = None
        """What has not been answered yet; no second one is asked beside it."""
        self._answers = True

    @property
    def trouble(self) -> str:
        """What is known against the disk; empty for nothing."""
        if not self._answers:
            return f"{self._folder}: the disk does not answer"
        return f"{self._folder}: the folder for the records is gone" if self.gb is None else ""

    async def look(self) -> None:
        """Ask anew, and wait for the answer as long as a disk that works may take."""
        if self._asked is None or self._asked.done():
            self._asked = asyncio.ensure_future(aside(self._look))
            self._asked.add_done_callback(_heard)
        asked = self._asked
        done, _ = await asyncio.wait({asked}, timeout=DISK_SILENCE_S)
        self._answers = bool(done) and asked.exception() is None  # this machine may have no thread to ask from
        if self._answers:
            self.gb = asked.result()

    async def watch(self) -> None:
        """For ever."""
        while True:
            await self.look()
            await asyncio.sleep(DISK_LOOK_S)

    def _look(self) -> float | None:
        try:
            return shutil.disk_usage(self._folder).free / 1e9
        except OSError:
            return None


def _heard(asked: "asyncio.Future[float | None]") -> None:
    """An answer that comes after it was waited for may be that there was no thread to ask from: of no use to anybody,
    and no error of the daemon's own in its log."""
    if not asked.cancelled():
        asked.exception()

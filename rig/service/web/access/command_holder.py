"""One may command, many may look: which visitor holds the command of the page. No HTTP here."""

import time
from collections import Counter
from collections.abc import Callable
from typing import Final

from rig.errors import StateError
from rig.service.web.access.visitors import Visitor

AWAY_S: Final = 10.0
"""Who has had no page open for so long has left the command to whoever wants it."""


class CommandHolder:
    """Who commands. Everybody may stop, whatever is said here."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._holder: Visitor | None = None
        self._open: Counter[str] = Counter()
        self._seen_s = 0.0
        """When the holder was last known to be there."""

    @property
    def holder(self) -> Visitor | None:
        """Who commands now; None: whoever takes the command first."""
        if self._holder is not None and self._away(self._holder):
            self._holder = None
        return self._holder

    def come(self, visitor: Visitor) -> None:
        """One more page of the visitor's is open."""
        self._open[visitor.id] += 1

    def go(self, visitor: Visitor) -> None:
        """One less."""
        self._open[visitor.id] -= 1
        if self._open[visitor.id] <= 0:
            del self._open[visitor.id]
            if self._holder == visitor:
                self._seen_s = self._clock()

    def take(self, visitor: Visitor) -> None:
        """StateError while another has it."""
        if self.holder not in (None, visitor):
            assert self.holder is not None
            raise StateError(f"browser {self.holder.name} commands; let it give the command up, or close its pages")
        self._holder = visitor
        self._seen_s = self._clock()

    def give_up(self, visitor: Visitor) -> None:
        """Leave the command to others; nothing when it is not the visitor's."""
        if self._holder == visitor:
            self._holder = None

    def require(self, visitor: Visitor) -> None:
        """StateError unless the visitor commands."""
        if self.holder != visitor:
            raise StateError("take the command first: one may command, many may look")

    def _away(self, visitor: Visitor) -> bool:
        return visitor.id not in self._open and self._clock() - self._seen_s > AWAY_S

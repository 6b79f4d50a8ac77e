"""How long somebody has been silent, as far as whoever listens was there to hear it.

A machine that stands still, as a virtual one does now and then, stops everybody at once: who runs again first would
take the others for dead. So of each pause of its own a listener counts no more than a share of its patience, and
somebody who is really gone is found out all the same, some looks later.
"""

import time
from typing import Final

_LOOKS: Final = 4
"""So many looks at least have heard nothing when the patience is over."""


class Silence:
    """That of one heartbeat; to be looked at many times within `patience_ns`."""

    def __init__(self, patience_ns: float) -> None:
        self._patience_ns, self._most_ns = patience_ns, patience_ns / _LOOKS
        self._beat_ns = self._looked_ns = 0
        self._silent_ns = 0.0

    def too_long(self, beat_ns: int) -> bool:
        """Whether the patience is over; `beat_ns`: the last beat by the monotonic clock, 0 before there was one."""
        now_ns = time.monotonic_ns()
        if beat_ns != self._beat_ns:
            self._beat_ns, self._silent_ns = beat_ns, min(now_ns - beat_ns, self._most_ns)
        else:
            self._silent_ns += min(now_ns - self._looked_ns, self._most_ns)
        self._looked_ns = now_ns
        return beat_ns != 0 and self._silent_ns > self._patience_ns

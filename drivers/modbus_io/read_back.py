"""Whether what a module says of its outputs can be believed: a gateway that passes nothing on any more may confirm each
write, and say of the outputs what it heard of them last.

It heard last of the safe set-points, when they were looked at before the rig was armed. So they are looked at once more
as soon as others have been written: what then is remembered is no safe state, and a module that still speaks of the
safe one is not believed any more.
"""

from collections.abc import Callable
from typing import Final

from drivers.modbus_io.stations import SAME_OUTPUT, Numbers, Stations
from rig.errors import DeviceError, DeviceLost

_CLEARLY: Final = 4
"""Times what counts as the same number: so far from safe a set-point has to be for the module to show it."""
_LAG_NS: Final = 300_000_000
"""A module may show an output so much later than it was written."""


class OutputsShown:
    """The outputs of one device, as the module tells them."""

    def __init__(self, safe: Numbers, now_ns: Callable[[], int]) -> None:
        self._safe, self._now_ns = safe, now_ns
        self._shown = False
        """Something else than the safe set-points was read back since they were seen last."""
        self._owed_since_ns = 0
        """Others were written then; 0: that has been looked at, or there is nothing to look at."""
        self._repeats = False
        """It spoke of the safe set-points while others had been written."""

    def wrote(self, stations: Stations, numbers: Numbers) -> None:
        """Set-points were written, and confirmed by the module."""
        if self._shown:
            return
        low, high = stations.plan.outputs.counts
        far = any(
            abs(number - self._safe[place]) > _CLEARLY * SAME_OUTPUT * (high - low) for place, number in numbers.items()
        )
        self._owed_since_ns = (self._owed_since_ns or self._now_ns()) if far else 0

    @property
    def owed(self) -> bool:
        """Whether `look` has something to look at."""
        return self._owed_since_ns != 0

    def look(self, stations: Stations) -> None:
        """One exchange. DeviceLost when the module does not show what is written."""
        if stations.hold(self._safe) is not True:
            self._shown, self._owed_since_ns = True, 0
        elif self._now_ns() - self._owed_since_ns > _LAG_NS:
            self._repeats = True
            raise DeviceLost(
                f"{stations.outputs.where}: it still says that the safe set-points stand at its outputs, and others "
                "were written: what it says is what it said before (a gateway?), or read_back of its map is wrong"
            )

    def holds_safe(self, stations: Stations) -> bool | None:
        """Whether the safe set-points stand there; None: it cannot tell. DeviceError where it is not believed."""
        found = stations.hold(self._safe)
        if found and self._repeats:
            raise DeviceError(f"{stations.outputs.where}: what it says of its outputs is not to be believed")
        self._shown = self._shown and not found
        self._owed_since_ns = 0
        return found

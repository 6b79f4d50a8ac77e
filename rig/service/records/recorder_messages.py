"""What is said to the recorder, and by it: runs that will come, markers, and what became of them. Plain data, which the
other processes of a session read too."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.realtime.faults import Fault, explain
from rig.realtime.ring import Ring

if TYPE_CHECKING:
    from rig.log.mcap.schema import Ended

_OF_THE_DEVICE = (Fault.DEVICE_LOST, Fault.DEVICE_ERRORS)


@dataclass(frozen=True)
class RunOrder:
    """A run that will come: its number, its file, and what the file says beside the samples."""

    run: int
    path: Path
    facts: Mapping[str, Any]
    attachments: Mapping[str, bytes]
    sweep_ticks: int
    wall_offset_ns: int
    """Wall clock minus the loop's clock: what is added to a sample's time."""


@dataclass(frozen=True)
class Mark:
    """A line of the operator's for the log of the run that is written."""

    text: str
    at_ns: int
    """On the loop's clock."""


@dataclass(frozen=True)
class RecorderTrouble:
    """Word from the recorder while a run goes on: why its file takes nothing at present; empty when it does again."""

    run: int
    error: str
    final: bool = False
    """It will not get better by itself: the file is not where it was."""


@dataclass
class RunResult:
    """What became of a run."""

    run: int
    file: Path
    ticks: int = 0
    missed: int = 0
    dropped: int = 0
    valid: bool = False
    complete: bool = False
    fault: int = 0
    error: str = ""
    lateness_us: dict[str, float] = field(default_factory=dict)
    angle_zero_deg: float = 0.0
    cpu_s: float = 0.0
    message: str = ""
    """The device's own words, where the fault is the device's."""

    @property
    def ended(self) -> "Ended":
        """How the run came to its end."""
        from rig.log.mcap.schema import Ended  # the files' protobuf, which loop and watchers need not load

        if self.fault:
            return Ended.FAULT
        if self.complete:
            return Ended.COMPLETE
        return Ended.CUT if self.dropped else Ended.STOPPED

    @property
    def cause(self) -> str:
        """The fault in words; empty without one."""
        return explain(self.fault, self.message) if self.fault else ""


def message_of(fault: int, ring: Ring) -> str:
    """The driver's words, for a fault that is the device's."""
    return ring.device_message if fault in _OF_THE_DEVICE else ""

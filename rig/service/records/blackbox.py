"""The black box: the last seconds before a fault as a log of their own, whether or not anything was being recorded.

The ring always holds them; this file copies them out. The ring outlives its processes, so a daemon that finds the ring
which another of its state folder left when it died first saves what is in it. Those of others are theirs.
"""

import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, Self

from rig.errors import LayoutError, RecordError, RigError, StateError
from rig.log.mcap.schema import BLACK_BOX
from rig.log.mcap.writer import RunWriter
from rig.realtime.faults import Fault, explain
from rig.realtime.ring import Ring
from rig.realtime.shared import KEPT_RING, folder, is_stale
from rig.sample import unpack

BLACK_BOX_S: Final = 30.0
"""Of the ring that a black box keeps; the ring holds 41 s at 5 ms. Less: what led to a fault may be gone."""


@dataclass(frozen=True)
class Box:
    """What a ring held at a moment, on its way to a file: the ring goes on."""

    fault: Fault
    message: str
    stamp: str
    about: Mapping[str, Any]
    wall_offset_ns: int
    packed: tuple[bytes, ...]
    """The samples of the last BLACK_BOX_S."""

    def write(self, out: Path) -> Path:
        """Into the folder `out`; returns the file. RecordError, and nothing stays, when the disk refuses: it may be
        tried again."""
        try:
            out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RecordError(f"{out}: cannot be made: {error.strerror}") from None
        writer = RunWriter(out / f"blackbox_{self.stamp}_{self.fault.name.lower()}.mcap", self.about, {})
        try:
            time_ns = 0
            for count, packed in enumerate(self.packed):
                time_ns = unpack(packed).scheduled_ns + self.wall_offset_ns
                writer.add(packed, time_ns, count)
            writer.log("fatal", explain(self.fault, self.message), time_ns)
            return writer.finish({"valid": True, "ticks": len(self.packed), "fault": explain(self.fault)})
        except RecordError:
            writer.discard()
            raise


def take(ring: Ring, fault: Fault, message: str, facts: Mapping[str, Any] | None = None) -> Box:
    """The last BLACK_BOX_S of `ring`; `message` stands in its log beside the cause. In any process that has the
    ring."""
    about = {
        "started_ns": time.time_ns(),
        "kind": BLACK_BOX,
        "name": f"blackbox_{fault.name.lower()}",
        "session": f"{ring.block.session:016x}",
        "fault": explain(fault),
        "said": message,
        **(facts or {}),
    }
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%S.%fZ")
    return Box(fault, message, stamp, about, time.time_ns() - time.monotonic_ns(), tuple(_last(ring, BLACK_BOX_S)))


def save(ring: Ring, out: Path, fault: Fault, message: str, facts: Mapping[str, Any] | None = None) -> Path:
    """Write the last BLACK_BOX_S of `ring` into `out`; returns the file. RecordError when the disk refuses."""
    return take(ring, fault, message, facts).write(out)


def _last(ring: Ring, seconds: float) -> Iterator[bytes]:
    """The packed samples of the last `seconds` of the loop's own time, oldest first."""
    head = ring.head
    start = max(head - ring.capacity + 1, 0)
    kept = [packed for sequence in range(start, head) if (packed := ring.slot(sequence)) is not None]
    if not kept:
        return
    begin_ns = unpack(kept[-1]).scheduled_ns - round(seconds * 1e9)
    yield from (packed for packed in kept if unpack(packed).scheduled_ns >= begin_ns)


@dataclass(frozen=True)
class Owner:
    """Whose ring it is: a daemon is known by its state folder, of which only one can run at a time."""

    folder: str
    """Device and inode of the state folder: two containers may have one of the same name."""
    rig: str
    state: str
    """Its path, for a person."""

    @classmethod
    def of(cls, state: Path, rig: str) -> Self:
        """The daemon with the folder `state`, which is there; OSError when it is not."""
        found = state.stat()
        return cls(f"{found.st_dev:x}:{found.st_ino:x}", rig, str(state.resolve()))

    @classmethod
    def read(cls, ring: Ring) -> Self:
        """As it stands in a ring; empty where nothing does."""
        folder, _, rest = ring.owner.partition("\n")
        rig, _, state = rest.partition("\n")
        return cls(folder, rig, state)

    def __str__(self) -> str:
        """As it is put into a ring."""
        return "\n".join((self.folder, self.rig.replace("\n", " "), self.state))


def salvage(out: Path, owner: Owner) -> tuple[list[Path], list[str]]:
    """Save and remove the rings that dead daemons of this owner left behind; returns the black boxes, and a line on
    each ring that stays: another's, one of another version of pamrig, and one for which there is no room. A ring that
    is broken is only removed."""
    saved, stay = [], []
    for path in _left():
        try:
            ring = Ring.attach(path)
            its = Owner.read(ring)
            if its.folder != owner.folder:
                stay.append(f"{path}: left by a dead daemon {_whose(its)}; not touched")
                continue
            newest = ring.latest()
            if newest is not None:
                fault = Fault(newest.fault) if newest.fault else Fault.CONTROL_LOST
                message = "saved by the next daemon from the memory of one that had died"
                saved.append(save(ring, out, fault, message, {"rig": its.rig}))
        except LayoutError as error:
            stay.append(f"{error}; left by a dead daemon, and not touched")
            continue
        except (StateError, ValueError, IndexError):
            pass
        except RigError as error:  # the disk takes nothing now: the evidence stays where it is
            stay.append(f"{path}: left by a dead daemon, whose black box cannot be written now: {error}")
            continue
        path.unlink(missing_ok=True)
    return saved, stay


def _whose(owner: Owner) -> str:
    if not owner.folder:
        return "that does not say whose it is (of an older pamrig)"
    return f"of the rig {owner.rig}, which the next one with --state {owner.state} saves"


def remove(owner: Owner) -> None:
    """Remove the rings that dead daemons of this owner left behind, for who wants none of them."""
    for path in _left():
        with suppress(StateError, ValueError):
            if Owner.read(Ring.attach(path)).folder == owner.folder:
                path.unlink(missing_ok=True)


def _left() -> Iterator[Path]:
    return (path for path in folder().glob(f"pamrig-*{KEPT_RING}") if is_stale(path))

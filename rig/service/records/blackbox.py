"""The black box: the last seconds before a fault as a log of their own, whether or not anything was being recorded.

The ring always holds them; this file copies them out. The ring outlives its processes, so a daemon that finds the ring
of a dead one first saves what is in it.
"""

import time
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from rig.errors import RigError, StateError
from rig.log.mcap.writer import RunWriter
from rig.realtime.faults import Fault, explain
from rig.realtime.ring import Ring
from rig.realtime.shared import KEPT_RING, folder, is_stale
from rig.sample import unpack

SECONDS: Final = 30.0


def save(ring: Ring, out: Path, fault: Fault, said: str, facts: Mapping[str, Any] | None = None) -> Path:
    """Write the last SECONDS of `ring` into `out`; returns the file. `said` stands in its log beside the cause.

    RecordError when the disk refuses. Called in any process that has the ring.
    """
    wall_offset_ns = time.time_ns() - time.monotonic_ns()
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%S.%fZ")
    out.mkdir(parents=True, exist_ok=True)
    cause = explain(fault)
    about = {
        "kind": "black box",
        "name": f"blackbox_{fault.name.lower()}",
        "session": f"{ring.block.session:016x}",
        "fault": cause,
        "said": said,
    }
    writer = RunWriter(
        out / f"blackbox_{stamp}_{fault.name.lower()}.mcap",
        {"started_ns": time.time_ns(), **about, **(facts or {})},
        {},
    )
    last_ns = 0
    count = 0
    for packed in _last(ring, SECONDS):
        scheduled_ns = unpack(packed).scheduled_ns
        last_ns = scheduled_ns + wall_offset_ns
        writer.add(packed, last_ns, count)
        count += 1
    writer.log("fatal", explain(fault, said), last_ns)
    return writer.finish({"valid": True, "ticks": count, "fault": cause})


def _last(ring: Ring, seconds: float) -> Iterator[bytes]:
    """The packed samples of the last `seconds` of the loop's own time, oldest first."""
    head = ring.head
    start = max(head - ring.capacity + 1, 0)
    kept = [packed for sequence in range(start, head) if (packed := ring.slot(sequence)) is not None]
    if not kept:
        return
    begin_ns = unpack(kept[-1]).scheduled_ns - round(seconds * 1e9)
    yield from (packed for packed in kept if unpack(packed).scheduled_ns >= begin_ns)


def salvage(out: Path) -> list[Path]:
    """Save and remove the rings that dead daemons left behind; returns the black boxes. A ring that is broken is only
    removed."""
    saved = []
    for path in folder().glob(f"pamrig-*{KEPT_RING}"):
        if not is_stale(path):
            continue
        try:
            ring = Ring.attach(path)
            newest = ring.latest()
            if newest is not None:
                fault = Fault(newest.fault) if newest.fault else Fault.CONTROL_LOST
                saved.append(save(ring, out, fault, "saved by the next daemon from the memory of one that had died"))
        except (StateError, ValueError, IndexError):
            pass
        except RigError:
            continue  # the disk takes nothing now: the evidence stays where it is
        path.unlink(missing_ok=True)
    return saved

"""The end of a recorder: it is waited for as long as its disk lets it get on, and whoever waits is told for what."""

import time
from collections.abc import Callable, Mapping
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Final

from rig.realtime.ring import Ring, RingReader
from rig.sample import unpack
from rig.service.processes import DISK_PATIENCE_S
from rig.service.records.recorder_messages import RunResult
from rig.silence import Silence

SAY_EVERY_S: Final = 5.0
"""Between two lines on what is waited for, s."""
_LOOK_S: Final = 0.02
_KILL_S: Final = 5.0
"""For the kernel to end a killed process that waits for its disk; it may not be able to."""


def await_end(recorder: BaseProcess, ring: Ring, say: Callable[[str], None], look: Callable[[], None]) -> str:
    """Wait until a recorder that was told to finish has ended. Returns why it was killed; empty when it ended by
    itself.

    It is killed when it has done nothing for DISK_PATIENCE_S, neither read from the ring nor written. Meanwhile `look`
    is called all the time, and `say` every SAY_EVERY_S with a line on what is waited for.
    """
    done, said_at_s = _done(recorder, ring), time.monotonic()
    since, silence = said_at_s, Silence(DISK_PATIENCE_S * 1e9)
    while recorder.is_alive():
        recorder.join(_LOOK_S)
        look()
        now, before = time.monotonic(), done
        done = _done(recorder, ring)
        if done != before:
            since = now
        elif silence.too_long(round(since * 1e9)) and recorder.is_alive():
            recorder.kill()
            recorder.join(_KILL_S)
            return f"the disk took nothing for {DISK_PATIENCE_S:g} s, and the recorder was ended"
        if now - said_at_s > SAY_EVERY_S:
            said_at_s = now
            say(
                f"waiting for the recorder (process {recorder.pid}): its disk has taken nothing for {now - since:.0f} s"
                f", and is given up after {DISK_PATIENCE_S:g}"
            )
    return ""


def _done(recorder: BaseProcess, ring: Ring) -> tuple[int, str]:
    """What grows while the recorder gets on: what it took from the ring, and the bytes it wrote (Linux, proc(5))."""
    try:
        wrote = Path(f"/proc/{recorder.pid}/io").read_text(encoding="ascii").partition("wchar:")[2].split()[0]
    except (OSError, IndexError):
        wrote = ""
    return ring.recorded, wrote


def abandoned(files: Mapping[int, Path], ring: Ring, why: str) -> list[RunResult]:
    """The results of runs that a recorder left unfinished (`files`: of each run that it still owed), as far as the ring
    still knows them; none of runs that had not begun."""
    left = {run: place for run, path in files.items() if (place := _place(path)) is not None}
    if not left:
        return []
    runs = [unpack(packed).run for packed in RingReader(ring, max(ring.head - ring.capacity, 0))]
    return [
        RunResult(
            run, place, runs.count(run), dropped=ring.head - ring.recorded,
            error=f"{why}; what it had not written is lost, the rest lies there",
        )
        for run, place in left.items()
    ]  # fmt: skip


def _place(path: Path) -> Path | None:
    """Where what was written of a record lies."""
    from rig.log.mcap.writer import PARTIAL_SUFFIX  # with what files are written with, which a loop need not load

    partial = path.with_name(path.name + PARTIAL_SUFFIX)
    return next((place for place in (partial, path) if place.exists()), None)

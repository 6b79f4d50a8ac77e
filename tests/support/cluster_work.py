"""Work for a cluster's workers to import: a piece that takes a while and leaves a trace of each time it was done."""

import os
import signal
import time
from pathlib import Path

from rig.outputs import OutputKind, writing


def leave_trace(folder: str, number: int) -> int:
    """Write a line for this attempt, wait, then the result whole; returns the number."""
    with (Path(folder) / f"{number}.tries").open("a", encoding="ascii") as tries:
        tries.write(f"{os.getpid()}\n")
    time.sleep(0.15)
    part = Path(folder) / f"{number}.{os.getpid()}.part"
    part.write_text(str(number))
    part.replace(Path(folder) / f"{number}.done")
    return number


def fail(number: int) -> int:
    raise ValueError(f"piece {number} cannot be done")


def write_and_stay(folder: str, number: int) -> None:
    """Leave a trace in the middle of writing a file, then never come to an end."""
    with writing(Path(folder) / f"{number}.json", OutputKind.JSON) as part:
        part.write_text("[")
        begin_and_stay(folder, number)


def begin_and_stay(folder: str, number: int) -> None:
    """Leave a trace, then never come to an end."""
    (Path(folder) / f"{number}.begun").touch()
    time.sleep(600)


def die(_: int) -> None:
    os.kill(os.getpid(), signal.SIGKILL)

"""The inside of a helper's process: it answers one request after the other, niced and bounded in memory.

Apart from who asks, for a new process loads this and nothing of the event loop on which it is waited for.
"""

import contextlib
import os
import resource
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Final

from rig.errors import RigError

_NICE: Final = 10
"""Below what an emergency stop goes through, and above what nobody waits for (decision 0423)."""


@dataclass(frozen=True)
class RequestRefused:
    """A RigError on its way back."""

    why: str


def serve_requests(pipe: Connection, carry_out: Callable[..., Any], memory_bytes: int) -> None:
    """In the process: carry out each request (its parts are the arguments) until the other end closes."""
    _step_back(memory_bytes)
    with contextlib.suppress(EOFError, OSError):
        pipe.send(None)  # it listens
        while True:
            pipe.send(_answer(carry_out, pipe.recv()))


def _answer(carry_out: Callable[..., Any], request: tuple[Any, ...]) -> Any:
    try:
        return carry_out(*request)
    except RigError as error:
        return RequestRefused(str(error))
    except MemoryError:
        return MemoryError()


def _step_back(memory_bytes: int) -> None:
    """Everybody else first, and the first to go when memory runs out."""
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, _NICE)
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    tightest = min(limit for limit in (soft, memory_bytes) if limit != resource.RLIM_INFINITY)
    resource.setrlimit(resource.RLIMIT_AS, (tightest, hard))  # who has less gets no more, and may not ask for it
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("1000", encoding="ascii")

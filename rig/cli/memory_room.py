"""Whether there is room for a library, asked before it is loaded, where the memory of a process is limited (`ulimit
-v`): those that compute with matrices and make machine code end their process where they find none, or ask for ever,
and hear no signal meanwhile."""

import mmap
import resource
import sys
from typing import Final

_MB: Final = 1 << 20
NEEDS_MB: Final = {"numpy": 100, "scipy.linalg": 250, "llvmlite": 330}
"""Of address space, for a library, what is loaded with it and what a command then does with it: measured with numpy 2,
scipy 1.15 and llvmlite 0.44 on x86-64, and a fifth more, for with less they do not fail but end the process."""


def say_none() -> None:
    """One line, for which nothing has to be loaded."""
    print(
        "pamrig: not enough memory for this command (`ulimit -v`, or a limit of its container or service?)",
        file=sys.stderr,
    )


def watch() -> None:
    """From now on a library that has no room is a MemoryError; nothing where nothing is limited."""
    if _is_limited():
        sys.meta_path.insert(0, _Watched())


class _Watched:
    """Asked before whoever finds modules; finds none itself."""

    def find_spec(self, name: str, *_: object) -> None:
        """MemoryError where too little is left for that library."""
        need_mb = NEEDS_MB.get(name)
        if need_mb is not None:
            ask(need_mb)


def ask(need_mb: int) -> None:
    """MemoryError where less is left of a memory that is limited; for work that ends as those libraries do."""
    if _is_limited() and not _is_free(need_mb * _MB):
        raise MemoryError(f"{need_mb} MB are not to be had")


def _is_limited() -> bool:
    return resource.getrlimit(resource.RLIMIT_AS)[0] != resource.RLIM_INFINITY


def _is_free(size_bytes: int) -> bool:
    """Whether so much could be taken now; none of it is touched."""
    try:
        mmap.mmap(-1, size_bytes, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS, prot=0).close()
    except OSError:
        return False
    return True

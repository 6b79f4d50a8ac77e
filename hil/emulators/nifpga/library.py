"""Builds the C library and puts it where nifpga looks for National Instruments' own."""

import ctypes
import functools
import hashlib
import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Final

from rig.errors import RigError

SOURCE: Final = Path(__file__).with_name("NiFpga.c")
FLAGS: Final = ("-O2", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared", "-Wl,-soname,libNiFpga.so")
BEFORE_READ, AFTER_WRITE, AFTER_STROBE, DELAY_US = range(4)

Hook = Callable[[int, int], None]
"""Called with the event, and with a slot (or microseconds for DELAY_US). It must not raise: the exception would be
lost."""

_HOOK = ctypes.CFUNCTYPE(None, ctypes.c_char_p, ctypes.c_int, ctypes.c_uint32)


def build(folder: Path, compiler: str = "gcc") -> Path:
    """Compile the library into `folder`, unless it is there; RigError when there is no compiler."""
    library = folder / "libNiFpga.so"
    if library.exists():
        return library
    folder.mkdir(parents=True, exist_ok=True)
    fresh = folder / f"libNiFpga.{os.getpid()}.so"
    try:
        subprocess.run([compiler, *FLAGS, "-o", str(fresh), str(SOURCE)], check=True, capture_output=True, text=True)
    except FileNotFoundError:
        raise RigError(f"the emulated myRIO is built by {compiler}, which is not installed") from None
    except subprocess.CalledProcessError as error:
        raise RigError(f"{SOURCE} does not compile: {error.stderr.strip().splitlines()[0]}") from None
    fresh.replace(library)
    return library


def cache_folder() -> Path:
    """Where the compiled library is kept, one folder a version of its source; RigError for a user without a home."""
    try:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:
        raise RigError(
            "the emulated myRIO is built in the user's cache, and this one has no home: set XDG_CACHE_HOME"
        ) from None
    return base / "pamrig" / f"nifpga-{hashlib.sha256(SOURCE.read_bytes()).hexdigest()[:16]}"


class Library:
    """The loaded library; one a process (see `load`), because nifpga finds it by its name."""

    def __init__(self, path: Path) -> None:
        """Load the library so that nifpga finds it, in child processes too."""
        parts = [str(path.parent), *filter(None, [os.environ.get("LD_LIBRARY_PATH")])]
        os.environ["LD_LIBRARY_PATH"] = ":".join(dict.fromkeys(parts))
        self._library = ctypes.CDLL(str(path), mode=ctypes.RTLD_GLOBAL)
        self._hooks: dict[bytes, Hook] = {}
        self._entry = _HOOK(self._dispatch)
        self._none = _HOOK()

    @staticmethod
    def serve(folder: Path) -> None:
        """Sessions opened from now on, here or in child processes, find their resources in `folder`."""
        os.environ["PAMRIG_RIO_DIR"] = str(folder)

    def set_hook(self, key: str, hook: Hook | None) -> None:
        """Call `hook` for the resource with this key, or no longer."""
        self._hooks.pop(key.encode(), None)
        if hook is not None:
            self._hooks[key.encode()] = hook
        self._library.pamrig_set_hook(self._entry if self._hooks else self._none)

    def _dispatch(self, key: bytes, event: int, argument: int) -> None:
        hook = self._hooks.get(key)
        if hook is not None:
            hook(event, argument)


@functools.cache
def load() -> Library:
    """The library of this process, built when need be."""
    return Library(build(cache_folder()))

"""What becomes of a command whose text nobody reads to its end (`| head`), has no room (`> /dev/full`), or holds signs
that the terminal's encoding has not.

The text ends there and the command goes on: files that it still has to write are written, what it runs comes to its
end, and its exit status says how that went.
"""

import contextlib
import errno
import io
import os
import sys
from typing import Any, Final, TextIO

_NAMES: Final = ("stdout", "stderr")


class _Lasting(io.FileIO):
    """A descriptor that takes whatever is written: bytes that it can no longer pass on are dropped."""

    failure: OSError | None = None
    """Why it passes nothing on any more."""

    def write(self, data: Any, /) -> int:
        if self.failure is None:
            try:
                return super().write(data)
            except OSError as error:
                self.failure = error
        return memoryview(data).nbytes


def _spelling(stream: TextIO) -> str | None:
    """What becomes of a sign that the encoding of a stream has not, as of Latin-1: it is spelled out where it would be
    an error, and the answer lost with it."""
    return "backslashreplace" if stream.errors == "strict" else stream.errors


class Streams:
    """stdout and stderr for one command, put in the place of the process's own."""

    def __init__(self) -> None:
        self._raws: list[_Lasting] = []
        for name in _NAMES:
            stream = getattr(sys, name)
            if stream is None:  # `>&-`: Python has None there, and packages do not expect that
                setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
            elif not stream.isatty():
                with contextlib.suppress(OSError):  # one that a test put there has no descriptor
                    setattr(sys, name, self._lasting(stream))
            elif isinstance(stream, io.TextIOWrapper):  # a terminal that is gone ends whoever draws on it
                stream.reconfigure(errors=_spelling(stream))

    def _lasting(self, stream: TextIO) -> TextIO:
        """The same, on a descriptor that takes everything."""
        raw = _Lasting(stream.fileno(), "w", closefd=False)
        self._raws.append(raw)
        return io.TextIOWrapper(
            io.BufferedWriter(raw),
            encoding=stream.encoding,
            errors=_spelling(stream),
            newline="\n",
            line_buffering=getattr(stream, "line_buffering", False),
            write_through=getattr(stream, "write_through", False),
        )

    def failure(self) -> OSError | None:
        """What went wrong with the text, apart from a reader who had seen enough; to be asked at the end."""
        for name in _NAMES:
            getattr(sys, name).flush()
        failures = (raw.failure for raw in self._raws)
        return next((error for error in failures if error is not None and error.errno != errno.EPIPE), None)

"""The bitfile of a myRIO: read from its file, and kept as it was for whoever has to open a session once more."""

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from xml.etree.ElementTree import ParseError

import nifpga

from rig.errors import ConfigError


def load_bitfile(path: Path, where: str) -> nifpga.Bitfile:
    """The bitfile at `path`, which the settings that stand at `where` name; ConfigError when it is missing or is
    none."""
    named = f"{where}.bitfile: " if where else ""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter(
                "ignore"
            )  # registers of types that nifpga cannot read are skipped, and looked up by name below
            return nifpga.Bitfile(str(path))
    except OSError as error:
        hint = "; it comes with your FPGA project, not with pamrig" if isinstance(error, FileNotFoundError) else ""
        raise ConfigError(f"{named}{path.resolve()}: the bitfile cannot be read: {error.strerror}{hint}") from None
    except (ParseError, AttributeError, TypeError, ValueError, AssertionError):
        raise ConfigError(f"{named}{path}: not a bitfile of an FPGA (.lvbitx)") from None


class KeptBitfile:
    """The bitfile at `path`, as it was when it was read first.

    The vendor's library reads it from its path at each opening. A file that was replaced while the rig was driven
    would be refused, or put another design onto an FPGA that holds pressures.
    """

    def __init__(self, path: Path, where: str) -> None:
        self._path, self._where = path, where
        self._content: bytes | None = None

    def forget(self) -> None:
        """Read it anew the next time."""
        self._content = None

    @contextmanager
    def at_hand(self) -> Iterator[nifpga.Bitfile]:
        """The bitfile, for as long as a session is being opened by its path; ConfigError as `load_bitfile`."""
        if self._content is None:
            bitfile = load_bitfile(self._path, self._where)
            self._content = self._found()
            yield bitfile
        elif self._found() == self._content:
            yield load_bitfile(self._path, self._where)
        else:
            with _in_memory(self._content) as copy:
                yield load_bitfile(copy, self._where)

    def _found(self) -> bytes | None:
        with suppress(OSError):
            return self._path.read_bytes()
        return None


@contextmanager
def _in_memory(content: bytes) -> Iterator[Path]:
    """The path of a file that no disk can lose."""
    descriptor = os.memfd_create("pamrig.lvbitx")
    try:
        with open(descriptor, "wb", closefd=False) as file:
            file.write(content)
        yield Path(f"/proc/self/fd/{descriptor}")
    finally:
        os.close(descriptor)

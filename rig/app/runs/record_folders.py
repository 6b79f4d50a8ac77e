"""The folder that the records of a command go to: a new one under logs/, or one in which none of them lies yet."""

import itertools
import os
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path

from rig.errors import RigError
from rig.log.mcap.writer import PARTIAL_SUFFIX
from rig.outputs import file_name, make_folder


def new_folder(name: str) -> Path:
    """logs/DATE_NAME, beside where the command was called; a number is added when it is taken."""
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
    plain = file_name(name)
    numbered = (f"{stamp}_{plain}" if n == 1 else f"{stamp}_{plain}_{n}" for n in itertools.count(1))
    return next(folder for item in numbered if not os.path.lexists(folder := Path("logs") / item))


def made_folder(name: str) -> Path:
    """The same, and made: two commands of one second, for two rigs, have one each."""
    while True:
        folder = new_folder(name)
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            continue  # since it was looked for
        except OSError as error:
            raise RigError(f"{folder}: cannot be made: {error.strerror}") from None
        return folder


def prepare_folder(out: Path, names: Iterable[str]) -> None:
    """Make the folder of the records `names`; RigError when one of them, finished or not, lies there already."""
    make_folder(out)
    if not os.access(out, os.W_OK):
        raise RigError(f"{out}: the folder cannot be written to; choose another with --out")
    for name in names:
        if os.path.lexists(out / name):
            raise RigError(
                f"{out / name}: exists already; logs are never overwritten, choose another folder with --out"
            )
        partial = out / f"{name}{PARTIAL_SUFFIX}"
        if os.path.lexists(partial):
            raise RigError(
                f"{partial}: an unfinished record lies there; `pamrig log recover` it, or choose another --out"
            )

"""Which name a record gets: the plain one is for the complete record, whatever was tried before. Nothing is lost."""

import os
from contextlib import suppress
from pathlib import Path

from rig.errors import RigError
from rig.log.mcap.contents import map_file, walk
from rig.log.mcap.framing import DamageError
from rig.log.mcap.schema import RESULT_METADATA, Ended, ended_of
from rig.log.mcap.writer import PARTIAL_SUFFIX


def vacated(path: Path) -> Path:
    """`path` for a record that is to come: one of that name that is not complete gives it up, beside a complete one it
    is numbered."""
    with suppress(RigError, DamageError):
        ended = ended_of(walk(map_file(path)).facts(RESULT_METADATA))
        if ended not in (None, Ended.COMPLETE):
            renamed(path, ended)
    return free(path)


def renamed(file: Path, ended: Ended | None) -> Path:
    """A record that is not complete under a name that says so, so that the complete one takes the plain name; its place
    now."""
    place = free(file.with_name(f"{file.stem}_{ended}{file.suffix}"))
    with suppress(OSError):
        file.rename(place)
        return place
    return file


def free(path: Path) -> Path:
    """`path`, or with a number the first of its kind that is not taken by a record or its unfinished form."""
    number, candidate = 1, path
    while any(os.path.lexists(f"{candidate}{suffix}") for suffix in ("", PARTIAL_SUFFIX)):
        number += 1
        candidate = path.with_name(f"{path.stem}_again{number}{path.suffix}")
    return candidate

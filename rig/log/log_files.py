"""Which files are logs, by their names and in which folders, and what the name of a file says of the record in it. No
record is read here.
"""

import logging
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from rig.errors import RecordError

SUFFIXES: Final = (".mcap", ".csv", ".csv.gz", ".tdms")
"""What a folder is searched for, in capitals or not: other systems write `.CSV`."""
_LOG = logging.getLogger("pamrig")
_REPEAT = re.compile(r"_r(?:epeat)?(\d+)$")
_SUFFIX = re.compile(r"\.(partial|mcap|csv|gz|tdms|parquet|mat|lvm|txt)$", re.IGNORECASE)
_SCORES: Final = re.compile(rb"record,[^,]*,nrmse,fit_percent,").match
_HEAD_BYTES: Final = 256
"""Of a CSV's first line that are read to tell a table of scores by it."""
_LABEL = re.compile(r"([a-z]+)_([0-9.]+)hz_([0-9.]+)mpa")


def is_log(path: Path) -> bool:
    """A file that a folder of logs is searched for: named like one, and no table of scores that we left there."""
    return is_named_like_one(path) and not _is_scores(path)


def is_named_like_one(path: Path) -> bool:
    """A file with the suffix of a log."""
    return path.name.lower().endswith(SUFFIXES) and path.is_file()


def _is_scores(path: Path) -> bool:
    """The table that identification and validation leave beside their figures (rig.report.fit_files)."""
    if path.suffix.lower() != ".csv":
        return False
    with suppress(OSError), path.open("rb") as file:
        return _SCORES(file.readline(_HEAD_BYTES)) is not None
    return False


def holds_logs(folder: Path) -> bool:
    """It is a folder, and a log lies in it or below."""
    return folder.is_dir() and any(map(is_log, below(folder)))


def below(folder: Path) -> Iterator[Path]:
    """Everything in a folder and in those in it; RecordError for one that may not be read: it is not to pass for
    empty."""

    def refuse(error: OSError) -> None:
        raise RecordError(f"{error.filename}: cannot be read: {error.strerror}")

    for place, folders, files in os.walk(folder, onerror=refuse):
        yield from (Path(place, name) for name in (*folders, *files))


def logs_in(folder: Path) -> list[Path]:
    """Every log in a folder and below; RecordError when there is none.

    A table of the same name beside an MCAP file is its export: the same record, which counts once.
    """
    named = sorted(filter(is_named_like_one, below(folder)))
    scores = {*filter(_is_scores, named)}
    files = [file for file in named if file not in scores]
    if not files:
        raise RecordError(f"{folder}: no log in this folder; a log is {', '.join(SUFFIXES)}")
    for file in sorted(scores):
        warn(f"{file}: passed over: a table of scores, no record")
    ours = {file.parent / stem(file) for file in files if is_mcap(file)}
    return [file for file in files if is_mcap(file) or file.parent / stem(file) not in ours]


def is_mcap(file: Path) -> bool:
    """It is named as a recording."""
    return file.suffix.lower() == ".mcap"


def pairing_name(facts: Mapping[str, Any], path: Path) -> str:
    """The name that is the same in every session and for every repeat: that of the run, else the file's; as one line of
    characters that can be shown, for it stands in many a line, figure and page."""
    name = str(facts.get("name") or stem(path))
    return _REPEAT.sub("", " ".join("".join(one if one.isprintable() else " " for one in name).split()))


def stem(path: Path) -> str:
    """The file's name without the suffixes of logs and of tables."""
    name = path.name
    while (shorter := _SUFFIX.sub("", name)) != name:
        name = shorter
    return name


def name_facts(path: Path) -> dict[str, Any]:
    """What the name of a file says, where it has no facts of its own: session (its folder), repeat, signal."""
    facts: dict[str, Any] = {"session": path.resolve().parent.name}
    if repeat := _REPEAT.search(stem(path)):
        facts["repeat"] = int(repeat[1])
    if label := _LABEL.match(stem(path)):
        facts |= {"signal": label[1], "frequency_hz": float(label[2]), "amplitude_mpa": float(label[3])}
    return facts


def warn(message: object) -> None:
    """Say what is passed over, in one line that any terminal can show."""
    _LOG.warning("%s", ascii(str(message))[1:-1])  # a name may hold anything, and this may go to a terminal

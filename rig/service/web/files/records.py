"""What lies in the folder of records, by session and name. Names are looked up in listings and never made paths."""

import contextlib
import os
import re
import stat
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from rig.errors import RecordError

LOOSE: Final = "-loose-"
"""The session of files that lie in the folder itself."""
MOST_SESSIONS: Final = 500
"""The latest that are listed."""
_SUFFIX: Final = ".mcap"
_STAMP: Final = re.compile(r"\d{8}T\d{6}Z")


def spelt(name: str) -> str:
    """A name in a folder as text that can be sent: bytes that are no UTF-8 are spelled out."""
    return name.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


class SessionFolders:
    """The sessions below one folder."""

    def __init__(self, folder: Path) -> None:
        self.root = folder

    def sessions(self) -> list[dict[str, Any]]:
        """The newest first: name, number of records, when it was last written to."""
        found = [_session(name, folder) for name, folder in self._folders().items()]
        found = [session for session in found if session["records"]]
        return sorted(found, key=lambda session: float(session["changed_s"]), reverse=True)[:MOST_SESSIONS]

    def files(self, session: str) -> list[Path]:
        """Its records in the order in which they were made; RecordError when there is no such session."""
        folder = self._folders().get(session)
        if folder is None:
            raise RecordError(f"{session[:80]!a}: no such session")
        found = _records_in(folder)
        return sorted(found, key=lambda file: (found[file].st_mtime_ns, file.name))

    def recorded_s(self, session: str) -> float:
        """When a session was recorded, in seconds since 1970: as its name says, else its oldest file; RecordError when
        there is none."""
        files = self.files(session)
        if found := _STAMP.match(session):
            with contextlib.suppress(ValueError):
                return datetime.strptime(found[0], "%Y%m%dT%H%M%SZ").replace(tzinfo=UTC).timestamp()
        return min((file.stat().st_mtime for file in files), default=0.0)

    def folder(self, session: str) -> Path:
        """Where a session lies; RecordError when there is none."""
        self.files(session)
        return self._folders()[session]

    def file(self, session: str, name: str) -> Path:
        """One record; RecordError when there is none."""
        found = next((file for file in self.files(session) if spelt(file.name) == name), None)
        if found is None:
            raise RecordError(f"{name[:120]!a}: no such record in this session")
        return found

    def _folders(self) -> dict[str, Path]:
        try:
            below = {spelt(item.name): item for item in self.root.iterdir() if item.is_dir() and not item.is_symlink()}
        except OSError:
            return {}
        return {LOOSE: self.root} | below


def _records_in(folder: Path) -> dict[Path, os.stat_result]:
    """The records of a folder, each as it was when it was looked at; one that goes away meanwhile hides no other."""
    found: dict[Path, os.stat_result] = {}
    for file in folder.glob(f"*{_SUFFIX}"):
        with contextlib.suppress(OSError):
            if stat.S_ISREG((seen := file.lstat()).st_mode):
                found[file] = seen
    return found


def _session(name: str, folder: Path) -> dict[str, Any]:
    files = _records_in(folder)
    changed_s = max((seen.st_mtime for seen in files.values()), default=0.0)
    return {"name": name, "records": len(files), "changed_s": changed_s}

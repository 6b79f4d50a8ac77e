"""Diagnoses asked for on the page: each a `pamrig gap diagnose` of its own in the background, with a folder that keeps
what was asked, what was found, and the report."""

import asyncio
import contextlib
import json
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from rig.config import finite
from rig.errors import RecordError, RigError, StateError
from rig.service.web.files.diagnosis_json import DiagnosedDay, gap_of, unit_of

REFERENCE_CHOICES: Final = ("auto", "sessions", "session", "fingerprint", "simulator")
"""What may stand for the rig without a gap; auto: the diagnosis chooses."""
DIAGNOSIS_PATIENCE_S: Final = 1800.0
"""A diagnosis that takes longer is ended, s."""
MOST_SHOWN: Final = 100
"""The latest ones; older ones stay in their folder."""
_ASKED, _FOUND, _REPORT, _SAID = "asked.json", "found.json", "report.html", "said.txt"


@dataclass(frozen=True)
class DiagnosisRequest:
    """What is to be diagnosed."""

    session: str
    model: str
    reference: str
    baselines: tuple[str, ...]
    asked_s: float
    recorded_s: float
    """When the session was recorded, s since 1970."""


class Diagnoses:
    """Kept below one folder, one at work at a time."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._working = ""
        self._task: asyncio.Task[None] | None = None

    def begin(self, question: DiagnosisRequest, log: Path, model: Path, baselines: Sequence[Path]) -> str:
        """Start one; returns its name. StateError while another is at work, RigError for a reference that is none."""
        if question.reference not in REFERENCE_CHOICES:
            raise RigError(f"{question.reference[:40]!a}: no such reference; allowed: {', '.join(REFERENCE_CHOICES)}")
        if self._working:
            raise StateError("a diagnosis is at work; wait for its end")
        name = time.strftime("%Y%m%dT%H%M%SZ", time.gmtime(question.asked_s))
        folder = self._folder / name
        try:
            self._folder.mkdir(exist_ok=True)  # not what it lies in: a state folder that was moved may come back
            folder.mkdir()
            (folder / _ASKED).write_text(json.dumps(asdict(question)), encoding="utf-8")
        except OSError as error:
            raise RigError(f"{folder}: cannot be made: {error.strerror}") from None
        self._working = name
        given = [option for baseline in baselines for option in ("--baseline", str(baseline))]
        call = ["gap", "diagnose", "--model", str(model), "--log", str(log), "--reference", question.reference, *given]
        self._task = asyncio.create_task(self._work(folder, call))
        return name

    def all(self) -> list[dict[str, Any]]:
        """The newest first, each with what was asked and, when it is over, what was found."""
        return [self._told(name) for name in self._names()]

    def _names(self) -> list[str]:
        with contextlib.suppress(OSError):
            names = sorted((item.name for item in self._folder.iterdir() if item.is_dir()), reverse=True)
            return names[:MOST_SHOWN]
        return []

    def days(self, model: str, reference: str) -> list[DiagnosedDay]:
        """The newest finished diagnosis of every session that was asked for with this model and reference."""
        newest: dict[str, DiagnosedDay] = {}
        for name in self._names():
            asked, found = _read(self._folder / name / _ASKED), _found(self._folder / name / _FOUND)
            session = str(asked.get("session"))
            if found and session not in newest and (asked.get("model"), asked.get("reference")) == (model, reference):
                newest[session] = DiagnosedDay(session, _number(asked.get("recorded_s") or asked.get("asked_s")), found)
        return list(newest.values())

    def report(self, name: str) -> Path:
        """Its page; RecordError when there is none."""
        known = {item.name: item for item in self._folder.iterdir()} if self._folder.is_dir() else {}
        if name not in known or not (known[name] / _REPORT).is_file():
            raise RecordError(f"{name[:40]!a}: no such diagnosis")
        return known[name] / _REPORT

    async def _work(self, folder: Path, call: list[str]) -> None:
        outputs = ["--json", str(folder / _FOUND), "--html", str(folder / _REPORT)]
        bound = [sys.executable, "-m", "rig.service.web.files.bound_to_parent", str(os.getpid())]
        command = [*bound, "rig.cli.main", *call, *outputs]
        try:
            with (folder / _SAID).open("wb") as messages:
                process = await asyncio.create_subprocess_exec(
                    *command, stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.DEVNULL, stderr=messages
                )
                await _ended(process)
        finally:
            self._working = ""

    def _told(self, name: str) -> dict[str, Any]:
        folder = self._folder / name
        asked, found = _read(folder / _ASKED), _found(folder / _FOUND)
        state = "at work" if name == self._working else "done" if found else "failed"
        message = "" if found or state == "at work" else _text(folder / _SAID)
        return {"name": name, "state": state, "asked": asked, "said": message, **(_summary(found) if found else {})}


async def _ended(process: asyncio.subprocess.Process) -> None:
    """Until it is over; one that takes too long is ended."""
    try:
        await asyncio.wait_for(process.wait(), DIAGNOSIS_PATIENCE_S)
    except TimeoutError:
        process.kill()
        await process.wait()


def _summary(found: dict[str, Any]) -> dict[str, Any]:
    """The line of one diagnosis in a list; keys of the result as docs/explanation/diagnosis.md has them."""
    return {
        "verdict": found.get("verdict"),
        "confidence": found.get("confidence"),
        "causes": [cause.get("effect") for cause in found.get("causes", [])],
        "gap": gap_of(found, "rms"),
        "unit": unit_of(found),
        "next": found.get("next_experiment"),
    }


def _found(path: Path) -> dict[str, Any]:
    """The JSON of a diagnosis; empty where there is none, or something else stands there: nobody would see the others
    then."""
    with contextlib.suppress(ValueError, LookupError, TypeError, AttributeError):
        found = _read(path)
        _summary(found)
        return found
    return {}


def _number(kept: object) -> float:
    with contextlib.suppress(ValueError, TypeError, OverflowError):
        return finite(kept)
    return 0.0


def _read(path: Path) -> dict[str, Any]:
    with contextlib.suppress(OSError, ValueError, RecursionError):
        read = json.loads(path.read_text(encoding="utf-8"))
        return read if isinstance(read, dict) else {}
    return {}


def _text(path: Path) -> str:
    with contextlib.suppress(OSError):
        lines = path.read_text(encoding="utf-8", errors="replace").strip().splitlines()
        return lines[-1][:500] if lines else "it ended without a result"
    return "it ended without a result"

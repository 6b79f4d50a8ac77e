"""The queue of sweeps: what is to be done, what was done, kept on disk so that a restart forgets nothing and resumes
nothing."""

import json
import threading
from collections.abc import Collection, Iterator
from dataclasses import asdict, dataclass, field, fields
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

from rig.config import structure
from rig.errors import ConfigError, RigError
from rig.fields import bounded
from rig.number_text import counted
from rig.service.records.durable_file import DurableFile

MOST_OPEN = 200
"""So many sweeps may wait: each stands in every status."""
KEPT_DONE = 50
"""So many finished jobs are remembered."""
_NAMED = 3
KEPT_FILES = 200
"""So many records of a job are remembered by name, the last; the others are in its folder. A sweep may go on for
days."""
SHOWN_FILES = 50
"""So many of them stand in a status."""
_MOST: Final = 1_000_000_000
"""Of whatever is counted in a queue's file: what is more was written by somebody else."""
_MOST_S: Final = 1e9


class JobState(StrEnum):
    """Where a sweep of the queue stands."""

    WAITING = "waiting"
    RUNNING = "running"
    DONE = "done"
    STOPPED = "stopped"
    """By the operator or a fault; `start` without a sweep goes on with the record that was not finished."""
    FAILED = "failed"


@dataclass
class Job:
    """One sweep of the queue."""

    sweep: str
    name: str
    id: int = bounded(1, _MOST)
    total: int = bounded(1, _MOST)
    """Records it consists of."""
    seconds: float = bounded(0.0, _MOST_S, "s")
    """Time of all its records."""
    pause_s: float = bounded(0.0, _MOST_S, "s", default=0.0)
    """Rest for the muscles after it."""
    state: JobState = JobState.WAITING
    done: int = bounded(0, _MOST, default=0)
    folder: str = ""
    not_valid: int = bounded(0, _MOST, default=0)
    """Of these, records that a missed period or the like makes no measurement of."""
    files: list[str] = field(default_factory=list)
    """The last KEPT_FILES records made."""
    error: str = ""

    def made(self, file: Path, *, valid: bool) -> None:
        """Remember one more record."""
        self.not_valid += not valid
        self.files = [*self.files, str(file)][-KEPT_FILES:]

    @property
    def open(self) -> bool:
        """There is something left to do that an operator did not give up."""
        return self.state in (JobState.WAITING, JobState.RUNNING, JobState.STOPPED)

    @property
    def seconds_left(self) -> float:
        """Time of the records that are still to come."""
        return self.seconds * (1 - self.done / self.total)


class Queue:
    """Jobs in order. Every change is on the disk before the call returns; any thread may make one."""

    def __init__(self, file: DurableFile) -> None:
        self._file = file
        self.jobs: list[Job] = []
        self._last_id = 0
        self._saving = threading.Lock()
        if file.path.exists():
            self._load()

    def _load(self) -> None:
        """What a former daemon left; a job that ran then was stopped by the restart."""
        try:
            kept = _kept(json.loads(self._file.path.read_text(encoding="utf-8")))
            self.jobs, self._last_id = kept.jobs, kept.last_id
        except ConfigError as error:
            self._file.put_aside(str(error))
        except (OSError, ValueError, RecursionError):
            self._file.put_aside()
        for job in self.jobs:
            if job.state is JobState.RUNNING:
                job.state, job.error = JobState.STOPPED, "the daemon ended while it ran"

    def add(self, sweep: Path, name: str, total: int, seconds: float, pause_s: float) -> Job:
        """A sweep at the end of the queue; RigError when it is full, or cannot be saved."""
        if len(self.left()) >= MOST_OPEN:
            raise RigError(f"the queue holds {MOST_OPEN} sweeps already; wait, or take them out by `pamrig clear`")
        self._last_id += 1
        job = Job(str(sweep), name, self._last_id, total, seconds, pause_s)
        self.jobs.append(job)
        try:
            self.save()
        except RigError:
            self.jobs.remove(job)  # the caller was refused: it must not be done later
            raise
        return job

    def left(self, only: Collection[int] | None = None) -> list[Job]:
        """The jobs that are not over, in order; of `only` these ids, when they are given."""
        return [job for job in self.jobs if job.open and (only is None or job.id in only)]

    def next(self, only: Collection[int] | None = None) -> Job | None:
        """The first of them."""
        return next(iter(self.left(only)), None)

    def clear(self) -> list[int]:
        """Drop what is neither running nor done; returns the ids. RigError when that cannot be saved: all stay."""
        before = self.jobs
        dropped = [job.id for job in before if job.state not in (JobState.RUNNING, JobState.DONE)]
        self.jobs = [job for job in before if job.id not in dropped]
        try:
            self.save()
        except RigError:
            self.jobs = before  # the caller was refused: after a restart they would be there again
            raise
        return dropped

    def seconds_left(self, only: Collection[int] | None = None) -> float:
        """Time of the records that are still to come, and of the pauses between the sweeps."""
        left = self.left(only)
        return sum(job.seconds_left for job in left) + sum(job.pause_s for job in left[:-1])

    def described(self, only: Collection[int] | None = None) -> str:
        """What waits or was interrupted, with its length: what would move before anything that is added now. Empty:
        nothing."""
        left = self.left(only)
        if not left:
            return ""
        named = ", ".join(
            f"{job.name} ({job.total - job.done} of {counted(job.total, 'record')})" for job in left[:_NAMED]
        )
        more = f" and {len(left) - _NAMED} more" if len(left) > _NAMED else ""
        sweeps = counted(len(left), "sweep")
        records = sum(job.total - job.done for job in left)
        return f"{sweeps} of before: {named}{more}; {counted(records, 'record')}, {self.seconds_left(only):.0f} s"

    def save(self) -> None:
        """Onto the disk, whole or not at all. RigError when the folder takes nothing."""
        with self._saving:
            over = [job for job in self.jobs if not job.open]
            for job in over[: max(len(over) - KEPT_DONE, 0)]:
                self.jobs.remove(job)
            text = json.dumps({"last_id": self._last_id, "jobs": list(self.to_json())}, indent=1)
            self._file.replace(text, "the queue cannot be saved")

    def to_json(self) -> Iterator[dict[str, Any]]:
        """Every job as plain data."""
        return (asdict(job) for job in self.jobs)

    def shown(self) -> Iterator[dict[str, Any]]:
        """The same for a status, which is sent often: the names of a job's last records, and how many there are."""
        return (asdict(job) | {"files": job.files[-SHOWN_FILES:], "made": len(job.files)} for job in self.jobs)


@dataclass
class _Kept:
    """A queue's file."""

    jobs: list[Job]
    last_id: int = bounded(0, _MOST)

    def __post_init__(self) -> None:
        ids = [job.id for job in self.jobs]
        if len(set(ids)) < len(ids) or max(ids, default=0) > self.last_id:
            raise ValueError("jobs: two have the same id, or one is above last_id")
        if over := next((job for job in self.jobs if job.done > job.total), None):
            raise ValueError(f"jobs: {over.done} of {over.total} records are done")
        if any("\0" in place for job in self.jobs for place in (job.sweep, job.folder)):
            raise ValueError("jobs: a place has a character that no file name can have")


def _kept(raw: object) -> _Kept:
    """The file as it was read, without keys of other versions; ConfigError when it is none that a daemon wrote."""
    if isinstance(raw, dict) and isinstance(raw.get("jobs"), list):
        known = {each.name for each in fields(Job)}
        jobs = [
            {key: value for key, value in job.items() if key in known} if isinstance(job, dict) else job
            for job in raw["jobs"]
        ]
        raw = {"last_id": raw.get("last_id"), "jobs": jobs}
    return structure(raw, _Kept, "it is no queue")

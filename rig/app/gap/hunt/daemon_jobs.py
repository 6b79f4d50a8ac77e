"""A hunt's sweeps as jobs of a daemon. The daemon goes on with a sweep whoever asked for it, so the records of a hunt
that was killed meanwhile are taken from there and not made again."""

import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rig.errors import CheckFailed, Interrupted, StateError
from rig.outputs import OutputKind, writing
from rig.service.client import Client

Status = Mapping[str, Any]
"""Of the daemon, see docs/reference/control_protocol.md."""


def last_job(status: Status) -> int:
    """The number of the newest job in the queue; 0 of an empty one. Every job to come has a larger one."""
    return max((int(job["id"]) for job in status["queue"]), default=0)


def at_hand(status: Status, sweep: Path, since: int) -> bool:
    """Whether the daemon works on this sweep, or has recorded it whole, as a job newer than `since`."""
    job = _job_of(status, sweep, since)
    if job is None:
        return False
    if job["state"] == "done":
        return not job["not_valid"] and all(map(os.path.exists, job["files"]))
    return job["state"] in ("running", "waiting") and status["working"] and job["id"] not in status["interrupted"]


def check_free(status: Status) -> None:
    """StateError while the daemon has something to do."""
    if status["working"]:
        raise StateError("the daemon works on its queue; wait for it by `pamrig queue`, or stop it")


def taken(daemon: Client, sweep: Path, since: int, out: Path) -> None:
    """The records of this sweep's newest job since that one, copied into the empty folder `out` once it is over;
    CheckFailed when they are not all valid, Interrupted by Ctrl-C, which leaves the job to the daemon."""
    try:
        status = daemon.wait()
    except KeyboardInterrupt:
        raise Interrupted(f"interrupted; the daemon has {sweep.stem}, and the same call takes its records") from None
    job = _job_of(status, sweep, since)
    if job is None:
        raise CheckFailed(f"{sweep}: somebody has taken its job out of the daemon's queue")
    if job["state"] != "done" or job["not_valid"]:
        fault = status["fault"]
        why = job["error"] or (f"{fault['name']}: {fault['cause']}" if fault else f"{job['not_valid']} not valid")
        raise CheckFailed(f"job {job['id']} {job['name']}: {job['state']}: {why}")
    out.mkdir(exist_ok=True)
    for file in _files_of(job):
        with writing(out / file.name, OutputKind.RECORDING) as part:
            shutil.copy2(file, part)


def _files_of(job: Mapping[str, Any]) -> list[Path]:
    """Every record of a job: a status names the last ones only, and its folder holds nothing else."""
    named = [Path(file) for file in job["files"]]
    return named if job.get("made", 0) <= len(named) else sorted(Path(job["folder"]).glob("*.mcap"))


def _job_of(status: Status, sweep: Path, since: int) -> Mapping[str, Any] | None:
    """The newest job of a sweep's file among those with a number above `since`: what an older one of that path was is
    not known."""
    place = os.path.realpath(sweep)
    found = [job for job in status["queue"] if job["id"] > since and os.path.realpath(job["sweep"]) == place]
    return max(found, key=lambda job: int(job["id"]), default=None)

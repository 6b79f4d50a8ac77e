"""The daemon's queue for a terminal: what an interrupted one still holds, the question about it, its table, and waiting
for it."""

from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING, Any

import click

from rig.app.terminal import console, listing
from rig.errors import CheckFailed
from rig.number_text import counted

if TYPE_CHECKING:
    from rich.table import Table

    from rig.service.client import Client

Job = dict[str, Any]
_OPEN = ("waiting", "running", "stopped")


def interrupted(status: dict[str, Any]) -> list[Job]:
    """The jobs that are left to do and nobody goes on with."""
    return [job for job in status["queue"] if job["id"] in status["interrupted"]]


def described(jobs: Iterable[Job]) -> str:
    """What would move, with its length."""
    jobs = list(jobs)
    names = ", ".join(
        f"{job['name']} ({job['total'] - job['done']} of {counted(job['total'], 'record')})" for job in jobs
    )
    return f"{names}; {sum(map(_seconds_left, jobs)):.0f} s"


def ask(waiting: list[Job]) -> str:
    """What is to become of an interrupted queue; the answer for `Client.start`. Aborts when nothing is to move."""
    console().print(f"the queue still holds {described(waiting)}", style="yellow")
    kind = click.Choice(["first", "only", "nothing"])
    answer = click.prompt(
        "first: do that before the new sweeps; only: leave it there; nothing: do not start", type=kind
    )
    if answer == "nothing":
        raise click.Abort
    return {"first": "first", "only": "leave"}[answer]


def table(jobs: Iterable[Job]) -> "Table":
    """The jobs in order."""
    shown = listing("job", "sweep", "state", "records", "left", "said")
    for job in jobs:
        spoilt = f"{job['not_valid']} not valid" if job.get("not_valid") else ""
        remark = "; ".join(text for text in (spoilt, job["error"]) if text)
        left = f"{_seconds_left(job):.0f} s" if job["state"] in _OPEN else ""
        cells = (str(job["id"]), job["name"], job["state"], f"{job['done']} of {job['total']}", left, remark)
        shown.add_row(*cells)
    return shown


def total(status: dict[str, Any]) -> str:
    """The last line under the table."""
    held = "" if status["working"] or not status["left_s"] else "; held: `pamrig start` goes on"
    return f"{status['left_s']:.0f} s of work left{held}"


def wait(client: "Client", ids: Collection[int]) -> None:
    """Until the daemon has done these jobs; CheckFailed when one of them was not done, or not every record of it is
    valid."""
    status = client.wait()
    jobs = [job for job in status["queue"] if job["id"] in ids]
    for job in jobs:
        console().print(
            f"job {job['id']} {job['name']}: {job['state']}, {job['done']} of {counted(job['total'], 'record')}"
        )
    if fault := status["fault"]:
        raise CheckFailed(f"{fault['name']}: {fault['cause']}")
    for job in jobs:
        if job["state"] != "done" or job.get("not_valid"):
            why = job["error"] or (
                f"{counted(job['not_valid'], 'record')} not valid" if job.get("not_valid") else job["state"]
            )
            raise CheckFailed(f"job {job['id']} {job['name']}: {why}")


def _seconds_left(job: Job) -> float:
    return float(job["seconds"] * (1 - job["done"] / job["total"]))

"""The records of a daemon's job as a hunt takes them."""

from pathlib import Path
from typing import Any, cast

from rig.app.gap.hunt.daemon_jobs import taken
from rig.service.client import Client
from rig.service.queue.job_queue import JobState, Queue
from rig.service.records.durable_file import DurableFile


class Done:
    """A daemon whose queue is done."""

    def __init__(self, queue: Queue) -> None:
        self._queue = queue

    def wait(self) -> dict[str, Any]:
        return {"queue": list(self._queue.shown()), "fault": None}


def test_a_hunt_takes_every_record_of_a_long_sweep(tmp_path: Path) -> None:
    """A status names the last 50 of them; the others were left out without a word."""
    queue, sweep, folder = Queue(DurableFile(tmp_path / "queue.json")), tmp_path / "first.yaml", tmp_path / "records"
    folder.mkdir()
    job = queue.add(sweep, "first", 60, 60.0, 0.0)
    for number in range(job.total):
        file = folder / f"record_{number:02}.mcap"
        file.write_text(str(number))
        job.made(file, valid=True)
    job.state, job.done, job.folder = JobState.DONE, job.total, str(folder)
    taken(cast(Client, Done(queue)), sweep, 0, tmp_path / "out")
    assert len(list((tmp_path / "out").glob("*.mcap"))) == job.total

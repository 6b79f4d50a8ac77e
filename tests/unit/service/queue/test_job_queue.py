"""The queue of sweeps over restarts: what was done is remembered, nothing is resumed, nothing is lost."""

import errno
import json
from pathlib import Path
from typing import Any

import pytest

from rig.errors import RigError
from rig.service.queue import job_queue
from rig.service.queue.job_queue import KEPT_DONE, KEPT_FILES, SHOWN_FILES, JobState, Queue
from rig.service.records.durable_file import DurableFile


def queue(folder: Path) -> Queue:
    return Queue(DurableFile(folder / "queue.json"))


def test_jobs_come_in_order_and_survive(tmp_path: Path) -> None:
    first = queue(tmp_path)
    for name in ("a", "b"):
        first.add(Path(f"/{name}.yaml"), name, 3, 30.0, 5.0)
    again = queue(tmp_path)
    assert [job.name for job in again.jobs] == ["a", "b"]
    assert again.next() is again.jobs[0]
    assert again.add(Path("/c.yaml"), "c", 1, 1.0, 0.0).id == 3


def test_a_job_that_ran_when_the_daemon_ended_is_stopped_not_running(tmp_path: Path) -> None:
    first = queue(tmp_path)
    job = first.add(Path("/a.yaml"), "a", 4, 40.0, 0.0)
    job.state, job.done, job.files = JobState.RUNNING, 2, ["one.mcap", "two.mcap"]
    first.save()
    (left,) = queue(tmp_path).jobs
    assert (left.state, left.done, left.files) == (JobState.STOPPED, 2, ["one.mcap", "two.mcap"])
    assert left.error == "the daemon ended while it ran"


def test_time_left_counts_records_and_the_pauses_between_sweeps(tmp_path: Path) -> None:
    jobs = queue(tmp_path)
    jobs.add(Path("/a.yaml"), "a", 4, 40.0, 10.0).done = 1
    jobs.add(Path("/b.yaml"), "b", 1, 20.0, 10.0)
    assert jobs.seconds_left() == pytest.approx(30.0 + 10.0 + 20.0)


def test_clear_spares_what_runs(tmp_path: Path) -> None:
    jobs = queue(tmp_path)
    jobs.add(Path("/a.yaml"), "a", 1, 1.0, 0.0).state = JobState.RUNNING
    jobs.add(Path("/b.yaml"), "b", 1, 1.0, 0.0)
    jobs.add(Path("/c.yaml"), "c", 1, 1.0, 0.0).state = JobState.FAILED
    assert jobs.clear() == [2, 3]
    assert [job.name for job in jobs.jobs] == ["a"]


def test_only_so_many_finished_jobs_are_kept(tmp_path: Path) -> None:
    jobs = queue(tmp_path)
    for _ in range(KEPT_DONE + 5):
        jobs.add(Path("/a.yaml"), "a", 1, 1.0, 0.0).state = JobState.DONE
    jobs.save()
    assert [job.id for job in queue(tmp_path).jobs] == list(range(6, KEPT_DONE + 6))


def test_only_so_many_records_of_a_long_job_are_kept_by_name(tmp_path: Path) -> None:
    jobs = queue(tmp_path)
    job = jobs.add(Path("/a.yaml"), "a", KEPT_FILES + 5, 1.0, 0.0)
    for number in range(KEPT_FILES + 5):
        job.made(Path(f"{number}.mcap"), valid=True)
    jobs.save()
    (left,) = queue(tmp_path).jobs
    assert left.files == [f"{number}.mcap" for number in range(5, KEPT_FILES + 5)]
    (shown,) = jobs.shown()
    assert (shown["files"], shown["made"]) == (left.files[-SHOWN_FILES:], KEPT_FILES)


@pytest.mark.parametrize(
    "text",
    [
        "", "{", "[]", "[" * 100_000, '{"jobs": []}', '{"jobs": [{}], "last_id": 1}', '{"jobs": [1], "last_id": 1}',
        '{"jobs": [], "last_id": 1e999}', '{"jobs": [], "last_id": NaN}',
    ],
    ids=range(9),
)  # fmt: skip
def test_a_broken_file_is_put_aside_not_trusted(tmp_path: Path, text: str) -> None:
    (tmp_path / "queue.json").write_text(text)
    assert queue(tmp_path).jobs == []
    assert (tmp_path / "queue.broken").read_text() == text


@pytest.mark.parametrize(("changed", "said"), [
    ({"total": 0}, "jobs[0].total: 0 is outside"), ({"total": True}, "jobs[0].total: expected a whole number"),
    ({"total": "many"}, "jobs[0].total"), ({"done": 9}, "9 of 3 records are done"), ({"done": -1}, "jobs[0].done"),
    ({"id": 7}, "above last_id"), ({"id": None}, "jobs[0].id"), ({"seconds": float("nan")}, "jobs[0].seconds"),
    ({"seconds": None}, "jobs[0].seconds"), ({"pause_s": float("inf")}, "jobs[0].pause_s"),
    ({"pause_s": "5"}, "jobs[0].pause_s"), ({"state": "asleep"}, "jobs[0].state: unknown value 'asleep'"),
    ({"files": "one.mcap"}, "jobs[0].files: expected a list"), ({"name": None}, "jobs[0].name: expected text"),
    ({"folder": "\0"}, "no file name can have"), ({"not_valid": 1e9}, "jobs[0].not_valid"),
])  # fmt: skip
def test_a_job_that_no_daemon_wrote_puts_the_file_aside_and_says_why(
    tmp_path: Path, changed: dict[str, Any], said: str, caplog: pytest.LogCaptureFixture
) -> None:
    """A total of 0, by hand, ended each status with "error in the daemon itself", and then the daemon."""
    queue(tmp_path).add(Path("/a.yaml"), "a", 3, 30.0, 0.0)
    kept = json.loads((tmp_path / "queue.json").read_text())
    kept["jobs"][0] |= changed
    (tmp_path / "queue.json").write_text(json.dumps(kept))
    found = queue(tmp_path)
    assert found.jobs == []
    assert found.add(Path("/b.yaml"), "b", 1, 1.0, 0.0).id == 1
    assert json.dumps(kept) == (tmp_path / "queue.broken").read_text()
    (line,) = caplog.messages
    assert said in line
    assert line.startswith(f"{tmp_path / 'queue.json'}: it is no queue: ")


def test_keys_of_another_version_are_passed_over(tmp_path: Path) -> None:
    queue(tmp_path).add(Path("/a.yaml"), "a", 3, 30.0, 0.0)
    kept = json.loads((tmp_path / "queue.json").read_text())
    kept["jobs"][0]["colour"] = "blue"
    (tmp_path / "queue.json").write_text(json.dumps(kept | {"more": 1}))
    assert [job.name for job in queue(tmp_path).jobs] == ["a"]


def test_a_queue_that_cannot_be_saved_says_so(tmp_path: Path) -> None:
    jobs = queue(tmp_path / "missing")
    with pytest.raises(RigError, match="the queue cannot be saved: No such file"):
        jobs.add(Path("/a.yaml"), "a", 1, 1.0, 0.0)
    assert jobs.next() is None


def test_what_cannot_be_dropped_from_the_file_stays_in_the_queue(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs = queue(tmp_path)
    jobs.add(Path("a.yaml"), "a", 1, 10.0, 0.0)

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(RigError, match="cannot be saved: No space left"):
        jobs.clear()
    assert [job.name for job in jobs.jobs] == ["a"]


def test_records_that_are_not_valid_are_counted_over_a_restart(tmp_path: Path) -> None:
    first = queue(tmp_path)
    job = first.add(Path("/a.yaml"), "a", 3, 30.0, 0.0)
    for valid in (True, False, False):
        job.made(tmp_path / "one.mcap", valid=valid)
    first.save()
    assert queue(tmp_path).jobs[0].not_valid == 2


def test_what_an_interrupted_queue_holds_is_named_with_its_length(tmp_path: Path) -> None:
    jobs = queue(tmp_path)
    assert jobs.described() == ""
    jobs.add(Path("/paper.yaml"), "paper", 15, 225.0, 0.0).done = 2
    assert jobs.described() == "1 sweep of before: paper (13 of 15 records); 13 records, 195 s"
    for name in ("b", "c", "d"):
        jobs.add(Path(f"/{name}.yaml"), name, 1, 10.0, 0.0)
    assert (
        "4 sweeps of before: paper (13 of 15 records), b (1 of 1 record), c (1 of 1 record) and 1 more; 16"
        in jobs.described()
    )


def test_of_a_queue_only_what_was_asked_for_counts(tmp_path: Path) -> None:
    jobs = queue(tmp_path)
    old, new = (jobs.add(Path(f"/{name}.yaml"), name, 1, 10.0, 5.0) for name in ("old", "new"))
    assert (jobs.next(), jobs.next({new.id})) == (old, new)
    assert (jobs.seconds_left(), jobs.seconds_left({new.id})) == (25.0, 10.0)


def test_a_full_queue_takes_no_more(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(job_queue, "MOST_OPEN", 2)
    jobs = queue(tmp_path)
    for _ in range(2):
        jobs.add(Path("/a.yaml"), "a", 1, 1.0, 0.0)
    with pytest.raises(RigError, match="the queue holds 2 sweeps already; wait, or take them out by `pamrig clear`"):
        jobs.add(Path("/a.yaml"), "a", 1, 1.0, 0.0)
    jobs.jobs[0].state = JobState.DONE
    assert jobs.add(Path("/a.yaml"), "a", 1, 1.0, 0.0).id == 3

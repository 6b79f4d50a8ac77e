"""The queue runner of the daemon, where no rig is needed: what it does when a sweep cannot be begun."""

import asyncio
import threading
from collections.abc import Awaitable, Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar

import pytest

from rig.app import compose, shipped
from rig.errors import RigError
from rig.realtime.commands import Request, program_path
from rig.service.aside import DiskWork
from rig.service.connections.protocol import Code, Refused
from rig.service.queue import queue_runner
from rig.service.queue.expander import Published, Summary
from rig.service.queue.job_queue import Job, JobState, Queue
from rig.service.queue.planner import Planner
from rig.service.queue.queue_runner import NoSpace, QueueRunner
from rig.service.records.durable_file import DurableFile
from rig.service.records.ledger import Ledger
from rig.service.records.record_names import free
from rig.service.records.recorder_messages import RunOrder
from rig.service.settings import DaemonSettings

T = TypeVar("T")
QUICK = shipped.configs() / "sweeps" / "quick.yaml"


def runner(folder: Path, spare_gb: float, session: Any = None) -> tuple[QueueRunner, Queue]:
    queue = Queue(DurableFile(folder / "queue.json"))
    monitor: Any = SimpleNamespace(fault=None, session=session, telemetry=None)
    settings = DaemonSettings(logs=folder / "logs", state=folder, spare_gb=spare_gb)
    return QueueRunner(
        monitor, queue, compose.load(None), settings, Ledger(DurableFile(settings.ledger)), DiskWork()
    ), queue


def worked_on(folder: Path, sweep: Path, spare_gb: float, session: Any = None) -> Job:
    """A job of `sweep`, after the runner has looked at it."""
    (folder / "logs").mkdir()

    async def look() -> Job:
        work, queue = runner(folder, spare_gb, session)
        job = queue.add(sweep, sweep.stem, 1, 10.0, 0.0)
        work.go_on()
        task = asyncio.create_task(work.run())
        while work.working:
            await asyncio.sleep(0.01)
        task.cancel()
        work.planner.close()
        return job

    return asyncio.run(asyncio.wait_for(look(), 30.0))


def test_a_full_disk_stops_a_job_that_can_go_on_later_and_leaves_no_folder(tmp_path: Path) -> None:
    job = worked_on(tmp_path, QUICK, spare_gb=1e6)
    assert job.state is JobState.STOPPED
    assert "1e+06 GB are to be spared" in job.error
    assert not list((tmp_path / "logs").iterdir())


def test_a_sweep_that_is_gone_fails(tmp_path: Path) -> None:
    job = worked_on(tmp_path, tmp_path / "gone.yaml", spare_gb=0.0)
    assert job.state is JobState.FAILED
    assert "no such file" in job.error


def test_a_program_for_which_there_is_no_room_in_memory_stops_a_job_that_can_go_on_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It failed, as a sweep that cannot be carried out, and `pamrig start` went on with the next one."""

    async def full(*_: object) -> None:
        raise RigError("/dev/shm/pamrig-1-program-1: cannot be made: No space left on device")

    monkeypatch.setattr(Planner, "publish", full)
    monkeypatch.setattr(QueueRunner, "check_space", lambda _: asyncio.sleep(0))
    job = worked_on(tmp_path, QUICK, 0.0, SimpleNamespace(id=1, recording=SimpleNamespace(trouble=None)))
    assert job.state is JobState.STOPPED
    assert "No space left" in job.error


def test_a_queue_that_cannot_be_saved_is_no_end_of_the_daemon(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """A full disk ended it, as an error in the daemon itself."""
    (tmp_path / "logs").mkdir()

    def full() -> None:
        raise RigError("queue.json: the queue cannot be saved: No space left on device")

    async def look() -> tuple[Job, bool]:
        work, queue = runner(tmp_path, 0.0)
        job = queue.add(tmp_path / "gone.yaml", "gone", 1, 10.0, 0.0)
        monkeypatch.setattr(queue, "save", full)
        work.go_on()
        task = asyncio.create_task(work.run())
        while work.working and not task.done():
            await asyncio.sleep(0.01)
        await asyncio.sleep(0.02)  # for what it keeps last
        ended = task.done()
        task.cancel()
        work.planner.close()
        return job, ended

    job, ended = asyncio.run(asyncio.wait_for(look(), 30.0))
    assert (job.state, ended) == (JobState.FAILED, False)
    assert "No space left on device; after a restart the daemon knows the queue as it was kept last" in caplog.text


def test_two_daemons_with_the_same_logs_have_a_folder_each_for_a_sweep_of_one_second(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The records of two rigs lay in one folder, as one session."""
    looked = []

    def found(path: Path) -> Path:
        if not looked:
            path.mkdir(parents=True)  # by the other, right after we looked
            looked.append(path)
            return path
        return free(path)

    monkeypatch.setattr(queue_runner, "free", found)
    job = worked_on(tmp_path, QUICK, spare_gb=0.0)
    assert job.folder
    assert Path(job.folder).is_dir()
    assert Path(job.folder) != looked[0].absolute()


def test_a_full_disk_is_said_before_a_sweep_is_queued(tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    with pytest.raises(NoSpace, match=r"GB free; 1e\+06 GB are to be spared \(`spare_gb`\)"):
        asyncio.run(runner(tmp_path, 1e6)[0].check_space())


def test_only_the_jobs_that_were_asked_for_are_begun(tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()

    async def look() -> tuple[Job, Job, str]:
        work, queue = runner(tmp_path, 0.0)
        old, new = (queue.add(tmp_path / f"{name}.yaml", name, 1, 10.0, 0.0) for name in ("old", "new"))
        assert "2 sweeps of before: old (1 of 1 record), new" in work.interrupted
        work.go_on([new.id])
        assert work.interrupted.startswith("1 sweep of before: old")
        task = asyncio.create_task(work.run())
        while work.working:
            await asyncio.sleep(0.01)
        task.cancel()
        work.planner.close()
        return old, new, work.interrupted

    old, new, left = asyncio.run(asyncio.wait_for(look(), 30.0))
    assert (old.state, new.state) == (JobState.WAITING, JobState.FAILED)  # there is no such file
    assert left == "1 sweep of before: old (1 of 1 record); 1 record, 10 s"


def test_who_adds_to_work_on_some_jobs_alone_does_not_set_the_others_in_motion(tmp_path: Path) -> None:
    work, queue = runner(tmp_path, 0.0)
    old, new, more = (queue.add(tmp_path / f"{name}.yaml", name, 1, 10.0, 0.0) for name in ("old", "new", "more"))
    work.go_on([new.id])
    assert work.to_json()["interrupted"] == [old.id, more.id]
    work.go_on([more.id])
    assert (work.to_json()["interrupted"], work.to_json()["left_s"]) == ([old.id], 20.0)
    new.state = more.state = JobState.DONE
    assert not work.working
    assert work.to_json()["left_s"] == 10.0
    work.go_on()
    assert (work.working, work.interrupted) == (True, "")
    work.hold()
    assert work.interrupted == "1 sweep of before: old (1 of 1 record); 1 record, 10 s"


class SlowPlanner(Planner):
    """Takes longer than anybody waits, for a sweep or for a record of it."""

    def __init__(self, slow: str) -> None:
        super().__init__(compose.load(None))
        self._slow, self.asked = slow, asyncio.Event()

    async def open(self, path: Path) -> Summary:
        return await self._answer("open", Summary(1, 10.0, b""))

    async def publish(self, index: int, run: int, session: int) -> Published:
        program_path(session, run).write_bytes(b"half of it")
        return await self._answer("publish", Published("x", {}, 10, 10))

    async def _answer(self, what: str, answer: T) -> T:
        if what == self._slow:
            self.asked.set()
            await asyncio.Event().wait()
        return answer


def begun_with(planner: SlowPlanner, folder: Path) -> tuple[QueueRunner, Job, "asyncio.Task[None]"]:
    """At work on a job that the planner does not come to an end with."""
    (folder / "logs").mkdir()
    session: Any = SimpleNamespace(id=0x7357)
    work, queue = runner(folder, 0.0, session)
    work.planner = planner
    job = queue.add(QUICK, "quick", 1, 10.0, 0.0)
    work.go_on()
    return work, job, asyncio.create_task(work.run())


@pytest.mark.parametrize("slow", ["open", "publish"])
def test_a_stop_does_not_wait_for_a_sweep_that_is_expanded(tmp_path: Path, slow: str) -> None:
    """A reset waits until the runner is idle, and nobody waits minutes for a reset."""

    async def stop() -> Job:
        planner = SlowPlanner(slow)
        work, job, task = begun_with(planner, tmp_path)
        await planner.asked.wait()
        work.hold()
        await asyncio.wait_for(work.idle(), 10.0)
        assert not work.working
        task.cancel()
        return job

    assert asyncio.run(stop()).state is JobState.STOPPED
    assert not program_path(0x7357, 1).exists()


def test_a_stop_and_a_start_at_once_find_somebody_at_work(tmp_path: Path) -> None:
    """While its planner was being ended the runner took the stop for its own end: the job stood as running for ever,
    nothing was started any more, and no reset came to an end."""

    async def again() -> bool:
        planner = SlowPlanner("open")
        work, _, task = begun_with(planner, tmp_path)
        await planner.asked.wait()
        planner.asked.clear()
        work.hold()
        work.go_on()
        await asyncio.wait({task, asked := asyncio.ensure_future(planner.asked.wait())}, timeout=10.0,
                           return_when=asyncio.FIRST_COMPLETED)  # fmt: skip
        at_work = asked.done() and not task.done()
        work.hold()
        await asyncio.wait_for(work.idle(), 10.0)
        task.cancel()
        return at_work

    assert asyncio.run(again())


def test_a_stop_before_the_planner_is_asked_waits_for_no_planner(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It came while the job was written down, and the job stood as running until a fresh planner had come up: for
    seconds every start was refused by what was left of the queue."""
    keeping, kept = threading.Event(), threading.Event()
    save = Queue.save

    def keep_slowly(queue: Queue) -> None:
        if any(job.state is JobState.RUNNING for job in queue.jobs):
            keeping.set()
            assert kept.wait(30.0)
        save(queue)

    monkeypatch.setattr(Queue, "save", keep_slowly)

    async def stop() -> tuple[Job, bool]:
        planner = SlowPlanner("open")
        work, job, task = begun_with(planner, tmp_path)
        while not keeping.is_set():
            await asyncio.sleep(0.001)
        work.hold()
        kept.set()
        await asyncio.wait_for(work.idle(), 10.0)
        task.cancel()
        return job, planner.asked.is_set()

    job, asked = asyncio.run(stop())
    assert job.state is JobState.STOPPED
    assert not asked


def test_the_end_of_the_daemon_does_not_wait_for_it_either(tmp_path: Path) -> None:
    async def end() -> None:
        planner = SlowPlanner("open")
        work, _, task = begun_with(planner, tmp_path)
        await planner.asked.wait()
        work.hold()
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await asyncio.wait_for(task, 10.0)

    asyncio.run(end())


class PreparedSession:
    """A session whose recorder takes its orders when it is let; what the loop is asked for is kept."""

    id, virtual = 0x7358, True

    def __init__(self) -> None:
        self.facts: dict[str, Any] = {"device": {}, "realtime": {}, "wall_offset_ns": 0}
        self.mailbox = SimpleNamespace(stop=lambda _: None)
        self.told, self.takes = threading.Event(), threading.Event()
        self.recording = SimpleNamespace(expect=self._expect, call_off=self._call_off)

    def adopt(self, run: int) -> None:
        pass

    def _expect(self, _: RunOrder) -> None:
        self.told.set()
        self.takes.wait(10.0)

    def _call_off(self, run: int) -> None:
        self.called_off = run

    def retire(self, run: int) -> None:
        program_path(self.id, run).unlink(missing_ok=True)


def ready(
    folder: Path, request: Callable[..., Awaitable[None]], name: str = "quick"
) -> tuple[QueueRunner, Job, PreparedSession]:
    """A job whose first record is about to begin; the loop is asked by `request`."""
    (folder / "logs").mkdir()
    session = PreparedSession()
    queue = Queue(DurableFile(folder / "queue.json"))
    monitor: Any = SimpleNamespace(fault=None, session=session, telemetry=None, request=request)
    settings = DaemonSettings(logs=folder / "logs", state=folder, spare_gb=0.0)
    work = QueueRunner(monitor, queue, compose.load(None), settings, Ledger(DurableFile(settings.ledger)), DiskWork())
    work.planner = SlowPlanner("nothing")
    job = queue.add(QUICK, name, 1, 10.0, 0.0)
    work.go_on()
    return work, job, session


def test_a_record_that_was_stopped_before_it_began_does_not_begin_once_the_disk_goes_on(tmp_path: Path) -> None:
    """A stop disarmed the rig meanwhile; whoever armed it anew set the record in motion. And a reset waited for the
    disk."""
    asked: list[Request] = []

    async def loop(request: Request, _: int = 0) -> None:
        asked.append(request)

    async def stop() -> Job:
        work, job, session = ready(tmp_path, loop)
        task = asyncio.create_task(work.run())
        await asyncio.to_thread(session.told.wait, 10.0)
        work.hold()
        try:
            await asyncio.wait_for(work.idle(), 5.0)
        finally:
            session.takes.set()
        task.cancel()
        return job

    job = asyncio.run(stop())
    assert (asked, job.state, job.error) == ([], JobState.STOPPED, "")


@pytest.mark.parametrize("name", ["quick", "x" * 245])
def test_a_record_that_the_loop_refuses_to_begin_is_left_to_do(tmp_path: Path, name: str) -> None:
    """An emergency stop came in the tick before: the rest of the sweep was given up as failed. A sweep whose file has a
    long name ended the daemon: no folder can be called so."""

    async def loop(_: Request, __: int = 0) -> None:
        raise Refused(Code.WRONG_STATE, "the loop refused start while fault")

    async def look() -> Job:
        work, job, session = ready(tmp_path, loop, name)
        session.takes.set()
        task = asyncio.create_task(work.run())
        while work.working and not task.done():
            await asyncio.sleep(0.01)
        task.cancel()
        return job

    job = asyncio.run(asyncio.wait_for(look(), 10.0))
    assert Path(job.folder).is_dir()
    assert (job.state, job.error) == (JobState.STOPPED, "the loop refused start while fault")

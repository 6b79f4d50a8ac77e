"""What a daemon holds its folders to before it works with them."""

import asyncio
import multiprocessing
import os
import shutil
import stat
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from rig.app import compose, shipped
from rig.app.supervise import parts_of
from rig.cli.commands import cli
from rig.errors import RigError, StateError
from rig.rig_config import RigConfig
from rig.service.connections import socket_access
from rig.service.daemon import Daemon
from rig.service.processes import start_process
from rig.service.queue.job_queue import Queue
from rig.service.queue.planner import Planner
from rig.service.records.durable_file import DurableFile
from rig.service.records.ledger import Ledger
from rig.service.records.operating_time import OperatingTime
from rig.service.session.session_monitor import SessionMonitor
from rig.service.session.session_parts import SessionParts
from rig.service.settings import DaemonSettings, View, Web
from rig.service.state_folder import StateFolder


def daemon_in(folder: Path) -> Daemon:
    """One that has not begun."""
    settings = DaemonSettings(logs=folder / "logs", state=folder, socket=folder / "s.sock", web=Web(on=False))
    return Daemon(parts_of(compose.load(None), virtual=True), settings)


def test_a_state_folder_that_was_there_is_closed_to_others(tmp_path: Path) -> None:
    tmp_path.chmod(0o777)
    daemon_in(tmp_path)
    assert tmp_path.stat().st_mode & 0o777 == 0o755


def test_a_state_folder_of_everybodys_is_refused(tmp_path: Path) -> None:
    tmp_path.chmod(0o1777)
    with pytest.raises(StateError, match="is to hold the daemon's queue and ledger, and is meant for everybody"):
        daemon_in(tmp_path)
    assert not (tmp_path / "daemon.lock").exists()


def queued(folder: Path) -> list[str]:
    """The sweeps of the queue that is kept there."""
    return [job.name for job in Queue(DurableFile(folder / "queue.json")).jobs]


def test_a_state_folder_that_is_moved_away_is_written_nowhere_else(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """By its name alone the queue of one daemon was written over that of another, which had begun at that place."""
    place, record = tmp_path / "state", tmp_path / "sine.mcap"
    record.write_bytes(b"record")
    ours = StateFolder(place)
    queue, ledger = Queue(ours.file(place / "queue.json")), Ledger(ours.file(place / "records.jsonl"))
    operating = OperatingTime(ours.file(place / "operating_time.json"))
    queue.add(Path("/sweep.yaml"), "ours", 1, 1.0, 0.0)
    assert not ours.came_back()
    away = place.rename(tmp_path / "away")
    for _ in range(2):
        assert not ours.came_back()
    assert len(caplog.records) == 1, "said once"
    with pytest.raises(StateError, match="another daemon is running with this state folder"):
        StateFolder(away)
    theirs = StateFolder(place)
    Queue(theirs.file(place / "queue.json")).add(Path("/sweep.yaml"), "theirs", 1, 1.0, 0.0)
    before = {file.name for file in place.iterdir()}
    for write in (queue.save, operating.save, partial(ledger.add, record), partial(ledger.forget, [])):
        with pytest.raises(RigError, match=f"{place}: the daemon's state folder was moved, or its disk taken away"):
            write()
    assert (queued(place), {file.name for file in place.iterdir()}) == (["theirs"], before)
    theirs.close()
    place.rename(tmp_path / "theirs")
    away.rename(place)
    assert ours.came_back()
    assert not ours.came_back()
    ledger.add(record)
    queue.add(Path("/sweep.yaml"), "more", 1, 1.0, 0.0)
    assert queued(place) == ["ours", "more"]
    ours.close()


def test_a_state_folder_that_is_removed_is_made_anew_for_the_same_daemon(tmp_path: Path) -> None:
    place = tmp_path / "state"
    ours = StateFolder(place)
    queue = Queue(ours.file(place / "queue.json"))
    queue.add(Path("/sweep.yaml"), "ours", 1, 1.0, 0.0)
    shutil.rmtree(place)
    queue.save()
    assert queued(place) == ["ours"]
    assert stat.S_IMODE(place.stat().st_mode) & 0o077 == stat.S_IMODE(socket_access.OWN_MODE) & 0o077
    with pytest.raises(StateError, match="another daemon is running with this state folder"):
        StateFolder(place)
    assert ours.came_back(), "whatever else is to be kept"
    shutil.rmtree(place)
    theirs = StateFolder(place)
    with pytest.raises(RigError, match=r"was removed, and cannot be made anew: .* another daemon is running"):
        queue.save()
    assert not (place / "queue.json").exists()
    theirs.close()
    ours.close()
    StateFolder(place).close()


def test_every_file_and_folder_of_the_settings_is_found_from_anywhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The socket was made anew in the root folder, and the page's second process found no model."""
    monkeypatch.chdir(tmp_path)
    given = Web(token_file=Path("a"), sweeps=[Path("b"), Path("/c")], model=Path("d"))
    settings = DaemonSettings(
        Path("s"), "", Path("l"), Path("t"), metrics=Path("m"), web=given, view=View(token_file=Path("v"))
    ).in_place()
    placed = (settings.socket, settings.logs, settings.state, settings.metrics, settings.view.token_file)
    assert placed == tuple(tmp_path / name for name in ("s", "l", "t", "m", "v"))
    assert (settings.web.token_file, settings.web.model) == (tmp_path / "a", tmp_path / "d")
    assert settings.web.sweeps == [tmp_path / "b", Path("/c")]
    assert DaemonSettings(socket=Path("/s"), state=Path("/t")).in_place().metrics is None


def test_the_rig_is_found_from_anywhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where its folder was removed no reset found the model beside it any more."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rig.yaml").write_text(
        shipped.default_rig().read_text().replace("../models/simulated.yaml", "simulated")
    )
    loaded: list[RigConfig] = []

    def daemon_of(parts: SessionParts, _: DaemonSettings) -> Daemon:
        loaded.append(parts.rig)
        raise StateError("seen")

    monkeypatch.setattr("rig.service.daemon.Daemon", daemon_of)
    with pytest.raises(StateError, match="seen"):
        cli.main(["daemon", "--rig", "rig.yaml", "--web", "off"], standalone_mode=False)
    with pytest.raises(StateError, match="seen"):
        cli.main(["daemon", "--rig", "simulated", "--web", "off"], standalone_mode=False)
    assert [rig.path for rig in loaded] == [tmp_path / "rig.yaml", shipped.default_rig()]


def test_the_folder_that_a_daemon_was_started_in_may_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With `logs` beside it, as by default, every status was an error of the daemon's, and no session began anew."""
    here, state = tmp_path / "here", tmp_path / "state"
    here.mkdir()
    monkeypatch.chdir(here)
    settings = DaemonSettings(logs=Path("logs"), state=state, socket=Path("../s.sock"), web=Web(on=False))
    daemon = Daemon(parts_of(compose.load(None), virtual=True), settings)
    monkeypatch.setattr(SessionMonitor, "open", lambda _: None)
    monkeypatch.setattr(Planner, "warm", lambda _: asyncio.sleep(0))

    async def without_it() -> dict[str, Any]:
        serving = asyncio.ensure_future(daemon.serve())
        while not (tmp_path / "s.sock").exists():
            await asyncio.sleep(0.001)
        (here / "logs").rmdir()
        here.rmdir()
        while not (status := daemon.status(None))["recording_error"]:
            await asyncio.sleep(0.001)
        (tmp_path / "s.sock").unlink()
        while not (tmp_path / "s.sock").exists():
            await asyncio.sleep(0.001)
        daemon.end()
        await serving
        return status

    status = asyncio.run(asyncio.wait_for(without_it(), 20.0))
    assert status["logs"] == f"{here}/logs"
    assert status["recording_error"] == f"{here}/logs: the folder for the records is gone"
    assert status["disk_free_gb"] is None

    assert not (tmp_path / "s.sock").exists(), "a daemon that ends takes its socket along"
    process = multiprocessing.get_context("spawn").Process(target=os.getpid)
    start_process(process)
    process.join()
    assert process.exitcode == 0

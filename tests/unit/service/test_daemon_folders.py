"""What a daemon holds its folders to before it works with them."""

import asyncio
import multiprocessing
import os
from pathlib import Path
from typing import Any

import pytest

from rig.app import compose, shipped
from rig.app.supervise import parts_of
from rig.cli.commands import cli
from rig.errors import StateError
from rig.rig_config import RigConfig
from rig.service.daemon import Daemon
from rig.service.processes import start_process
from rig.service.queue.planner import Planner
from rig.service.session.session_monitor import SessionMonitor
from rig.service.session.session_parts import SessionParts
from rig.service.settings import DaemonSettings, View, Web


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

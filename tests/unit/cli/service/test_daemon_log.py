"""The daemon's log on standard error: names in it move no cursor and make no lines of their own."""

import logging
from pathlib import Path

import pytest
from click.testing import CliRunner

from rig.cli.service.daemon import daemon

NAME = "\x1b[31mred\nINFO armed"


class Talking:
    """In place of the daemon: says one line and ends."""

    def __init__(self, *_: object) -> None:
        pass

    async def serve(self) -> None:
        logging.getLogger("pamrig").warning("rig %s", NAME)


def test_a_rig_s_name_is_spelled_out_in_the_log(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("rig.service.daemon.Daemon", Talking)
    monkeypatch.setattr(logging.getLogger(), "handlers", [])  # a library may have left one that writes elsewhere
    done = CliRunner().invoke(daemon, ["--state", str(tmp_path), "--web", "off"])
    assert done.exit_code == 0, done.output
    said = [line for line in done.stderr.splitlines() if "WARNING" in line]
    assert len(said) == len(done.stderr.splitlines()) == 1
    assert said[0].endswith(r" WARNING rig \x1b[31mred\nINFO armed")
    assert logging.getLogger().handlers == [], "it leaves none behind"

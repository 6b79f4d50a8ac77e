"""Who goes on with a rig that was left unsafe: an heir, his successor, and when he ends."""

import threading
from types import SimpleNamespace
from typing import Any

import pytest
from support.rigs.fieldbus_rigs import soon

from rig.errors import RigError
from rig.realtime.safe_state import SecondPath
from rig.service.session.left_unsafe import LeftUnsafe


def test_an_heir_that_is_lost_has_a_successor_and_one_that_cannot_be_had_is_told_of_once(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Killed before the daemon, and the daemon after it: nobody was left who tried."""
    heirs = [SimpleNamespace(alive=True, end=lambda: None, release=lambda: None) for _ in range(2)]
    asked: list[object] = []

    def appoint() -> Any:
        asked.append(None)
        if len(asked) > len(heirs):
            raise RigError("no memory")
        return heirs[len(asked) - 1]

    attempts: list[object] = []
    left = LeftUnsafe(appoint)
    left.owe()
    left.begin(lambda: SecondPath(lambda: attempts.append(None), lambda: False), lambda: "")
    try:
        for lost, heir in enumerate(heirs, 1):
            assert soon(lambda: len(asked) == lost)  # noqa: B023 (asked before the next)
            heir.alive = False
        assert soon(lambda: "no memory" in caplog.text)
        tried = len(attempts)
        assert soon(lambda: len(attempts) > tried + 2)
        assert len(asked) == len(heirs) + 1
    finally:
        left.end()


def test_an_heir_who_is_being_appointed_when_nothing_is_owed_any_more_ends_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a busy machine his process was there for as long as the daemon."""
    monkeypatch.setattr("rig.service.session.left_unsafe._LET_GO_S", 0.0)
    appointing, go, told = threading.Event(), threading.Event(), list[str]()
    heir = SimpleNamespace(alive=True, end=lambda: told.append("ended"), release=lambda: None)

    def appoint() -> Any:
        appointing.set()
        assert go.wait(10.0)
        return heir

    left = LeftUnsafe(appoint)
    left.owe()
    left.begin(lambda: SecondPath(lambda: None, lambda: False), lambda: "")
    assert appointing.wait(10.0)
    ending = threading.Thread(target=left.end)
    ending.start()
    ending.join(0.1)
    go.set()
    ending.join()
    assert soon(lambda: told == ["ended"])

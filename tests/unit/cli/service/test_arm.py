"""`pamrig arm`: who arms is told as the kernel knows him."""

import pwd
from typing import Any

import pytest
from click.testing import CliRunner

from rig.cli.service.daemon import arm
from rig.service import client


class Heard:
    """In a client's place: keeps who armed."""

    by = ""

    def __init__(self, _: Any) -> None: ...

    def __enter__(self) -> "Heard":
        return self

    def __exit__(self, *_: object) -> None: ...

    def arm(self, by: str) -> list[str]:
        Heard.by = by
        return []


def test_a_user_without_a_name_arms_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a container whose users nobody has named it ended in a traceback."""

    def unknown(uid: int) -> None:
        raise KeyError(f"getpwuid(): uid not found: {uid}")

    monkeypatch.setattr(client, "Client", Heard)
    monkeypatch.setattr(pwd, "getpwuid", unknown)
    monkeypatch.setattr("os.getuid", lambda: 12345)
    for name in ("LOGNAME", "USER", "LNAME", "USERNAME"):
        monkeypatch.delenv(name, raising=False)
    done = CliRunner().invoke(arm, [])
    assert (done.exception, Heard.by) == (None, "12345, by pamrig arm")


def test_a_name_in_the_environment_is_nobody_s(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(client, "Client", Heard)
    monkeypatch.setenv("LOGNAME", "somebody\nelse")
    assert CliRunner().invoke(arm, []).exception is None
    assert "somebody" not in Heard.by

"""Who makes safe in the place of a lost process, and who drives the same wire next."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rig.app import wire_locks
from rig.errors import DeviceLost
from rig.realtime.safe_report import Outcome
from rig.realtime.safe_state import SecondPath, insist, write_and_look

ATTEMPT = """
import os, sys
from rig.app import wire_locks
wire_locks.TABLE = {table!r}
with wire_locks.making_safe(["a"], 1, watcher={watcher}):
    print("announced", flush=True)
    sys.stdin.readline()
print("written", flush=True)
"""
NOBODY = 1


@pytest.fixture(autouse=True)
def own_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wire_locks, "TABLE", f"pamrigwire-{os.getpid()}-{tmp_path.name}")
    monkeypatch.setattr(wire_locks, "ATTEMPT_S", 0.2)
    monkeypatch.setattr(wire_locks, "GONE_S", 0.2)


@contextmanager
def attempting(*, watcher: bool = True) -> Iterator["subprocess.Popen[str]"]:
    """A process in the middle of an attempt: it writes when its input says so."""
    code = ATTEMPT.format(table=wire_locks.TABLE, watcher=watcher)
    process = subprocess.Popen([sys.executable, "-c", code], stdin=-1, stdout=-1, text=True)
    assert process.stdout
    assert process.stdout.readline() == "announced\n"
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def claimed(wires: list[str], commander: int, written: list[str]) -> SecondPath:
    """A way to a device on these wires, in the place of a lost process of the commander's."""
    return SecondPath(
        lambda: written.append("safe"), lambda: True, claim=lambda: wire_locks.making_safe(wires, commander)
    )  # fmt: skip


def test_who_takes_a_wire_waits_for_the_attempt_that_is_under_way(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wire_locks, "ATTEMPT_S", 60.0)
    with attempting() as other:
        waits: list[float] = []

        def sleep(seconds: float) -> None:
            waits.append(seconds)
            if len(waits) == 3:
                assert other.stdin
                assert other.stdout
                other.stdin.write("write\n")
                other.stdin.flush()
                assert other.stdout.readline() == "written\n"

        monkeypatch.setattr("time.sleep", sleep)
        with wire_locks.held(["a"]):
            assert len(waits) == 3
            assert other.wait() == 0


def test_a_watcher_that_was_stopped_in_the_middle_of_it_never_comes_to_write() -> None:
    """Continued in the sweep of a new daemon it wrote the safe set-points there."""
    with attempting() as other:
        other.send_signal(signal.SIGSTOP)
        os.waitpid(other.pid, os.WUNTRACED)
        with wire_locks.held(["a"]):
            assert other.wait(5.0) == -signal.SIGKILL


def test_one_that_comes_to_no_end_is_ended_too() -> None:
    with attempting() as other, wire_locks.held(["a"]):
        assert other.wait(5.0) == -signal.SIGKILL


def test_one_that_is_ended_has_its_time_to_go_where_the_machine_stood_still_before(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It was ended and named in one look, as one that cannot be ended."""
    pause, stood_s = time.sleep, [0.0]

    def sleep(seconds: float) -> None:
        pause(seconds)
        stood_s[0] = wire_locks.ATTEMPT_S + wire_locks.GONE_S + 1.0

    with attempting() as other:
        monkeypatch.setattr("time.sleep", sleep)
        monkeypatch.setattr("time.monotonic", lambda: stood_s[0])
        with wire_locks.held(["a"]):
            monkeypatch.undo()
            assert other.wait(5.0) == -signal.SIGKILL


def test_a_process_that_commands_is_not_ended_but_named() -> None:
    with attempting(watcher=False) as other:
        with pytest.raises(DeviceLost, match=f"a: is being made safe by process {other.pid} .*; end that first"):
            wire_locks.hold(["a"])
        assert other.poll() is None
        assert wire_locks.who_drives(["a"]) == "", "nothing was taken"


def test_a_name_that_somebody_forged_ends_nobody() -> None:
    with attempting() as victim:
        word = f"{wire_locks._name_of('b')} safe by watcher 0 {victim.pid}"  # noqa: SLF001  # as another program may
        forged = wire_locks._bind(word)  # noqa: SLF001
        with pytest.raises(DeviceLost, match="is being made safe by"):
            wire_locks.hold(["b"])
        os.close(forged)
        assert victim.poll() is None


def test_beside_somebody_else_who_drives_nothing_is_written_in_another_s_place() -> None:
    written: list[str] = []
    lost = claimed(["a", "b"], NOBODY, written)
    with wire_locks.held(["b"]):
        assert write_and_look(lost) is Outcome.FAILED
        assert not written
        own = claimed(["a", "b"], os.getpid(), written)
        assert write_and_look(own) is Outcome.SEEN, "its own loop, which hangs or is on its way out"
        assert insist(lost, 0.0) is Outcome.SEEN, "an operator's word"
    assert write_and_look(lost) is Outcome.SEEN
    assert len(written) == 3


def test_where_nobody_says_who_drives_it_is_written() -> None:
    """Its own loop, of a machine that gave no descriptor for a second name, may be the one."""
    written: list[str] = []
    held = wire_locks.hold(["a"])
    os.close(held.pop())
    assert write_and_look(claimed(["a"], NOBODY, written)) is Outcome.SEEN
    assert written == ["safe"]
    os.close(held.pop())


def test_a_machine_that_gives_no_descriptor_keeps_nobody_from_making_safe(monkeypatch: pytest.MonkeyPatch) -> None:
    def none_left(*_: object) -> None:
        raise OSError(24, "Too many open files")

    written: list[str] = []
    monkeypatch.setattr(wire_locks.socket, "socket", none_left)
    assert write_and_look(claimed(["a"], NOBODY, written)) is Outcome.SEEN
    assert written == ["safe"]

"""The monitor of one rig before its session is open: a clear answer, not a bug of the daemon."""

import asyncio
import errno
import gc
import os
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from support.rigs.fieldbus_rigs import soon

from rig.app.compose import load
from rig.app.shipped import find_config
from rig.app.supervise import parts_of
from rig.errors import DeviceError, StateError
from rig.realtime.faults import Fault
from rig.realtime.ring import Ring
from rig.realtime.safe_report import Outcome, SafeReport, Writer
from rig.realtime.safe_state import SecondPath
from rig.realtime.shared import folder, living_owner
from rig.realtime.state import Event, State
from rig.service.connections.protocol import Refused
from rig.service.session.session import Watching
from rig.service.session.session_end import SessionEnd
from rig.service.session.session_monitor import SessionMonitor


def test_arm_before_the_rig_is_open_says_to_try_again() -> None:
    monitor = SessionMonitor(cast(Any, None))
    with pytest.raises(Refused, match="still being opened; try again in a second"):
        asyncio.run(monitor.arm())


def test_a_reset_without_a_session_says_to_try_again() -> None:
    monitor = SessionMonitor(cast(Any, None))
    with pytest.raises(Refused, match="still being opened; try again in a second"):
        asyncio.run(monitor.clear_fault(0))


def test_a_rig_that_was_never_open_is_not_called_safe() -> None:
    assert "was not open" in SessionMonitor(cast(Any, None)).close()


def test_a_file_that_the_device_needs_is_the_device_s_fault_not_the_loop_s() -> None:
    rig = load(find_config(Path("paper_myrio"), "rigs"))
    monitor = SessionMonitor(parts_of(rig))
    monitor.open()
    assert (monitor.fault, monitor.state) == (Fault.DEVICE_LOST, State.FAULT)
    assert f"{rig.path}: devices.myrio.bitfile: " in monitor.message
    assert "bitfiles/myRIO-1900.lvbitx: the bitfile cannot be read" in monitor.message


@pytest.mark.parametrize("before", [True, False])
def test_an_emergency_stop_before_the_rig_is_open_holds_when_it_is(before: bool) -> None:
    """It was answered by the safe state, and forgotten: the rig came up disarmed, to be armed at once."""
    monitor = SessionMonitor(parts_of(load(None), virtual=True))

    def stopped() -> bool:
        monitor.check()
        return monitor.fault is Fault.ESTOP

    def cleared() -> bool:
        try:
            asyncio.run(monitor.clear_fault(monitor.estops))
        except Refused:
            return False
        return True

    with ThreadPoolExecutor(1) as starter:  # the loop is told when its maker's thread dies
        if before:
            monitor.begin_estop()
        opened = starter.submit(monitor.open)
        monitor.begin_estop()
        opened.result()
        try:
            assert soon(stopped)
            with pytest.raises(Refused, match="emergency stop"):
                asyncio.run(monitor.clear_fault(0))
            assert soon(cleared), "the safe state may not be written yet"
            assert soon(lambda: not stopped())
        finally:
            monitor.close()


def test_a_status_may_be_asked_for_while_a_session_ends() -> None:
    """A reset unmapped the ring under it: the answer was an error of the daemon, and one with metrics ended."""
    monitor = SessionMonitor(parts_of(load(None), virtual=True))
    monitor.open()

    def ticked() -> bool:
        monitor.check()
        return monitor.telemetry is not None and monitor.telemetry.ticks > 0

    assert soon(ticked)
    monitor.close()
    assert monitor.telemetry is not None
    assert monitor.telemetry.to_json()["ticks"] > 0


def test_sessions_that_ended_leave_no_memory_behind() -> None:
    monitor = SessionMonitor(parts_of(load(None), virtual=True))
    monitor.open()
    for _ in range(2):
        monitor.reopen(0)
    monitor.close()
    del monitor
    gc.collect()
    assert "-daemon-ring" not in Path("/proc/self/maps").read_text()


def refuse_memory(*_: object) -> Ring:
    raise StateError("/dev/shm/pamrig-x: cannot be made: No space left on device")


def refuse_processes() -> str:
    raise OSError(errno.EAGAIN, "Resource temporarily unavailable")


@pytest.mark.parametrize("lacks", ["memory", "processes"])
def test_a_machine_that_gives_no_new_session_leaves_the_fault_and_a_way_out(
    lacks: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A reset that met a full /dev/shm or no free process left a daemon that called the rig disarmed, without a fault
    and without a loop, and that no reset was allowed for any more."""
    parts = parts_of(load(None), virtual=True)
    if lacks == "memory":
        monkeypatch.setattr(Ring, "create", refuse_memory)
    else:
        parts = replace(parts, driver=refuse_processes)
    monitor = SessionMonitor(parts)
    monitor.reopen(0)
    assert (monitor.fault, monitor.state) == (Fault.LOOP_DIED, State.FAULT)
    told = {
        "memory": "/dev/shm/pamrig-x: cannot be made: No space left on device",
        "processes": "this machine gives no process, descriptor or memory for it: Resource temporarily unavailable",
    }
    assert monitor.message == told[lacks]
    monitor.require(Event.RESET)
    assert not [path for path in folder().glob("pamrig-*") if living_owner(path) == os.getpid()]


def test_a_fault_stands_while_a_reset_opens_the_rig_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """The status said that the rig was disarmed and had no fault."""
    parts, seen = parts_of(load(None), virtual=True), []
    monitor = SessionMonitor(replace(parts, driver=lambda: seen.append((monitor.state, monitor.fault)) or ""))
    monitor.open()
    monitor.begin_estop()

    def stopped() -> bool:
        monitor.check()
        return monitor.fault is Fault.ESTOP

    assert soon(stopped)
    seen.clear()
    monitor.reopen(monitor.estops)
    monitor.close()
    assert set(seen) == {(State.FAULT, Fault.ESTOP)}


def test_an_emergency_stop_without_a_loop_waits_for_no_disk() -> None:
    """Commands that write the queue, on a disk that stood still, had every thread that it needed."""
    written, disk = list[str](), threading.Event()
    path = SecondPath(lambda: written.append("safe"), lambda: True)
    parts = replace(parts_of(load(None), virtual=True), watching=Watching(lambda *_: None, (), lambda: path))

    async def stop() -> SafeReport:
        loop = asyncio.get_running_loop()
        loop.set_default_executor(ThreadPoolExecutor(1))
        waits = loop.run_in_executor(None, disk.wait, 30.0)
        try:
            return await asyncio.wait_for(SessionMonitor(parts).estop(), 10.0)
        finally:
            disk.set()
            await waits

    assert asyncio.run(stop()).outcome is Outcome.SEEN
    assert written


def test_a_rig_that_was_left_unsafe_is_made_safe_also_after_a_reset_that_could_not_open_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The reset ended the session of a device that was away, and with it all who tried to make it safe: the old
    set-points stood when it was back."""
    device = SimpleNamespace(back=False, asked=0, closed=0)

    def safe() -> None:
        device.asked += 1
        if not device.back:
            raise DeviceError("no answer")

    def close() -> None:
        device.closed += 1

    path = SecondPath(safe, lambda: device.back, close)
    driving: list[str] = []
    parts = replace(
        parts_of(load(None)),
        watching=Watching(cast(Any, None), (), lambda: path),
        driver=lambda: driving[-1] if driving else "",
    )
    monkeypatch.setattr("rig.service.session.session_monitor.Session", no_answer)
    monitor = SessionMonitor(parts)
    failed = SafeReport(Writer.GUARDIAN, outcome=Outcome.FAILED)
    monitor.session = cast(
        Any,
        SimpleNamespace(watch=None, loop_alive=False, close=lambda *_: [], end=SessionEnd(True, failed), ring=None),
    )
    monitor.reopen(0)
    assert monitor.session is None
    assert soon(lambda: device.asked > 2)
    assert monitor.safe is not None
    assert monitor.safe.words.startswith("NOT SAFE as far as is known: the commanding process could not")
    monitor.reopen(0)  # once more, as one does
    asked = device.asked
    assert soon(lambda: device.asked > asked)
    driving.append("it is driven by process 12")
    assert soon(lambda: not asked_meanwhile(device)), "its set-points are his"
    driving.clear()
    device.back = True
    assert soon(lambda: monitor.safe is not None and monitor.safe.outcome is Outcome.SEEN)
    assert monitor.close() == "safe state written by the commanding process, seen at the device"
    assert device.closed == 2


def test_a_reset_in_vain_leaves_somebody_who_goes_on_without_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Who watched the session was released, and nobody was left when the daemon was killed while it tried."""
    told: list[str] = []
    heir = SimpleNamespace(
        alive=True,
        await_ready=lambda _: told.append("ready"),
        await_quiet=lambda: told.append("quiet"),
        release=lambda: None,
        end=lambda: told.append("ended"),
    )

    def appoint() -> Any:
        told.append("appointed")
        return heir

    def close(_: object, insist: Callable[..., str] | None = None) -> list[object]:
        if insist is not None:
            insist(lambda: False, lambda: None)
        told.append("watchers released")
        return []

    def opens(*_: object, **__: object) -> None:
        told.append("opens")
        raise DeviceError("no answer")

    path = SecondPath(lambda: opens(), lambda: False)
    monkeypatch.setattr("rig.service.session.session_monitor.Session", opens)
    watching = Watching(cast(Any, None), (), lambda: path, appoint)
    monitor = SessionMonitor(replace(parts_of(load(None)), watching=watching, driver=lambda: "another"))
    failed = SafeReport(Writer.GUARDIAN, outcome=Outcome.FAILED)
    monitor.session = cast(
        Any, SimpleNamespace(watch=None, loop_alive=False, close=close, end=SessionEnd(True, failed), ring=None)
    )
    monitor.reopen(0)
    assert told == ["appointed", "ready", "watchers released", "quiet", "opens"]
    monitor.reopen(0)
    monitor.close()
    assert told[5:] == ["quiet", "opens", "quiet", "ended"]


def test_while_a_session_is_closed_for_a_reset_its_own_words_stand(monkeypatch: pytest.MonkeyPatch) -> None:
    """The status said that the device could not be opened and that nobody wrote to it, while its supervisor did."""
    failed, said = SafeReport(Writer.SUPERVISOR, outcome=Outcome.FAILED), list[str]()
    monkeypatch.setattr("rig.service.session.session_monitor.Session", no_answer)
    path = SecondPath(lambda: no_answer(), lambda: False)
    watching = Watching(cast(Any, None), (), lambda: path)
    monitor = SessionMonitor(replace(parts_of(load(None)), watching=watching, driver=lambda: ""))

    def close(*_: object) -> list[object]:
        said.append(monitor.safe.words if monitor.safe is not None else "")
        return []

    watch = SimpleNamespace(safe=failed, how_it_ended=lambda: "")
    monitor.session = cast(
        Any,
        SimpleNamespace(watch=watch, loop_alive=False, close=close, end=SessionEnd(True, failed), ring=None),
    )
    monitor.reopen(0)
    monitor.close()
    assert said == [failed.words]


def asked_meanwhile(device: SimpleNamespace) -> bool:
    before = device.asked
    time.sleep(0.25)
    return bool(device.asked != before)


def no_answer(*_: object, **__: object) -> None:
    raise DeviceError("no answer")


class Away:
    """A device that takes the safe state once it is back; and the parts of a rig that hangs on it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.back, self.asked = False, 0
        monkeypatch.setattr("rig.service.session.session_monitor.Session", no_answer)
        monkeypatch.setattr("rig.service.session.emergency_stop.ESTOP_PATIENCE_S", 0.05)
        path = SecondPath(self.safe, lambda: True)
        self.parts = replace(
            parts_of(load(None)), watching=Watching(cast(Any, None), (), lambda: path), driver=lambda: ""
        )

    def safe(self) -> None:
        self.asked += 1
        if not self.back:
            raise DeviceError("no answer")


def test_a_device_that_could_never_be_opened_is_called_unknown_and_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """It was "nobody has reported the safe state yet", as of a rig for which somebody tries."""
    device = Away(monkeypatch)
    monitor = SessionMonitor(device.parts)
    monitor.open()
    assert monitor.safe is not None
    assert (monitor.safe.outcome, monitor.safe.safe) == (Outcome.UNOPENED, False)
    assert monitor.safe.words.startswith("NOT SAFE as far as is known: the device could not be opened")
    assert "nobody writes to it before a reset" in monitor.safe.words
    assert not asked_meanwhile(cast(Any, device))
    assert "was not open" in monitor.close()


def test_an_emergency_stop_of_a_device_that_could_not_be_opened_is_tried_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """It was refused after three seconds, and old set-points stood when the device was back."""
    device = Away(monkeypatch)
    monitor = SessionMonitor(device.parts)
    monitor.open()
    for _ in range(2):
        with pytest.raises(
            Refused, match=r"not carried out: there is no loop, and no answer; .*The safe state is written as soon as"
        ):
            asyncio.run(monitor.estop())
    assert monitor.safe is not None
    assert monitor.safe.outcome is Outcome.FAILED
    asked = device.asked
    assert soon(lambda: device.asked > asked)
    monitor.reopen(monitor.estops)
    asked = device.asked
    assert soon(lambda: device.asked > asked), "a reset in vain leaves somebody who tries"
    device.back = True
    assert soon(lambda: monitor.safe is not None and monitor.safe.outcome is Outcome.SEEN)
    assert not asked_meanwhile(cast(Any, device))
    assert monitor.close() == "safe state written by the commanding process, seen at the device"


def test_a_safe_state_that_was_seen_is_doubted_once_the_device_does_not_open(monkeypatch: pytest.MonkeyPatch) -> None:
    """A device that was lost, made safe when it was back, and switched off after that stayed "seen at the device"
    beside a reset that did not find it; what stood there when it was back was nobody's business."""
    device = Away(monkeypatch)
    monitor = SessionMonitor(device.parts)
    seen = SafeReport(Writer.LOOP, outcome=Outcome.SEEN, written_ns=1, confirmed_ns=1)
    monitor.session = cast(
        Any,
        SimpleNamespace(watch=None, loop_alive=False, close=lambda *_: [], end=SessionEnd(True, seen), ring=None),
    )
    monitor.reopen(0)
    assert monitor.safe is not None
    assert not monitor.safe.safe
    assert soon(lambda: device.asked > 2)
    device.back = True
    assert soon(lambda: monitor.safe is not None and monitor.safe.outcome is Outcome.SEEN)
    monitor.close()


def test_an_emergency_stop_that_nobody_carried_out_is_not_told_by_what_was_seen_before_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It was "not carried out: safe state written by the guardian, seen at the device"."""
    monkeypatch.setattr("rig.service.session.emergency_stop.ESTOP_PATIENCE_S", 0.02)
    seen = SafeReport(Writer.GUARDIAN, outcome=Outcome.SEEN, written_ns=1, confirmed_ns=1)
    watch = SimpleNamespace(answer=SafeReport(), safe=seen, demand=lambda _: None, follow_up=lambda: None)
    monitor = SessionMonitor(parts_of(load(None)))
    monitor.session = cast(Any, SimpleNamespace(watch=watch, loop_alive=False))
    with pytest.raises(Refused, match="nobody could write the safe state anew; known from before: safe state written"):
        asyncio.run(monitor.estop())

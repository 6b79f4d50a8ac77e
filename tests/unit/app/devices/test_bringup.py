"""A device without a loop is left safe, whatever comes on the way out."""

import contextlib
import math
import re
import signal
import threading
import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from rig.app.devices import bringup
from rig.app.devices.bringup import LETTING_GO_NS, DeviceTicker
from rig.errors import DeviceLost, RigError
from rig.interfaces import Measurement
from rig.sample import BROKEN_WIRE, SUSPECT

SAFE_MPA = (0.2, 0.2)


class Pressed:
    """A device; while it is being made safe for the first time somebody presses Ctrl-C, or sends that signal."""

    def __init__(self, number: signal.Signals = signal.SIGINT) -> None:
        self.number = number
        self.is_safe = self.struck = self.is_open = False

    def open(self) -> dict[str, str]:
        self.is_open = True
        return {}

    def read(self) -> Measurement:
        return Measurement()

    def write(self, *_: float) -> None:
        self.is_safe = False

    def safe(self) -> None:
        if not self.struck:
            self.struck = True
            signal.raise_signal(self.number)
        self.is_safe = True

    def close(self) -> None:
        self.is_open = False


class Above:
    """Who stands above the command, and is let go at its end."""

    def __init__(self, device: Pressed) -> None:
        self._device = device
        self.let_go_of_a_safe_rig: bool | None = None

    def beat(self, ahead_ns: int = 0) -> None:
        pass

    def trouble(self) -> str:
        return ""

    def start(self) -> None:
        pass

    def end(self) -> None:
        self.let_go_of_a_safe_rig = self._device.is_safe


def held(device: Any, above: Any = None, *, given_up: bool = False) -> None:
    """The device is held, and let go; `given_up`: by Ctrl-C."""
    with DeviceTicker(device, 5_000_000, SAFE_MPA, above) as ticker:
        ticker.go_to(*SAFE_MPA)
        if given_up:
            raise KeyboardInterrupt


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_second_ctrl_c_does_not_keep_the_rig_from_its_safe_state(number: signal.Signals) -> None:
    """Those above the command were told that the rig was safe and let it be; the old set-points stood."""
    device = Pressed(number)
    above, before = Above(device), signal.getsignal(number)
    with pytest.raises(KeyboardInterrupt):
        held(device, above, given_up=True)
    assert device.struck
    assert (device.is_safe, above.let_go_of_a_safe_rig, device.is_open) == (True, True, False)
    assert signal.getsignal(number) is before


def test_those_above_are_let_go_after_the_device(monkeypatch: pytest.MonkeyPatch) -> None:
    """A command that was killed between the two left a module whose watchdog went on, and nobody who looked: 0 MPa half
    a second later. And it was waited for their end, while nobody fed it."""
    device, order = Pressed(), list[str]()
    above = Above(device)
    monkeypatch.setattr(device, "close", lambda: order.append("device"))
    monkeypatch.setattr(above, "beat", lambda ahead_ns=0: order.append("beat") if ahead_ns == LETTING_GO_NS else None)
    monkeypatch.setattr(above, "end", lambda: order.append("those above"))
    with contextlib.suppress(KeyboardInterrupt):
        held(device, above)
    assert order == ["beat", "device", "those above"]


def test_a_ctrl_c_on_the_way_out_is_heard_after_it() -> None:
    device = Pressed()
    with pytest.raises(KeyboardInterrupt):
        held(device)
    assert (device.is_safe, device.is_open) == (True, False)


class Watched(Pressed):
    """A device with a watchdog of its own, which each reading feeds."""

    def __init__(self) -> None:
        super().__init__()
        self.struck, self.fed = True, threading.Event()

    def read(self) -> Measurement:
        self.fed.set()
        return super().read()


class SlowAbove(Above):
    """Whose start takes longer than that watchdog waits; or fails then."""

    def __init__(self, device: Watched, fails: bool) -> None:
        super().__init__(device)
        self._watched, self._fails = device, fails
        self.fed_meanwhile = False

    def start(self) -> None:
        self.fed_meanwhile = self._watched.fed.wait(5.0)
        if self._fails:
            raise RigError("the supervisor's process was not ready")


@pytest.mark.parametrize("fails", [False, True])
def test_a_devices_own_watchdog_is_fed_while_those_above_are_started(fails: bool) -> None:
    """On a machine that took half a second to start two processes it had tripped: no calibration began."""
    device = Watched()
    above, before = SlowAbove(device, fails), threading.active_count()
    with pytest.raises(RigError, match="not ready") if fails else contextlib.nullcontext():
        held(device, above)
    assert above.fed_meanwhile
    assert not device.is_open
    assert above.let_go_of_a_safe_rig is not None, "and let go, or they would go on to watch this process"
    assert threading.active_count() == before


class NotThere(Pressed):
    """A device that does not answer; while it is closed somebody presses Ctrl-C."""

    def open(self) -> dict[str, str]:
        raise DeviceLost("scripted: not there")

    def close(self) -> None:
        signal.raise_signal(self.number)
        super().close()
        self.struck = True


def test_those_above_a_device_that_cannot_be_opened_are_let_go_too() -> None:
    """Their shared memory stayed, and more with each attempt."""
    device = NotThere()
    above = Above(device)
    with pytest.raises(KeyboardInterrupt):
        held(device, above)
    assert device.struck
    assert above.let_go_of_a_safe_rig is not None


@pytest.mark.parametrize("lost", [False, True], ids=["under pressure", "with its device lost"])
def test_the_ticks_end_with_a_command_that_never_came_to_its_way_out(
    lost: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A second signal within microseconds of the first kept it from there: the interpreter waited for those above, they
    for the ticks, which held the set-points for ever."""
    device = Watched()
    with DeviceTicker(device, 5_000_000, SAFE_MPA, Above(device)) as ticker:  # type: ignore[arg-type]
        ticker.go_to(*SAFE_MPA)
        (thread,) = [each for each in threading.enumerate() if each.name == "ticker"]
        if lost:
            monkeypatch.setattr(device, "read", lambda: math.sqrt(-1.0))
        monkeypatch.setattr(threading, "main_thread", lambda: SimpleNamespace(is_alive=bool))
        thread.join(10.0)
        assert not thread.is_alive()
    assert device.is_safe


class Buggy(Pressed):
    """A device whose driver has a bug, which shows once its valves have moved."""

    moved = False

    def write(self, *_: float) -> None:
        self.is_safe, self.moved = False, True

    def read(self) -> Measurement:
        if self.moved:
            raise ZeroDivisionError("division by zero")
        return super().read()

    def safe(self) -> None:
        self.is_safe = True


def test_a_bug_of_a_driver_is_heard_by_who_waits_for_its_ticks(monkeypatch: pytest.MonkeyPatch) -> None:
    """The thread ended without a word, and the command waited for ever with its set-points at the valves."""
    monkeypatch.setattr(bringup, "SLEW_MPA_S", 1e-3)
    device = Buggy()
    with (
        pytest.raises(DeviceLost, match=r"failed by an error of the program: ZeroDivisionError\('division by zero'\)"),
        DeviceTicker(device, 5_000_000, SAFE_MPA) as ticker,
    ):
        ticker.go_to(0.3, 0.3)
    assert (device.is_safe, device.is_open) == (True, False)


class Standing(Pressed):
    """A rig at rest at these pressures; what is written to it is remembered."""

    def __init__(self, p1_mpa: float, p2_mpa: float, flags: int = 0) -> None:
        super().__init__()
        self.struck = True
        self._now = Measurement(p1_mpa, p2_mpa, flags=flags)
        self.written: list[tuple[float, ...]] = []

    def read(self) -> Measurement:
        return self._now

    def write(self, *pressures_mpa: float) -> None:
        self.written.append(pressures_mpa)


@pytest.mark.parametrize(("device", "begins"), [
    (Standing(0.0, 0.1), (0.0, 0.1)), (Standing(0.9, -0.01), (0.3, 0.0)), (Standing(math.nan, 0.1), (0.2, 0.1)),
    (Standing(0.0, 0.1, BROKEN_WIRE), (0.2, 0.2)), (Standing(0.0, 0.1, SUSPECT), (0.2, 0.2)),
], ids=["empty", "beyond", "one monitor", "a broken wire", "suspect"])  # fmt: skip
def test_the_first_set_points_are_the_pressures_that_stand(
    device: Standing, begins: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first ones were the safe pressures, whatever stood there: a rig without air jumped to them."""
    monkeypatch.setattr(bringup, "AVERAGED_S", 0.02)
    monkeypatch.setattr(bringup, "SLEW_MPA_S", 2.0)
    step_mpa = 2.0 * 0.005
    with DeviceTicker(device, 5_000_000, SAFE_MPA) as ticker:
        ticker.go_to(0.3, 0.3)
    assert device.written[0] == pytest.approx(tuple(min(p + step_mpa, 0.3) for p in begins))
    assert device.written[-1] == (0.3, 0.3)


class Away(Pressed):
    """A device that is lost once it was written to, and takes the safe state only when `back` is set; who asks for it
    then may be `struck_by` a signal."""

    def __init__(self) -> None:
        super().__init__()
        self.struck, self.moved = True, False
        self.back = threading.Event()
        self.asked = 0
        self.on_asking: Callable[[int], None] = lambda _: None

    def read(self) -> Measurement:
        if self.moved and not self.back.is_set():
            raise DeviceLost("scripted: gone")
        return super().read()

    def write(self, *_: float) -> None:
        self.moved, self.is_safe = True, False

    def safe(self) -> None:
        self.asked += 1
        self.on_asking(self.asked)
        if not self.back.is_set():
            raise DeviceLost("scripted: gone")
        self.is_safe = True

    def holds_safe(self) -> bool:
        return self.is_safe


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bringup, "MAKE_SAFE_S", 0.05)
    monkeypatch.setattr(bringup, "SLEW_MPA_S", 1e-3)


@pytest.mark.usefixtures("impatient")
def test_a_device_that_comes_back_late_is_made_safe_and_the_last_line_says_so(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """After two seconds the command was over, "NOT SAFE", and the old set-points stood when the device was back."""
    device = Away()
    device.on_asking = lambda count: device.back.set() if count > 30 else None
    with pytest.raises(DeviceLost) as lost, DeviceTicker(device, 5_000_000, SAFE_MPA) as ticker:
        ticker.go_to(0.3, 0.3)
    assert device.is_safe
    said = str(lost.value)
    assert said.startswith("scripted: gone; safe state written by the commanding process, seen at the device")
    assert "NOT SAFE as far as is known: the device does not take the safe state" in capsys.readouterr().err


@pytest.mark.usefixtures("impatient")
def test_ctrl_c_ends_the_trying_with_an_honest_word() -> None:
    device = Away()
    device.on_asking = lambda count: signal.raise_signal(signal.SIGINT) if _is_main() and count > 10 else None
    with pytest.raises(DeviceLost) as lost, DeviceTicker(device, 5_000_000, SAFE_MPA) as ticker:
        ticker.go_to(0.3, 0.3)
    said = str(lost.value)
    assert said.startswith("scripted: gone; NOT SAFE as far as is known: old set-points may stand, open the dump valve")
    assert re.search(r"given up by Ctrl-C or a signal after \d+ s of trying$", said)
    assert not device.is_open


def _is_main() -> bool:
    return threading.current_thread() is threading.main_thread()


def said_soon(capsys: pytest.CaptureFixture[str], words: str) -> bool:
    said, deadline = "", time.monotonic() + 5.0
    while words not in said and time.monotonic() < deadline:
        said += capsys.readouterr().err
        time.sleep(0.001)
    return words in said


@pytest.mark.usefixtures("impatient")
def test_a_device_is_tried_for_as_long_as_somebody_is_asked_for_a_number(capsys: pytest.CaptureFixture[str]) -> None:
    """It was tried for two seconds, and then the old set-points stood under the question."""
    device, heard = Away(), threading.Event()
    with pytest.raises(DeviceLost), DeviceTicker(device, 5_000_000, SAFE_MPA) as ticker:  # noqa: PT012
        with contextlib.suppress(DeviceLost):
            ticker.go_to(0.3, 0.3)
        assert said_soon(capsys, "the safe state is written as soon as the device takes it")
        device.on_asking = lambda _: heard.set()
        device.back.set()
        assert heard.wait(5.0), "the question is still open"
        assert said_soon(capsys, "seen at the device")
        assert device.is_safe
        ticker.wait(1.0)


class Tripping(Watched):
    """A device whose own watchdog takes the outputs elsewhere when it is not fed; `away` for a while if that is set."""

    def __init__(self) -> None:
        super().__init__()
        self.away = threading.Event()
        self.moved, self.made_safe = False, threading.Event()

    def read(self) -> Measurement:
        if self.away.is_set():
            self.is_safe = False
            self.away.clear()
            raise DeviceLost("scripted: gone for a moment")
        return super().read()

    def write(self, *_: float) -> None:
        self.moved, self.is_safe = True, False

    def safe(self) -> None:
        self.is_safe = True
        self.made_safe.set()


class Left(Above):
    """Of whom one is lost as soon as the rig has moved."""

    def trouble(self) -> str:
        return "the guardian's process is gone" if self._device.moved else ""  # type: ignore[attr-defined]


def test_the_safe_state_of_a_command_that_gave_up_stands_for_as_long_as_somebody_is_asked_for_a_number() -> None:
    """Nobody spoke to the module any more: after half a second its watchdog had taken both valves to 0 MPa, under "safe
    state written"."""
    device = Tripping()
    with pytest.raises(DeviceLost), DeviceTicker(device, 5_000_000, SAFE_MPA, Left(device)) as ticker:  # type: ignore[arg-type]  # noqa: PT012
        with contextlib.suppress(DeviceLost):
            ticker.go_to(0.3, 0.3)
        assert device.made_safe.wait(5.0)
        device.fed.clear()
        assert device.fed.wait(5.0), "its watchdog is fed while the question is open"
        device.made_safe.clear()
        device.away.set()
        assert device.made_safe.wait(5.0), "and what it may have lost is written anew"
        ticker.wait(1.0)
    assert device.is_safe


def test_a_rig_that_was_left_by_ctrl_c_is_said_to_be_safe(capsys: pytest.CaptureFixture[str]) -> None:
    device = Away()
    device.back.set()
    with pytest.raises(KeyboardInterrupt):
        held(device, given_up=True)
    assert "safe state written by the commanding process, seen at the device" in capsys.readouterr().err

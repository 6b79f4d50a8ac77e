"""A loop that is told to end, or loses the process that commands, while its device opens."""

import os
import signal
from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import Any

import pytest

from rig.app.loop_process import LoopEnding, NotWanted
from rig.errors import DeviceLost
from rig.realtime.faults import Fault

GONE = 0
"""The process that commands, where it is none of ours any more."""


class Opening:
    """A device that takes its time to open."""

    def __init__(self, meanwhile: Callable[[], None] = lambda: None) -> None:
        self._meanwhile = meanwhile
        self.closed = 0

    def open(self) -> Mapping[str, str]:
        self._meanwhile()
        return {"device": "slow"}

    def close(self) -> None:
        self.closed += 1


@pytest.fixture
def told() -> list[Fault]:
    return []


@pytest.fixture
def loop(told: list[Fault]) -> Any:
    return SimpleNamespace(terminate=told.append)


def test_a_device_that_is_not_wanted_any_more_is_closed_again(loop: Any, told: list[Fault]) -> None:
    """The process ended at once: a Modbus module was left with its watchdog armed, and went to 0 MPa half a second
    later, under "nothing was written to it"."""
    ending = LoopEnding(GONE)
    device = Opening(lambda: ending(signal.SIGTERM, None))
    with pytest.raises(NotWanted) as end:
        ending.opened(device, loop)  # type: ignore[arg-type]
    assert (end.value.number, device.closed, told) == (signal.SIGTERM, 1, [])


def test_a_second_signal_does_not_interrupt_the_closing(loop: Any) -> None:
    ending = LoopEnding(GONE)
    device = Opening(lambda: ending(signal.SIGTERM, None))
    closed = []
    device.close = lambda: (ending(signal.SIGHUP, None), closed.append(True))  # type: ignore[method-assign,assignment,func-returns-value]
    with pytest.raises(NotWanted):
        ending.opened(device, loop)  # type: ignore[arg-type]
    assert closed


def test_before_there_is_a_device_it_ends_at_once() -> None:
    with pytest.raises(NotWanted):
        LoopEnding(GONE)(signal.SIGHUP, None)


@pytest.mark.parametrize(("number", "fault"), [(signal.SIGTERM, Fault.TERMINATED), (signal.SIGHUP, Fault.CONTROL_LOST)])
def test_a_loop_that_has_its_device_leaves_in_good_order(
    number: int, fault: Fault, loop: Any, told: list[Fault]
) -> None:
    ending, device = LoopEnding(GONE), Opening()
    assert ending.opened(device, loop) == {"device": "slow"}  # type: ignore[arg-type]
    ending(number, None)
    assert (told, device.closed) == ([fault], 0)


@pytest.mark.parametrize("opening", [True, False])
def test_a_terminal_that_is_closed_is_for_the_process_that_commands(
    opening: bool, loop: Any, told: list[Fault]
) -> None:
    """Under `nohup` that goes on; the loop ended, with CONTROL_LOST beside a daemon that was there."""
    ending = LoopEnding(os.getppid())
    device = Opening(lambda: ending(signal.SIGHUP, None) if opening else None)
    ending.opened(device, loop)  # type: ignore[arg-type]
    ending(signal.SIGHUP, None)
    assert (told, device.closed) == ([], 0)


def test_a_device_that_does_not_open_says_why(loop: Any) -> None:
    def lost() -> None:
        raise DeviceLost("no such module")

    with pytest.raises(DeviceLost):
        LoopEnding(GONE).opened(Opening(lost), loop)  # type: ignore[arg-type]

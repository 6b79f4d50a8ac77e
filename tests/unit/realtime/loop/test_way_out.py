"""The way out of a loop beside a device that carries the safe state slowly: one deadline, by the clock."""

from dataclasses import dataclass

import pytest
from support.scripted import ListRing, ScriptedClock, ScriptedDevice, ScriptedOperator

from rig.errors import DeviceError, DevicePending
from rig.realtime.loop import Loop, LoopSettings
from rig.realtime.way_out import LEAVING_NS
from rig.rig_config import PERIODS_MS
from rig.service.session.session import END_PATIENCE_S

MS = 1_000_000
FOR_EVER_NS = 10**12
PERIODS = [*PERIODS_MS, 5.0, 20.0]
BLOCKS = {"at once": 0.0, "within half a period": 0.5, "within a period": 1.0}


@dataclass
class SlowWire(ScriptedDevice):
    """Has the safe state on its way for `takes_ns` from the first call on, and notes when it was asked."""

    takes_ns: int = 0
    blocks_ns: int = 0
    """How long each call waits for the wire before it says so."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.clock, self.ring = ScriptedClock(), ListRing()
        self.ring.now_ns = self.clock.now_ns
        self.asked_ns: list[int] = []
        self.unannounced_ns = 0
        """By how much a call ended later than the loop had told its watchers."""
        self.closed_ns = 0

    def safe(self) -> None:
        self.asked_ns.append(self.clock.now_ns())
        left_ns = self.asked_ns[0] + self.takes_ns - self.clock.now_ns()
        self.clock.let_pass(min(self.blocks_ns, max(left_ns, 0)))
        told_ns = self.ring.beaten_ns + self.ring.ahead_ns
        self.unannounced_ns = max(self.unannounced_ns, self.clock.now_ns() - told_ns)
        if self.clock.now_ns() < self.asked_ns[0] + self.takes_ns:
            raise DevicePending("on its way")
        super().safe()

    def close(self) -> None:
        super().close()
        self.closed_ns = self.clock.now_ns()

    def left_after(self, period_ns: int) -> int:
        """Leave as a loop of that period does; how long it took."""
        began_ns = self.clock.now_ns()
        settings = LoopSettings(period_ns=period_ns)
        Loop(self, self.clock, self.ring, ScriptedOperator({}), settings).leave()  # type: ignore[arg-type]
        assert self.closed == 1
        return self.closed_ns - began_ns


@pytest.mark.parametrize("period_ms", PERIODS)
@pytest.mark.parametrize("blocks", BLOCKS.values(), ids=BLOCKS)
def test_who_leaves_waits_until_a_slow_device_is_safe(period_ms: float, blocks: float) -> None:
    """A device that said at once that it would take 20 ms was asked 200 times within 0.24 ms, and closed."""
    period_ns = round(period_ms * MS)
    device = SlowWire(takes_ns=400 * MS, blocks_ns=round(blocks * period_ns))
    took_ns = device.left_after(period_ns)
    assert device.outputs == ["safe"]
    assert device.takes_ns <= took_ns <= device.takes_ns + period_ns
    assert len(device.asked_ns) <= 2 * took_ns / period_ns + 1, "it waits between two attempts"
    assert device.unannounced_ns <= 0
    assert device.ring.ahead_ns == LEAVING_NS, "it may take its time to let go"


@pytest.mark.parametrize("period_ms", PERIODS)
@pytest.mark.parametrize("blocks", BLOCKS.values(), ids=BLOCKS)
def test_who_leaves_waits_for_a_slow_device_no_longer_than_he_may(period_ms: float, blocks: float) -> None:
    """It waited 200 times half a period: 10 s at 100 ms, where the supervisor had ended it after one."""
    period_ns = round(period_ms * MS)
    device = SlowWire(takes_ns=FOR_EVER_NS, blocks_ns=round(blocks * period_ns))
    took_ns = device.left_after(period_ns)
    assert device.outputs == []
    assert LEAVING_NS - 2 * period_ns <= took_ns <= LEAVING_NS + period_ns < END_PATIENCE_S * 1e9
    assert device.unannounced_ns <= 0
    assert device.ring.safe[-1] == "coming"
    assert device.closed_ns >= device.ring.beaten_ns > device.asked_ns[0], "the heart beats to the end"


def test_a_device_that_fails_is_tried_again_a_moment_later_and_left_to_others_soon() -> None:
    period_ns = round(5 * MS)
    device = SlowWire(safes={call: DeviceError("scripted: time-out") for call in range(2)})
    device.left_after(period_ns)
    assert device.outputs == ["safe"]
    assert device.asked_ns[1] - device.asked_ns[0] == period_ns // 2
    device = SlowWire(safes={call: DeviceError("scripted: time-out") for call in range(9)})
    assert device.left_after(period_ns) <= 2 * period_ns
    assert (device.outputs, len(device.asked_ns)) == ([], 3)

"""The myRIO that a tick is rehearsed on: nifpga's own registers, the loop's whole tick, and no device touched."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from support.rigs.myrio_lab import Lab, lab_with

from drivers.mixed import MixedRig
from drivers.myrio.device import MyRio
from hil.emulators.nifpga.bitfile import guarded_personality, personality
from rig.interfaces import DeviceContext, Role
from rig.realtime.clock import VirtualClock
from rig.realtime.loop import LoopSettings
from rig.realtime.rehearsal import Rehearsal
from rig.realtime.state import State


@pytest.fixture(params=["paper", "guarded", "signed"])
def lab(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Lab]:
    registers = {"paper": personality, "guarded": guarded_personality, "signed": lambda: personality("I16")}
    made = lab_with(tmp_path, registers[request.param]())
    yield made
    made.stand_in.close()


@pytest.mark.parametrize("closed", [False, True])
def test_ticks_are_rehearsed_in_a_sweep_without_a_call_to_the_device(lab: Lab, closed: bool) -> None:
    device = lab.device()
    device.open()
    device.write(0.31, 0.09)
    calls, strobes, beside = lab.fpga.calls, lab.fpga.strobes, VirtualClock()
    settings = LoopSettings(safe_p1_mpa=0.2, safe_p2_mpa=0.2)
    twin = device.twin(beside)
    rehearsal = Rehearsal(twin, beside, settings, closed_loop=closed)
    for _ in range(200):
        rehearsal()
    assert not rehearsal.failed
    assert rehearsal.loop.state is State.RUNNING
    shown = twin.read()
    assert shown.flags == 0, "what it shows is plausible"
    assert (shown.p1_mpa, shown.p2_mpa) == pytest.approx((0.2, 0.2), abs=0.005)
    assert abs(shown.angle_deg) < 1.0
    assert (lab.fpga.calls, lab.fpga.strobes) == (calls, strobes)
    device.close()


def test_a_twin_can_be_had_before_the_device_is_open_and_where_nothing_is_connected(lab: Lab) -> None:
    twin = lab.device(resource="RIO7").twin(VirtualClock())
    twin.open()
    assert twin.read().p1_mpa == pytest.approx(0.2, abs=0.005)
    twin.write(0.3, 0.1)
    twin.safe()
    twin.close()


def test_a_mixture_has_a_twin_when_all_of_its_parts_have_one(lab: Lab) -> None:
    def part(*roles: Role) -> MyRio:
        context = DeviceContext(lab.clock, frozenset(roles), 0.2, 0.2)
        return MyRio(lab.settings, context)

    parts = [part(Role.VALVE_1, Role.MONITOR_1, Role.MONITOR_2), part(Role.VALVE_2, Role.ANGLE)]
    twin = MixedRig(parts, lab.clock).twin(VirtualClock())
    assert twin is not None
    twin.open()
    assert abs(twin.read().angle_deg) < 1.0

    class Bare:
        roles = frozenset({Role.ANGLE})

    assert MixedRig([parts[0], Bare()], lab.clock).twin(VirtualClock()) is None  # type: ignore[list-item]

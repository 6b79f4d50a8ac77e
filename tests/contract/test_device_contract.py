"""Every device keeps the promises of rig.interfaces.Device: one suite, all of them, each on its emulator or
stand-in."""

import math
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import pytest
from support.rigs.factories import FACTORIES, SAFE, WITHOUT_PLUG, Bench

from rig.errors import DeviceError, DeviceLost, DevicePending
from rig.interfaces import Device, Measurement, Role
from rig.realtime.clock import VirtualClock
from rig.sample import Flag

REAL: frozenset[str] = frozenset()
"""Whose wires keep real time; the others' clock is turned."""
if find_spec("factories_fieldbus"):
    from support.rigs.factories_fieldbus import FIELDBUS

    REAL = frozenset(FIELDBUS)
    FACTORIES |= FIELDBUS
BENCHES = [pytest.param(name, marks=[pytest.mark.real_time] if name in REAL else []) for name in FACTORIES]
PLUGGED = [bench for bench in BENCHES if bench.values[0] not in WITHOUT_PLUG]
PULLS = ("open", "read", "write", "safe", "close")


@pytest.fixture(params=BENCHES)
def bench(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Bench]:
    with FACTORIES[request.param](tmp_path) as made:
        yield made


@pytest.fixture(params=PLUGGED)
def plugged(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Bench]:
    with FACTORIES[request.param](tmp_path) as made:
        yield made


@pytest.fixture
def device(bench: Bench) -> Iterator[Device]:
    device = bench.device()
    yield device
    device.close()


@pytest.fixture
def pluggable(plugged: Bench) -> Iterator[Device]:
    """The device on a bench whose plug can be pulled; closed whatever happens, so that one failure stays one."""
    device = plugged.device()
    yield device
    plugged.plug()
    device.close()


def near(bench: Bench, wanted: tuple[float, float]) -> bool:
    """Whether the regulators follow these set-points, within the resolution of the wire."""
    return all(abs(a - b) <= bench.step_mpa for a, b in zip(bench.commands(), wanted, strict=True))


def make_safe(bench: Bench, device: Device) -> None:
    """A slow wire may have it under way for a while; whoever says it is done has done it."""

    def done() -> bool:
        try:
            device.safe()
        except DevicePending:
            return False
        return True

    assert bench.soon(done)


def read_once(device: Device) -> Measurement | None:
    """What one read gives; nothing where a busy machine tore a reply, which is an error of that one read."""
    try:
        return device.read()
    except DeviceLost:
        raise
    except DeviceError:
        return None


def read_until_fresh(bench: Bench, device: Device) -> Measurement:
    """The first measurement with every value present; a device with a wire of its own needs a moment after opening."""
    found: list[Measurement] = []

    def complete() -> bool:
        now = read_once(device)
        if now is None:
            return False
        found.append(now)
        return not now.flags & (Flag.P1_ABSENT | Flag.P2_ABSENT | Flag.ANGLE_ABSENT)

    assert bench.soon(complete), f"never a complete measurement: {found[-1:]}"
    return found[-1]


def test_opens_and_closes_many_times(bench: Bench, device: Device) -> None:
    for _ in range(4):
        facts = device.open()
        assert facts
        assert all(isinstance(key, str) and isinstance(value, str) for key, value in facts.items())
        read_until_fresh(bench, device)
        device.close()
        device.close()


def test_opening_reading_and_closing_move_nothing(bench: Bench, device: Device) -> None:
    before = bench.commands()
    device.open()
    for _ in range(5):
        read_once(device)
        bench.clock.wait_until_ns(bench.clock.now_ns() + 5_000_000)
    read_until_fresh(bench, device)
    device.close()
    assert bench.commands() == before


def test_reading_before_the_first_write_is_legal(bench: Bench, device: Device) -> None:
    device.open()
    now = read_until_fresh(bench, device)
    assert all(map(math.isfinite, (now.p1_mpa, now.p2_mpa, now.angle_deg, now.p1_raw, now.p2_raw, now.angle_raw)))


def test_calls_on_a_closed_device_are_refused_in_one_line(bench: Bench, device: Device) -> None:
    for call in (device.read, lambda: device.write(0.2, 0.2)):
        with pytest.raises(DeviceLost) as caught:
            call()
        assert "\n" not in str(caught.value)


def test_set_points_arrive_on_their_own_valves(bench: Bench, device: Device) -> None:
    device.open()
    for wanted in ((0.1, 0.3), (0.3, 0.1), (0.2, 0.2)):
        device.write(*wanted)
        assert bench.soon(lambda wanted=wanted: near(bench, wanted)), (bench.commands(), wanted)


def test_set_points_out_of_range_are_clamped(bench: Bench, device: Device) -> None:
    device.open()
    device.write(9.0, -9.0)
    assert bench.soon(lambda: bench.commands()[0] > 0.4 and bench.commands()[1] < 0.05), bench.commands()
    assert 0.0 <= bench.commands()[1] <= bench.commands()[0] <= 0.9


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_set_point_that_is_not_finite_moves_neither_valve(bench: Bench, device: Device, bad: float) -> None:
    device.open()
    device.write(0.25, 0.15)
    assert bench.soon(lambda: near(bench, (0.25, 0.15)))
    for pair in ((bad, 0.3), (0.3, bad)):
        with pytest.raises(DeviceError):
            device.write(*pair)
    bench.clock.wait_until_ns(bench.clock.now_ns() + 100_000_000)
    assert near(bench, (0.25, 0.15))


def test_pressures_come_back_as_they_were_written(bench: Bench, device: Device) -> None:
    device.open()
    device.write(0.3, 0.1)
    if not bench.follows:
        moved = device.read()
        assert bench.soon(lambda: device.read().p1_mpa > moved.p1_mpa), "the record does not go on"
        return

    def settled() -> bool:
        now = read_once(device)
        if now is None:
            return False
        return abs(now.p1_mpa - 0.3) < 0.01 and abs(now.p2_mpa - 0.1) < 0.01 and now.angle_deg > 10.0

    assert bench.soon(settled), read_once(device)


def test_a_device_that_tells_what_stands_at_its_outputs_tells_the_truth(bench: Bench, device: Device) -> None:
    """Before `open`, open, and after `close`, as far as it can tell at all."""
    holds_safe = getattr(device, "holds_safe", lambda: None)
    device.open()
    device.write(0.4, 0.05)
    assert bench.soon(lambda: not near(bench, SAFE))
    assert holds_safe() in (False, None)
    make_safe(bench, device)
    assert near(bench, SAFE)
    assert holds_safe() in (True, None)
    device.close()
    assert holds_safe() in (True, None)


def test_safe_is_idempotent_and_works_in_every_state(bench: Bench, device: Device) -> None:
    device.open()
    device.write(0.4, 0.05)
    assert bench.soon(lambda: not near(bench, SAFE))
    for _ in range(3):
        make_safe(bench, device)
        assert near(bench, SAFE), bench.commands()
    device.write(0.4, 0.05)
    device.close()
    make_safe(bench, device)
    assert near(bench, SAFE), bench.commands()


def test_safe_works_before_the_first_open(plugged: Bench, pluggable: Device) -> None:
    make_safe(plugged, pluggable)
    assert near(plugged, SAFE), plugged.commands()


def test_closing_leaves_the_outputs(bench: Bench, device: Device) -> None:
    device.open()
    device.write(0.33, 0.07)
    assert bench.soon(lambda: near(bench, (0.33, 0.07)))
    device.close()
    bench.clock.wait_until_ns(bench.clock.now_ns() + 100_000_000)
    assert near(bench, (0.33, 0.07))


def test_ages_are_never_negative_and_a_late_reader_gets_new_values(bench: Bench, device: Device) -> None:
    device.open()
    read_until_fresh(bench, device)
    for _ in range(20):
        bench.clock.wait_until_ns(bench.clock.now_ns() + 5_000_000)
        now = read_until_fresh(bench, device)
        assert min(now.p1_age_ns, now.p2_age_ns, now.angle_age_ns) >= 0
        if isinstance(bench.clock, VirtualClock):
            assert max(now.p1_age_ns, now.p2_age_ns, now.angle_age_ns) <= bench.context.period_ns


@pytest.mark.parametrize("left_out", [Role.MONITOR_1, Role.MONITOR_2])
def test_a_monitor_that_was_not_asked_for_is_absent(bench: Bench, left_out: Role) -> None:
    device = bench.make(replace(bench.context, roles=bench.context.roles - {left_out}))
    with closing(device):
        device.open()
        now = device.read()
    first = left_out is Role.MONITOR_1
    assert now.flags & (Flag.P1_ABSENT if first else Flag.P2_ABSENT)
    assert math.isnan(now.p1_mpa if first else now.p2_mpa)
    assert (now.p1_age_ns if first else now.p2_age_ns) == 0
    assert left_out not in device.roles


@pytest.mark.parametrize("at", PULLS)
def test_a_pulled_plug_is_one_line_at_every_call(plugged: Bench, pluggable: Device, at: str) -> None:
    device = pluggable
    if at != "open":
        device.open()
        device.write(0.3, 0.1)
        assert plugged.soon(lambda: near(plugged, (0.3, 0.1)))
    plugged.pull()
    errors = _until_error(plugged, device, at)
    assert all("\n" not in str(error) for error in errors)
    if at in ("read", "write"):
        assert errors, f"{at} never said that the plug is pulled"
    device.close()
    plugged.plug()
    device.open()
    make_safe(plugged, device)
    assert near(plugged, SAFE), plugged.commands()


def test_safe_works_after_an_error_once_the_plug_is_back(plugged: Bench, pluggable: Device) -> None:
    device = pluggable
    device.open()
    device.write(0.3, 0.1)
    assert plugged.soon(lambda: near(plugged, (0.3, 0.1)))
    plugged.pull()
    assert _until_error(plugged, device, "read")
    plugged.plug()
    assert plugged.soon(lambda: _made_safe(device)), (
        "a line that is back needs a moment, and the loop tries again each tick"
    )
    assert plugged.soon(lambda: near(plugged, SAFE)), plugged.commands()


def test_nothing_old_is_passed_as_new_while_the_plug_is_pulled(plugged: Bench, pluggable: Device) -> None:
    device = pluggable
    device.open()
    read_until_fresh(plugged, device)
    pulled_ns = plugged.clock.now_ns()
    plugged.pull()
    for _ in range(200):
        plugged.clock.wait_until_ns(plugged.clock.now_ns() + 5_000_000)
        try:
            now = device.read()
        except DeviceError:
            continue
        since = plugged.clock.now_ns() - pulled_ns
        for absent, age in (
            (Flag.P1_ABSENT, now.p1_age_ns),
            (Flag.P2_ABSENT, now.p2_age_ns),
            (Flag.ANGLE_ABSENT, now.angle_age_ns),
        ):
            assert now.flags & absent or age >= since - 2 * plugged.context.period_ns - 50_000_000


def test_a_second_device_on_the_same_hardware_makes_it_safe(plugged: Bench, pluggable: Device) -> None:
    if not getattr(pluggable, "second_path", False):
        pytest.skip("this device allows no second path")
    pluggable.open()
    pluggable.write(0.4, 0.05)
    assert plugged.soon(lambda: near(plugged, (0.4, 0.05)))
    with closing(plugged.device()) as other:
        make_safe(plugged, other)
        assert near(plugged, SAFE), plugged.commands()


def _made_safe(device: Device) -> bool:
    try:
        device.safe()
    except DeviceError:
        return False
    return True


def _until_error(bench: Bench, device: Device, at: str) -> list[DeviceError]:
    """Make the call until it fails, for a second at most."""
    call = {"write": lambda: device.write(0.22, 0.18)}.get(at) or getattr(device, at)
    for _ in range(200 if at in ("read", "write") else 1):
        try:
            call()
        except DeviceError as error:
            return [error]
        bench.clock.wait_until_ns(bench.clock.now_ns() + 5_000_000)
    return []

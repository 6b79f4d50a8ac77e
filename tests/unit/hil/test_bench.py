"""The simulated rig: a function of time, set-points and seed, that looks like hardware through the Device protocol."""

import math
import random
import statistics
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest

from hil.bench import SimulatedRig, SimulatedSettings, normal_numbers
from rig.app import shipped
from rig.errors import DeviceLost, ModelError
from rig.interfaces import DeviceContext, Measurement, Role
from rig.model.parameters import AddedEffect
from rig.realtime.clock import VirtualClock
from rig.sample import Flag

MODEL = shipped.configs() / "models" / "simulated.yaml"
PERIOD_NS = 5_000_000


def rig(clock: VirtualClock, roles: frozenset[Role] = frozenset(Role), **settings: Any) -> SimulatedRig:
    made = SimulatedRig(replace(SimulatedSettings(MODEL), **settings), DeviceContext(clock, roles, 0.2, 0.2))  # type: ignore[arg-type]
    made.open()
    return made


def history(ticks: int = 400, **settings: Any) -> list[Measurement]:
    clock = VirtualClock()
    device, read = rig(clock, **settings), []
    for tick in range(ticks):
        clock.wait_until_ns(tick * PERIOD_NS)
        read.append(device.read())
        dp = 0.2 * math.sin(2 * math.pi * 0.5 * tick * 0.005)
        device.write(0.2 + dp / 2, 0.2 - dp / 2)
    return read


def test_one_seed_is_one_history_and_another_is_another() -> None:
    assert history(seed=5) == history(seed=5)
    assert history(seed=5) != history(seed=6)


def test_its_noise_is_that_of_the_standard_library() -> None:
    ours, source = normal_numbers(random.Random(5)), random.Random(5)
    assert [next(ours) for _ in range(1000)] == [source.gauss(0.0, 1.0) for _ in range(1000)]


def test_it_turns_as_far_as_the_paper_s_rig() -> None:
    angles = [m.angle_deg - 3.0 for m in history(800)][400:]
    assert 30.0 < max(angles) < 50.0
    assert -50.0 < min(angles) < -30.0


def test_the_loop_is_hysteretic() -> None:
    read = history(800)[400:]
    crossing = [
        m.angle_deg for tick, m in enumerate(read, 400) if abs(math.sin(2 * math.pi * 0.5 * tick * 0.005)) < 0.02
    ]
    assert max(crossing) - min(crossing) > 2.0, "one dp, two angles: up and down"


def test_pressures_lag_behind_their_set_points_and_arrive() -> None:
    clock = VirtualClock()
    device = rig(clock, pressure_noise_mpa=0.0)
    device.write(0.3, 0.1)
    assert device.read().p1_mpa == pytest.approx(0.2, abs=2e-3)
    clock.wait_until_ns(20_000_000)
    assert 0.21 < device.read().p1_mpa < 0.29
    clock.wait_until_ns(2_000_000_000)
    settled = device.read()
    assert (settled.p1_mpa, settled.p2_mpa) == (pytest.approx(0.3, abs=2e-3), pytest.approx(0.1, abs=2e-3))


def test_reading_twice_at_one_time_moves_nothing_but_the_noise() -> None:
    clock = VirtualClock()
    device = rig(clock, pressure_noise_mpa=0.0, angle_noise_deg=0.0)
    device.write(0.3, 0.1)
    clock.wait_until_ns(50_000_000)
    assert device.read()[:6] == device.read()[:6]


def test_how_often_it_is_read_does_not_matter() -> None:
    found = []
    for step_ns in (PERIOD_NS, 10 * PERIOD_NS):
        clock = VirtualClock()
        device = rig(clock, pressure_noise_mpa=0.0, angle_noise_deg=0.0)
        device.write(0.3, 0.1)
        for now in range(0, 1_000_000_001, step_ns):
            clock.wait_until_ns(now)
            last = device.read()
        found.append(last[:6])
    assert found[0] == found[1]


def test_values_are_what_their_counts_say() -> None:
    for m in history(50):
        assert m.p1_mpa == pytest.approx((m.p1_raw * 5.0 / 4096 - 1.0) / 8.0)
        assert m.angle_deg == pytest.approx(m.angle_raw * 345.0 / 2**14 - 172.5)
        assert all(raw == int(raw) for raw in (m.p1_raw, m.p2_raw, m.angle_raw))


def test_the_noise_is_as_large_as_said() -> None:
    clock = VirtualClock()
    device = rig(clock, pressure_noise_mpa=0.002, angle_noise_deg=0.5)
    clock.wait_until_ns(3_000_000_000)
    read = [device.read() for _ in range(2000)]
    assert statistics.stdev(m.p1_mpa for m in read) == pytest.approx(0.002, rel=0.1)
    assert statistics.stdev(m.angle_deg for m in read) == pytest.approx(0.5, rel=0.1)


def test_a_rig_without_monitors_says_so() -> None:
    clock = VirtualClock()
    m = rig(clock, frozenset({Role.VALVE_1, Role.VALVE_2, Role.ANGLE, Role.MONITOR_2})).read()
    assert math.isnan(m.p1_mpa)
    assert math.isnan(m.p1_raw)
    assert math.isfinite(m.p2_mpa)
    assert m.flags == Flag.P1_ABSENT


def test_closed_it_answers_nothing_but_can_be_made_safe_and_opened_again() -> None:
    clock = VirtualClock()
    device = rig(clock)
    device.write(0.3, 0.1)
    device.close()
    with pytest.raises(DeviceLost):
        device.read()
    with pytest.raises(DeviceLost):
        device.write(0.2, 0.2)
    device.safe()
    device.open()
    clock.wait_until_ns(2_000_000_000)
    assert device.read().p1_mpa == pytest.approx(0.2, abs=5e-3)


@pytest.mark.parametrize("drift", [0.0, 0.05])
def test_drift_makes_each_seed_a_session_of_its_own(drift: float) -> None:
    quiet = {"pressure_noise_mpa": 0.0, "angle_noise_deg": 0.0, "drift": drift}
    same = [m.angle_deg for m in history(200, seed=1, **quiet)] == [m.angle_deg for m in history(200, seed=2, **quiet)]
    assert same == (drift == 0.0)


def with_effect(effect: str, **numbers: float) -> list[float]:
    """Angles of a rig that has it."""
    return [read.angle_deg for read in history(800, effects=[AddedEffect(effect, numbers)])]


def test_a_lost_sample_repeats_the_whole_reading() -> None:
    """The noise that was put on top of it hid nine of ten."""
    angles, sound = with_effect("lost_samples", probability=0.2), [read.angle_deg for read in history(800)]
    repeated, by_chance = (sum(a == b for a, b in pairwise(each)) / len(each) for each in (angles, sound))
    assert by_chance < 0.05
    assert repeated - by_chance == pytest.approx(0.2, abs=0.04)


def test_a_coarse_reading_takes_only_multiples_of_its_step() -> None:
    assert all(
        angle == pytest.approx(0.5 * round(angle / 0.5), abs=1e-9)
        for angle in with_effect("quantisation", step_deg=0.5)
    )


def test_counts_follow_what_is_read() -> None:
    falls = AddedEffect("sensor_dropout", {"probability": 0.05, "rail_deg": -90.0})
    fell = [read for read in history(800, effects=[falls]) if read.angle_deg == -90.0]
    assert len(fell) > 20
    (count,) = {read.angle_raw for read in fell}
    assert (count - 2**13) * 345.0 / 2**14 == pytest.approx(-90.0, abs=0.02)


def test_an_effect_that_nobody_knows_is_told_in_words() -> None:
    with pytest.raises(ModelError, match="unknown effect 'backlahs'; did you mean 'backlash'"):
        with_effect("backlahs", width_deg=1.0)

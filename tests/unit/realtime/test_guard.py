"""The guard by itself: what it clips, what it believes, and its leaky bucket. What the loop makes of it stands in
test_loop_*.py."""

import math
from typing import Any

import pytest

from rig.interfaces import Measurement
from rig.realtime.faults import Fault
from rig.realtime.guard import MOST_ANGLE_DEG, Bucket, Guard, Limits
from rig.sample import Flag

PERIOD_S = 0.005
GOOD = Measurement(0.2, 0.2, 1.0, 1.0, 2.0, 3.0)


def guard(**limits: object) -> Guard:
    made = Guard(Limits(**limits), PERIOD_S)  # type: ignore[arg-type]
    made.start_from(0.2, 0.2)
    return made


def test_what_is_inside_passes_untouched() -> None:
    assert guard().command(0.21, 0.19) == (0.21, 0.19, 0)


@pytest.mark.parametrize(
    ("asked", "flag"), [(0.9, Flag.CLIPPED_RANGE), (-0.2, Flag.CLIPPED_RANGE), (0.4, Flag.CLIPPED_SLEW)]
)
def test_what_is_outside_is_clipped_and_said_so(asked: float, flag: Flag) -> None:
    made = guard()
    p1_mpa, p2_mpa, flags = made.command(asked, 0.2)
    assert flags & flag
    assert p2_mpa == 0.2
    assert abs(p1_mpa - 0.2) <= 5.0 * PERIOD_S + 1e-12


@pytest.mark.parametrize("asked", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_leaves_the_set_point_where_it_is(asked: float) -> None:
    assert guard().command(asked, 0.2) == (0.2, 0.2, Flag.CLIPPED_RANGE)


@pytest.mark.parametrize("asked", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_caught_at_the_second_valve_too(asked: float) -> None:
    assert guard().command(0.2, asked) == (0.2, 0.2, Flag.CLIPPED_RANGE)


@pytest.mark.parametrize("asked", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_never_passes_even_as_the_first_command(asked: float) -> None:
    p1_mpa, p2_mpa, flags = Guard(Limits(), PERIOD_S).command(asked, 0.3)
    assert 0.0 <= p1_mpa <= 0.5
    assert p2_mpa == 0.3
    assert flags & Flag.CLIPPED_RANGE


@pytest.mark.parametrize("p0_mpa", [0.35, 0.1, 0.45, 0.2, 0.3])
def test_what_is_on_a_limit_is_not_clipped(p0_mpa: float) -> None:
    made = guard(slew_mpa_s=4.0)
    made.start_from(p0_mpa, p0_mpa)
    reach = min(p0_mpa, 0.5 - p0_mpa)
    steps = round(reach / 0.02)
    for k in range(1, steps + 1):
        dp = 2 * reach * k / steps if reach / steps <= 0.02 else 2 * 0.02 * k
        *_, flags = made.command(p0_mpa + dp / 2, p0_mpa - dp / 2)
        assert flags == 0


def test_several_periods_allow_several_steps() -> None:
    made = guard(slew_mpa_s=1.0)
    assert made.command(0.3, 0.2, periods=4)[0] == pytest.approx(0.22)


def test_the_bucket_forgives_single_errors_but_no_habit() -> None:
    bucket = Bucket(10)
    assert not any(bucket.add(failed) for failed in [True, False, False] * 50)
    assert [bucket.add(True) for _ in range(5)] == [False] * 4 + [True]


def test_the_bucket_holds_no_more_than_its_size() -> None:
    bucket = Bucket(10)
    for _ in range(1000):
        bucket.add(True)
    assert [bucket.add(False) for _ in range(3)] == [False] * 3
    assert bucket.level == 7


def test_a_stale_value_is_flagged_after_one_period_and_faults_after_its_patience() -> None:
    made = guard()
    assert made.check(GOOD._replace(p1_age_ns=4_000_000), 1.0, False) == (0, Fault.NONE)
    assert made.check(GOOD._replace(p1_age_ns=6_000_000), 1.0, False) == (Flag.STALE, Fault.NONE)
    old = [made.check(GOOD._replace(angle_age_ns=101_000_000), 1.0, False)[1] for _ in range(5)]
    assert old == [Fault.NONE] * 4 + [Fault.STALE_VALUE]


def test_a_broken_wire_is_told_rather_than_the_bad_value_it_gives() -> None:
    made = guard()
    broken = GOOD._replace(p1_mpa=-0.125, flags=int(Flag.BROKEN_WIRE))
    assert [made.check(broken, 1.0, False)[1] for _ in range(5)][-1] is Fault.BROKEN_WIRE


@pytest.mark.parametrize(
    ("wrong", "fault"),
    [
        ({"p1_mpa": 0.65}, Fault.BAD_VALUE),
        ({"p2_age_ns": 101_000_000}, Fault.STALE_VALUE),
        ({"flags": int(Flag.BROKEN_WIRE)}, Fault.BROKEN_WIRE),
    ],
)
def test_good_measurements_forgive_single_bad_ones_but_no_habit(wrong: dict[str, Any], fault: Fault) -> None:
    made, bad = guard(pressure_jump_mpa=1.0), GOOD._replace(**wrong)
    assert {made.check(now, 1.0, False)[1] for now in [bad, GOOD, GOOD] * 20} == {Fault.NONE}
    assert [made.check(bad, 1.0, False)[1] for _ in range(5)] == [Fault.NONE] * 4 + [fault]


def test_the_first_measurement_is_no_jump() -> None:
    assert guard().check(GOOD._replace(angle_deg=80.0), 80.0, False) == (0, Fault.NONE)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("beyond_deg", "suspect"), [(-1.0, False), (1.0, True)])
def test_a_sensor_may_be_mounted_a_turn_off_and_no_more(beyond_deg: float, suspect: bool, side: float) -> None:
    angle_deg = side * (MOST_ANGLE_DEG + beyond_deg)
    flags, fault = guard().check(GOOD._replace(angle_deg=angle_deg), 0.0, False)
    assert (bool(flags & Flag.SUSPECT), fault) == (suspect, Fault.NONE)


def test_a_sensor_of_the_rig_that_gives_nothing_is_suspect_and_one_it_does_not_have_is_not() -> None:
    nothing = GOOD._replace(p1_mpa=math.nan, flags=int(Flag.P1_ABSENT))
    has = Guard(Limits(), PERIOD_S, expected=int(Flag.P1_ABSENT))
    has_not = Guard(Limits(), PERIOD_S, expected=int(Flag.P2_ABSENT))
    assert has.check(nothing, 1.0, False)[0] & Flag.SUSPECT
    assert not has_not.check(nothing, 1.0, False)[0] & Flag.SUSPECT


def test_a_missing_monitor_follows_everything_and_is_never_frozen() -> None:
    made = guard()
    blind = GOOD._replace(p1_mpa=math.nan, p2_mpa=math.nan, p1_raw=math.nan, p2_raw=math.nan,
                          flags=int(Flag.P1_ABSENT | Flag.P2_ABSENT))  # fmt: skip
    for tick in range(1000):
        made.command(0.2 + 0.1 * math.sin(tick / 50), 0.2 - 0.1 * math.sin(tick / 50))
        assert made.check(blind._replace(angle_raw=float(tick)), 1.0, True)[1] is Fault.NONE


@pytest.mark.parametrize("which", ["p1_raw", "p2_raw", "angle_raw"])
def test_each_sensor_can_freeze(which: str) -> None:
    made = guard(frozen_s=0.2)
    found = Fault.NONE
    for tick in range(200):
        swing = 0.05 * math.sin(tick / 20)
        made.command(0.2 + swing, 0.2 - swing)
        alive = GOOD._replace(p1_mpa=0.2 + swing, p2_mpa=0.2 - swing, p1_raw=tick, p2_raw=-tick, angle_raw=tick + 0.5)
        found = found or made.check(alive._replace(**{which: 7.0}), 1.0, True)[1]
    assert found is Fault.FROZEN_SENSOR


def test_a_slow_pressure_has_its_patience_and_no_more() -> None:
    made = guard(follow_s=0.1, frozen_s=60.0)
    made.start_from(0.35, 0.2)
    late = [
        made.check(GOOD._replace(p1_raw=float(n), p2_raw=float(n), angle_raw=float(n)), 1.0, True)[1] for n in range(21)
    ]
    assert late == [Fault.NONE] * 20 + [Fault.NOT_FOLLOWING]


def lossy(n: int, made: Guard, alive: Measurement) -> Fault:
    """A tick of a rig on whose line every tenth reply is lost."""
    lost = Measurement(math.nan, math.nan, math.nan, math.nan, math.nan, math.nan, flags=Flag.READ_ERROR)
    return Fault(made.check(lost if n % 10 == 9 else alive, 1.0, True)[1])


def test_a_lost_reply_forgives_no_pressure_that_is_far_off() -> None:
    made = guard(follow_s=0.1, frozen_s=60.0)
    made.start_from(0.35, 0.2)
    found = [lossy(n, made, GOOD._replace(p1_raw=float(n), p2_raw=float(n), angle_raw=float(n))) for n in range(40)]
    assert Fault.NOT_FOLLOWING in found
    assert set(found[:20]) == {Fault.NONE}


def test_a_lost_reply_thaws_no_frozen_sensor() -> None:
    made, found = guard(frozen_s=0.2), Fault.NONE
    for tick in range(200):
        swing = 0.05 * math.sin(tick / 20)
        made.command(0.2 + swing, 0.2 - swing)
        alive = GOOD._replace(p1_mpa=0.2 + swing, p2_mpa=0.2 - swing, p1_raw=tick, p2_raw=-tick, angle_raw=7.0)
        found = found or lossy(tick, made, alive)
    assert found is Fault.FROZEN_SENSOR

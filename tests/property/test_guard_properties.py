"""Whatever is asked for, what reaches the valves is finite, inside the envelope, and never faster than allowed."""

import math

from hypothesis import given
from hypothesis import strategies as st

from rig.interfaces import Measurement
from rig.realtime.faults import Fault
from rig.realtime.guard import Bucket, Guard, Limits
from rig.sample import Flag

ANYTHING = st.floats(allow_nan=True, allow_infinity=True) | st.floats(-1.0, 2.0)
PERIOD_S = 0.005


@given(
    start=st.tuples(st.floats(0.0, 0.5), st.floats(0.0, 0.5)),
    asked=st.lists(st.tuples(ANYTHING, ANYTHING, st.integers(1, 6)), max_size=60),
    slew=st.floats(0.01, 50.0),
)
def test_the_outputs_stay_inside(
    start: tuple[float, float], asked: list[tuple[float, float, int]], slew: float
) -> None:
    guard = Guard(Limits(slew_mpa_s=slew), PERIOD_S)
    guard.start_from(*start)
    before = start
    for p1, p2, periods in asked:
        *now, flags = guard.command(p1, p2, periods)
        for wanted, was, became in zip((p1, p2), before, now, strict=True):
            assert math.isfinite(became)
            assert -1e-12 <= became <= 0.5 + 1e-12
            assert abs(became - was) <= slew * PERIOD_S * periods + 2e-9
            assert abs(became - wanted) <= 1e-9 or flags & (Flag.CLIPPED_RANGE | Flag.CLIPPED_SLEW)
        before = (now[0], now[1])


@given(
    values=st.lists(st.tuples(ANYTHING, ANYTHING, ANYTHING), min_size=1, max_size=40),
    commanding=st.booleans(),
)
def test_no_measurement_upsets_it_and_what_is_not_finite_is_suspect(
    values: list[tuple[float, float, float]], commanding: bool
) -> None:
    guard = Guard(Limits(), PERIOD_S)
    guard.start_from(0.2, 0.2)
    for p1, p2, angle in values:
        flags, fault = guard.check(Measurement(p1, p2, angle, p1, p2, angle), angle, commanding)
        assert isinstance(fault, Fault)
        if not all(map(math.isfinite, (p1, p2, angle))):
            assert flags & Flag.SUSPECT


@given(st.lists(st.booleans(), max_size=300), st.integers(1, 50))
def test_the_bucket_is_never_below_empty_nor_above_full(outcomes: list[bool], size: int) -> None:
    bucket = Bucket(size)
    for failed in outcomes:
        full = bucket.add(failed)
        assert 0 <= bucket.level <= size
        assert full == (bucket.level == size)

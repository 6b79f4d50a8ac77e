"""For every program: the tick index alone decides the phase, nothing lies outside what was asked for, and a stop always
gets home."""

import itertools

from hypothesis import given
from hypothesis import strategies as st

from rig.realtime.program import Program
from rig.sample import Phase

PRESSURE = st.floats(0.0, 0.5)
LENGTH = st.integers(0, 30)
PROGRAMS = st.builds(
    lambda rest, points, lengths: Program(1, rest, rest, [p for p, _ in points], [p for _, p in points], *lengths),
    PRESSURE,
    st.lists(st.tuples(PRESSURE, PRESSURE), min_size=1, max_size=40),
    st.tuples(LENGTH, LENGTH, LENGTH, LENGTH),
)
STARTS = st.tuples(PRESSURE, PRESSURE)


@given(PROGRAMS, STARTS)
def test_phases_come_in_order_and_pressures_stay_between_what_was_asked_for(
    p: Program, start: tuple[float, float]
) -> None:
    points = [p.at(index, start) for index in range(p.ticks)]
    found = [at[0] for at in points]
    assert found == sorted(found)
    assert found.count(Phase.SWEEP) == len(p.p1_cmd_mpa)
    for valve, table in ((1, p.p1_cmd_mpa), (2, p.p2_cmd_mpa)):
        allowed = [*table, start[valve - 1], p.rest_p1_mpa]
        assert all(min(allowed) - 1e-12 <= at[valve] <= max(allowed) + 1e-12 for at in points)


@given(PROGRAMS, STARTS)
def test_a_stop_gets_to_rest_without_turning_back(p: Program, start: tuple[float, float]) -> None:
    way = [p.way_out(left, start)[1] for left in range(p.ramp_out_ticks, -1, -1)]
    assert way[-1] == p.rest_p1_mpa
    distances = [abs(p1 - p.rest_p1_mpa) for p1 in way]
    assert all(b <= a + 1e-12 for a, b in itertools.pairwise(distances))

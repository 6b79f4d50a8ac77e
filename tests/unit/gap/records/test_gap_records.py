"""What pairs with what: each rule on both sides of its limit; the start, the input and the periods of a sweep."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.conditions import MEASURED_REST
from rig.errors import ModelError, RecordError
from rig.gap.records.alignment import align
from rig.gap.records.cleaning.dropouts import Rows
from rig.gap.records.conditions import difference
from rig.gap.records.holes import bridged
from rig.gap.records.pairs import pair_up
from rig.gap.records.partners import find_partner
from rig.gap.records.periods import period_rows, whole_periods
from rig.gap.records.reach import beyond_reach, check_direction, check_reach, check_scale, pressure_reach_ratio
from rig.gap.records.settings import ANGLE_AGAINST, FARTHEST, MOST_SHIFT_S, SAME_COMMAND
from rig.gap.records.usable import usability
from rig.record import MEASURED_COLUMNS, Column, Record

T = np.arange(0.0, 10.0, 0.005)


def record(name: str = "sine", hertz: float = 0.5, scale: float = 1.0, late_s: float = 0.0, **facts: object) -> Record:
    """A joint of 100 deg/MPa without dynamics under a sine, or a part of one."""
    command = 0.1 * scale * np.sin(2 * np.pi * hertz * (T - late_s))
    return Record(name, T, command, angle_deg=100.0 * command, facts=facts)


def chirp(late_s: float = 0.0) -> Record:
    return Record(
        "chirp", T, command := 0.1 * np.sin(2.0 * (T - late_s) ** 1.7 * (late_s < T)), angle_deg=100 * command
    )


def test_commands_are_the_same_up_to_a_tenth_of_their_spread() -> None:
    assert align(record(), record(scale=1.0 + 0.9 * SAME_COMMAND)).same
    assert not align(record(), record(scale=1.0 + 1.1 * SAME_COMMAND)).same


def test_a_phase_and_a_late_start_are_taken_out() -> None:
    assert align(record(), record(late_s=0.37)).shift_s == pytest.approx(0.37, abs=1e-3)
    assert align(chirp(), replace(chirp(), **_later(chirp(), 60))).shift_s == pytest.approx(-0.3, abs=5e-3)
    assert not align(chirp(), replace(chirp(), **_later(chirp(), round(1.5 * MOST_SHIFT_S / 0.005)))).same


def _later(sweep: Record, rows: int) -> dict[str, Column]:
    """The same sweep whose record begins so many rows into it."""
    assert sweep.angle_deg is not None
    return {
        name: np.roll(column, -rows)
        for name, column in (("dp_cmd_mpa", sweep.dp_cmd_mpa), ("angle_deg", sweep.angle_deg))
    }


def test_a_baseline_of_another_phase_lies_on_the_cases_clock() -> None:
    pairing = pair_up([record()], [[record(late_s=0.4)]], 0.2)
    pair = pairing.pairs[0]
    assert pairing.matches[0].shift_s == pytest.approx(0.4, abs=1e-3)
    assert np.max(np.abs((pair.case.angle_deg - pair.days[0].angle_deg) * pair.used)) < 0.05


def test_a_name_that_the_session_has_decides() -> None:
    other = record("sine", hertz=0.9)
    partner, match = find_partner(record("sine"), [other, record("another")], 1)
    assert partner is None
    assert match.off is not None
    assert match.off > match.limit
    assert "the command of sine differs" in match.why
    assert find_partner(record("sine"), [record("another")], 1)[1].by == "command"


@pytest.mark.parametrize(("kg", "pairs"), [(1.04, True), (1.08, False)])
def test_another_load_is_another_sweep(kg: float, pairs: bool) -> None:
    partner, match = find_partner(record(load_kg=1.0), [record(load_kg=kg)], 1)
    assert (partner is not None) is pairs
    assert pairs or "load_kg is 1, not 1.08" in match.why


@pytest.mark.parametrize(
    ("name", "near", "far"), [("p0_mpa", 0.209, 0.211), ("temperature_c", 4.9, 5.3), ("tension_n", 0.205, 0.22)]
)
def test_every_condition_has_its_limit(name: str, near: float, far: float) -> None:
    own = record(**{name: 0.2})
    assert difference(own, record(**{name: near})) is None
    assert difference(own, record(**{name: far})) is not None


def test_a_condition_may_be_a_column_or_a_word() -> None:
    warm = replace(record(), extra={"temperature_c": np.full(len(T), 40.0)})
    assert difference(warm, record(temperature_c=20.0)) is not None
    assert difference(record(load="weight A"), record(load="weight B")) is not None
    assert difference(record(load="weight A"), record()) is None, "what only one says is not compared"


def test_of_two_conditions_that_differ_the_first_that_the_record_names_is_said() -> None:
    load, warm = {"load_kg": 1.0, "temperature_c": 20.0}, {"temperature_c": 20.0, "load_kg": 1.0}
    other = record(load_kg=2.0, temperature_c=40.0)
    said = [difference(record(**mine), other) for mine in (load, warm)]
    assert [one.name for one in said if one is not None] == ["load_kg", "temperature_c"]


def test_records_of_one_command_under_several_loads_do_not_collapse() -> None:
    session = [record("light", load_kg=0.5), record("heavy", load_kg=2.0)]
    assert find_partner(record("case", load_kg=2.0), session, 1)[1].partner == "heavy"
    assert "differ in load_kg" in find_partner(record("case"), session, 1)[1].why


def test_sessions_that_pair_with_nothing_are_refused_with_how_far_off() -> None:
    with pytest.raises(
        RecordError, match=r"none of 2 baseline sessions pairs with a record: sine: .* differs by .* allowed: 10 %"
    ):
        pair_up([record()], [[record(hertz=0.9)], [record(hertz=1.3)]], 0.2)


def test_a_measured_input_is_compared_at_the_cases_own() -> None:
    pairing = pair_up([record(scale=1.05)], [[record()]], 0.2)
    pair = pairing.pairs[0]
    left = (pair.case.angle_deg - pair.days[0].angle_deg) * pair.used
    assert np.std(left) < 0.05 * np.std(0.05 * pair.case.angle_deg)
    assert any("they are taken at its own" in note for note in pairing.notes)


def regulated(off_mpa: float = 0.0) -> Record:
    """A sine whose pressures were measured, off by a constant."""
    plain = record()
    p1, p2 = (0.2 + off_mpa + sign * 0.5 * plain.dp_cmd_mpa for sign in (1.0, -1.0))
    return replace(plain, p1_mpa=p1, p2_mpa=p2)


def paused(whole: Record, hole: Rows) -> Record:
    """The same without some of its rows."""
    return replace(whole, t_s=T[~hole], **{n: column[~hole] for n, column in whole.columns().items() if n != "t_s"})


@pytest.mark.parametrize("seconds", [0.1, 0.4, 1.0, 1.9])
@pytest.mark.parametrize("days", [0, 1])
def test_what_drove_the_joint_in_a_hole_is_another_days_or_the_set_points(seconds: float, days: int) -> None:
    """A straight line through half a sine leaves the joint's memory wrong long after. Beside a day rows are missing,
    without one what was measured is."""
    hole = np.abs(T - 3.2 - 0.5 * seconds) <= 0.5 * seconds
    silent = replace(regulated(), **{n: np.where(hole, np.nan, getattr(regulated(), n)) for n in MEASURED_COLUMNS})
    pair = pair_up([paused(regulated(), hole) if days else silent], [[regulated(off_mpa=0.01)]] * days, 0.2).pairs[0]
    assert pair.case.p1_mpa == pytest.approx(0.2 + 0.05 * np.sin(np.pi * pair.t_s), abs=2e-3)
    assert 0.9 * seconds < np.sum(pair.used == 0.0) * pair.dt_s < seconds + 0.1


@given(st.integers(0, 1000), st.floats(-1.0, 1.0))
def test_a_hole_takes_the_other_course_and_meets_its_own_edges(seed: int, off: float) -> None:
    random = np.random.default_rng(seed)
    column, other = random.normal(size=60).cumsum(), random.normal(size=60).cumsum()
    hole = np.zeros(60, dtype=bool)
    hole[(start := int(random.integers(1, 40))) : start + int(random.integers(1, 19))] = True
    assert np.array_equal(bridged(column, hole, other)[~hole], column[~hole])
    assert bridged(column, hole, column + off) == pytest.approx(column)


@pytest.mark.parametrize(("seconds", "whole"), [(7.0, 6.0), (5.9, 5.9)])
def test_periodic_records_are_cut_to_whole_periods(seconds: float, whole: float) -> None:
    command = np.sin(2 * np.pi * 0.5 * np.arange(0.0, seconds, 0.01))
    assert whole_periods(command) == pytest.approx(100 * whole, abs=2)


def test_days_that_cannot_be_used_are_refused_by_their_own_reasons() -> None:
    """The case's notes stood among them, before they were cut to three."""
    with_a_pulse = 10.0 * np.sin(2 * np.pi * 0.5 * T)
    with_a_pulse[700] = -172.5
    case = [replace(record(f"case_{k}"), angle_deg=with_a_pulse) for k in range(4)]
    with pytest.raises(RecordError) as refused:
        pair_up(case, [[record().rows(T < 1.5)]], 0.2)
    assert str(refused.value).startswith("no baseline session can be used: baseline sine: too short")


def test_a_chirp_has_no_period() -> None:
    assert period_rows(chirp().dp_cmd_mpa) is None


def test_a_short_record_is_told_with_its_duration() -> None:
    used, note = usability(record().rows(T < 1.5))
    assert not used
    assert "300 rows in 1.495 s; needed: at least 50 rows and 2 s" in note


HELD = np.where(T % 2.0 < 0.5, 0.05, 0.05 * np.cos(2 * np.pi * (T % 2.0 - 0.5) / 1.5))


@pytest.mark.parametrize(
    ("command", "change", "clipped"),
    [
        (0.1 * np.sin(2 * np.pi * 0.5 * T), lambda angle: np.minimum(angle, 7.0), True),
        (0.1 * np.sin(2 * np.pi * 0.5 * T), lambda angle: np.minimum(0.5 * np.round(angle / 0.5), 7.0), True),
        (0.1 * np.sin(2 * np.pi * 0.5 * T), lambda angle: 0.55 * np.round(angle / 0.55), False),
        (HELD, lambda angle: angle, False),
    ],
    ids=["cut off", "cut off on a coarse converter's steps", "a coarse converter's steps", "where the command holds"],
)
def test_a_sensor_is_clipped_that_stays_at_its_end_where_it_should_move(
    command: Column, change: Callable[[Column], Column], clipped: bool
) -> None:
    swept = replace(record(), dp_cmd_mpa=command, angle_deg=change(100.0 * command))
    pairing = pair_up([swept], [], 0.2)
    assert bool(pairing.clipped) is clipped
    assert [note for note in pairing.notes if "clipped?" in note] == list(pairing.clipped)


@pytest.mark.parametrize(
    ("upper_deg", "smoothed_deg", "clipped"),
    [(7.0, 0.0, False), (6.8, 0.0, False), (7.0, 0.04, False), (2.0, 0.0, True), (2.0, 0.04, True), (20.0, 0.0, False)],
    ids=["as then", "hardly less", "as then, smoothed", "far deeper", "far deeper than one smoothed", "not at all"],
)
def test_what_stayed_at_its_end_on_the_earlier_days_is_not_clipped_now(
    upper_deg: float, smoothed_deg: float, clipped: bool
) -> None:
    """A day that a fingerprint keeps is smooth: it repeats no value, and stays within a step of its end."""
    course = 0.1 * np.sin(2 * np.pi * 0.5 * T)
    then, now = (
        replace(record(), dp_cmd_mpa=course, angle_deg=0.1 * np.round(np.minimum(gain * course, upper) / 0.1))
        for gain, upper in ((100.0, 7.0), (100.5, upper_deg))
    )
    then = replace(then, angle_deg=then.angle_deg + smoothed_deg * np.sin(7.0 * T))
    assert bool(pair_up([now], [[then]], 0.2).clipped) is clipped


@pytest.mark.parametrize(("correlation", "refused"), [(ANGLE_AGAINST - 0.02, True), (ANGLE_AGAINST + 0.02, False)])
def test_an_angle_that_runs_against_what_is_expected_is_refused(correlation: float, refused: bool) -> None:
    wave, other = np.sin(2 * np.pi * 0.5 * T), np.cos(2 * np.pi * 0.5 * T)
    angle = correlation * wave + np.sqrt(1.0 - correlation**2) * other
    if not refused:
        check_direction([angle], [wave], "the simulator's")
        return
    with pytest.raises(RecordError, match="the angle runs against the simulator's: is its sign turned"):
        check_direction([angle], [wave], "the simulator's")


@pytest.mark.parametrize(("times", "refused"), [(1.05 * FARTHEST, True), (0.95 * FARTHEST, False), (0.1, False)])
def test_an_angle_that_moves_much_farther_than_the_earlier_days_is_another_rigs(times: float, refused: bool) -> None:
    case = replace(record(), angle_deg=times * 100.0 * record().dp_cmd_mpa)
    if not refused:
        check_scale(case, [record()])
        return
    with pytest.raises(RecordError, match="times as far as in the baselines, allowed: 4; another rig"):
        check_scale(case, [record()])


@pytest.mark.parametrize(("times", "refused"), [(0.24, True), (0.26, False), (3.9, False), (4.1, True)])
def test_a_model_that_moves_otherwise_by_a_factor_of_four_is_no_model_of_this_rig(times: float, refused: bool) -> None:
    angle = np.sin(T)
    if not refused:
        check_reach([times * angle], [angle])
        return
    with pytest.raises(ModelError, match=r"the model moves .* times as far as the rig"):
        check_reach([times * angle], [angle])


def test_a_joint_that_friction_stops_in_small_sweeps_is_this_rigs() -> None:
    """A unit is the same in every record, friction is not."""
    said = [30.0 * np.sin(T), 8.0 * np.sin(T), 5.0 * np.sin(T)]
    check_reach(said, [16.0 * np.sin(T), 1.0 * np.sin(T), 0.2 * np.sin(T)])
    with pytest.raises(ModelError, match=r"the model moves 5 times as far as the rig"):
        check_reach(said, [column / 5.0 for column in said])


@pytest.mark.parametrize(("times", "ratio", "beyond"), [(3.9, 1.0, False), (4.1, 1.0, True), (4.1, 1.2, False)])
def test_a_record_in_which_a_model_moves_far_beyond_the_rig_is_outside_its_range(
    times: float, ratio: float, beyond: bool
) -> None:
    reason = beyond_reach("sine", times * np.sin(T), float(np.ptp(np.sin(T))), ratio)
    assert ("outside its range" in reason) is beyond


@pytest.mark.parametrize(("moved", "refused"), [(1.0, True), (0.1, False), (3.0, True)])
def test_a_rig_whose_pressures_hardly_move_moves_less_and_is_no_other_rig(moved: float, refused: bool) -> None:
    """A joint that moves an eighth as far as the model says: under pressures that move as far, and under less."""
    said, angle = (0.2 + 0.1 * np.sin(T), 0.2 - 0.1 * np.sin(T)), 40.0 * np.sin(T)
    own = tuple(0.2 + moved * (column - 0.2) for column in said)
    ratio = pressure_reach_ratio(said, (own[0], own[1]))
    assert pressure_reach_ratio(said, (None, own[1])) == 1.0
    if not refused:
        check_reach([angle], [angle / 8.0], ratio)
        return
    with pytest.raises(ModelError, match="8 times as far"):
        check_reach([angle], [angle / 8.0], ratio)


def test_the_share_that_is_refused_is_told_with_what_is_allowed_there() -> None:
    with pytest.raises(ModelError, match=r"moves 9 times .* allowed without a baseline: 0\.25 \.\. 8 times"):
        check_reach([9.0 * np.sin(T)], [np.sin(T)], pressure_ratio=2.0)


def test_sessions_of_different_sweeps_stand_for_one_earlier_day() -> None:
    """Each record has two of three days, and no two records the same two: no column of days would be one day."""
    a, b, c = (record(f"sine_{hertz}", hertz) for hertz in (0.3, 0.5, 0.8))

    def day(*records: Record, noise: float) -> list[Record]:
        return [replace(one, angle_deg=np.asarray(one.angle_deg) + noise * np.cos(3.0 * T)) for one in records]

    days = [day(a, b, noise=0.1), day(a, c, noise=0.2), day(b, c, noise=0.3)]
    pairing = pair_up([a, b, c], days, 0.2)
    assert [len(pair.days) for pair in pairing.pairs] == [1, 1, 1]
    assert any("different sweeps: together they count as one earlier day" in note for note in pairing.notes)
    whole = pair_up([a, b, c], [day(a, b, c, noise=0.1), day(a, b, c, noise=0.2)], 0.2)
    assert [len(pair.days) for pair in whole.pairs] == [2, 2, 2]
    assert not any("different sweeps" in note for note in whole.notes)


@pytest.mark.parametrize("hertz", [0.2, 0.7, 1.5, 3.0])
@pytest.mark.parametrize("late_s", [0.0, 0.05, 0.15])
def test_monitors_that_follow_mirrored_are_swapped_however_late(hertz: float, late_s: float) -> None:
    followed = 0.05 * np.sin(2 * np.pi * hertz * (T - late_s))
    right = replace(record(hertz=hertz), p1_mpa=0.2 + followed, p2_mpa=0.2 - followed)
    assert usability(right) == (True, "")
    used, note = usability(replace(right, p1_mpa=right.p2_mpa, p2_mpa=right.p1_mpa))
    assert not used
    assert "are the two monitors, or the valves, swapped?" in note


def at_rest(mpa: float, **facts: object) -> Record:
    pressed = 0.05 * np.sin(np.pi * T)
    return replace(record(**facts), p1_mpa=mpa + pressed, p2_mpa=mpa - pressed)


@pytest.mark.parametrize(("said", "read", "other", "same"), [
    (0.2, 0.2, 0.225, True), (0.2, 0.2, 0.235, False),
    (0.3, 0.2, 0.2, True),  # both measured the same: what one of them says of itself is wrong, or its monitors are
    (None, 0.2, 0.3, True),  # nobody says it: a shift of both pressures looks the same, and pairs
])  # fmt: skip
def test_a_p0_that_one_says_and_the_other_measured_is_compared(
    said: float | None, read: float, other: float, same: bool
) -> None:
    own = at_rest(read) if said is None else at_rest(read, p0_mpa=said)
    assert (difference(own, at_rest(other)) is None) is same
    assert (difference(at_rest(other), own) is None) is same


@pytest.mark.parametrize(("missing", "where"), [("case", "the case"), ("day", "the baselines")])
def test_which_pressure_was_not_measured_and_where_is_said(missing: str, where: str) -> None:
    case, day = regulated(), replace(regulated(), angle_deg=100.1 * record().dp_cmd_mpa)
    lacking = replace(case if missing == "case" else day, p2_mpa=None)
    pairing = pair_up(*(([lacking], [[day]]) if missing == "case" else ([case], [[lacking]])), 0.2)
    assert pairing.notes[-1] == f"p2_mpa was not measured in {where} (sine): the angle alone is used"


def test_without_earlier_days_a_pressure_that_stands_alone_is_said_to_be_unused() -> None:
    alone = pair_up([replace(regulated(), p2_mpa=None)], [], 0.2)
    assert list(alone.notes) == ["p2_mpa was not measured in the case (sine): the angle alone is used"]
    assert not pair_up([replace(regulated(), p1_mpa=None, p2_mpa=None)], [], 0.2).notes


def test_an_earlier_day_that_runs_against_the_case_is_named() -> None:
    turned = [replace(record(), angle_deg=-np.asarray(record().angle_deg), name="sine")]
    with pytest.raises(RecordError, match="runs against that of baseline session 2"):
        pair_up([record()], [[record(scale=1.01)], turned], 0.2)
    with pytest.raises(RecordError, match="runs against the earlier days'"):
        pair_up([record()], [turned], 0.2)


@pytest.mark.parametrize("seconds", [0.1, 0.2, 0.4])
def test_rows_that_were_cut_out_change_nothing_beside_a_day_that_has_them(seconds: float) -> None:
    whole, day = record(), record()
    kept = (T < 4.0) | (4.0 + seconds <= T)
    cut = Record(whole.name, T[kept], whole.dp_cmd_mpa[kept], angle_deg=np.asarray(whole.angle_deg)[kept])
    pairing = pair_up([cut], [[replace(day, angle_deg=1.001 * np.asarray(day.angle_deg))]], 0.2)
    pair = pairing.pairs[0]
    assert not [note for note in pairing.notes if "its input is not exactly" in note]
    assert [note for note in pairing.notes if "without samples from 4 s on" in note]
    gap = (pair.case.angle_deg - pair.days[0].angle_deg / 1.001) * pair.used
    assert float(np.max(np.abs(gap))) < 0.03, "of 10 deg, at its edges"


@pytest.mark.parametrize(("jittered", "said"), [
    (1, ["sine_0.3: its input is not exactly the baselines'; they are taken at its own"]),
    (3, ["3 of 3 records: their input is not exactly the baselines'; those are taken at it"]),
])  # fmt: skip
def test_that_a_jittered_clock_makes_other_inputs_is_said_once(jittered: int, said: list[str]) -> None:
    draw, sweeps = np.random.default_rng(3), [record(f"sine_{hertz}", hertz) for hertz in (0.3, 0.5, 0.8)]
    stamps = np.sort(T + draw.uniform(-0.04, 0.04, len(T)))
    case = [replace(one, t_s=stamps) if k < jittered else one for k, one in enumerate(sweeps)]
    days = [[replace(one, angle_deg=1.001 * np.asarray(one.angle_deg)) for one in sweeps]]
    assert [note for note in pair_up(case, days, 0.2).notes if "input is not" in note] == said


def test_falls_stay_with_their_record_where_p0_is_read_from_the_pressures() -> None:
    """Records around several P0s are taken anew with what was read."""
    case = [replace(at_rest(mpa), name=f"at_{mpa}") for mpa in (0.15, 0.2, 0.25)]
    angle = np.asarray(case[1].angle_deg) + 5.0
    angle[200::200] = 0.0
    case[1] = replace(case[1], angle_deg=angle)
    pairs = pair_up(case, [], 0.2).pairs
    assert [pair.raw.facts[MEASURED_REST] for pair in pairs] == pytest.approx([0.15, 0.2, 0.25])
    assert [sum(int(one.fallen.sum()) for one in pair.dropouts) for pair in pairs] == [0, 9, 0]

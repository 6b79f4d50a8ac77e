"""Missed periods beside witnessed stalls: what the machine is to blame for, and that nothing else is excused by it."""

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.records.made_logs import BOOT_NS, PERIOD_NS, made_content, made_log

from rig.log.convert import write_content
from rig.qualify.stalls import OWN_NS, Miss, Place, Recorded, is_held_up, judge, recorded_in, summary
from rig.qualify.witness import LATE_NS, SLEEP_NS, Account, Stall, watch

MS = 1_000_000
DUE = 1000 * MS
MISS = Miss(DUE, DUE + 6 * MS, 1)
PLACE = Place({1}, 85)


def stall(from_ms: float, to_ms: float, asleep_ms: float = 0.2) -> Stall:
    """The witness ran `asleep_ms` before the stall began, as seen from the loop's due time."""
    ran_ns = DUE + round((from_ms - asleep_ms) * MS)
    return Stall(ran_ns, ran_ns + SLEEP_NS, DUE + round(to_ms * MS))


@pytest.mark.parametrize(
    "stalls",
    [
        [stall(-3, 5.9)],
        [stall(-0.01, 5.9, asleep_ms=0.0)],
        [stall(0.7, 6.0, asleep_ms=0.9)],
        [stall(-3, 12)],
        [stall(-30, -20), stall(-3, 5.9), stall(40, 50)],
    ],
    ids=["across", "just begun", "begun while the witness slept", "the witness came after the loop", "among others"],
)
def test_a_miss_inside_a_stall_is_the_machines(stalls: list[Stall]) -> None:
    assert is_held_up(MISS, stalls)


@pytest.mark.parametrize(
    "stalls",
    [
        [],
        [stall(-9, -1)],
        [stall(8, 15)],
        [stall(1.5, 5.9)],
        [stall(-3, 3)],
        [stall(-3, 2), stall(3, 4), stall(5, 5.9)],
    ],
    ids=[
        "none",
        "before",
        "after",
        "begun after the loop was due",
        "over long before the loop woke",
        "with time to run between",
    ],
)
def test_a_miss_that_no_stall_explains_is_not_excused(stalls: list[Stall]) -> None:
    assert not is_held_up(MISS, stalls)


spans = st.lists(st.tuples(st.integers(1, 15 * MS), st.integers(1, 15 * MS)), max_size=8)


def machine(gaps: list[tuple[int, int]]) -> tuple[list[tuple[int, int]], Callable[[int], int]]:
    """A core that stands still now and then: the stretches, and when someone who wants to run at a time does."""
    stretches, at_ns = [], 0
    for runs_ns, stands_ns in gaps:
        stretches.append((at_ns + runs_ns, at_ns + runs_ns + stands_ns))
        at_ns += runs_ns + stands_ns
    return stretches, lambda wish_ns: next((end for begin, end in stretches if begin <= wish_ns < end), wish_ns)


def witnessed(runs_at: Callable[[int], int], until_ns: int) -> list[Stall]:
    """What the real witness notes on that core."""
    clock = [runs_at(0)]

    def sleep(seconds: float) -> None:
        clock[0] = runs_at(clock[0] + round(seconds * 1e9))

    return list(watch(lambda: clock[0] < until_ns, lambda: clock[0], sleep))


def after_work(stretches: list[tuple[int, int]], at_ns: int, work_ns: int) -> int:
    """When someone who begins at a time has had `work_ns` of the core."""
    for begin, end in stretches:
        if end <= at_ns or at_ns + work_ns < begin:
            continue
        work_ns -= max(begin - at_ns, 0)
        at_ns = end
    return at_ns + work_ns


@given(spans, st.integers(0, 100 * MS), st.integers(OWN_NS + 1, 30 * MS))
def test_a_loop_that_is_late_by_itself_is_never_excused(gaps: list[tuple[int, int]], due_ns: int, own_ns: int) -> None:
    stretches, runs_at = machine(gaps)
    woken_ns = after_work(stretches, due_ns, own_ns)
    assert not is_held_up(Miss(due_ns, woken_ns, 1), witnessed(runs_at, woken_ns + 50 * MS))


@given(st.integers(1, 20 * MS), st.integers(PERIOD_NS, 50 * MS), st.floats(0, 1), st.integers(0, LATE_NS))
def test_a_period_lost_to_one_stall_is_always_excused(begin_ns: int, long_ns: int, share: float, own_ns: int) -> None:
    _, runs_at = machine([(begin_ns, long_ns)])
    due_ns = begin_ns + int(share * (long_ns - PERIOD_NS))
    miss = Miss(due_ns, runs_at(due_ns) + own_ns, 1)
    assert is_held_up(miss, witnessed(runs_at, miss.woken_ns + 50 * MS))


def test_what_is_not_witnessed_is_less_than_a_period() -> None:
    """Else a period could be excused that the loop would have missed without the stall."""
    assert OWN_NS < PERIOD_NS


@given(st.lists(st.integers(0, LATE_NS), max_size=50))
def test_a_witness_notes_no_punctual_wake(late_ns: list[int]) -> None:
    clock, lates = [0], iter(late_ns)

    def sleep(_: float) -> None:
        clock[0] += SLEEP_NS + next(lates, 0)

    assert not list(watch(lambda: clock[0] < 100 * MS, lambda: clock[0], sleep))


# the judgement

HELD = Recorded((MISS,), blemished=False)
OWN = Recorded((Miss(DUE + 500 * MS, DUE + 507 * MS, 1),), blemished=False)
SEEN = Account(1, 99, (stall(-3, 5.9),))


def test_records_are_judged_one_by_one() -> None:
    found = judge(PLACE, [Account(0), SEEN], [HELD, OWN, Recorded((), blemished=False)], not_valid=2)
    assert (found["missed_in_records"], found["missed_in_stalls"]) == (2, 1)
    assert (found["not_valid"], found["not_valid_otherwise"]) == (2, 1)
    assert (found["stalls"], found["longest_stall_ms"]) == (1, pytest.approx(8.1))
    assert [(miss["late_ms"], miss["witness_held_ms"], miss["in_stall"]) for miss in found["misses"]] == [
        (6.0, pytest.approx(5.9), True),
        (7.0, 0.0, False),
    ]
    assert "2 periods missed in the records, 1 of them in a stall" in summary(found)[0]


@pytest.mark.parametrize(
    ("place", "accounts", "why"),
    [
        (PLACE, [Account(1, why_not="fifo denied: Operation not permitted")], "core 1: fifo denied"),
        (PLACE, [Account(0, 99, SEEN.stalls)], "no witness on the loop's core"),
        (PLACE, [], "no witness on the loop's core"),
        (Place({1}, 99), [SEEN], "core 1: the witness ran at priority 99, the rig at 99"),
        (
            Place({0, 1}, 85),
            [Account(0, why_not="the witness ended before its time"), SEEN],
            "core 0: the witness ended",
        ),
    ],
    ids=["denied", "another core", "none", "not above the rig", "one of two silent"],
)
def test_without_a_witness_to_believe_nothing_is_excused(place: Place, accounts: list[Account], why: str) -> None:
    found = judge(place, accounts, [HELD], not_valid=1)
    assert (found["missed_in_stalls"], found["not_valid_otherwise"]) == (0, 1)
    assert why in found["nothing_excused_because"]
    assert why in summary(found)[-1]


def test_a_stall_of_another_core_excuses_only_a_loop_that_may_run_there() -> None:
    elsewhere = [Account(0, 99, SEEN.stalls), Account(1, 99)]
    assert judge(PLACE, elsewhere, [HELD], 1)["missed_in_stalls"] == 0
    free = judge(Place({0, 1}, 85), elsewhere, [HELD], 1)
    assert free["missed_in_stalls"] == 1
    assert "cores 0 or 1" in summary(free)[-1]


def test_stalls_of_two_cores_do_not_add_up() -> None:
    halves = [Account(0, 99, (stall(-3, 3),)), Account(1, 99, (stall(2.5, 6),))]
    assert judge(Place({0, 1}, 85), halves, [HELD], 1)["missed_in_stalls"] == 0


def test_a_fault_in_the_same_record_is_no_stall() -> None:
    found = judge(PLACE, [SEEN], [Recorded((MISS,), blemished=True)], not_valid=1)
    assert (found["missed_in_stalls"], found["not_valid_otherwise"]) == (1, 1)


def test_a_record_without_a_file_is_not_excused() -> None:
    assert judge(PLACE, [SEEN], [HELD], not_valid=2)["not_valid_otherwise"] == 1


# from the files


def test_misses_are_read_from_the_records(tmp_path: Path) -> None:
    (tmp_path / "session").mkdir()
    samples = made_log(tmp_path / "session" / "late.mcap", 400, missed_at=300).samples
    made_log(tmp_path / "session" / "blackbox_device_lost.mcap", 400, missed_at=200)
    (record,) = recorded_in(tmp_path)
    assert record == Recorded((Miss(BOOT_NS + 300 * PERIOD_NS, int(samples["woken_ns"][300]), 2),), blemished=False)


def test_what_else_is_wrong_with_a_record_is_seen(tmp_path: Path) -> None:
    for name, wrong in {"fault": {"fault": "DEVICE_LOST"}, "dropped": {"dropped": 3}, "other": {"missed": 7}}.items():
        content = made_content(200, missed_at=100)
        content = replace(content, result_facts={**content.result_facts, **wrong})
        write_content(content, tmp_path / f"{name}.mcap")
    (tmp_path / "cut.mcap").write_bytes((tmp_path / "fault.mcap").read_bytes()[:5000])
    found = recorded_in(tmp_path)
    assert len(found) == 4
    assert all(record.blemished for record in found)


def test_a_place_is_what_the_kernel_says() -> None:
    place = Place()
    place.see(os.getpid(), is_loop=False)
    assert place == Place(set(), 0)
    place.see(os.getpid(), is_loop=True)
    assert place == Place(os.sched_getaffinity(0), 0)

"""What the loop follows: phases by tick index, no jumps between them, and the block of shared memory it travels in."""

import itertools
import secrets

import pytest
from support.scripted import program

from rig.errors import StateError
from rig.realtime.program import Program
from rig.realtime.shared import SharedBlock
from rig.sample import Phase

START = (0.1, 0.15)


def walk(p: Program) -> list[tuple[Phase, float, float]]:
    return [p.at(index, START) for index in range(p.ticks)]


def test_the_phases_have_their_lengths() -> None:
    p = Program(1, 0.2, 0.2, [0.21] * 7, [0.19] * 7, settle_ticks=3, zero_ticks=4, ramp_in_ticks=5, ramp_out_ticks=6)
    lengths = {phase: len(list(group)) for phase, group in itertools.groupby(walk(p), key=lambda at: at[0])}
    assert lengths == {Phase.SETTLE: 3, Phase.ZERO: 4, Phase.RAMP_IN: 5, Phase.SWEEP: 7, Phase.RAMP_OUT: 6}
    assert p.ticks == 25
    assert p.at(p.sweep_start, START)[0] is Phase.SWEEP


def test_it_begins_where_it_is_and_ends_at_rest() -> None:
    p = program(part=50)
    points = walk(p)
    assert points[0][1:] == START
    assert points[-1][1:] == pytest.approx((0.2, 0.2))
    assert all(at[1:] == (0.2, 0.2) for at in points if at[0] is Phase.ZERO)
    settled = [at[1:] for at in points if at[0] is Phase.SETTLE][25:]
    assert settled == [(0.2, 0.2)] * 25, "the second half of the settling stands still"


def test_there_is_no_jump_anywhere() -> None:
    points = walk(program(part=100, sweep=400))
    steps = [max(abs(b[1] - a[1]), abs(b[2] - a[2])) for a, b in itertools.pairwise(points)]
    assert max(steps) <= 2 * 0.1 / 100 + 1e-12


@pytest.mark.parametrize("gone", ["settle_ticks", "zero_ticks", "ramp_in_ticks", "ramp_out_ticks"])
def test_any_part_but_the_sweep_may_be_missing(gone: str) -> None:
    lengths = {"settle_ticks": 3, "zero_ticks": 3, "ramp_in_ticks": 3, "ramp_out_ticks": 3} | {gone: 0}
    p = Program(1, 0.2, 0.2, [0.21, 0.22], [0.19, 0.18], **lengths)
    found = [at[0] for at in walk(p)]
    assert len(found) == p.ticks == 11
    assert found.count(Phase.SWEEP) == 2
    assert found == sorted(found)


def test_an_early_way_out_begins_where_it_is_and_ends_at_rest() -> None:
    p = program(part=10)
    way = [p.way_out(left, (0.25, 0.15)) for left in range(10, -1, -1)]
    assert way[0] == (Phase.RAMP_OUT, 0.25, 0.15)
    assert way[-1][1:] == (0.2, 0.2)
    assert [at[1] for at in way] == sorted((at[1] for at in way), reverse=True)


def test_it_comes_out_of_shared_memory_as_it_went_in() -> None:
    session, p = secrets.randbits(63), program(7, sweep=33)
    block = p.publish(f"test-{session:x}", session)
    try:
        back = Program.attach(block.path, session)
        assert back.run == 7
        assert walk(back) == walk(p)
    finally:
        block.unlink()


def test_a_block_of_another_session_or_kind_is_refused() -> None:
    session = secrets.randbits(63)
    block = program().publish(f"test-{session:x}", session)
    other = SharedBlock.create(f"test-{session:x}-other", session, 8 * 8)
    cut = SharedBlock.create(f"test-{session:x}-cut", session, 10 * 8)
    cut.words[8 + 4] = 5000  # more ticks than the block holds
    try:
        with pytest.raises(StateError, match="stale"):
            Program.attach(block.path, session + 1)
        for foreign in (other, cut):
            with pytest.raises(StateError, match="cut short"):
                Program.attach(foreign.path, session)
        with pytest.raises(StateError, match="no such shared memory"):
            Program.attach(block.path.with_name("pamrig-nowhere"), session)
    finally:
        for made in (block, other, cut):
            made.unlink()

"""A program that closes the loop: it starts and stops without a bump, holds its limits, skips what is skipped, and
faults for an angle that is lost and an error that stays."""

import itertools
import math
import secrets
from array import array
from dataclasses import replace

import pytest
from support.scripted import (
    DEG_PER_MPA,
    PERIOD_NS,
    ScriptedClock,
    ScriptedDevice,
    ScriptedOperator,
    failing,
    program,
    run_loop,
)

from rig.errors import StateError
from rig.gains import ClosedLoop
from rig.interfaces import Measurement
from rig.realtime.clock import VirtualClock
from rig.realtime.closed_loop import LOST_TICKS, Feedback, TrackingProgram, attach
from rig.realtime.commands import Request
from rig.realtime.faults import Fault
from rig.realtime.guard import Limits
from rig.realtime.loop import LoopSettings
from rig.realtime.rehearsal import Rehearsal
from rig.realtime.state import State
from rig.sample import ANGLE_ABSENT, ANGLE_SUSPECT, CLIPPED_SLEW, READ_ERROR, Phase, Sample

P0_MPA = 0.2
PERIOD_S = PERIOD_NS * 1e-9
GAINS = ClosedLoop(kp_mpa_per_deg=0.002, ki_mpa_per_deg_s=0.2, error_deg=8.0, error_s=0.05)
START = 2
"""Tick in which the program starts; the loop closes after settle and zero."""
SETTLE = ZERO = 10
LEAD = 20


def tracking(
    gains: ClosedLoop = GAINS, *, sweep: int = 200, amplitude_deg: float = 4.0, share: float = 0.0, out: int = 10
) -> TrackingProgram:
    """A slow sine from 0; `share` of the right feed-forward for the scripted rig."""
    angles = [0.0] * LEAD + [amplitude_deg * math.sin(2 * math.pi * k / 200) for k in range(sweep)]
    half = [0.5 * share * angle / DEG_PER_MPA for angle in angles]
    p1, p2 = [P0_MPA + h for h in half], [P0_MPA - h for h in half]
    return TrackingProgram(
        1, P0_MPA, P0_MPA, p1[LEAD:], p2[LEAD:], SETTLE, ZERO, LEAD, out, p1[:LEAD], p2[:LEAD], angles, gains, PERIOD_S
    )


def operator(program: TrackingProgram, **more: object) -> ScriptedOperator:
    return ScriptedOperator({1: Request.ARM, START: program}, **more)  # type: ignore[arg-type]


def device(**more: object) -> ScriptedDevice:
    return ScriptedDevice(found_mpa=(P0_MPA, P0_MPA), **more)  # type: ignore[arg-type]


def followed(program: TrackingProgram, **more: object) -> list[Sample]:
    samples, _ = run_loop(device(**more), operator(program), START + program.ticks + 5)
    return samples


def errors(samples: list[Sample]) -> list[float]:
    return [s.reference_deg - s.angle_deg for s in samples if s.phase == Phase.SWEEP]


def rms(values: list[float]) -> float:
    return math.sqrt(math.fsum(v * v for v in values) / len(values))


def test_feedback_follows_and_feed_forward_follows_closer() -> None:
    reference = rms([s.reference_deg for s in followed(tracking()) if s.phase == Phase.SWEEP])
    alone, both = rms(errors(followed(tracking()))), rms(errors(followed(tracking(share=1.0))))
    assert alone < 0.3 * reference
    assert both < 0.3 * alone


def test_the_reference_is_recorded_while_the_loop_is_closed_and_only_then() -> None:
    samples = followed(tracking())
    closed = [s for s in samples if s.phase in (Phase.RAMP_IN, Phase.SWEEP)]
    assert len(closed) == LEAD + 200
    assert all(math.isfinite(s.reference_deg) == (s in closed) for s in samples)


@pytest.mark.parametrize("offset_deg", [-3.0, 0.5, 3.0])
def test_it_starts_without_a_bump_wherever_the_joint_stands(offset_deg: float) -> None:
    """The joint has moved since its zero was taken: the integral begins so that nothing jumps."""
    at = START + SETTLE + ZERO

    def moved(now: Measurement) -> Measurement:
        return now._replace(angle_deg=now.angle_deg + offset_deg, angle_raw=now.angle_raw + offset_deg)

    reads = dict.fromkeys(range(at, at + 400), moved)
    samples = followed(tracking(), reads=reads)
    first = [s.dp_cmd_mpa for s in samples if s.phase == Phase.RAMP_IN]
    a_tick = abs(offset_deg) * GAINS.ki_mpa_per_deg_s * PERIOD_S + 1e-9
    assert first[0] == 0.0
    assert abs(first[1]) <= a_tick < 0.1 * GAINS.kp_mpa_per_deg * 40
    assert abs(first[2] - first[1]) <= a_tick + GAINS.kp_mpa_per_deg * a_tick * DEG_PER_MPA
    assert abs(math.fsum(errors(samples)[100:]) / 100) < 1.0  # and the integral takes the offset away


def test_its_end_and_a_stop_begin_where_the_set_points_stand() -> None:
    whole = followed(tracking(sweep=50, out=50))
    stopped, _ = run_loop(device(), operator(tracking(out=50), stop_at=START + SETTLE + ZERO + LEAD + 40), 300)
    for samples in (whole, stopped):
        way = [s for s in samples if s.phase in (Phase.SWEEP, Phase.RAMP_OUT)]
        assert way[-1].phase == Phase.RAMP_OUT
        steps = [abs(b.p1_cmd_mpa - a.p1_cmd_mpa) for a, b in itertools.pairwise(way)]
        assert max(steps) < 0.002
        assert not any(s.fault for s in samples)


def test_the_guard_comes_last() -> None:
    wild = ClosedLoop(kp_mpa_per_deg=0.1, ki_mpa_per_deg_s=1.0, limit_mpa=1.0, error_deg=180.0)
    limits = Limits(pressure_mpa=(0.15, 0.25), slew_mpa_s=1.0, angle_deg=(-360.0, 360.0), angle_jump_deg=360.0)
    rig = device()
    samples, _ = run_loop(rig, operator(tracking(wild, amplitude_deg=40.0)), 300, settings=LoopSettings(limits=limits))
    written = [out for out in rig.outputs if isinstance(out, tuple)]
    assert all(0.15 <= p <= 0.25 for pair in written for p in pair)
    assert all(abs(b[0] - a[0]) <= 0.005 + 1e-9 for a, b in itertools.pairwise(written))
    assert any(s.flags & CLIPPED_SLEW for s in samples)


def test_the_feedback_adds_no_more_than_its_limit() -> None:
    samples = followed(tracking(replace(GAINS, limit_mpa=0.01)))
    assert max(abs(s.dp_cmd_mpa) for s in samples if s.phase == Phase.SWEEP) == pytest.approx(0.01)


def test_what_the_limit_took_does_not_wind_up() -> None:
    """After a quarter turn beyond its limit the output leaves it as soon as the reference comes back, not later."""
    gains = replace(GAINS, limit_mpa=0.02, error_deg=180.0)
    dp = [s.dp_cmd_mpa for s in followed(tracking(gains)) if s.phase == Phase.SWEEP]
    back = next(k for k in range(50, 200) if dp[k] < 0.0199)
    reached = next(k for k in range(50, 200) if 4.0 * math.sin(2 * math.pi * k / 200) < 0.02 * DEG_PER_MPA)
    assert back <= reached + 6


def test_a_wrong_sign_ends_in_the_safe_state_by_its_own_name() -> None:
    wrong = ClosedLoop(kp_mpa_per_deg=-0.005, ki_mpa_per_deg_s=-0.5, error_deg=8.0, error_s=0.05)
    rig = device()
    samples, loop = run_loop(rig, operator(tracking(wrong)), 300)
    assert loop.fault is Fault.TRACKING_ERROR
    at = next(k for k, s in enumerate(samples) if s.fault)
    outside = [s for s in samples[: at + 1] if abs(s.reference_deg - s.angle_deg) > 8.0]
    assert len(outside) == 11  # longer than 0.05 s
    # set-points from the tick of ARM to the one before the fault, then the safe state: at the fault and on the way out
    assert [output for output in rig.outputs if output != "safe"] == rig.outputs[1:at]
    assert rig.outputs[at:] == ["safe", "safe"]
    assert samples[at].state == State.FAULT


def test_a_short_excursion_is_no_fault() -> None:
    at = START + SETTLE + ZERO + LEAD + 60

    def knocked(now: Measurement) -> Measurement:
        return now._replace(angle_deg=now.angle_deg + 12.0)

    samples = followed(tracking(), reads=dict.fromkeys(range(at, at + 8), knocked))
    assert not any(s.fault for s in samples)


def nothing(now: Measurement) -> Measurement:
    return now._replace(angle_deg=math.nan)


def test_an_angle_that_is_lost_is_told_by_its_own_name() -> None:
    at = START + SETTLE + ZERO + LEAD + 30
    samples = followed(tracking(), reads=dict.fromkeys(range(at, at + 50), nothing))
    faulted = next(s for s in samples if s.fault)
    assert faulted.fault == Fault.ANGLE_LOST
    assert faulted.tick == at + LOST_TICKS - 1


def test_fewer_ticks_without_an_angle_hold_the_feedback() -> None:
    at = START + SETTLE + ZERO + LEAD + 30
    samples = followed(tracking(), reads=dict.fromkeys(range(at, at + LOST_TICKS - 1), nothing))
    assert not any(s.fault for s in samples)
    held = [s.dp_cmd_mpa for s in samples[at - 1 : at + LOST_TICKS - 1]]
    assert len(set(held)) == 1


def test_in_open_loop_a_lost_angle_has_its_old_name() -> None:
    reads = dict.fromkeys(range(30, 80), nothing)
    operated = ScriptedOperator({1: Request.ARM, 2: program(sweep=100)})
    loop = run_loop(ScriptedDevice(reads=reads), operated, 100)[1]
    assert loop.fault is Fault.BAD_VALUE


def test_a_device_that_fails_is_told_as_that() -> None:
    at = START + SETTLE + ZERO + LEAD + 30
    samples = followed(tracking(), reads=failing(at, 50))
    assert next(s.fault for s in samples if s.fault) == Fault.DEVICE_ERRORS


def test_a_pressure_that_cannot_be_true_is_no_lost_angle() -> None:
    at = START + SETTLE + ZERO + LEAD + 30

    def high(now: Measurement) -> Measurement:
        return now._replace(p1_mpa=9.9)

    samples = followed(tracking(), reads=dict.fromkeys(range(at, at + 50), high))
    assert next(s.fault for s in samples if s.fault) == Fault.BAD_VALUE


def test_skipped_periods_are_skipped_in_reference_and_integral() -> None:
    at = START + SETTLE + ZERO + LEAD + 30
    late = followed_late(tracking(), {at: 2 * PERIOD_NS + PERIOD_NS // 2})
    on_time = followed(tracking())
    by_tick = {s.tick: s.reference_deg for s in on_time}
    assert sum(s.missed for s in late) == 2
    assert all(s.reference_deg == pytest.approx(by_tick[s.tick], nan_ok=True) for s in late if s.tick in by_tick)
    assert rms(errors(late)) == pytest.approx(rms(errors(on_time)), rel=0.1)


def followed_late(program: TrackingProgram, late_ns: dict[int, int]) -> list[Sample]:
    samples, _ = run_loop(device(), operator(program), START + program.ticks, clock=ScriptedClock(late_ns))
    return samples


def test_it_comes_out_of_shared_memory_as_it_went_in() -> None:
    session, made = secrets.randbits(63), tracking(share=0.5)
    block = made.publish(f"test-{session:x}", session)
    try:
        back = attach(block.path, session)
        assert isinstance(back, TrackingProgram)
        assert (back.settings, back.period_s, list(back.reference_deg)) == (GAINS, PERIOD_S, made.reference_deg)
        for index in range(made.ticks):
            standing = (0.21, 0.19)
            assert back.at(index, (0.1, 0.1), 0.3, 0, standing) == made.at(index, (0.1, 0.1), 0.3, 0, standing)
    finally:
        block.unlink()


def test_a_program_of_the_other_kind_is_not_taken_for_one() -> None:
    session = secrets.randbits(63)
    block = program().publish(f"test-{session:x}", session)
    try:
        assert not isinstance(attach(block.path, session), TrackingProgram)
        with pytest.raises(StateError, match="closes no loop"):
            TrackingProgram.attach(block.path, session)
    finally:
        block.unlink()


def test_a_reference_of_another_length_is_refused() -> None:
    with pytest.raises(StateError, match="each tick"):
        replace(tracking(), reference_deg=array("d", [0.0]))


@pytest.mark.parametrize("flag", [ANGLE_ABSENT, ANGLE_SUSPECT, READ_ERROR])
def test_no_flagged_angle_reaches_the_output(flag: int) -> None:
    feedback = Feedback(GAINS, PERIOD_S)
    before = feedback.add(1, 1.0, 0.5, 0, 0.0)
    assert feedback.add(2, 1.0, 1e6, flag, before) == before


def test_the_derivative_answers_to_speed_and_is_filtered() -> None:
    gains = ClosedLoop(kp_mpa_per_deg=0.0, kd_mpa_s_per_deg=0.001, filter_s=0.02)
    feedback = Feedback(gains, PERIOD_S)
    out = [feedback.add(k, 0.1 * k, 0.0, 0, 0.0) for k in range(1, 60)]
    assert out[0] == 0.0
    assert out[1] == pytest.approx(0.001 * 20.0 * 0.2)
    assert out[-1] == pytest.approx(0.001 * 20.0, rel=1e-3)


def test_a_rehearsal_of_a_closed_loop_looks_at_the_angle_again_and_again() -> None:
    rig = device()
    rehearsal = Rehearsal(rig, VirtualClock(), LoopSettings(), closed_loop=True)
    before = len(rig.outputs)
    for _ in range(50):
        rehearsal()
    assert not rehearsal.failed
    assert not rehearsal.loop.fault
    assert rehearsal.loop.state is State.RUNNING
    assert len(rig.outputs) == before + 50

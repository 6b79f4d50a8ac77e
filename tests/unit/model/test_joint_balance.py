"""The joint's balance holds at every tick, however far the joint moves in one: dry friction is steep where it sticks
and flat beyond, and Newton's steps alone go to and fro between its two sides."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import argrelmax

from rig.model.compiled.columns import Joint, balanced
from rig.model.compiled.stages import compiled
from rig.model.effect_stages import EFFECT_STAGES
from rig.model.equations.joint_balance import (
    DRY,
    LEAST_DAMPING,
    LOOP_RADII_DEG,
    NEW,
    NEW_BEFORE,
    PRESLIDING_DEG,
    REACHES_DEG,
    SHARES,
    SPREAD,
    STATE_SIZE,
    balanced_angle,
    deflection,
    moved_on,
    on_its_line,
)

DT_S = 0.005
P0_MPA = 0.2


def numbers(
    width_deg: float, viscous_s: float, inertia_s: float, slip: list[float], gives_deg: float = PRESLIDING_DEG
) -> list[float]:
    """Of `balanced_angle`: added dry friction on a joint with friction of its own."""
    return [width_deg, 0.0, 0.0, 0.0, 0.0, P0_MPA, viscous_s, inertia_s, *slip, 0.0, 0.0, gives_deg]


def missed(new: float, pulled_to: float, before: list[float], params: list[float]) -> float:
    """By how many degrees the balance does not hold at an angle, one tick after `before`."""
    old, rate, earlier = before[3], before[4], before[NEW_BEFORE]
    step = new - old
    faster = (2.0 * step / DT_S - 3.0 * rate + earlier) / DT_S
    miss = new + params[6] * step / DT_S + params[7] ** 2 * faster - pulled_to
    for k, (radius, share) in enumerate(zip(REACHES_DEG, SHARES, strict=True)):
        held = deflection(k, before, NEW)
        miss += params[8 + k // len(SPREAD)] * share * min(max(held + step, -radius), radius)
    return miss + params[0] / params[15] * min(max(before[DRY] + step, -params[15]), params[15])


@given(
    st.floats(0.0, 10.0),
    st.floats(0.0, 0.05),
    st.floats(0.0, 0.05),
    st.lists(st.floats(0.0, 5.0), min_size=5, max_size=5),
    st.lists(st.floats(-40.0, 40.0), min_size=1, max_size=30),
    st.floats(PRESLIDING_DEG, 10.0),
)
def test_the_balance_holds_at_every_tick(
    width_deg: float, viscous_s: float, inertia_s: float, slip: list[float], pulled: list[float], gives_deg: float
) -> None:
    params, state = numbers(width_deg, viscous_s, inertia_s, slip, gives_deg), [0.0] * STATE_SIZE
    for pulled_to in pulled:
        before = list(state)
        new = balanced_angle(pulled_to, 1.0, 1.0, state, params, DT_S)
        steepest = 1.0 + viscous_s / DT_S + 2.0 * (inertia_s / DT_S) ** 2 + 2.0 * sum(slip) + width_deg / gives_deg
        assert abs(missed(new, pulled_to, before, params)) <= 1e-5 * steepest


@given(
    st.lists(st.floats(0.0, 5.0), min_size=5, max_size=5),
    st.lists(st.tuples(st.floats(-2.0, 2.0), st.floats(-30.0, 30.0)), min_size=1, max_size=60),
)
def test_the_line_of_a_friction_is_the_sum_of_its_parts(slip: list[float], moves: list[tuple[float, float]]) -> None:
    """Each part moves with the joint until it slips and sticks again as soon as that turns back; what is only tried,
    in between, changes nothing."""
    params, state, parts = numbers(0.0, 0.0, 0.0, slip), [0.0] * STATE_SIZE, [0.0] * len(REACHES_DEG)
    for step, tried in moves:
        on_its_line(tried, state, NEW, params)
        force = moved_on(step, state, NEW, params)
        parts = [min(max(part + step, -reach), reach) for part, reach in zip(parts, REACHES_DEG, strict=True)]
        weights = [slip[k // len(SPREAD)] * SHARES[k] for k in range(len(parts))]
        whole = sum(weight * part for weight, part in zip(weights, parts, strict=True))
        assert math.isclose(force, whole, rel_tol=1e-9, abs_tol=1e-9)
        counted = [k for k, weight in enumerate(weights) if weight > 0.0]
        assert np.allclose([deflection(k, state, NEW) for k in counted], [parts[k] for k in counted], atol=1e-9)


@given(st.floats(0.3, 4.0), st.floats(0.2, 3.0), st.floats(10.0, 35.0), st.floats(PRESLIDING_DEG, 10.0))
def test_dry_friction_changes_an_angle_by_no_more_than_its_width(
    width_deg: float, frequency_hz: float, amplitude_deg: float, gives_deg: float
) -> None:
    t = np.arange(round(4.0 / frequency_hz / DT_S)) * DT_S
    angle = amplitude_deg * np.sin(2.0 * math.pi * frequency_hz * t)
    entry = EFFECT_STAGES["coulomb_friction"]
    known = entry.neutral() | {
        "width_deg": width_deg,
        "presliding_deg": gives_deg,
        "loop_1": 2.4,
        "loop_2": 0.8,
        "loop_3": 0.3,
        "loop_5": 0.1,
    }
    changed, pressure = angle.copy(), np.full(len(angle), P0_MPA)
    params = np.array([known[name] for name in entry.parameters])
    compiled(entry.stage)(pressure, pressure.copy(), changed, np.zeros(entry.state_size), params, DT_S)
    assert np.max(np.abs(changed - angle)) <= width_deg + 1e-4


def test_an_element_carries_its_weight_times_its_travel_once_all_of_it_slips() -> None:
    for j, radius in enumerate(LOOP_RADII_DEG):
        own = slice(j * len(SPREAD), (j + 1) * len(SPREAD))
        whole = sum(share * reach for share, reach in zip(SHARES[own], REACHES_DEG[own], strict=True))
        assert math.isclose(whole, radius)


def test_a_joint_with_friction_starts_where_it_rests_and_goes_on_once_it_moves() -> None:
    """Sent further by 3 deg at rest, friction keeps most of it; the first travel breaks it loose."""
    angle = 15.0 * np.sin(2.0 * math.pi * 0.5 * np.arange(2000) * DT_S)
    joint = Joint(0.02, 0.02, (2.4, 0.8, 0.3, 0.0, 0.1))
    moved = balanced(angle, np.full(len(angle), 3.0), np.ones(len(angle)), joint, DT_S)
    assert 0.2 < moved[0] - angle[0] < 1.5
    assert np.mean((moved - angle)[400:]) > 2.0


@given(st.floats(0.03, 0.12), st.sampled_from([0.0025, 0.005, 0.01]))
def test_an_added_mass_rings_as_long_whatever_the_tick(time_s: float, tick_s: float) -> None:
    """On a joint without friction of its own, sent from rest by 1 deg: a swing has 1 / (2 pi time_s) Hz, and the next
    one e^(-2 pi damping) of it."""
    swings = 4
    state, params = [0.0] * STATE_SIZE, [0.0, 0.0, time_s, 0.0, 0.0, P0_MPA, 0.0, 0.0, *[0.0] * 7]
    rows = round(swings * 2.0 * math.pi * time_s / tick_s)
    angle = np.array([balanced_angle(1.0, 1.0, 1.0, state, params, tick_s) for _ in range(rows)]) - 1.0
    crossings = np.nonzero(np.diff(np.sign(angle)))[0]
    assert np.diff(crossings).mean() * tick_s == pytest.approx(math.pi * time_s, abs=tick_s)
    tops = np.abs(angle)[argrelmax(np.abs(angle))[0]]
    lost = -np.log(tops[2:] / tops[:-2]).mean() / (2.0 * math.pi)
    assert lost == pytest.approx(LEAST_DAMPING, abs=0.02)

"""Pulses of a sample or a few are taken out and said; motion, converters' steps, noise and drop-outs stay."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.plants.gap_rigs import session

from rig.gap import diagnose
from rig.gap.records.cleaning.outliers import outliers, without_falls
from rig.record import Column, Record

T = 0.005 * np.arange(2000)
MOTION = 20.0 * np.sin(2 * np.pi * 0.7 * T) + 6.0 * np.sin(2 * np.pi * 2.3 * T)


def noisy(seed: int) -> Column:
    """A motion read by a converter of 0.1 deg with noise."""
    read: Column = 0.1 * np.round((MOTION + np.random.default_rng(seed).normal(0.0, 0.1, len(T))) / 0.1)
    return read


@given(
    st.integers(0, 2**32 - 1),
    st.lists(st.integers(1, 95).map(lambda k: 20 * k), min_size=1, max_size=3, unique=True),
    st.integers(1, 3),
    st.floats(25.0, 200.0) | st.floats(-200.0, -25.0),
)
def test_pulses_far_apart_are_found_where_they_are(seed: int, rows: list[int], width: int, height: float) -> None:
    column, there = noisy(seed), np.zeros(len(T), dtype=bool)
    for row in rows[: 4 // width]:
        there[row : row + width] = True
    column[there] += height
    assert (outliers(column) == there).all()


@pytest.mark.parametrize(
    "column",
    [
        noisy(1),
        MOTION,
        np.where(T > 5.0, MOTION + 15.0, MOTION),
        2.5 * np.round(MOTION / 2.5),
        np.sign(np.sin(2 * np.pi * T)),
        np.zeros(len(T)),
        MOTION + 0.3 * np.random.default_rng(2).standard_t(3, len(T)),
        np.where(np.arange(len(T)) % 100 == 50, -172.5, MOTION),
        np.where(np.arange(len(T)) % 700 == 50, 0.1, 0.0),
        np.full(len(T), np.nan),
    ],
    ids=["noise", "motion", "step", "coarse", "square", "still", "heavy tails", "many", "flicker", "nothing"],
)
def test_what_a_rig_does_is_no_outlier(column: Column) -> None:
    assert not outliers(column).any()


@pytest.mark.parametrize("reads", [-172.5, 1e300])
def test_one_pulse_of_a_healthy_session_is_said_and_no_cause(reads: float) -> None:
    records = session(212)
    angle = records[0].angle_deg
    assert angle is not None
    angle = angle.copy()
    angle[700] = reads
    found = diagnose(None, [replace(records[0], angle_deg=angle), *records[1:]], [session(211)])
    assert found.verdict == "none"
    said = f"1 sample stands far from both neighbours in the angle, the farthest reads {reads:.4g} deg; left out"
    assert f"{records[0].name}: {said}" in found.notes


@pytest.mark.parametrize("row", [6, 1993], ids=["at the start", "at the end"])
def test_a_pulse_beside_rest_at_zero_leaves_the_rest_no_fall(row: int) -> None:
    sweep = np.where((T > 1.0) & (T < 9.0), 20.0 * np.sin(2 * np.pi * 0.5 * (T - 1.0)), 0.0)
    sweep[row] = -36.9
    cleaned = without_falls([Record("rest", T, 0.005 * sweep, angle_deg=sweep)])
    assert cleaned.dropouts == [()]
    assert np.flatnonzero(np.isnan(cleaned.records[0].angle_deg)).tolist() == [row]
    assert cleaned.notes == [
        "rest: 1 sample stands far from both neighbours in the angle, the farthest reads -36.9 deg; left out"
    ]

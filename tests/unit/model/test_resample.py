"""Records put onto another clock: what is too fast for a longer period does not come back as something slow, and
nothing is moved in time."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.model.parameters import AddedEffect, Model, MuscleModel, Parameter, StageKind
from rig.model.resample import on_grid
from rig.model.simulation import simulate
from rig.record import Column, Record

OWN_S, LONGER_S = 0.005, 0.02


def record(angle_deg: Column, dp_mpa: Column | None = None, jitter_s: float = 0.0) -> Record:
    time = OWN_S * np.arange(len(angle_deg))
    time[1:-1] += np.random.default_rng(1).uniform(-jitter_s, jitter_s, len(time) - 2)
    return Record("one", time, np.zeros(len(time)) if dp_mpa is None else dp_mpa, angle_deg=angle_deg)


def tone(hz: float, rows: int = 2001) -> Column:
    return np.asarray(np.sin(2 * np.pi * hz * OWN_S * np.arange(rows)))


def angle_of(resampled: Record) -> Column:
    assert resampled.angle_deg is not None
    return resampled.angle_deg


@pytest.mark.parametrize(("hz", "most"), [(49.5, 0.01), (40.0, 0.01), (32.0, 0.03)])
def test_a_tone_above_the_new_nyquist_frequency_is_gone(hz: float, most: float) -> None:
    left = angle_of(on_grid(record(tone(hz)), LONGER_S))[20:-20]
    assert np.max(np.abs(left)) < most


@pytest.mark.parametrize("hz", [0.5, 2.0, 8.0, 15.0])
@pytest.mark.parametrize("longer_s", [0.008, 0.01, LONGER_S])
def test_a_slow_signal_is_neither_late_nor_smaller(hz: float, longer_s: float) -> None:
    resampled = on_grid(record(tone(hz)), longer_s)
    inner = slice(20, -20)
    turns = 2 * np.pi * hz * resampled.t_s[inner]
    cosine, sine = np.linalg.lstsq(
        np.column_stack([np.cos(turns), np.sin(turns)]), angle_of(resampled)[inner], rcond=None
    )[0]
    assert np.hypot(cosine, sine) == pytest.approx(1.0, abs=0.03)
    assert np.arctan2(cosine, sine) / (2 * np.pi * hz) == pytest.approx(0.0, abs=2e-5), "seconds that it is late"


def test_jitter_and_missing_values_do_not_bring_it_back() -> None:
    angle = tone(0.5) + tone(40.0)
    angle[::97] = np.nan
    resampled = on_grid(record(angle, jitter_s=0.0005), LONGER_S)
    inner = slice(20, -20)
    off = angle_of(resampled)[inner] - np.sin(2 * np.pi * 0.5 * resampled.t_s[inner])
    assert np.sqrt(np.mean(off**2)) < 0.06, "of 0.71"


def test_its_own_period_changes_nothing() -> None:
    one = record(tone(40.0), tone(30.0))
    same = on_grid(one, OWN_S)
    assert angle_of(same) == pytest.approx(tone(40.0), abs=1e-9)
    assert np.array_equal(same.dp_cmd_mpa, one.dp_cmd_mpa)


@pytest.mark.parametrize(("dt_s", "rows"), [(0.005, 101), (0.0035, 143), (0.008, 63), (0.3, 2), (0.1, 6)])
def test_no_row_stands_behind_the_record(dt_s: float, rows: int) -> None:
    """The last row stood up to half a period behind the last that was measured, with that one's values."""
    resampled = on_grid(record(tone(0.5, 101)), dt_s)
    assert len(resampled) == rows
    assert resampled.t_s[-1] <= 100 * OWN_S + 1e-9


@given(seed=st.integers(0, 10**6), rows=st.integers(2, 400), times=st.floats(1.3, 30.0), level=st.floats(-1e3, 1e3))
def test_a_level_stays_and_a_command_keeps_its_mean(seed: int, rows: int, times: float, level: float) -> None:
    dp = np.random.default_rng(seed).uniform(-0.2, 0.2, rows)
    one = record(np.full(rows, level), dp)
    resampled = on_grid(one, times * OWN_S)
    assert angle_of(resampled) == pytest.approx(np.full(len(resampled), level), rel=1e-9, abs=1e-9)
    assert np.all(np.abs(resampled.dp_cmd_mpa) <= np.max(np.abs(dp)) + 1e-12)
    whole = len(resampled) - 1
    until = np.append(one.t_s, one.t_s[-1] + OWN_S)
    end = whole * times * OWN_S
    held = float(np.sum(dp * np.clip(np.diff(np.minimum(until, end)), 0.0, None)))
    assert float(np.sum(resampled.dp_cmd_mpa[:whole])) * times * OWN_S == pytest.approx(held, abs=1e-9 + 0.2 * max(
        0.0, end - until[-1]))  # fmt: skip


def test_a_step_on_the_grid_stays_a_step() -> None:
    dp = np.where(np.arange(400) >= 200, 0.2, 0.0)
    resampled = on_grid(record(np.zeros(400), dp), LONGER_S)
    assert set(np.round(resampled.dp_cmd_mpa, 12)) == {0.0, 0.2}
    assert resampled.t_s[np.argmax(resampled.dp_cmd_mpa > 0.1)] == pytest.approx(1.0)


def test_a_simulation_on_a_longer_period_is_not_later() -> None:
    """A muscle that only follows: its lag under a sine is half a tick of what is in force, at either period."""
    follows = {"rho": 1.0, "k": 40.0, "eps": 1.0, "psi": 0.0, "gamma": 0.0, "n": 1.0, "u_unit_mpa": 0.2,
               "y_unit_deg": 1.0}  # fmt: skip
    muscle = MuscleModel(StageKind.BW_CONTINUOUS, {name: Parameter(value) for name, value in follows.items()})
    model = Model(muscle=muscle, sample_time_s=LONGER_S, effects=[AddedEffect("delay", {"delay_s": 0.0})])
    driven = record(tone(1.0), 0.2 * tone(1.0))
    angles = [angle_of(simulate(replace(model, sample_time_s=dt), driven, start_deg=0.0)) for dt in (OWN_S, LONGER_S)]
    turns = 2 * np.pi * driven.t_s
    late = [-np.arctan2(float(np.mean(angle * np.cos(turns))), float(np.mean(angle * np.sin(turns)))) / (2 * np.pi)
            for angle in angles]  # fmt: skip
    assert late[1] - late[0] == pytest.approx(0.5 * (LONGER_S - OWN_S), abs=2e-3)

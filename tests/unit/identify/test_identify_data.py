"""What identification refuses, and in which words; what it repairs, and that it says so."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import savgol_filter

from rig.errors import RecordError
from rig.identify.records.data import RecordOptions, prepare, repeated_packets
from rig.identify.templates import Template, input_gain, template_model
from rig.model.parameters import Input
from rig.model.resample import on_grid
from rig.record import Record
from rig.smoothing import through_parabolas

MODEL = template_model(Template())
PRESSURE = template_model(Template(drive=Input.PRESSURE))


def good(rows: int = 2000, dt_s: float = 0.005) -> Record:
    time = np.arange(rows) * dt_s
    dp = 0.2 * np.sin(np.pi * time)
    noise = np.random.default_rng(1).normal(0.0, 0.0004, rows)
    angle = 40.0 * np.sin(np.pi * time - 0.3)
    return Record("sine", time, dp, angle_deg=angle, p1_mpa=0.2 + dp / 2 + noise, p2_mpa=0.2 - dp / 2 - noise)


def with_value(record: Record, column: str, rows: slice, value: float) -> Record:
    changed = getattr(record, column).copy()
    changed[rows] = value
    return replace(record, **{column: changed})


def scaled(record: Record, column: str, factor: float) -> Record:
    return replace(record, **{column: getattr(record, column) * factor})


@pytest.mark.parametrize(
    ("record", "said"),
    [
        (good(100), "too short"),
        (replace(good(), dp_cmd_mpa=np.full(2000, 0.1)), "the command is constant"),
        (replace(good(), angle_deg=np.full(2000, 3.0)), "the angle is constant"),
        (replace(good(), angle_deg=None), "it has no angle"),
        (with_value(good(), "dp_cmd_mpa", slice(10, 11), np.nan), r"dp_cmd_mpa is not a number at 0\.050 s"),
        (
            with_value(
                replace(good(), p1_cmd_mpa=good().dp_cmd_mpa + 0.2, p2_cmd_mpa=good().dp_cmd_mpa),
                "p1_cmd_mpa",
                slice(10, 11),
                np.nan,
            ),
            r"p1_cmd_mpa is not a number at 0\.050 s",
        ),
        (with_value(good(), "angle_deg", slice(0, 500), np.nan), "25% of angle_deg is missing"),
        (
            with_value(good(), "angle_deg", slice(9, 10), 1e300),
            r"angle_deg reaches 1e\+300, more than any potentiometer",
        ),
        (with_value(good(), "t_s", slice(1999, 2000), 1e9), "a gap of 1e"),
        (good(500, 0.02), r"sampled every 20 ms, the model works at 5 ms; --resample .* --sample-time"),
        (good().rows(np.r_[0:800, 1000:2000]), "a gap of 1.* s at 3.995 s"),
        (replace(good(), t_s=np.r_[np.arange(1000), np.arange(1000)] * 0.005), "time does not rise after 4.995 s"),
        (scaled(good(), "angle_deg", np.pi / 180), "is it in radians"),
        (scaled(good(), "dp_cmd_mpa", 10.0), "is it in bar"),
        (scaled(good(), "p1_mpa", 1000.0), "is it in kPa"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(record: Record, said: str) -> None:
    with pytest.raises(RecordError, match=said) as failure:
        prepare(record, MODEL)
    assert str(failure.value).startswith("sine: ")
    assert "\n" not in str(failure.value)


def test_pressures_are_needed_only_where_they_drive() -> None:
    bare = replace(good(), p1_mpa=None, p2_mpa=None)
    assert prepare(bare, MODEL).warnings == []
    with pytest.raises(RecordError, match="use --input command"):
        prepare(bare, PRESSURE)


def test_trusted_units_pass() -> None:
    assert (
        len(prepare(scaled(good(), "angle_deg", np.pi / 180), MODEL, RecordOptions(trust_units=True)).angle_deg) == 2000
    )


def test_a_few_missing_values_are_interpolated_and_named() -> None:
    data = prepare(with_value(good(), "angle_deg", slice(100, 105), np.nan), MODEL)
    assert data.warnings == ["sine: 5 values of angle_deg are missing and were interpolated"]
    assert np.allclose(data.angle_deg, good().angle_deg, atol=0.5)


def test_missing_rows_are_interpolated_and_named() -> None:
    data = prepare(good().rows(np.r_[0:500, 505:2000]), MODEL)
    assert len(data.angle_deg) == 2000
    assert "resampled to 5 ms" in data.warnings[0]
    assert np.allclose(data.angle_deg, good().angle_deg, atol=0.5)


def test_another_period_is_resampled_when_allowed() -> None:
    data = prepare(good(500, 0.02), MODEL, RecordOptions(resample=True))
    assert len(data.angle_deg) == 1997
    assert "resampled" in data.warnings[0]


def test_repeated_packets_are_found_and_interpolated() -> None:
    record = good()
    rows = np.arange(40, 2000, 4)
    columns = {name: getattr(record, name).copy() for name in ("p1_mpa", "p2_mpa", "angle_deg")}
    for column in columns.values():
        column[rows] = column[rows - 1]
    broken = replace(record, **columns)
    assert np.array_equal(np.nonzero(repeated_packets(broken))[0], rows)
    data = prepare(broken, PRESSURE)
    assert "490 rows repeat the packet before" in data.warnings[0]
    assert np.max(np.abs(data.angle_deg - record.angle_deg)) < 0.1 < np.max(np.abs(broken.angle_deg - record.angle_deg))


def test_nothing_after_the_cut_is_looked_at() -> None:
    data = prepare(good(), MODEL, RecordOptions(until_s=4.0, skip_s=1.0))
    assert data.grid.t_s[-1] == pytest.approx(4.0)
    assert data.skip == 200
    with pytest.raises(RecordError, match="nothing is left"):
        prepare(good(), MODEL, RecordOptions(skip_s=20.0))


def test_the_muscles_see_the_set_point_of_the_row_before() -> None:
    data = prepare(good(), MODEL)
    assert np.allclose((data.p1_mpa - data.p2_mpa)[1:], good().dp_cmd_mpa[:-1])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_gain_has_the_rigs_sign_even_where_a_sweep_lags_by_half_a_turn(sign: float) -> None:
    time = np.arange(4000) * 0.005
    turns = 0.1 * time + 0.1225 * time**2
    lag = np.minimum(0.15 * (0.1 + 0.245 * time), 0.5)
    record = Record(
        "chirp", time, 0.2 * np.sin(2 * np.pi * turns), angle_deg=sign * 40.0 * np.sin(2 * np.pi * (turns - lag))
    )
    assert input_gain([record], 0.2) == pytest.approx(sign * 40.0, rel=0.02)


def test_a_wrong_time_stamp_does_not_take_all_the_memory() -> None:
    with pytest.raises(RecordError, match=r"2000 rows over 1e\+09 s would become 2e\+11 rows"):
        on_grid(with_value(good(), "t_s", slice(1999, 2000), 1e9), 0.005)


@given(seed=st.integers(0, 1000), half=st.integers(2, 20), more=st.integers(0, 60))
def test_parabolas_smooth_as_scipys_filter_does(seed: int, half: int, more: int) -> None:
    rows = 2 * half + 1
    column = np.random.default_rng(seed).standard_normal(rows + more)
    assert np.allclose(through_parabolas(column, rows), savgol_filter(column, rows, 2), rtol=0.0, atol=1e-12)

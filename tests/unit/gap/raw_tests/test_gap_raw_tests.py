"""Tests on the raw samples: each threshold from both sides, drop-outs and lost samples at small rates, intervals that
hold the truth."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter
from scipy.special import stdtr
from support.plants.gap_rigs import identified, session
from support.records.changed_samples import Change, repeating

from rig.columns import grouped_median, on_even_steps, white_noise
from rig.gap import diagnose
from rig.gap.raw_tests.all_tests import read_signatures
from rig.gap.raw_tests.noise import KnownNoise
from rig.gap.raw_tests.noise_levels import level_deg
from rig.gap.raw_tests.quantisation import quantisation_step
from rig.gap.raw_tests.settings import COARSER, HIGHEST_CONFIDENCE, SLOPE_ROWS, TESTS
from rig.gap.raw_tests.signature import Signature
from rig.gap.raw_tests.spectral_lines import fast_spectra, mains_line
from rig.gap.raw_tests.statistics import by_chance, student_above, wilson
from rig.gap.records.cleaning.dropouts import without_dropouts
from rig.gap.records.pairs import pair_up
from rig.record import Column, Record
from rig.smoothing import smoothed

T = np.arange(0.0, 20.0, 0.005)
STEP_DEG = 345.0 / 4096


def day(seed: int, change: Change | None = None) -> list[Record]:
    """Two sweeps of 20 deg on a 12-bit converter with 0.05 deg of noise."""
    random = np.random.default_rng(seed)
    records = []
    for hertz in (0.5, 0.9):
        command = 0.2 * np.sin(2 * np.pi * hertz * T)
        read = 100.0 * command + 3.0 + 0.05 * random.standard_normal(len(T))
        angle = STEP_DEG * np.round(read / STEP_DEG)
        records.append(
            Record(f"sine_{hertz}", T, command, angle_deg=angle if change is None else change(angle, random))
        )
    return records


def results(records: list[Record]) -> dict[str, Signature]:
    return {one.test: one for one in read_signatures(pair_up(records, [day(k) for k in (1, 2, 3)], 0.2).pairs)}


def found_in(change: Change, seed: int = 11) -> dict[str, Signature]:
    return {name: one for name, one in results(day(seed, change)).items() if one.found}


def falling(share: float, rail: float, run: int = 1) -> Change:
    def fall(angle: Column, random: np.random.Generator) -> Column:
        out = angle.copy()
        for start in np.flatnonzero(random.random(len(angle)) < share / run):
            out[start : start + run] = rail
        return out

    return fall


def test_a_healthy_day_shows_nothing() -> None:
    for seed in (11, 12, 13):
        assert found_in(lambda angle, _: angle, seed) == {}


@pytest.mark.parametrize("share", [0.005, 0.05, 0.2])
@pytest.mark.parametrize(("rail", "run"), [(0.0, 1), (-172.5, 3)])
def test_drop_outs_are_found_alone_and_measured(share: float, rail: float, run: int) -> None:
    found = found_in(falling(share, rail, run))
    assert list(found) == ["drop-outs"]
    sizes = found["drop-outs"].sizes
    fell = float(np.mean([np.asarray(one.angle_deg) == rail for one in day(11, falling(share, rail, run))]))
    assert sizes["probability"].value == pytest.approx(fell, rel=0.15)
    assert sizes["probability"].low < fell < sizes["probability"].high
    assert sizes["rail_deg"].value == pytest.approx(rail)


@pytest.mark.parametrize("rail", [0.0, -172.5])
def test_falls_that_scatter_about_a_rail_count_once(rail: float) -> None:
    def scattered(angle: Column, random: np.random.Generator) -> Column:
        fallen = falling(0.02, rail)(angle, random) == rail
        return np.where(fallen, rail + STEP_DEG * random.integers(-1, 2, len(angle)), angle)

    cleaned, found = without_dropouts(day(14, scattered))
    assert [len(mine) for mine in found] == [1, 1]
    for one, mine in zip(cleaned, found, strict=True):
        assert np.isnan(np.asarray(one.angle_deg)).sum() == mine[0].at_rail.sum()
        assert mine[0].fallen.mean() == pytest.approx(0.02, rel=0.35)


def test_records_too_slow_to_show_a_tone_show_none_by_chance() -> None:
    slow = [one.rows(slice(None, None, 8)) for one in day(15)]
    tone = next(one for one in read_signatures(pair_up(slow, [], 0.2).pairs) if one.test == "spurious tone")
    assert (tone.found, tone.p_value) == (False, 1.0)


def test_lost_samples_and_zeros_are_told_apart_and_are_no_noise() -> None:
    found = found_in(lambda angle, random: falling(0.01, 0.0)(repeating(0.01)(angle, random), random))
    assert set(found) == {"repeated samples", "drop-outs"}


def coloured(seed: int, change: Change | None = None) -> list[Record]:
    """A day whose noise a filter has coloured, fainter than the converter's step."""
    random = np.random.default_rng(seed)
    records = []
    for one in day(seed):
        noise = np.convolve(0.06 * random.standard_normal(len(T) + 8), np.ones(9) / 9.0, mode="valid")
        angle = STEP_DEG * np.round((100.0 * one.dp_cmd_mpa + 3.0 + noise) / STEP_DEG)
        records.append(replace(one, angle_deg=angle if change is None else change(angle, random)))
    return records


@pytest.mark.parametrize("days", [0, 1, 3])
@pytest.mark.parametrize("made", [day, coloured])
def test_half_a_percent_of_lost_samples_is_found_and_is_no_noise(made: Callable[..., list[Record]], days: int) -> None:
    healthy = [made(k) for k in (1, 2, 3)[:days]]
    for seed in (11, 12):
        lost, whole = (
            {one.test for one in read_signatures(pair_up(records, healthy, 0.2).pairs) if one.found}
            for records in (made(seed, repeating(0.005)), made(seed))
        )
        assert lost == {"repeated samples"}
        assert whole == set()


@given(st.floats(0.01, 10.0), st.integers(0, 1000))
def test_a_median_of_steps_goes_with_the_noise_and_not_with_the_step(noise: float, seed: int) -> None:
    random = np.random.default_rng(seed)
    sizes = np.abs(noise * random.standard_normal(4001))
    assert grouped_median(sizes) == pytest.approx(float(np.median(sizes)), rel=0.01)
    coarse = noise * np.round(sizes / noise)
    assert grouped_median(coarse) == pytest.approx(float(np.median(sizes)), abs=0.15 * noise)


def test_a_median_without_or_of_equal_sizes_is_none_of_its_own() -> None:
    assert grouped_median(np.zeros(5)) == 0.0
    assert 0.0 < grouped_median(np.full(5, 2.0)) <= 2.0


def test_lost_samples_are_measured() -> None:
    probability = found_in(repeating(0.02))["repeated samples"].sizes["probability"]
    assert probability.low < 0.02 < probability.high


def test_more_noise_is_noise_and_no_lost_sample() -> None:
    found = found_in(
        lambda angle, random: STEP_DEG * np.round((angle + 0.3 * random.standard_t(4, len(angle))) / STEP_DEG)
    )
    assert set(found) == {"noise"}


def test_two_fallen_samples_are_outliers_and_three_are_drop_outs() -> None:
    for rows, taken in (([300, 900], 0), ([300, 900, 1500], 3), ([300, 301, 302], 3)):
        angle = day(5)[0].angle_deg
        assert angle is not None
        angle = angle.copy()
        angle[rows] = -172.5
        cleaned, _ = without_dropouts([replace(day(5)[0], angle_deg=angle)])
        assert cleaned[0].angle_deg is not None
        assert np.isnan(cleaned[0].angle_deg).sum() == taken


@pytest.mark.parametrize(("rows", "found"), [(2, False), (3, True), (8, True)])
def test_one_long_burst_is_a_drop_out(rows: int, found: bool) -> None:
    """Three samples at a rail that no joint reaches are no accident, though they fell at once."""
    records, day_before = day(5), day(6)
    angle = records[0].angle_deg
    assert angle is not None
    angle = angle.copy()
    angle[300 : 300 + rows] = -180.0
    case = [replace(records[0], angle_deg=angle), *records[1:]]
    signatures = read_signatures(pair_up(case, [day_before], 0.2).pairs)
    assert {signature.test: signature.found for signature in signatures}["drop-outs"] is found


def test_a_filter_s_way_back_is_taken_out_with_the_fall() -> None:
    angle = day(5)[0].angle_deg
    assert angle is not None
    angle = angle.copy()
    for start in (300, 900, 1500):
        angle[start : start + 3] += np.array([1.0, 0.5, 0.25]) * (-172.5 - angle[start : start + 3])
    cleaned, _ = without_dropouts([replace(day(5)[0], angle_deg=angle)])
    assert cleaned[0].angle_deg is not None
    assert np.nanmin(cleaned[0].angle_deg) > -25.0


def test_a_sensor_that_is_clipped_does_not_drop_out() -> None:
    cleaned, found = without_dropouts([replace(one, angle_deg=np.clip(one.angle_deg, -15.0, 15.0)) for one in day(6)])
    assert found == [(), ()]
    assert all(np.isfinite(one.angle_deg).all() for one in cleaned if one.angle_deg is not None)


@pytest.mark.parametrize(("factor", "is_found"), [(0.95 * COARSER, False), (1.05 * COARSER, True)])
def test_a_step_is_a_finding_from_its_threshold_on(factor: float, is_found: bool) -> None:
    def on(step: float) -> list[Record]:
        return [
            replace(one, angle_deg=step * np.round(one.angle_deg / step)) for one in day(7) if one.angle_deg is not None
        ]

    assert quantisation_step(on(0.3 * factor), [on(0.3)]).found is is_found


@pytest.mark.parametrize(("noise_steps", "is_plain"), [(0.0, True), (0.12, True), (0.25, False)])
def test_without_an_earlier_day_a_step_is_plain_that_the_noise_beside_it_does_not_hide(
    noise_steps: float, is_plain: bool
) -> None:
    step, random = 0.6, np.random.default_rng(8)
    records = [
        replace(one, angle_deg=step * np.round(one.angle_deg / step + noise_steps * random.standard_normal(len(one))))
        for one in day(7)
        if one.angle_deg is not None
    ]
    found = quantisation_step(records, [])
    assert found.found is is_plain
    assert found.value == pytest.approx(step)


def test_what_is_stated_comes_from_the_samples() -> None:
    assert wilson(5, 1000)[0] < 0.005 < wilson(5, 1000)[1]
    assert wilson(5, 1000, run=3.0)[1] > wilson(5, 1000)[1], "bursts are fewer independent samples"
    assert by_chance(5.0, 1.0) < by_chance(5.0, 1.0, degrees=4.0), "few days know their spread badly"
    plain = Signature("noise", "sensor_noise", True, 1.0, 0.5, "deg", "", p_value=1e-9)
    assert plain.confidence == HIGHEST_CONFIDENCE
    assert replace(plain, p_value=0.05).confidence == pytest.approx(1.0 - 0.05 * TESTS)
    assert replace(plain, found=False).confidence == 0.0


def test_missing_values_are_no_noise() -> None:
    column = np.random.default_rng(1).standard_normal(5000)
    column[::50] = np.nan
    assert white_noise([column]) == pytest.approx(1.0, rel=0.06)
    moving = 25.0 * np.sin(2 * np.pi * 0.5 * T) + 0.03 * np.random.default_rng(2).standard_normal(len(T))
    moving[np.random.default_rng(3).random(len(T)) < 0.25] = np.nan
    assert white_noise([moving]) == pytest.approx(0.03, rel=0.1), "motion is none, however many packets were lost"
    assert math.isnan(white_noise([np.full(100, np.nan)]))
    assert math.isnan(white_noise([]))


@given(degrees=st.integers(1, 1000), t=st.floats(-20.0, 1e6))
def test_the_tail_of_students_t_is_scipys(degrees: int, t: float) -> None:
    assert student_above(t, degrees) == pytest.approx(float(stdtr(degrees, -t)), rel=1e-7, abs=1e-300)


def test_with_endless_degrees_of_freedom_it_is_the_normal_one() -> None:
    assert student_above(1.959964, math.inf) == pytest.approx(0.025, rel=1e-6)


def found_by_a_fingerprint(records: list[Record]) -> dict[str, Signature]:
    """What is found without an earlier day, by the noise that a fingerprint of another healthy day holds."""
    usual_deg = white_noise([angle for record in day(1) if (angle := record.angle_deg) is not None])
    return {
        signature.test: signature
        for signature in read_signatures(pair_up(records, [], 0.2).pairs, KnownNoise(usual_deg))
        if signature.found
    }


def louder(std_deg: float) -> Change:
    return lambda angle, random: angle + std_deg * random.standard_normal(len(angle))


def without_every_third(angle: Column, random: np.random.Generator) -> Column:
    lost = random.random(len(angle)) < 0.3
    lost[0] = False
    return angle[np.maximum.accumulate(np.where(lost, 0, np.arange(len(angle))))]


@pytest.mark.parametrize("std_deg", [0.08, 0.3])
def test_noise_beyond_what_a_fingerprint_knows_is_found_and_measured(std_deg: float) -> None:
    found = found_by_a_fingerprint(day(5, louder(std_deg)))
    assert list(found) == ["noise"]
    assert found["noise"].numbers["std_deg"] == pytest.approx(std_deg, rel=0.1)


def unevenly(records: list[Record]) -> list[Record]:
    """The records as a logger reads them that is late by 0.15 of a period in every fifth row, and never catches up."""
    read = []
    for record in records:
        assert record.angle_deg is not None
        late = np.random.default_rng(len(record.name)).random(len(record)) < 0.2
        t_s = record.t_s[0] + np.cumsum(record.period_s * (1.0 + 0.15 * late))
        rows = t_s <= record.t_s[-1]
        motion = smoothed(record.angle_deg, SLOPE_ROWS, mirrored=True)
        angle = np.interp(t_s, record.t_s, motion) + (record.angle_deg - motion)
        command = np.interp(t_s, record.t_s, record.dp_cmd_mpa)
        there = Record(record.name, t_s, command, angle_deg=angle, facts=record.facts)
        read.append(there.rows(rows))
    return read


@pytest.mark.parametrize("std_deg", [0.15, 0.3])
def test_noise_is_found_on_rows_that_are_not_quite_even(std_deg: float) -> None:
    """A clock that jitters is most loggers': beside a fingerprint no noise of theirs was ever too loud."""
    assert "noise" not in found_by_a_fingerprint(unevenly(day(5)))
    found = found_by_a_fingerprint(unevenly(day(5, louder(std_deg))))
    assert found["noise"].numbers["std_deg"] == pytest.approx(std_deg, rel=0.1)


@pytest.mark.parametrize(
    ("change", "tests"),
    [
        (None, []),
        (without_every_third, ["repeated samples"]),
        (lambda angle, _: 0.4 * np.round(angle / 0.4), ["quantisation step"]),
        (lambda angle, _: 2 * STEP_DEG * np.round(angle / 2 / STEP_DEG), []),  # the noise allows a step of 0.2 deg
    ],
    ids=["healthy", "lost", "coarse", "a little coarser"],
)
def test_what_is_no_noise_is_none_beside_a_fingerprint(change: Change | None, tests: list[str]) -> None:
    assert list(found_by_a_fingerprint(day(6, change))) == tests


def every(rows: int, records: list[Record]) -> list[Record]:
    return [record.rows(np.arange(len(record)) % rows == 0) for record in records]


@pytest.mark.parametrize("rows", [4, 10])
@pytest.mark.parametrize("seed", [5, 6, 7])
def test_coarse_rows_are_no_noise_beside_a_fingerprint(rows: int, seed: int) -> None:
    """The motion between rows that are 40 ms apart and more was noise of the sensor, with 0.9 to 0.99."""
    assert "noise" not in found_by_a_fingerprint(every(rows, day(seed)[1:]))
    assert "noise" in found_by_a_fingerprint(every(rows, day(seed, louder(0.6))[1:]))


@pytest.mark.parametrize("rows", [4, 12])
@pytest.mark.parametrize("seed", [7, 8])
def test_coarse_rows_are_no_noise_beside_days_of_fine_ones(rows: int, seed: int) -> None:
    """What of the motion they show was added to the days' noise in squares, and medians are no squares."""
    healthy, noisy = (results(every(rows, day(seed, change)))["noise"] for change in (None, louder(0.6)))
    assert (healthy.found, noisy.found) == (False, True)
    assert healthy.value == pytest.approx(healthy.baseline, rel=0.1)


def test_a_diagnosis_by_a_fingerprint_names_a_louder_sensor() -> None:
    noisy = [
        replace(record, angle_deg=record.angle_deg + 0.4 * np.random.default_rng(9).standard_normal(len(record)))
        for record in session(71)
        if record.angle_deg is not None
    ]
    assert [cause.effect for cause in diagnose(identified(), noisy, reference="fingerprint").causes] == ["sensor_noise"]
    assert diagnose(identified(), session(72), reference="fingerprint").causes == []


@given(st.floats(0.04, 0.5), st.integers(0, 1000))
def test_the_decimals_of_a_file_change_nothing_of_a_converter_s_noise(step_deg: float, seed: int) -> None:
    random = np.random.default_rng(seed)
    exact = step_deg * np.round((20.0 * np.sin(np.pi * T) + step_deg * random.standard_normal(len(T))) / step_deg)
    filed = np.round(exact, 3)
    assert level_deg([filed]) == pytest.approx(level_deg([exact]), rel=0.03)
    assert np.ptp(on_even_steps(filed) - exact) < 2e-3


@pytest.mark.parametrize("column", [np.sin(T), np.round(3.0 * T**2) + 0.3 * (T > 10.0), np.zeros_like(T)])
def test_a_column_without_even_steps_stays_as_it_is(column: Column) -> None:
    assert np.array_equal(on_even_steps(column), column)


@pytest.mark.parametrize(("hum_deg", "found"), [(0.0, False), (0.02, True)])
def test_a_resonance_beside_the_mains_is_no_line(hum_deg: float, found: bool) -> None:
    """A sensor's mount that shakes at 11 Hz, in rows 40 ms apart, where 60 Hz show at 10: 10 of 10 healthy days of such
    a rig had a line of 0.002 deg."""
    t, random = np.arange(0.0, 20.0, 0.04), np.random.default_rng(4)
    radius = math.exp(-2.0 * math.pi * 11.0 * 0.06 * 0.005)
    ring = [1.0, -2.0 * radius * math.cos(2.0 * math.pi * 11.0 * 0.005), radius**2]
    records = []
    for hertz in (0.2, 0.3, 0.5):
        shake = lfilter([1.0], ring, random.standard_normal(8 * len(t)))[::8]
        angle = 20.0 * np.sin(2 * np.pi * hertz * t) + 0.005 * shake / shake.std()
        angle += hum_deg * np.sin(2 * np.pi * 60.0 * t + 0.3) + 1e-4 * random.standard_normal(len(t))
        records.append(Record("sine", t, angle / 100.0, angle_deg=angle))
    assert mains_line(fast_spectra(records), []).found is found

"""Marks in the raw records: each is found when it is there, and nothing is found when it is not."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.plants.gap_rigs import baselines, session

from rig.gap.raw_tests.all_tests import read_signatures
from rig.gap.raw_tests.lost_samples import lost_samples, without_lost
from rig.gap.raw_tests.signature import Signature
from rig.gap.raw_tests.spectral_lines import fast_spectra, mains_line
from rig.gap.records.pairs import pair_up
from rig.record import Column, Record


def signatures(records: list[Record]) -> dict[str, Signature]:
    pairing = pair_up(records, [list(day) for day in baselines()], 0.2)
    return {signature.test: signature for signature in read_signatures(pairing.pairs)}


def changed(seed: int, change: "object") -> list[Record]:
    assert callable(change)
    return [replace(record, angle_deg=change(record.t_s, record.angle_deg)) for record in session(seed)]


def repeated(t: Column, y: Column) -> Column:
    lost = np.random.default_rng(5).random(len(y)) < 0.08
    lost[0] = False
    out = y.copy()
    for k in np.flatnonzero(lost):
        out[k] = out[k - 1]
    return out


def test_healthy_records_bear_no_mark() -> None:
    assert [signature.test for signature in signatures(session(61)).values() if signature.found] == []


@pytest.mark.parametrize(
    ("signature", "effect", "change", "key", "size"),
    [
        ("quantisation step", "quantisation", lambda t, y: 0.5 * np.round(y / 0.5), "step_deg", 0.5),
        ("mains line", "mains_hum", lambda t, y: y + 0.2 * np.sin(2 * np.pi * 50 * t + 1), "amplitude_deg", 0.2),
        (
            "noise",
            "sensor_noise",
            lambda t, y: y + 0.1 * np.random.default_rng(3).standard_normal(len(y)),
            "std_deg",
            0.1,
        ),
        ("repeated samples", "lost_samples", repeated, "probability", 0.08),
    ],
)
def test_mark_is_found_alone_and_measured(signature: str, effect: str, change: object, key: str, size: float) -> None:
    found = {name: one for name, one in signatures(changed(62, change)).items() if one.found}
    assert list(found) == [signature]
    assert found[signature].effect == effect
    assert found[signature].numbers[key] == pytest.approx(size, rel=0.2)


@pytest.mark.parametrize(("period_s", "hertz"), [(0.005, 60.0), (0.01, 60.0), (0.02, 60.0), (0.0125, 50.0)])
def test_hum_is_as_large_as_it_is_wherever_sampling_folds_it(period_s: float, hertz: float) -> None:
    """The motion's smoothing takes three quarters off a line that shows at 10 Hz."""
    t = np.arange(0.0, 20.0, period_s)
    hum = 0.7 * np.sin(2.0 * np.pi * hertz * t + 0.4)
    record = Record("hum", t, np.zeros(len(t)), angle_deg=hum + 5.0 * np.sin(2.0 * np.pi * 0.5 * t))
    found = mains_line(fast_spectra([record]), [])
    assert found.found
    assert found.numbers["amplitude_deg"] == pytest.approx(0.7, rel=0.02)
    assert found.numbers["frequency_hz"] == hertz


@pytest.mark.parametrize("hertz", [50.0, 60.0])
@pytest.mark.parametrize("louder_deg", [0.0, 0.1])
def test_a_rectifiers_hum_is_no_noise_and_hides_none(hertz: float, louder_deg: float) -> None:
    """Its even multiples show at half the sampling rate, or elsewhere than the line itself."""

    def rectified(t: Column, y: Column) -> Column:
        wave = np.maximum(np.sin(2 * np.pi * hertz * 1.0002 * t + 0.7), 0.0)
        return y + 0.8 * wave + louder_deg * np.random.default_rng(8).standard_normal(len(y))

    found = {name: one for name, one in signatures(changed(67, rectified)).items() if one.found}
    assert set(found) == {"mains line", *(["noise"] if louder_deg else [])}
    assert found["mains line"].variance_deg2 == pytest.approx(0.8**2 * (0.25 - 1 / np.pi**2), rel=0.1)
    if louder_deg:
        assert found["noise"].numbers["std_deg"] == pytest.approx(louder_deg, rel=0.2)


def test_dead_spot_is_not_lost_samples() -> None:
    def stuck(t: Column, y: Column) -> Column:
        return np.where((y > 3.0) & (y < 6.0), 3.0, y)

    assert not signatures(changed(63, stuck))["repeated samples"].found


def test_a_dead_spot_that_goes_on_without_a_jump_is_not_lost_samples() -> None:
    """The angle is what the sensor shows of a joint that goes on: a track that is worn through at one place."""

    def worn(t: Column, y: Column) -> Column:
        return y - np.clip(y - 3.0, 0.0, 0.5)

    assert not signatures(changed(65, worn))["repeated samples"].found


@pytest.mark.parametrize("rows", [2, 4, 7, 10])
def test_a_sensor_that_is_read_more_seldom_than_the_loop_runs_repeats_its_samples(rows: int) -> None:
    """At 100 to 20 Hz beside a loop of 200 Hz."""

    def held(t: Column, y: Column) -> Column:
        return y[rows * (np.arange(len(y)) // rows)]

    signature = signatures(changed(66, held))["repeated samples"]
    assert signature.found
    assert signature.numbers["probability"] == pytest.approx(1.0 - 1.0 / rows, abs=0.03)


@given(st.floats(0.02, 0.85), st.integers(0, 50))
@settings(max_examples=12)
def test_lost_samples_are_found_however_many_are_lost(share: float, seed: int) -> None:
    def lost(t: Column, y: Column) -> Column:
        kept = np.random.default_rng(seed).random(len(y)) >= share
        kept[0] = True
        return y[np.maximum.accumulate(np.where(kept, np.arange(len(y)), 0))]

    signature = signatures(changed(67, lost))["repeated samples"]
    assert signature.found
    assert signature.numbers["probability"] == pytest.approx(share, rel=0.2)


def test_dead_monitor_is_seen() -> None:
    records = [replace(record, p1_mpa=np.zeros(len(record))) for record in session(64)]
    seen = signatures(records)
    assert seen["monitor of p1"].text == "the monitor of p1 does not move (a broken wire?)"
    assert not seen["mean pressure"].found, "half of nothing is no rest pressure"


def test_lost_samples_in_runs_are_found_and_bridged() -> None:
    def lost(t: Column, y: Column) -> Column:
        out = y.copy()
        for start in np.random.default_rng(8).choice(len(y) - 10, 100, replace=False):
            out[start + 1 : start + 5] = out[start]
        return out

    records = changed(64, lost)
    assert signatures(records)["repeated samples"].found
    healthy = session(64)
    for record, mended, truth in zip(
        records, [without_lost(one, lost_samples(one)) for one in records], healthy, strict=True
    ):
        assert mended.angle_deg is not None
        assert record.angle_deg is not None
        assert truth.angle_deg is not None
        assert np.std(mended.angle_deg - truth.angle_deg) < 0.3 * np.std(record.angle_deg - truth.angle_deg)


def test_samples_that_each_sensor_loses_by_itself_are_bridged_in_its_own_rows() -> None:
    def held(column: Column, seed: int) -> Column:
        kept = np.random.default_rng(seed).random(len(column)) >= 0.6
        kept[0] = True
        return column[np.maximum.accumulate(np.where(kept, np.arange(len(column)), 0))]

    for record in session(64):
        assert record.p1_mpa is not None
        assert record.p2_mpa is not None
        assert record.angle_deg is not None
        lossy = replace(
            record, angle_deg=held(record.angle_deg, 1), p1_mpa=held(record.p1_mpa, 2), p2_mpa=held(record.p2_mpa, 3)
        )
        mended, shortened = (
            without_lost(lossy, lost_samples(lossy)),
            without_lost(record.rows(slice(50)), lost_samples(lossy)),
        )
        for name in ("angle_deg", "p1_mpa", "p2_mpa"):
            truth, lost, whole = (getattr(one, name) for one in (record, lossy, mended))
            assert np.std(whole - truth) < 0.5 * np.std(lost - truth)
        assert len(shortened) == 50
    alone = without_lost(
        replace(lossy, p1_mpa=None, p2_mpa=None), lost_samples(replace(lossy, p1_mpa=None, p2_mpa=None))
    )
    assert alone.p1_mpa is None


@pytest.mark.parametrize(("later_rows", "every"), [(0, 1), (60, 1), (0, 2)])
def test_another_record_is_bridged_at_the_same_times_whatever_its_rows(later_rows: int, every: int) -> None:
    """A healthy day that began later, or was sampled at half the rate, lost other rows than the case before."""
    record = session(64)[0]
    assert record.angle_deg is not None
    lossy = replace(record, angle_deg=repeated(record.t_s, record.angle_deg))
    lost = lost_samples(lossy)
    day = record.rows(slice(later_rows, None, every))
    bridged = without_lost(day, lost)
    assert bridged.angle_deg is not None
    assert day.angle_deg is not None
    changed_s = day.t_s[bridged.angle_deg != day.angle_deg]
    assert len(changed_s) > 0.9 * np.isin(lost.angle_s, day.t_s).sum()
    assert np.isin(changed_s, lost.angle_s).all()


@pytest.mark.parametrize(("share", "found"), [(0.0, False), (0.3, True), (0.8, True)])
def test_samples_are_lost_on_a_coarse_angle_without_any_healthy_day(share: float, found: bool) -> None:
    """A coarse converter repeats its samples as well: how often, the case's own noise says."""

    def lost(t: Column, y: Column) -> Column:
        coarse = 0.1 * np.round(y / 0.1)
        kept = np.random.default_rng(5).random(len(y)) >= share
        kept[0] = True
        return coarse[np.maximum.accumulate(np.where(kept, np.arange(len(y)), 0))]

    pairs = [replace(pair, raw_days=()) for pair in pair_up(changed(67, lost), baselines(), 0.2).pairs]
    signature = next(one for one in read_signatures(pairs) if one.test == "repeated samples")
    assert signature.found is found


def test_more_noise_is_no_lost_sample() -> None:
    def noisy(t: Column, y: Column) -> Column:
        return 0.08 * np.round((y + 0.4 * np.random.default_rng(4).standard_normal(len(y))) / 0.08)

    assert not signatures(changed(65, noisy))["repeated samples"].found


def test_a_hole_in_the_stamps_is_said() -> None:
    def holed(record: Record) -> Record:
        kept = (record.t_s < 4.0) | (record.t_s > 6.5)
        columns = ("t_s", "dp_cmd_mpa", "p1_mpa", "p2_mpa", "p1_cmd_mpa", "p2_cmd_mpa", "angle_deg")
        return replace(
            record, **{name: getattr(record, name)[kept] for name in columns if getattr(record, name) is not None}
        )

    pairing = pair_up([holed(record) for record in session(66)], [list(day) for day in baselines()], 0.2)
    assert any("s without samples from" in note for note in pairing.notes)
    assert all(pair.used[(pair.t_s > 4.1) & (pair.t_s < 6.4)].max() == 0.0 for pair in pairing.pairs)
    stamps = next(one for one in read_signatures(pairing.pairs) if one.test == "time stamps")
    assert (stamps.found, stamps.value) == (True, len(pairing.pairs)), "rows that stand in a hole have no stamps"


def test_rows_that_are_missing_are_no_lost_samples() -> None:
    """A coarse angle repeats itself where it is slow; what counts as slow is asked of the rows that there are."""

    def coarse(record: Record) -> Record:
        return replace(record, angle_deg=0.02 * np.round(np.asarray(record.angle_deg) / 0.02))

    def cut(record: Record) -> Record:
        inside = (record.t_s > 3.0) & (record.t_s < 6.5)
        return replace(record, angle_deg=np.where(inside, np.nan, np.asarray(record.angle_deg)))

    days = [[coarse(record) for record in day] for day in baselines()]
    pairing = pair_up([cut(coarse(record)) for record in session(68)], days, 0.2)
    signature = next(one for one in read_signatures(pairing.pairs) if one.test == "repeated samples")
    assert not signature.found
    assert signature.value == pytest.approx(signature.baseline, rel=0.3)


def test_lost_samples_beside_a_hole_have_a_size() -> None:
    def lost(t: Column, y: Column) -> Column:
        return np.where((t > 3.0) & (t < 3.5), np.nan, repeated(t, y))

    signature = signatures(changed(68, lost))["repeated samples"]
    assert signature.found
    assert np.isfinite(signature.variance_deg2)

"""The blind check on somebody's records: what is put in, what is kept from the diagnosis, and what may be asked."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from support.plants.gap_rigs import session

from rig.app.gap.blind_checking import source_and_modes
from rig.blind_check.put_in import PUT_IN, lagging, late
from rig.blind_check.real_source import SINGLE_RATIOS, RecordsSource
from rig.blind_check.source import Label
from rig.cli.gap.check import check
from rig.errors import ConfigError, RecordError
from rig.gap.hypotheses.library import LIBRARY
from rig.log.convert import write_record
from rig.model.effect_stages import EFFECT_STAGES
from rig.record import Record


@pytest.fixture(scope="module")
def days(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three sessions of three records each."""
    root = tmp_path_factory.mktemp("own")
    for seed in (1, 2, 3):
        _write(root / f"day_{seed}", session(seed))
    return root


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One session of one record."""
    return _write(tmp_path_factory.mktemp("one") / "session", session(1)[:1])


def _write(folder: Path, records: list[Record]) -> Path:
    folder.mkdir()
    for record in records:
        write_record(record, folder / f"{record.name}.mcap", {})
    return folder


def label(source: RecordsSource, kind: str, effect: str = "") -> Label:
    """The first of its kind, of this effect where one is named."""
    return next(one for one in source.sheet(1, 60) if one["kind"] == kind and effect in ("", *one["effects"]))


def test_a_seed_gives_its_sheet_and_no_other(days: Path) -> None:
    source = RecordsSource(days)
    assert source.sheet(5, 20) == source.sheet(5, 20)
    assert source.sheet(5, 20) != source.sheet(6, 20)
    kinds = [one["kind"] for one in source.sheet(5, 20)]
    assert {kind: kinds.count(kind) for kind in set(kinds)} == {"none": 6, "foreign": 3, "pair": 3, "single": 8}


def test_what_is_put_in_are_effects_of_sensor_and_time_base_with_the_librarys_numbers() -> None:
    for name, law in PUT_IN.items():
        assert law.stage in ("timing", "sensor")
        assert law.in_library is (name in LIBRARY)
        if law.number:
            assert law.number in {number.name for number in EFFECT_STAGES[name].numbers}


@pytest.mark.parametrize("effect", ["sensor_gain", "delay", "sensor_lag", "quantisation"])
def test_an_effect_has_the_size_that_gives_its_gap(days: Path, effect: str) -> None:
    source = RecordsSource(days)
    one = label(source, "single", effect)
    facts = source.case(one).facts
    assert facts["ratio_angle"] == pytest.approx(one["wanted_ratios"][0], rel=0.1)
    assert SINGLE_RATIOS[0] <= one["wanted_ratios"][0] <= SINGLE_RATIOS[1]


def test_the_day_with_the_effect_is_none_of_the_earlier_days(days: Path) -> None:
    source = RecordsSource(days)
    one = label(source, "none")
    case, bench = source.case(one), source.bench(one)
    assert len(bench.baselines) == 2 == one["baselines"]
    name = next(iter(case.records))
    assert not any(np.array_equal(case.records[name]["angle_deg"], day[name]["angle_deg"]) for day in bench.baselines)


def test_some_records_are_kept_from_every_diagnosis(days: Path, alone: Path) -> None:
    for folder in (days, alone):
        source = RecordsSource(folder)
        one = label(source, "single", "delay")
        case, bench = source.case(one), source.bench(one)
        assert case.untouched
        assert not set(case.untouched) & set(case.records)
        assert all(set(day) == set(case.untouched) for day in bench.untouched)
        assert len(bench.untouched) >= 2


def test_of_one_session_another_reading_stands_for_the_other_day(alone: Path) -> None:
    source = RecordsSource(alone)
    one = label(source, "none")
    case, bench = source.case(one), source.bench(one)
    name = next(iter(case.records))
    apart = case.records[name]["angle_deg"] - bench.baselines[0][name]["angle_deg"]
    assert 0.0 < float(np.std(apart)) < 0.2
    with pytest.raises(RecordError, match="nothing can be recorded anew"):
        source.repeat(one, {}, {}, 1)


def test_what_the_sessions_do_not_allow_is_refused(alone: Path, days: Path) -> None:
    assert source_and_modes(alone, False)[1] == ("one_day", "fingerprint")
    assert source_and_modes(days, False)[1] == ("days", "one_day", "fingerprint")
    with pytest.raises(ConfigError, match=r"--modes days: cannot be asked of .* \(1 session\); allowed: one_day, fing"):
        source_and_modes(alone, False, groups=("days",))
    with pytest.raises(ConfigError, match="--records takes no plant"):
        source_and_modes(alone, False, families=("pleated",))


def test_a_lag_and_a_delay_are_exact() -> None:
    t = np.arange(0.0, 4.0, 0.005)
    ramp = np.maximum(t - 1.0, 0.0)
    assert lagging(ramp, 0.1, 0.005)[-1] == pytest.approx(ramp[-1] - 0.1, abs=2e-3)
    record = Record("ramp", t, ramp, angle_deg=ramp)
    assert np.allclose(late(record, 0.05).angle_deg, np.maximum(t - 1.05, 0.0), atol=1e-9)


def test_the_whole_check_on_records_seals_asks_and_scores(alone: Path, tmp_path: Path) -> None:
    out = tmp_path / "check"
    call = ["--records", str(alone), "--cases", "4", "--seed", "3", "--modes", "one_day", "--no-angle", "-o", str(out)]
    done = CliRunner().invoke(check, [*call, "--workers", "1", "--json", "-"], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    assert '"one_day"' in done.output
    assert (out / "sealed.json").exists()
    again = CliRunner().invoke(check, ["score", str(out), "--workers", "1"], catch_exceptions=False)
    assert again.exit_code == 0, "its labels say that these are records: `score` is not told so again"

"""A rig over many days: change points that hold their false-alarm rate, growth, the picture, the order of days."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter
from support.plants.gap_rigs import session

from rig.cli.commands import cli
from rig.errors import ConfigError
from rig.gap.answer.result import Interval
from rig.gap.history.change_points import change_points, fewest_days
from rig.gap.history.sentences import history_sentences
from rig.gap.history.trends import Change, Day, changes, growth, look_back, size_of, sizes_of
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.settings import FALSE_ALARM_RATE
from rig.log.convert import write_record
from rig.model.parameters import AddedEffect
from rig.record import Record
from rig.report.history_figure import history_figure


def days_with(gaps: list[float], lags: list[float]) -> list[Day]:
    return [
        Day(
            f"day_{k:02d}", float(k), gap, 0.1, "explained" if lag else "none",
            {"valve_lag": Interval(lag, lag - 0.001, lag + 0.001, "s")} if lag else {},
        )
        for k, (gap, lag) in enumerate(zip(gaps, lags, strict=True))
    ]  # fmt: skip


def test_a_step_is_found_where_it_is() -> None:
    random = np.random.default_rng(1)
    values = 0.1 + 0.01 * random.standard_normal(20)
    values[12:] += 0.2
    ((at, p_value),) = change_points(values, FALSE_ALARM_RATE)
    assert at == 12
    assert p_value <= FALSE_ALARM_RATE


def test_two_steps_are_two_changes() -> None:
    values = np.repeat([0.1, 0.5, 0.2], 10) + 0.01 * np.random.default_rng(2).standard_normal(30)
    assert [at for at, _ in change_points(values, FALSE_ALARM_RATE)] == [10, 20]


def test_series_without_a_change_hardly_ever_alarm() -> None:
    random = np.random.default_rng(3)
    series = [random.standard_t(3.0, 14) for _ in range(100)]
    assert sum(bool(change_points(values, 0.05, seed=k)) for k, values in enumerate(series)) <= 11  # 5 % of 100, + 3 sd


def test_days_that_remember_the_day_before_hardly_ever_alarm() -> None:
    random = np.random.default_rng(4)
    series = [lfilter([1.0], [1.0, -0.5], random.standard_normal(70))[50:] for _ in range(100)]
    assert sum(bool(change_points(values, 0.05, seed=k)) for k, values in enumerate(series)) <= 13  # 32 by shuffling


@settings(max_examples=20, deadline=None)
@given(st.lists(st.floats(0.0, 5.0), max_size=12), st.integers(0, 100))
def test_any_series_is_answered_the_same_each_time(values: list[float], seed: int) -> None:
    column = np.array(values)
    found = change_points(column, 0.2, seed)
    assert found == change_points(column, 0.2, seed)
    assert all(3 <= at <= len(values) - 3 for at, _ in found)


def test_a_cause_that_appears_and_grows_is_told() -> None:
    lags = [0.0] * 10 + [0.010 + 0.001 * k for k in range(10)]
    days = days_with([0.1] * 10 + [0.5 + 0.05 * k for k in range(10)], lags)
    appeared = [change for change in changes(days) if change.quantity == "valve_lag"]
    assert appeared[0].day == "day_10"
    (slope,) = growth(days)
    assert slope.first_day == "day_10"
    assert slope.per_day == pytest.approx(0.001, rel=0.05)
    assert slope.low <= slope.per_day <= slope.high
    said = " ".join(history_sentences(look_back(days)))
    assert "valve_lag" in said
    assert "0.001 s a day" in said


def asymmetric(number: str, *values: float) -> list[Day]:
    """Days with an effect that is told by this number of it; none where it is 0."""
    made = [size_of("fill_exhaust_asymmetry", {number: Interval(v, v, v, "1")}) if v else {} for v in values]
    return [Day(f"day_{k:02d}", float(k), 0.5, 0.1, "explained", sizes) for k, sizes in enumerate(made)]


def test_numbers_of_different_laws_are_not_one_series() -> None:
    share, rate = asymmetric("ratio", 1.5, 1.6), asymmetric("exhaust_mpa_s", 0.3, 0.4, 0.3, 0.4, 0.3)
    (both,) = {quantity for day in rate for quantity in day.sizes}
    assert both == "fill_exhaust_asymmetry by exhaust_mpa_s"
    known, values = sizes_of([*share, *rate], both)
    assert (known, values.tolist()) == (rate, [0.3, 0.4, 0.3, 0.4, 0.3])
    assert [one.effect for one in growth([*share, *rate])] == [both], "two days of the other have no slope"


def test_where_an_effect_is_not_named_its_size_is_what_changes_nothing() -> None:
    days = asymmetric("ratio", 0.0, 1.5)
    assert sizes_of(days, "fill_exhaust_asymmetry")[1].tolist() == [1.0, 1.5]
    slow = days_with([0.1] * 8, [0.0] * 4 + [0.01] * 4)
    assert sizes_of(slow, "valve_lag")[1].tolist() == [0.0] * 4 + [0.01] * 4
    assert " went from 0 to 0.01 s on day_10" in " ".join(
        history_sentences(look_back(days_with([0.1] * 20, [0.0] * 10 + [0.01] * 10)))
    )


def test_what_is_no_effect_of_the_library_has_no_size() -> None:
    assert size_of("unknown", {}) == size_of("valve_lag", {"balance": Interval(1.0, 1.0, 1.0)}) == {}


def test_where_nothing_changes_that_is_said() -> None:
    assert history_sentences(look_back(days_with([0.1, 0.11, 0.1, 0.09, 0.1, 0.1], [0.0] * 6))) == [
        "6 days are too few to tell a change of level: at a false-alarm rate of 1 % it takes 10"
    ]
    assert history_sentences(look_back(days_with([0.1, 0.11, 0.1, 0.09, 0.1, 0.1] * 2, [0.0] * 12))) == [
        "nothing changed over these days (at a false-alarm rate of 1 %)"
    ]


def test_in_fewer_days_than_it_takes_the_plainest_step_is_none() -> None:
    fewest = fewest_days(FALSE_ALARM_RATE)
    for days, found in ((fewest - 1, False), (fewest + 2, True)):
        plain = np.where(np.arange(days) < days // 2, 0.0, 1.0) + 1e-3 * np.random.default_rng(2).standard_normal(days)
        assert bool(change_points(plain, FALSE_ALARM_RATE)) is found


@pytest.mark.parametrize("lags", [[0.01, 0.02], [0.01, 0.02, 0.03], [0.01, 0.02, 0.03, 0.04]])
def test_a_few_days_of_a_cause_have_no_slope_that_is_known_to_95_per_cent(lags: list[float]) -> None:
    assert growth(days_with([0.1] * (2 + len(lags)), [0.0, 0.0, *lags])) == []


def test_several_sessions_of_few_dates_have_none_either() -> None:
    days = days_with([0.1] * 6, [0.01, 0.011, 0.012, 0.02, 0.021, 0.022])
    assert growth([replace(day, days=float(number // 3)) for number, day in enumerate(days)]) == []


@pytest.mark.parametrize("memory", [0.0, 0.5])
@pytest.mark.parametrize("count", [5, 12, 30])
def test_the_interval_of_a_slope_holds_what_it_says(count: int, memory: float) -> None:
    random = np.random.default_rng(6)
    drawn = lfilter([1.0], [1.0, -memory], random.standard_normal((150, count + 50)), axis=1)[:, 50:]
    found = [growth(days_with([0.1] * count, [0.1 + 0.001 * off for off in one]))[0] for one in drawn.tolist()]
    assert sum(one.low * one.high > 0.0 for one in found) <= 15  # 5 % of 150, and 3 sd


def test_a_change_is_found_however_many_causes_were_named_meanwhile() -> None:
    names = [name for name, effect in LIBRARY.items() if effect.laws and not effect.signature][:24]
    days = days_with(
        [0.1 + 0.001 * (k % 3) for k in range(10)] + [0.5 + 0.001 * (k % 4) for k in range(10)], [0.0] * 20
    )
    busy = [
        replace(day, sizes={name: Interval(0.01, 0.0, 0.02) for name in names[k::20]}) for k, day in enumerate(days)
    ]
    assert [change.day for change in changes(busy) if change.quantity == "gap_deg"] == ["day_10"]


def test_the_picture_has_a_panel_for_each_effect_and_marks_the_changes() -> None:
    days = days_with([0.1] * 5 + [0.5] * 5, [0.0] * 5 + [0.01] * 5)
    figure = history_figure(days, [Change("gap_deg", "day_05", 0.1, 0.5, 0.004)])
    assert len(figure.axes) == 2
    assert "day_05" in {text.get_text() for text in figure.axes[0].texts}


def write(folder: Path, records: Sequence[Record]) -> None:
    folder.mkdir(parents=True)
    for record in records:
        write_record(record, folder / f"{record.name}.mcap", {})


def test_the_command_puts_days_in_order_of_time(tmp_path: Path) -> None:
    later = AddedEffect("delay", {"delay_s": 0.04})
    for name, records in (
        ("20260302T120000Z_b", session(4)),  # as pamrig names a folder itself
        ("a_2026-03-09", session(5, later)),
        ("c_2026-02-01", session(6)),
    ):
        write(tmp_path / "days" / name, records)
    write(tmp_path / "healthy", session(1))
    (tmp_path / "model.yaml").write_text(Path("configs/models/simulated.yaml").read_text())
    called = CliRunner().invoke(
        cli,
        [
            "gap", "history", f"{tmp_path / 'days'}", "--model", f"{tmp_path / 'model.yaml'}",
            "--baseline", f"{tmp_path / 'healthy'}", "--json", f"{tmp_path / 'h.json'}", "-o", f"{tmp_path / 'h.svg'}",
            "--workers", "1",
        ],
    )  # fmt: skip
    assert called.exit_code == 0, called.output
    report = json.loads((tmp_path / "h.json").read_text())
    assert [day["name"] for day in report["days"]] == ["c_2026-02-01", "20260302T120000Z_b", "a_2026-03-09"]
    assert [day["days"] for day in report["days"]] == [0.0, 29.5, 36.0]
    assert "delay" in report["days"][-1]["sizes"]
    assert (tmp_path / "h.svg").exists()


def test_a_day_that_nothing_dates_among_dated_ones_is_named_and_not_put_into_1970(tmp_path: Path) -> None:
    for name, records in (("2026-03-02", session(4)), ("2026-03-09", session(5)), ("repaired", session(6))):
        write(tmp_path / name, [replace(record, facts={}) for record in records[:1]])
    done = CliRunner().invoke(cli, ["gap", "history", f"{tmp_path}", "--model", "configs/models/simulated.yaml"])
    assert isinstance(done.exception, ConfigError)
    assert str(done.exception).startswith("repaired: neither the folder's name nor its records say when it was")
    assert "\n" not in str(done.exception)


def test_a_single_day_is_no_history(tmp_path: Path) -> None:
    done = CliRunner().invoke(cli, ["gap", "history", f"{tmp_path}", "--model", "configs/models/simulated.yaml"])
    assert isinstance(done.exception, ConfigError)

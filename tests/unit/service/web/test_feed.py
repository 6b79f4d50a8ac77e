"""What the plots are fed with: thinned out, no peak lost, the simulator in step with the ticks."""

from typing import Any

import pytest

from rig.app import shipped
from rig.model.chain import Chain
from rig.model.parameters import load_model
from rig.service.web.stream.feed import COLUMNS, STRETCH, Feed

PERIOD_S = 0.005


def samples(
    ticks: range, angle: Any = lambda tick: 0.0, phase: str = "sweep", p1: float = 0.25
) -> dict[str, list[Any]]:
    count = len(ticks)
    pressures = {
        name: [p1 if "1" in name else 0.15] * count for name in ("p1_cmd_mpa", "p2_cmd_mpa", "p1_mpa", "p2_mpa")
    }
    return {"tick": list(ticks), **pressures, "angle_deg": [angle(tick) for tick in ticks], "phase": [phase] * count}


def test_rows_come_every_twenty_milliseconds_and_once_each() -> None:
    feed = Feed(PERIOD_S, None)
    first = feed.add(samples(range(100)))
    again = feed.add(samples(range(50, 120)))
    assert [row[0] for row in first.fine + again.fine] == pytest.approx([0.02 * n for n in range(30)])
    assert len(feed.fine) == 30


def test_a_peak_of_one_row_stays_in_the_coarse_rows() -> None:
    feed = Feed(PERIOD_S, None)
    news = feed.add(samples(range(4 * STRETCH), lambda tick: 9.0 if tick == 12 else 0.0))
    assert max(row[COLUMNS.index("output")] or 0 for row in news.coarse) == 9.0
    assert len(news.coarse) == 2


def test_another_session_begins_anew_and_a_late_repeat_does_not() -> None:
    feed = Feed(PERIOD_S, None)
    feed.add(samples(range(5000, 5200)))
    assert not feed.add(samples(range(5100, 5150))).begins
    news = feed.add(samples(range(40)))
    assert news.begins
    assert [row[0] for row in feed.fine] == pytest.approx([0.02 * n for n in range(10)])


def test_the_simulator_answers_the_same_set_points_tick_by_tick_over_holes_too() -> None:
    model = load_model(shipped.configs() / "models" / "simulated.yaml")
    feed = Feed(PERIOD_S, Chain(model), model.sample_time_s)
    for begin in (0, 30, 70):  # what lies between 60 and 70 never came
        feed.add(samples(range(begin, begin + 30)))
    last = dict(zip(COLUMNS, feed.fine[-1], strict=True))
    assert last["t_s"] == pytest.approx(96 * PERIOD_S)
    alone = Chain(model)
    alone.reset(0.25, 0.15)
    angle = [alone.step(0.25, 0.15)[2] for _ in range(97 * round(PERIOD_S / model.sample_time_s))][-1]
    assert last["simulated"] == pytest.approx(angle, abs=1e-3)
    assert last["residual"] == pytest.approx(-angle, abs=1e-3)


def test_there_is_no_residual_before_the_angle_is_zeroed() -> None:
    model = load_model(shipped.configs() / "models" / "simulated.yaml")
    feed = Feed(PERIOD_S, Chain(model), model.sample_time_s)
    feed.add(samples(range(40), phase="settle"))
    assert {row[COLUMNS.index("residual")] for row in feed.fine} == {None}


def test_what_was_not_measured_is_left_out() -> None:
    feed = Feed(PERIOD_S, None)
    feed.add(samples(range(80), lambda _: None))
    assert feed.fine[0][COLUMNS.index("output")] is None
    assert len(feed.coarse) == 4

"""Two records beside each other: alignment by the commands, differences, what has no counterpart, and the command."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from support.records.made_logs import made_log

from rig.cli.log import log
from rig.errors import CheckFailed, RecordError
from rig.log.compare import beside, compare
from rig.record import Record

DT_S = 0.005


def chirp(count: int = 1600, begin: int = 0, name: str = "chirp") -> Record:
    """A command that never repeats, and an angle that follows it."""
    t_s = np.arange(begin, begin + count) * DT_S
    dp = 0.2 * np.sin(2 * np.pi * (0.2 * t_s + 0.08 * t_s**2))
    return Record(name, t_s - t_s[0], dp, 150.0 * dp, facts={"session": "made"})


LEAPS = replace(chirp(), t_s=np.where(np.arange(1600) < 1000, 0.0, 1e9) + chirp().t_s)
"""Its clock was set while it ran."""


@given(st.integers(-300, 300))
def test_a_record_that_begins_at_another_time_is_brought_back(rows: int) -> None:
    pair = beside(chirp(begin=400), chirp(begin=400 - rows))
    assert pair.shift_s == pytest.approx(rows * DT_S)
    assert pair.angle.max < 1e-9
    assert len(pair.a) == 1600 - abs(rows)


@given(st.floats(0.002, 0.009), st.floats(-3.0, 3.0))
def test_another_rate_and_an_offset(period_s: float, offset_deg: float) -> None:
    a = chirp()
    t_s = np.arange(0.0, a.t_s[-1], period_s)
    b = Record("b", t_s, np.interp(t_s, a.t_s, a.dp_cmd_mpa), np.interp(t_s, a.t_s, a.angle_deg) + offset_deg)
    pair = beside(a, b)
    assert abs(pair.shift_s) <= max(period_s, DT_S)
    assert pair.angle.mean == pytest.approx(offset_deg, abs=0.6)


def test_a_periodic_command_is_not_shifted_by_a_period() -> None:
    a = chirp()
    dp = 0.2 * np.sin(2 * np.pi * 0.5 * a.t_s)
    late = np.concatenate([np.zeros(10), dp[:-10]])
    pair = beside(replace(a, dp_cmd_mpa=dp), replace(a, dp_cmd_mpa=late))
    assert pair.shift_s == pytest.approx(10 * DT_S)


@given(st.floats(0.5, 2.0), st.floats(0.97, 1.03), st.integers(1, 4), st.floats(4.0, 12.0))
def test_nor_where_its_rate_or_its_size_differ_a_little(hz: float, size: float, every: int, length_s: float) -> None:
    """A sine beside itself at half the rate was shifted by one period, and its angle was off by degrees."""
    t_s = np.arange(0.0, length_s, DT_S)
    dp = 0.2 * np.sin(2 * np.pi * hz * t_s)
    a = Record("a", t_s, dp, 100 * dp)
    b = replace(a, dp_cmd_mpa=size * dp).rows(slice(None, None, every))
    pair = beside(a, b)
    assert abs(pair.shift_s) <= every * DT_S + 1e-9
    assert pair.angle.rms <= 100 * 0.2 * 2 * np.pi * hz * every * DT_S


def test_missing_values_do_not_count_and_columns_that_one_lacks_are_left_out() -> None:
    a = chirp()
    angle = a.angle_deg.copy() + 1.0
    angle[100:110] = np.nan
    pair = beside(replace(a, p1_mpa=a.dp_cmd_mpa), replace(a, angle_deg=angle))
    assert pair.angle.max == pytest.approx(1.0)
    assert set(pair.differences) == {"dp_cmd_mpa", "angle_deg"}


def test_records_go_together_by_name_and_repeat() -> None:
    a = [chirp(name="one"), chirp(name="one"), chirp(name="two")]
    b = [chirp(name="one"), replace(chirp(name="one"), angle_deg=chirp().angle_deg + 2.0), chirp(name="three")]
    found = compare(a, b)
    assert [(pair.name, round(pair.angle.max, 9)) for pair in found.pairs] == [("one", 0.0), ("one repeat 2", 2.0)]
    assert (found.only_a, found.only_b) == (["two"], ["three"])
    assert found.departures(2.1) == ["two: only in A", "three: only in B"]
    assert len(found.departures(1.9)) == 3


def test_a_repeat_goes_with_the_same_repeat_where_another_is_missing() -> None:
    """The first of B ended in a fault, and a folder leaves it out."""
    a, b = (
        [replace(chirp(), angle_deg=chirp().angle_deg + number, facts={"repeat": number}) for number in numbers]
        for numbers in ((1, 2, 3), (2, 3))
    )
    found = compare(a, b)
    assert [(pair.name, pair.angle.max) for pair in found.pairs] == [("chirp repeat 2", 0.0), ("chirp repeat 3", 0.0)]
    assert (found.only_a, found.only_b) == (["chirp"], [])


@pytest.mark.parametrize(
    ("a", "b", "said"),
    [
        ([chirp(name="one")] * 2, [chirp(name="two")], "no record of A is called like one of B: one"),
        ([replace(chirp(), angle_deg=None)], [chirp()], "it has no angle"),
        ([chirp(count=1)], [chirp()], "chirp has 1 row; two records are compared from 2 rows on"),
        ([chirp()], [chirp().rows(slice(0, 0))], "chirp has 0 rows"),
        ([LEAPS], [LEAPS], "1600 rows over 1e.09 s are 2e.11 rows of 5 ms; allowed: 20000000"),
        ([chirp(count=1600)], [replace(chirp(), angle_deg=np.full(1600, np.nan))], "no row in common"),
    ],
)
def test_what_cannot_be_compared_is_one_line(a: list[Record], b: list[Record], said: str) -> None:
    with pytest.raises(RecordError, match=said) as error:
        compare(a, b)
    assert "\n" not in str(error.value)


def test_the_command_and_its_exit_status(tmp_path: Path) -> None:
    for name, seed in (("a", 1), ("b", 2)):
        (tmp_path / name).mkdir()
        made_log(tmp_path / name / "sine.mcap", seed=seed)
    places = [str(tmp_path / "a"), str(tmp_path / "b")]
    done = CliRunner().invoke(log, ["compare", *places, "--json", "-", "-o", str(tmp_path / "figures")])
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    (record,) = told["records"]
    assert 0.0 < record["rmse_deg"] < record["max_deg"] == told["max_deg"]
    assert (tmp_path / "figures" / f"{record['record']}.svg").stat().st_size > 1000
    enough, short = record["max_deg"] * 1.01, record["max_deg"] * 0.99
    assert CliRunner().invoke(log, ["compare", *places, "--within", f"{enough}"]).exit_code == 0
    refused = CliRunner().invoke(log, ["compare", *places, "--within", f"{short}"])
    assert isinstance(refused.exception, CheckFailed)
    assert json.loads(done.stdout)["differ"] is False

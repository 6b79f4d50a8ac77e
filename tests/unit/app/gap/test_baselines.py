"""The earlier days of a diagnosis: which they are is said, the log under test is none of them, and the odd one is left
out."""

from pathlib import Path

import pytest
from support.records.made_days import made_day

from rig.app.gap.baselines import EarlierDay, agreeing, check_no_own_baseline, sessions_of
from rig.errors import RigError


def day(name: str, lag_ticks: int = 0, seed: int = 1) -> EarlierDay:
    return EarlierDay(Path(name), made_day(lag_ticks, seed))


def test_days_that_agree_are_all_compared_with() -> None:
    days = [day(f"day_{n}", seed=n) for n in range(6)]
    assert agreeing(days).days == days
    assert agreeing(days).odd == {}


@pytest.mark.parametrize("count", [3, 6])
def test_a_sick_day_among_healthy_ones_is_left_out_and_said(count: int) -> None:
    healthy, sick = [day(f"day_{n}", seed=n) for n in range(count - 1)], day("sick", lag_ticks=8)
    found = agreeing([sick, *healthy])
    assert found.days == healthy
    assert found.records == [each.records for each in healthy]
    *listed, note = found.lines()
    assert listed == [f"earlier day day_{n}: 2 records" for n in range(count - 1)]
    assert note.startswith("note: sick is left out (--every-day keeps it): it disagrees with the other days: its angle")


def test_every_day_is_kept_where_it_is_asked_for_and_where_too_many_disagree() -> None:
    healthy, sick = [day(f"day_{n}", seed=n) for n in range(4)], day("sick", lag_ticks=8)
    every = agreeing([*healthy, sick], every=True)
    assert every.days == [*healthy, sick]
    assert list(every.odd) == [sick.path]
    assert "left out" not in every.odd[sick.path]
    sweeps = [day(f"day_{number}", lag_ticks=8 * n) for number, n in enumerate((0, 0, 4, 9))]
    split = agreeing(sweeps)
    assert split.days == sweeps
    assert all("all are kept" in said for said in split.odd.values())


def test_of_two_days_that_differ_both_are_kept_and_it_is_said() -> None:
    two = agreeing([day("monday"), day("tuesday", lag_ticks=8)])
    assert [each.path.name for each in two.days] == ["monday", "tuesday"]
    (said,) = two.odd.values()
    assert said.startswith("monday and tuesday differ by ")
    assert said.endswith("a third day tells which")


@pytest.fixture
def folders(tmp_path: Path) -> Path:
    """A folder of four days."""
    for name in ("d1", "d2", "d3", "today"):
        _keep_log(tmp_path / "all" / name)
    return tmp_path / "all"


def _keep_log(folder: Path) -> None:
    folder.mkdir(parents=True)
    (folder / "sine.csv").touch()


def test_a_note_beside_the_days_does_not_make_one_session_of_them(folders: Path) -> None:
    (folders / "README.txt").touch()
    (folders / "figures").mkdir()
    (folders / "figures" / "loop.png").touch()
    days = [folders / name for name in ("d1", "d2", "d3", "today")]
    assert sessions_of([folders]) == days
    (folders / "sine.csv").touch()
    assert sessions_of([folders]) == [folders], "logs of its own: a session"


def test_days_of_several_months_are_a_session_each(tmp_path: Path) -> None:
    days = [tmp_path / "all" / month / day for month in ("10", "11") for day in ("1", "2")]
    for day in days:
        _keep_log(day)
    assert sessions_of([tmp_path / "all"]) == days
    assert sessions_of([days[0], tmp_path / "missing"]) == [days[0], tmp_path / "missing"]


def test_a_parent_folder_that_contains_the_log_is_refused(folders: Path) -> None:
    assert len(sessions_of([folders])) == 4
    with pytest.raises(RigError, match=r"it contains the log under test, .*today; name the earlier days one by one"):
        check_no_own_baseline([folders / "today"], [folders])
    with pytest.raises(RigError, match="that is the log under test"):
        check_no_own_baseline([folders / "today"], [folders / "d1", folders / ".." / "all" / "today"])
    with pytest.raises(RigError, match="it is a part of the log under test"):
        check_no_own_baseline([folders], [folders / "d1"])
    with pytest.raises(RigError, match="contains the log under test"):
        check_no_own_baseline([folders / "today" / "x.mcap"], [folders / "today"])
    check_no_own_baseline([folders / "today"], [folders / "d1", folders / "d2"])

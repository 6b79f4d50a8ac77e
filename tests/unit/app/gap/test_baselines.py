"""The earlier days of a diagnosis: which they are is said, the log under test is none of them, and the odd one is
named."""

from pathlib import Path

import numpy as np
import pytest

from rig.app.gap.baselines import Session, check_apart, described, odd_days, sessions_of
from rig.errors import RigError
from rig.record import Record


def day(name: str, lag_ticks: int = 0, seed: int = 1, gain: float = 1.0, offset_deg: float = 0.0) -> Session:
    """A day of two records, with a little noise of its own."""
    rng, t_s = np.random.default_rng(seed), np.arange(2000) * 0.005
    records = []
    for number, hz in enumerate((0.5, 0.8)):
        dp = 0.2 * np.sin(2 * np.pi * hz * t_s)
        answer = np.roll(dp, lag_ticks)
        records.append(
            Record(
                f"sine{number}", t_s, dp, angle_deg=150 * gain * answer + offset_deg + rng.normal(0, 0.05, 2000),
                p1_mpa=0.2 + answer / 2 + rng.normal(0, 5e-4, 2000), p2_mpa=0.2 - answer / 2 + rng.normal(0, 5e-4,
                2000),
            )
        )  # fmt: skip
    return Session(Path(name), records)


def test_days_that_agree_are_none_of_them_odd() -> None:
    days = [day(f"day_{n}", seed=n, gain=1 + 0.001 * n, offset_deg=3.0 * n) for n in range(6)]
    assert odd_days(days) == []


@pytest.mark.parametrize("count", [3, 6])
def test_a_sick_day_among_healthy_ones_is_named(count: int) -> None:
    days = [day(f"day_{n}", seed=n) for n in range(count - 1)] + [day("sick", lag_ticks=8)]
    said = odd_days(days)
    assert [line.partition(" ")[0] for line in said] == ["sick"] * 3, "in the angle and in both pressures"
    assert "its angle is" in said[0]
    assert "deg (rms) from theirs" in said[0]


def test_of_two_days_nobody_can_say_which_is_odd() -> None:
    assert odd_days([day("a"), day("b", lag_ticks=8)]) == []


def test_a_day_without_the_channel_or_with_other_commands_is_not_compared() -> None:
    alone = Session(Path("other"), [Record("sine0", np.arange(9.0), np.ones(9), angle_deg=np.zeros(9))])
    assert odd_days([day("a"), day("b", seed=2), alone]) == []


def test_the_sessions_are_listed() -> None:
    lines = list(described([day("day_1"), day("day_2", seed=2)], ["day_2 disagrees"]))
    assert lines == ["earlier day day_1: 2 records", "earlier day day_2: 2 records", "note: day_2 disagrees"]


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
        check_apart([folders / "today"], [folders])
    with pytest.raises(RigError, match="that is the log under test"):
        check_apart([folders / "today"], [folders / "d1", folders / ".." / "all" / "today"])
    with pytest.raises(RigError, match="it is a part of the log under test"):
        check_apart([folders], [folders / "d1"])
    with pytest.raises(RigError, match="contains the log under test"):
        check_apart([folders / "today" / "x.mcap"], [folders / "today"])
    check_apart([folders / "today"], [folders / "d1", folders / "d2"])

"""A regression is seen: ratios beside an earlier run's, judged by how far the rounds lay apart."""

import json
import os
import random
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from rig.cli.commands import cli
from rig.cli.qualify import bench as command
from rig.errors import CheckFailed, ConfigError
from rig.qualify.benchmarks import figure, share
from rig.qualify.figures.comparison import STILL, Move, compared, earlier, moved
from rig.qualify.figures.machine import worked_s
from rig.qualify.figures.markdown import machine_line, sections
from rig.qualify.figures.rounds import gathered

MACHINE = {"date": "2026-11-22", "cpu": "one", "cores": 2, "system": "Linux", "python": "3.11"}


def rounds(ratios: list[float], **more: Any) -> dict[str, Any]:
    return gathered([{"read": figure(ratio * 2.0, "s", "peer", 2.0, **more)} for ratio in ratios])


def move(was: list[float], now: list[float], **more: Any) -> Move:
    found = moved("log", "read", rounds(was, **more)["read"], rounds(now, **more)["read"])
    assert found is not None
    return found


def test_rounds_become_their_middle_and_extremes() -> None:
    row = rounds([0.5, 0.3, 0.4])["read"]
    assert (row["ratio"], row["ratio_low"], row["ratio_high"], row["rounds"]) == (0.4, 0.3, 0.5, 3)
    assert (row["value"], row["value_low"], row["value_high"]) == pytest.approx((0.8, 0.6, 1.0))
    assert "ratio_low" not in rounds([0.5])["read"], "one round has no spread"


def test_a_row_that_one_round_lacks_is_made_of_the_others() -> None:
    full, empty = {"a": figure(1.0, "s"), "b": figure(2.0, "s")}, {"a": figure(3.0, "s")}
    made = gathered([full, empty])
    assert made["a"]["value"] == 2.0
    assert made["b"]["value"] == 2.0


def test_worse_is_beyond_the_spread_of_both_runs_and_not_at_it() -> None:
    assert not move([1.0, 1.1, 0.9], [1.4, 1.5, 1.3]).worse, "moved by 0.4, spread 0.2 and 0.2"
    assert move([1.0, 1.1, 0.9], [1.45, 1.55, 1.35]).worse
    assert move([1.45, 1.55, 1.35], [1.0, 1.1, 0.9]).better
    assert move([1.45, 1.55, 1.35], [1.0, 1.1, 0.9], better="higher").worse
    assert not move([1.0, 1.0], [0.999 + STILL] * 2).worse, "that little is no move"
    assert move([1.0, 1.0], [1.001 + STILL] * 2).worse


def test_shares_of_cases_are_judged_by_their_interval_even_from_none() -> None:
    def alarms(k: int) -> dict[str, Any]:
        return share([True] * k + [False] * (40 - k), better="lower")

    few, many = moved("gap", "alarms", alarms(0), alarms(3)), moved("gap", "alarms", alarms(0), alarms(30))
    assert few is not None
    assert many is not None
    assert (few.worse, many.worse) == (False, True)
    found = moved("gap", "named", share([True] * 36 + [False] * 4), share([True] * 4 + [False] * 36))
    assert found is not None
    assert found.worse


def test_times_and_what_was_measured_once_are_not_judged_but_what_a_seed_fixes_is() -> None:
    assert moved("log", "x", figure(1.0, "s"), figure(9.0, "s")) is None
    assert moved("log", "x", figure(1.0, "s", "peer", 1.0), figure(9.0, "s", "peer", 1.0)) is None
    fixed = moved("t", "x", figure(1.0, "deg", "PI", 1.0, seeded=True), figure(9.0, "deg", "PI", 1.0, seeded=True))
    assert fixed is not None
    assert fixed.worse


@given(seed=st.integers(0, 10_000), slower=st.floats(1.5, 4.0))
def test_a_slower_program_is_seen_through_noise_of_five_per_cent(seed: int, slower: float) -> None:
    draw = random.Random(seed)
    was, now = ([base * draw.uniform(0.95, 1.05) for _ in range(5)] for base in (1.0, slower))
    assert move(was, now).worse
    assert not move(now, was).worse


def test_the_same_program_is_seldom_called_slower() -> None:
    draw = random.Random(5)

    def five() -> list[float]:
        return [draw.gauss(1.0, 0.1) for _ in range(5)]

    assert sum(move(five(), five()).worse for _ in range(2000)) <= 2


def test_what_is_no_longer_measured_is_told_and_nothing_in_common_is_refused() -> None:
    before = {"machine": MACHINE, "log": rounds([1.0, 1.1]) | {"write": figure(1.0, "s")}}
    found = compared(before, {"machine": MACHINE, "log": rounds([1.0, 1.1])}, "old.json")
    assert found.gone == ("log: write",)
    assert not found.worse
    with pytest.raises(ConfigError, match=r"--against old\.json: it has no ratio of the benchmarks loop"):
        compared(before, {"machine": MACHINE, "loop": rounds([1.0, 1.1])}, "old.json")


@pytest.mark.parametrize("text", ["", "[]", '{"log": {}}', '{"machine": {}, "log": {"read": 3}}'])
def test_a_file_that_holds_no_figures_is_refused_in_one_line(tmp_path: Path, text: str) -> None:
    path = tmp_path / "old.json"
    path.write_text(text)
    with pytest.raises(ConfigError, match=r"--against .*old\.json") as caught:
        earlier(path)
    assert "\n" not in str(caught.value)


def run_with(monkeypatch: pytest.MonkeyPatch, ratios: list[float], *words: str) -> Any:
    monkeypatch.setattr(command, "run_benchmark", lambda name, count: rounds(ratios))
    return CliRunner().invoke(cli, ["bench", "log", *words])


def test_the_command_ends_with_1_when_a_ratio_is_worse_and_names_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old, new = str(tmp_path / "old.json"), str(tmp_path / "new.json")
    run_with(monkeypatch, [1.0, 1.1, 0.9], "--json", old)
    same = run_with(monkeypatch, [1.0, 1.1, 0.9], "--against", old)
    assert same.exit_code == 0
    assert "1 ratios judged" in same.output
    slow = run_with(monkeypatch, [3.0, 3.1, 2.9], "--against", old, "--json", new)
    assert isinstance(slow.exception, CheckFailed)
    assert "log: read" in slow.output
    (worse,) = json.loads(Path(new).read_text())["against"]["worse"]
    assert worse["figure"] == "read"
    assert (worse["was"], worse["now"]) == (1.0, 3.0)
    assert run_with(monkeypatch, [3.0, 3.1, 2.9], "--against", new).exit_code == 0, (
        "a compared run can be compared with"
    )


def test_the_page_is_drawn_from_the_file_with_its_date_and_machine() -> None:
    one = {"machine": MACHINE, "log": rounds([1.0, 1.1]) | {"lost": figure(3.0, "s", goal=1.0, why="counted")}}
    text = sections(one)
    assert "### `pamrig bench log`" in text
    assert "| read | 2.1 s (2 to 2.2) | peer: 2 | 1.05 (1 to 1.1) |  |  |" in text
    assert "| lost | 3 s |  |  |  | 1, **missed** |" in text
    assert "Without a peer or a limit: counted." in text
    busy = machine_line({"machine": MACHINE | {"load": 34.5}})
    assert busy.endswith("Python 3.11; other work kept 34.5 processors busy.\n")
    assert machine_line(one) == "Measured 2026-11-22 on one, 2 cores, Linux, Python 3.11.\n"


def test_other_work_is_what_processors_do_but_rest() -> None:
    stat = "cpu  300 100 200 9000 500 10 20 70 0 0\ncpu0 1 2 3 4 5 6 7 8 0 0\n"
    assert worked_s(stat) == 700 / os.sysconf("SC_CLK_TCK")


def test_pieces_of_one_machine_and_day_are_joined(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out, now = tmp_path / "figures.json", dict(MACHINE)
    monkeypatch.setattr("rig.qualify.figures.machine.machine", lambda: dict(now))
    monkeypatch.setattr(command, "run_benchmark", lambda name, rounds: rounds_of_one(name))
    for names, load in ((["loop", "log"], 3.0), (["log", "record"], 1.0)):
        now["load"] = load
        assert CliRunner().invoke(cli, ["bench", *names, "--add", "--json", str(out)]).exit_code == 0
    found = json.loads(out.read_text())
    assert set(found) == {"machine", "loop", "log", "record"}
    assert found["machine"]["load"] == 3.0
    now["date"] = "2026-11-23"
    result = CliRunner().invoke(cli, ["bench", "log", "--add", "--json", str(out)])
    assert isinstance(result.exception, ConfigError)
    assert str(result.exception) == f"--add {out}: date is '2026-11-22' there and '2026-11-23' here"
    assert CliRunner().invoke(cli, ["bench", "log", "--add"]).exit_code == 2


def rounds_of_one(name: str) -> dict[str, Any]:
    return {f"{name} row": figure(1.0, "s", "peer", 2.0)}

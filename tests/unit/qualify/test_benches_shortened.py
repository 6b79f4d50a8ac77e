"""Every benchmark runs, shortened, and its table is drawn. Figures of so short a run say nothing; that they are there,
every one of them, does."""

import json
import re
import shutil
from collections.abc import Callable, Collection, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
import yaml
from conftest import ROOT
from support.warm import Warm

from rig.app import shipped
from rig.cli.qualify import bench as command
from rig.qualify.benchmarks import (
    gap,
    history,
    identify,
    log,
    loop,
    page,
    record,
    safety,
    tracking,
    waits,
)
from rig.qualify.benchmarks.devices import all_devices, deaths, fieldbus, tick
from rig.qualify.figures.rounds import measured

BRIEF = """\
settle_s: 0.3
zero_s: 0.1
ramp_in_s: 0.2
duration_s: 2.0
ramp_out_s: 0.2
records: [{sine: {frequency_hz: 0.5, amplitude_mpa: 0.2}}]
"""
GAINS = "closed_loop: {kp_mpa_per_deg: 0.002, ki_mpa_per_deg_s: 0.04, limit_mpa: 0.2}\n"
LISTED: Mapping[str, list[str]] = yaml.safe_load(
    (Path(__file__).parent / "figures_of_benches.yaml").read_text(encoding="utf-8")
)
VARIES = re.compile(
    r"\d+(?= (?:evaluations|baud|viewers|days|of them))|(?<=max of )\d+|(?<=loaded by ).+"
    r"|^[^:]+(?=: [^,:]+, (?:healthy|changed|augmented))|(?<=: )[^,:]+(?=, (?:healthy|changed|augmented))"
)
"""What of a figure's name depends on how long, or on what, a benchmark is run."""


def unlike(name: str, figures: Collection[str], left_out: Collection[str] = ()) -> set[str]:
    """Figures that are listed for a benchmark and were not measured, or measured and not listed; but for what was left
    out."""
    return (set(LISTED[name]) - set(left_out)) ^ {VARIES.sub("N", figure) for figure in figures}


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Set constants of a benchmark to so much less."""

    def shorten(module: Any, **less: object) -> None:
        for name, value in less.items():
            assert hasattr(module, name), f"{module.__name__} has no {name} any more"
            monkeypatch.setattr(module, name, value)

    return shorten


def assert_drawn(
    name: str, figures: Mapping[str, Any], capsys: pytest.CaptureFixture[str], left_out: Collection[str] = ()
) -> None:
    """Every figure is there, has a number, and a line in the table."""
    assert not unlike(name, figures, left_out)
    for row in figures.values():
        assert row["value"] == row["value"], row
        assert row["unit"]
        assert row.get("peer") or row.get("limit") or row.get("why") or "low" in row, row
    command.show(name, dict(figures), None)
    shown = capsys.readouterr().out
    assert shown.count("\n") > len(figures)


@pytest.mark.real_time
def test_loop(short: Callable[..., None], capsys: pytest.CaptureFixture[str]) -> None:
    short(loop, SECONDS=0.5)
    assert_drawn("loop", loop.bench_loop(), capsys)


@pytest.mark.real_time
def test_record(short: Callable[..., None], capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "brief.yaml").write_text(BRIEF)
    short(record, SWEEP=tmp_path / "brief")
    figures = measured(record.bench_record, 1)
    assert figures["bytes a record, real clock"]["value"] > figures["bytes a record, real clock"]["limit_value"]
    assert_drawn("record", figures, capsys)


def test_identify(short: Callable[..., None], capsys: pytest.CaptureFixture[str]) -> None:
    if find_spec("pyswarms") is None:  # importing it leaves a file where one stands
        pytest.skip("pyswarms is not installed")
    short(identify, SEEDS=range(1, 2), IDENTIFY_ROUNDS=1, PEER_ITERATIONS=3, ITERATIONS=20, QUALITY_ITERATIONS=(5, 10))
    short(identify, FRESH=False)
    assert_drawn("identify", identify.bench_identify(), capsys)


def test_log(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("mcap_protobuf")
    assert_drawn("log", log.bench_log(records=2000, damages=3, kills=1), capsys)


@pytest.mark.real_time
def test_devices(short: Callable[..., None], capsys: pytest.CaptureFixture[str]) -> None:
    short(all_devices, ALL_DEVICES_TICKS=200)
    short(tick, TICKS=20, TURNS=1)
    short(fieldbus, FIELDBUS_TICKS=50, RATE_S=0.05, BAUDS=(9600, 115200))
    short(deaths, DEATHS=2, BAUDS=(9600, 115200))
    assert_drawn("devices", all_devices.bench_devices(), capsys)


@pytest.mark.real_time
def test_safety(short: Callable[..., None], capsys: pytest.CaptureFixture[str]) -> None:
    short(safety, QUIET_S=0.5)
    assert_drawn("safety", safety.bench_safety(trials=1), capsys)


@pytest.fixture
def forked(warm: Warm, tmp_path: Path) -> Callable[..., str]:
    """A command as the benchmarks' own, whose time is not what is measured: what it says as JSON."""

    def pamrig(*words: object) -> str:
        status, said = warm.run(["pamrig", *map(str, words)], tmp_path)
        assert status == 0, said
        return said[said.find("{") : said.rfind("}") + 1]  # it stands beside what stderr was told

    return pamrig


def test_gap(
    shared: Path,
    short: Callable[..., None],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    forked: Callable[..., str],
) -> None:
    practice = shared / "practice"
    if not (practice / "labels.json").is_file():
        pytest.skip("the practice set is not part of the project")
    monkeypatch.setenv("PAMRIG_PRACTICE", str(practice))
    search = ("--seeds", "1", "--particles", "20", "--iterations", "50", "--unbounded")
    effects = ("valve_lag", "pressure_ceiling", "coulomb_friction")  # those of the cases
    short(gap, CASES_A_UNIT=2, RECORDS=4, ROWS=820, EFFECTS=effects, SEARCH=search)
    short(gap, pamrig=forked)
    assert_drawn("gap", gap.bench_gap(), capsys)


def test_tracking(
    short: Callable[..., None], capsys: pytest.CaptureFixture[str], tmp_path: Path, forked: Callable[..., str]
) -> None:
    reference = tmp_path / "brief.yaml"
    reference.write_text(BRIEF.replace("0.2}", "25}").replace("amplitude_mpa", "amplitude_deg") + GAINS)
    short(tracking, CASES=tracking.CASES[:1], HEALTHY_DAYS=1, TURN_S=0.5, TURNS=1, SWEEP="quick", REFERENCE=reference)
    short(tracking, pamrig=forked)
    assert_drawn("tracking", tracking.bench_tracking(), capsys)


def test_history(short: Callable[..., None], capsys: pytest.CaptureFixture[str]) -> None:
    short(history, SERIES=10)
    assert_drawn("history", history.bench_history(), capsys)


def test_waits(short: Callable[..., None], capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for name in ("simulated", "simulated_worn"):
        text = (
            (shipped.configs() / "rigs" / f"{name}.yaml").read_text().replace("../models/simulated.yaml", "simulated")
        )
        (tmp_path / f"{name}.yaml").write_text(text + "effects: [valve_lag, delay]\n")
    short(waits, HEALTHY=f"{tmp_path}/simulated.yaml", WORN=f"{tmp_path}/simulated_worn.yaml")
    search = ("--seeds", "1", "--particles", "20", "--iterations", "50", "--unbounded")
    short(waits, SWEEP="quick", WAITS_DAYS=1, SEARCH=search, PARTS=(waits.diagnosed, waits.identified))
    figures = waits.bench_waits()
    assert all(row["value"] > row["limit_value"] for row in figures.values()), "nothing is quicker than its limit"
    assert_drawn("waits", figures, capsys, ["make run, once installed"])


def test_check(short: Callable[..., None], capsys: pytest.CaptureFixture[str]) -> None:
    """Its command runs whole in `test_blind_check`; here it takes a minute, of which nothing is waited for."""
    asked: list[tuple[str, ...]] = []
    short(waits, timed=lambda place, *words: asked.append(words) or 60.0)
    figures = waits.bench_check()
    assert [words[:2] for words in asked] == [("gap", "check")]
    assert [row["value"] for row in figures.values()] == [60.0 * waits.WHOLE_CHECK / waits.CHECK_CASES]
    assert_drawn("check", figures, capsys)


@pytest.mark.real_time
def test_page(short: Callable[..., None], capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("playwright")
    if not (shutil.which("chromium") or shutil.which("chromium-browser")):
        pytest.skip("no Chromium on this machine")
    short(page, PAINTS=1, WATCHED_S=1.0, VIEWERS=2, FREEZES=1)
    short(safety, QUIET_S=0.5)
    assert_drawn("page", page.bench_page(trials=1), capsys)


def test_a_figure_that_is_lost_or_new_is_noticed() -> None:
    whole = LISTED["log"]
    assert not unlike("log", whole)
    assert unlike("log", whole[1:]) == {whole[0]}
    assert unlike("log", [*whole, "write, by hand"]) == {"write, by hand"}
    assert unlike("log", whole[1:], whole[:1]) == set()


def test_the_page_shows_what_is_measured() -> None:
    shown = json.loads((ROOT / "docs" / "reference" / "figures.json").read_text(encoding="utf-8"))
    pages = {name: figures for name, figures in shown.items() if name in LISTED}
    assert pages
    assert not {name: stale for name, figures in pages.items() if (stale := unlike(name, figures) - set(LISTED[name]))}


def test_every_benchmark_is_here() -> None:
    run = {name.removeprefix("test_") for name in globals() if name.startswith("test_")}
    assert set(command.BENCHMARKS) - run == {"wrist"}, "the wrist has a test of its own"

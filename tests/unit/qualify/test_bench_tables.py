"""A benchmark's figures are kept whatever becomes of its table, and every benchmark's table can be drawn."""

import ast
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from rig.cli.commands import cli
from rig.cli.qualify import bench as command
from rig.errors import CheckFailed
from rig.qualify import benchmarks
from rig.qualify.benchmarks import cells, figure
from rig.qualify.benchmarks.log_peers import measured_apart

MODULES = sorted(Path(benchmarks.__file__).parent.rglob("*.py"))
SAMPLE = {"peer": "the peer", "peer_value": 2.0}


def calls(module: Path) -> Iterator[dict[str, Any]]:
    """Every row that a benchmark's source makes, with numbers put in."""
    for node in ast.walk(ast.parse(module.read_text())):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "figure":
            named = {keyword.arg: SAMPLE.get(keyword.arg, 7) for keyword in node.keywords if keyword.arg}
            given = [1.5, "unit", "the peer", 2.0][: len(node.args)]
            yield figure(*given, **named)


@pytest.mark.parametrize("module", MODULES, ids=lambda path: path.stem)
def test_every_row_of_every_benchmark_can_be_drawn(module: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = {f"row {number}": row for number, row in enumerate(calls(module))}
    command.show(module.stem, rows, None)
    shown = capsys.readouterr().out
    assert all(name in shown for name in rows)


def test_no_benchmark_makes_rows_by_hand() -> None:
    for module in MODULES:
        if module.stem != "__init__":
            assert '"peer_value":' not in module.read_text(), module


def test_a_share_says_of_what_and_an_interval_how_wide() -> None:
    assert cells(figure(3, "ticks", of=2000))[:5] == ["3", "ticks (of 2000)", "", "", ""]
    assert cells(figure(97.0, "%", of=40, low=90.0, high=99.0))[1] == "% (90 to 99, of 40)"
    assert cells(figure(1.0, "s", "peer", None))[:5] == ["1", "s", "peer", "", ""]
    assert cells(figure(3.0, "s", limit="the wire", limit_value=2.0, goal=4.0))[5:] == ["the wire", "1.5", "4"]


def reasons(module: Path) -> Iterator[tuple[str, set[str]]]:
    """Of each row that a benchmark's source makes: where, and what it says beside its value."""
    for node in ast.walk(ast.parse(module.read_text())):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "figure":
            said = {keyword.arg or "more" for keyword in node.keywords} | ({"peer"} if len(node.args) > 2 else set())
            yield f"{module.name}:{node.lineno}", said


def test_every_figure_has_a_peer_or_a_limit_or_says_why_not() -> None:
    rows = [row for module in MODULES if module.stem != "__init__" for row in reasons(module)]
    assert len(rows) > 50
    assert [place for place, said in rows if not said & {"peer", "limit", "why", "more"}] == []


def test_figures_are_kept_when_a_later_benchmark_or_a_table_breaks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def run(name: str, rounds: int | None) -> dict[str, Any]:
        if name == "log":
            raise ModuleNotFoundError("No module named 'pyswarms'", name="pyswarms")
        if name == "gap":
            raise RuntimeError("broken")
        return {"row": figure(1.0, "s")}

    monkeypatch.setattr(command, "run_benchmark", run)
    out = tmp_path / "x.json"
    result = CliRunner().invoke(cli, ["bench", "loop", "log", "record", "--json", str(out)])
    assert isinstance(result.exception, CheckFailed)
    assert str(result.exception) == "log needs the package pyswarms, which is not installed"
    assert set(json.loads(out.read_text())) == {"machine", "loop", "record"}
    assert "row" in result.output
    monkeypatch.setattr(command, "show", lambda *_: 1 / 0)
    assert isinstance(CliRunner().invoke(cli, ["bench", "loop", "--json", str(out)]).exception, ZeroDivisionError)
    assert set(json.loads(out.read_text())) == {"machine", "loop"}
    assert isinstance(CliRunner().invoke(cli, ["bench", "record", "gap", "--json", str(out)]).exception, RuntimeError)
    assert set(json.loads(out.read_text())) == {"machine", "record"}


def reads_by_a_peer(path: Path, records: int) -> dict[str, float]:
    import pamrig_no_such_peer  # type: ignore[import-not-found]  # noqa: F401

    return {"seconds": 0.0}


def test_a_peer_that_is_missing_in_a_process_of_its_own_is_told_by_name(tmp_path: Path) -> None:
    with pytest.raises(ModuleNotFoundError) as missing:
        measured_apart(reads_by_a_peer, tmp_path, 1)
    assert missing.value.name == "pamrig_no_such_peer"

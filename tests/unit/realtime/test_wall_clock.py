"""A wall clock that jumps cannot reach the loop: nothing on the real-time side ever looks at it."""

import ast
from pathlib import Path

import pytest

REALTIME = Path(__file__).resolve().parents[3] / "rig" / "realtime"
WALL = {"time", "time_ns", "gmtime", "localtime", "ctime", "strftime"}


def wall_clock_uses(source: str) -> list[str]:
    """Every way in which a module could ask for the time of day."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if (
            isinstance(node, ast.Attribute)
            and isinstance(node.value, ast.Name)
            and node.value.id == "time"
            and node.attr in WALL
        ):
            found.append(f"time.{node.attr}")
        if isinstance(node, ast.ImportFrom) and node.module in ("time", "datetime"):
            found.append(f"from {node.module}")
        if isinstance(node, ast.Import) and any(alias.name == "datetime" for alias in node.names):
            found.append("datetime")
    return found


@pytest.mark.parametrize("module", sorted(REALTIME.glob("*.py")), ids=lambda path: path.stem)
def test_the_real_time_side_never_asks_for_the_time_of_day(module: Path) -> None:
    assert wall_clock_uses(module.read_text(encoding="utf-8")) == []


def test_the_search_finds_what_it_looks_for() -> None:
    assert wall_clock_uses("import time\nx = time.time_ns()") == ["time.time_ns"]
    assert wall_clock_uses("from datetime import UTC") == ["from datetime"]

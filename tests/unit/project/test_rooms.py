"""The rules of the rooms hold: import-linter's contracts, and what it cannot see."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT

SOURCES = sorted(path for room in ("rig", "drivers", "hil") for path in (ROOT / room).rglob("*.py"))


def test_the_contracts_hold() -> None:
    lint = Path(sys.executable).with_name("lint-imports")
    done = subprocess.run([lint, "--no-cache"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("room", ["rig", "drivers", "hil"])
def test_every_file_says_what_it_holds(room: str) -> None:
    silent = [
        path for path in SOURCES if path.is_relative_to(ROOT / room) and path.stat().st_size and not docstring(path)
    ]
    assert not silent


def test_no_file_is_a_heap() -> None:
    assert not [(path.name, lines) for path in SOURCES if (lines := len(path.read_text().splitlines())) > 400]


def test_below_the_roof_nobody_asks_whether_it_is_a_simulation() -> None:
    words = ("is_simulated", "if simulation", "if simulated", "if virtual")
    roof = [ROOT / "rig" / room for room in ("app", "cli", "qualify", "public")]
    below = [path for path in SOURCES if not any(path.is_relative_to(room) for room in roof)]
    assert not [path for path in below if any(word in path.read_text() for word in words)]


def docstring(path: Path) -> str | None:
    return ast.get_docstring(ast.parse(path.read_text()))

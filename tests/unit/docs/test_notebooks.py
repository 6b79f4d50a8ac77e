"""The notebooks run, and what is stored in them is what they show: as many outputs, of the same kinds, pictures too."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import nbformat
import pytest
from conftest import ROOT

NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


def shown(path: Path) -> list[list[tuple[str, ...]]]:
    """For each cell of code, the kinds of its outputs."""
    cells = [cell for cell in nbformat.read(path, as_version=4).cells if cell.cell_type == "code"]
    return [[(out.output_type, *sorted(out.get("data", {}))) for out in cell.outputs] for cell in cells]


def sources(path: Path) -> list[Any]:
    return [cell.source for cell in nbformat.read(path, as_version=4).cells]


def test_there_are_four() -> None:
    assert [path.stem for path in NOTEBOOKS] == ["campaign", "find_a_gap", "first_sweep", "identify_and_validate"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_and_shows_what_is_stored(path: Path, tmp_path: Path) -> None:
    call = [sys.executable, str(ROOT / "docs" / "notebooks.py"), path.stem, "--to", str(tmp_path)]
    done = subprocess.run(call, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    assert shown(tmp_path / path.name) == shown(path), "run `python docs/notebooks.py`"
    assert sources(tmp_path / path.name) == sources(path)
    assert any("image/png" in kinds for cell in shown(path) for kinds in cell)
    assert "/tmp" not in path.read_text()

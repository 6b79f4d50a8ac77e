"""The notebooks run, and what is stored in them is what they show: as many outputs, of the same kinds, pictures too."""

import importlib.util
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


def test_what_others_left_on_the_machine_is_no_part_of_a_notebook() -> None:
    spec = importlib.util.spec_from_file_location("notebooks", ROOT / "docs" / "notebooks.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    notebook = nbformat.v4.new_notebook()
    lines = ("shared memory: removed 2 blocks of processes that were killed", "the run is valid")
    shows = [nbformat.v4.new_output("display_data", {"text/plain": line}) for line in lines]
    notebook.cells = [nbformat.v4.new_code_cell("run()", outputs=shows)]
    kept = module.plain(notebook).cells[0].outputs
    assert [output.data["text/plain"] for output in kept] == ["the run is valid"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_and_shows_what_is_stored(path: Path, tmp_path: Path) -> None:
    call = [sys.executable, str(ROOT / "docs" / "notebooks.py"), path.stem, "--to", str(tmp_path)]
    done = subprocess.run(call, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    assert shown(tmp_path / path.name) == shown(path), "run `python docs/notebooks.py`"
    assert sources(tmp_path / path.name) == sources(path)
    assert any("image/png" in kinds for cell in shown(path) for kinds in cell)
    assert "/tmp" not in path.read_text()

"""The notebooks of docs/notebooks: `python docs/notebooks.py` carries each out in an empty folder and keeps what it
shows; `python docs/notebooks.py NAME` that one, `... --to FOLDER` leaves the stored ones as they are.
"""

import argparse
import sys
import tempfile
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

from rig.service.session.session import SWEPT

NOTEBOOKS = Path(__file__).resolve().parent / "notebooks"
LONGEST_S = 180
"""For one cell."""


def carried_out(path: Path) -> Any:
    """The notebook with what its cells show now; CellExecutionError when one fails."""
    notebook = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory(prefix="pamrig-") as folder:
        resources = {"metadata": {"path": folder}}
        NotebookClient(notebook, timeout=LONGEST_S, kernel_name="python3", resources=resources).execute()
    return plain(notebook)


def plain(notebook: Any) -> Any:
    """Without what differs from one execution or machine to the next and says nothing."""
    notebook.metadata = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    for number, cell in enumerate(notebook.cells):
        cell.id, cell.metadata = f"cell-{number}", {}
        if "outputs" in cell:
            cell.outputs = [output for output in cell.outputs if not _of_others(output)]
        for output in cell.get("outputs", []):
            output.pop("metadata", None)
            if output.output_type in ("display_data", "execute_result"):
                output.metadata = {}
    return notebook


def _of_others(output: Any) -> bool:
    """What a run says of processes that somebody killed on this machine."""
    return str(output.get("data", {}).get("text/plain", "")).startswith(SWEPT)


def main() -> int:
    """Carry out those that were named, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--to", type=Path, default=NOTEBOOKS)
    asked = parser.parse_args()
    for path in sorted(NOTEBOOKS.glob("*.ipynb")):
        if not asked.names or path.stem in asked.names:
            nbformat.write(carried_out(path), asked.to / path.name)
            print(path.stem)
    return 0


if __name__ == "__main__":
    sys.exit(main())

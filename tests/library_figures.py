"""What the library costs: `python tests/library_figures.py [NAME ...]` measures it and keeps it in
docs/reference/library_figures.json; `python docs/generated.py` draws the page.

Figures are seconds of a processor, of a process and its children, so that other work on the machine counts little.
NAME is import, fmu, notebooks or tests; without one all are measured. It is no test of the suite: it takes minutes.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from support.plants.fmu_plant import make_fmu

from rig.app.model.simulating import commands_of
from rig.model.parameters import load_model
from rig.model.simulation import simulate
from rig.qualify.benchmarks import figure
from rig.qualify.figures.machine import machine
from rig.qualify.figures.rounds import measured

ROOT = Path(__file__).resolve().parent.parent
KEPT = ROOT / "docs" / "reference" / "library_figures.json"
Figures = dict[str, dict[str, Any]]
STARTS = 10
"""Starts of Python that one round is the mean of."""
RECORDS = 8
"""Records that a round of an FMU simulates."""
API_TESTS = (
    "tests/unit/public", "tests/unit/model/test_external_simulators.py", "tests/unit/log/test_log_channels.py",
    "tests/unit/gap/test_gap_channels.py", "tests/unit/ground/test_channels.py", "tests/unit/ground/test_own_units.py",
    "tests/unit/cli/test_motor_by_commands.py", "tests/unit/docs/test_notebooks.py",
)  # fmt: skip


def children_s() -> float:
    """Seconds of a processor that ended children have used."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def used_s(words: list[str]) -> float:
    """Seconds of a processor of a command; CalledProcessError when it fails."""
    before = children_s()
    subprocess.run(words, cwd=ROOT, check=True, capture_output=True)
    return children_s() - before


def imports() -> Figures:
    """`import pamrig` beside Python's own start, and what the first records bring with them."""

    def start_ms(code: str) -> float:
        return 1e3 * float(np.mean([used_s([sys.executable, "-c", code]) for _ in range(STARTS)]))

    bare, ours, heavy = start_ms("pass"), start_ms("import pamrig"), start_ms("import pamrig; pamrig.read")
    numpy = start_ms("import numpy")
    return {
        "import pamrig": figure(ours - bare, "ms", "import numpy", numpy - bare, goal=300.0),
        "the same with what reads records": figure(heavy - bare, "ms", "import numpy", numpy - bare),
        "start of Python": figure(bare, "ms", why="what stands under the others"),
    }


def fmus() -> Figures:
    """A step of an FMU through `--model`, beside the bare calls of FMPy that set its inputs, step it and read it."""
    (command,) = commands_of(Path("quick"), 0.005)
    rows = len(command)
    made: Figures = {}
    with tempfile.TemporaryDirectory(prefix="pamrig-") as folder:
        for version in (2, 3):
            place = make_fmu(Path(folder) / f"plant{version}.fmu", version)
            model = load_model(place)
            simulate(model, command)
            began_s = time.process_time()
            for number in range(RECORDS):  # another start is another question: nothing is remembered
                simulate(model, command, start_deg=1e-3 * (number + 1))
            ours_s = (time.process_time() - began_s) / (RECORDS * rows)
            bare_s = bare_step_s(place, version, rows)
            made[f"a step of an FMU {version}"] = figure(
                1e6 * ours_s, "us", limit="set, step and read by FMPy's own calls", limit_value=1e6 * bare_s
            )
    return made


def bare_step_s(place: Path, version: int, rows: int) -> float:
    """Seconds of a step by FMPy's calls alone."""
    about = read_model_description(str(place), validate=False)
    kind = FMU2Slave if version == 2 else FMU3Slave
    own = {
        "guid": about.guid, "unzipDirectory": extract(str(place)), "instanceName": "bare",
        "modelIdentifier": about.coSimulation.modelIdentifier,
    }  # fmt: skip
    plant = kind(**own)
    plant.instantiate()
    plant.enterInitializationMode()
    plant.exitInitializationMode()
    put, get = (plant.setReal, plant.getReal) if version == 2 else (plant.setFloat64, plant.getFloat64)
    began_s = time.process_time()
    for row in range(rows):
        put([1, 2], [0.2, 0.2])
        plant.doStep(currentCommunicationPoint=0.005 * row, communicationStepSize=0.005)
        get([3])
    return (time.process_time() - began_s) / rows


def notebooks() -> Figures:
    """Each notebook of docs/notebooks, carried out in an empty folder by `docs/notebooks.py`, kernel included."""
    return {
        f"notebook {path.stem}": figure(
            used_s([sys.executable, "docs/notebooks.py", path.stem, "--to", tempfile.mkdtemp(prefix="pamrig-")]), "s"
        )
        for path in sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
    }


def suite() -> Figures:
    """The tests of the library: public names and examples, plugin, simulators of others, channel maps, notebooks."""
    words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *API_TESTS]
    return {"tests of the library": figure(used_s(words), "s", goal=45.0)}


PARTS: dict[str, tuple[Callable[[], Figures], int]] = {
    "import": (imports, 5),
    "fmu": (fmus, 5),
    "notebooks": (notebooks, 1),
    "tests": (suite, 1),
}
"""What is measured, and in how many rounds."""


def kept(names: list[str]) -> Iterator[tuple[str, Figures]]:
    """The figures of those parts; of the others what was measured before."""
    for name in names:
        run, rounds = PARTS[name]
        yield name, measured(run, rounds)


def main() -> None:
    """Measure, and keep each part as soon as it is there, with its date."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(PARTS))
    asked = parser.parse_args().names or list(PARTS)
    if unknown := [name for name in asked if name not in PARTS]:
        parser.error(f"{unknown[0]}: allowed are {', '.join(PARTS)}")
    for name, figures in kept(asked):
        known = json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {}
        known[name] = {"machine": machine(), "figures": figures}
        KEPT.write_text(json.dumps({part: known[part] for part in PARTS if part in known}, indent=1) + "\n")
        print(name, json.dumps({key: round(row["value"], 3) for key, row in figures.items()}), flush=True)


if __name__ == "__main__":
    main()

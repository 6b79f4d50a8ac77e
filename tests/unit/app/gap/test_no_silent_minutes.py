"""What takes long says what it is at: a design, a hunt, the first diagnosis on a machine."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import pytest
from support.plants.begun_hunts import hunt_options, without_a_finding
from support.plants.gap_rigs import session
from support.rigs.narrow_rig import narrow_rig

from rig.app.gap.diagnosing import first_time
from rig.app.gap.hunt import hunting
from rig.app.gap.hunt.hunting import hunt
from rig.app.gap.known_rigs import Asked
from rig.app.gap.planning import design_session

MODEL = Path("configs/models/simulated.yaml")


def test_a_design_says_what_it_is_at_from_its_start_to_the_choice(tmp_path: Path) -> None:
    heard: list[tuple[float, str]] = []
    asked = Asked(MODEL, (), False, "auto", narrow_rig(tmp_path))
    design_session(asked, 30.0, ("none",), lambda share, what: heard.append((share, what)))
    assert heard[0] == (0.0, "describing the rig")
    assert heard[-1][1] == "choosing the records"
    assert all(before <= after <= 1.0 for (before, _), (after, _) in pairwise(heard))


@pytest.mark.usefixtures("each_diagnosed_once")
def test_a_hunt_says_that_it_diagnoses_and_plans(left_hunt: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []

    @contextmanager
    def told(what: str, total: float | None = None) -> Iterator[Callable[[float, str], None]]:
        said.append(what)
        yield lambda done, note: None

    monkeypatch.setattr(hunting, "progress", told, raising=False)
    hunt(hunt_options(without_a_finding(left_hunt)), allowed=lambda step: False)
    assert said == ["diagnosing after step 1", "planning what tells more"]


def test_the_first_diagnosis_on_a_machine_says_that_it_compiles(tmp_path: Path) -> None:
    session(1)  # compiles
    assert first_time() == ""
    code = "from rig.app.gap.diagnosing import first_time; print(first_time())"
    bare = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", code], env=bare, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "the first time: compiling"

"""A hunt on the worn simulated rig with one sine behind it and its second sweep planned, for tests to go on with.

Every pytest loads this file, whatever it runs: what a hunt needs is imported where one begins.
"""

import pickle
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from rig.app.gap.hunt.options import HuntOptions
    from rig.gap.answer.result import Diagnosis
    from rig.gap.pipeline import Grounds
    from rig.model.parameters import Model
    from rig.record import Record

MODEL = Path(__file__).resolve().parents[3] / "configs" / "models" / "simulated.yaml"


def hunt_options(folder: Path, **more: Any) -> "HuntOptions":
    from rig.app import compose
    from rig.app.gap.hunt.options import HuntOptions

    rig = compose.load(Path("simulated_worn"))
    return replace(HuntOptions(rig, MODEL, folder, first=Path("quick"), virtual=True, seed=5), **more)


@pytest.fixture(scope="session")
def begun_hunt(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from rig.app.gap.hunt.hunting import hunt

    folder = tmp_path_factory.mktemp("hunts") / "begun"
    with diagnosing_once():
        begun = hunt(hunt_options(folder), allowed=lambda step: step.sweep == "step_1.yaml").hunt
    assert begun.ended == "not confirmed"
    assert [step.done for step in begun.steps] == [True, False]
    return folder


@pytest.fixture
def left_hunt(begun_hunt: Path, tmp_path: Path) -> Path:
    """The same, to do with as a test likes."""
    return Path(shutil.copytree(begun_hunt, tmp_path / "left"))


def without_a_finding(folder: Path) -> Path:
    """The hunt as it is when its first sweep is recorded and nothing was made of it yet."""
    from rig.app.gap.hunt.folder import open_hunt

    begun = open_hunt(folder, hunt_options(folder).asked)
    replace(begun, steps=(replace(begun.steps[0], set=()),)).save()
    return folder


@pytest.fixture(scope="module")
def each_diagnosed_once() -> Iterator[None]:
    """The same records under the same question are diagnosed once."""
    with diagnosing_once():
        yield


@contextmanager
def diagnosing_once() -> Iterator[None]:
    from rig.app.gap.hunt import hunting

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(hunting, "diagnose_with_grounds", diagnosed_once)
        yield


def diagnosed_once(
    model: "Model",
    records: "list[Record]",
    days: "list[list[Record]]",
    *,
    experiments: "list[list[Record]]",
    **named: Any,
) -> "tuple[Diagnosis, Grounds]":
    """Answers by what was asked, as bytes: records hold columns, which are neither hashed nor compared. In which folder
    they lie is not asked."""
    return _diagnosed(pickle.dumps((model, *map(_anywhere, (records, *experiments)))), pickle.dumps((days, named)))


@cache
def _diagnosed(recorded: bytes, under: bytes) -> Any:
    from rig.gap.diagnosis import diagnose_with_grounds

    (model, records, *experiments), (days, named) = pickle.loads(recorded), pickle.loads(under)
    return diagnose_with_grounds(model, records, days, experiments=experiments, **named)


def _anywhere(records: "list[Record]") -> "list[Record]":
    return [replace(record, source=None) for record in records]

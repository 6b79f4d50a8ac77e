"""`python docs/structure.py` counts the layout of the code as it is; no module imports itself by way of others."""

import importlib.util
from types import ModuleType

import pytest
from conftest import ROOT


def loaded() -> ModuleType:
    spec = importlib.util.spec_from_file_location("structure", ROOT / "docs" / "structure.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


STRUCTURE = loaded()


@pytest.fixture(scope="module")
def figures() -> dict[str, str]:
    found: dict[str, str] = STRUCTURE.figures(STRUCTURE.Checkout(ROOT))
    return found


def test_no_module_imports_itself_by_way_of_others(figures: dict[str, str]) -> None:
    assert figures["modules in circles of imports"] == "0"


def test_the_way_of_a_diagnosis_is_found(figures: dict[str, str]) -> None:
    files, stays, returns = map(int, figures["way of a diagnosis: files, stays, returns"].split(", "))
    assert files > 1
    assert stays == files + returns


def test_every_room_is_counted() -> None:
    rooms = STRUCTURE.rooms(STRUCTURE.Checkout(ROOT))
    assert {"drivers", "hil", "rig", "rig/gap", "rig/realtime"} <= set(rooms)

"""`python docs/structure.py` counts the layout of the code as it is; no module imports itself by way of others."""

from typing import Any

import pytest
from conftest import ROOT
from support.script import module_at

STRUCTURE = module_at(ROOT / "docs" / "structure.py")


@pytest.fixture(scope="module")
def code() -> Any:
    """This checkout, parsed once."""
    return STRUCTURE.Checkout(ROOT)


@pytest.fixture(scope="module")
def figures(code: Any) -> dict[str, str]:
    found: dict[str, str] = STRUCTURE.figures(code)
    return found


def test_no_module_imports_itself_by_way_of_others(figures: dict[str, str]) -> None:
    assert figures["modules in circles of imports"] == "0"


def test_the_way_of_a_diagnosis_is_found(figures: dict[str, str]) -> None:
    files, stays, returns = map(int, figures["way of a diagnosis: files, stays, returns"].split(", "))
    assert files > 1
    assert stays == files + returns


def test_every_room_is_counted(code: Any) -> None:
    rooms = STRUCTURE.rooms(code)
    assert {"drivers", "hil", "rig", "rig/gap", "rig/realtime"} <= set(rooms)

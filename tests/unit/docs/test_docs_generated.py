"""The reference keeps step with the code it is drawn from."""

from pathlib import Path

import pytest
from conftest import ROOT
from support.script import module_at

from rig.realtime.faults import Fault
from rig.realtime.state import TABLE, Event, State
from rig.sample import Flag

GENERATOR = module_at(ROOT / "docs" / "generated.py")


@pytest.mark.parametrize("page", GENERATOR.pages(), ids=lambda page: page.stem)
def test_a_page_is_as_the_code_is(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert GENERATOR.filled(text) == text, "run `python docs/generated.py`"


def test_every_block_has_its_page() -> None:
    text = "".join(page.read_text(encoding="utf-8") for page in GENERATOR.pages())
    assert all(f"<!-- generated: {name} -->" in text for name in GENERATOR.BLOCKS)


def test_nothing_is_left_out() -> None:
    assert all(f"`{flag.name}`" in GENERATOR.flags() for flag in Flag)
    assert all(f"`{fault.name}`" in GENERATOR.faults() for fault in Fault if fault)
    drawn = GENERATOR.state_diagram()
    assert all(
        f"{s.name} --> {to.name}: {e}" in drawn for (s, e), to in TABLE.items() if (s, e) != (State.FAULT, Event.FAULT)
    )

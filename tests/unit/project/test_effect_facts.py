"""What is true of an effect stands in its entries, of the stage table and of the library; no list of names says it."""

import ast
from pathlib import Path

from conftest import ROOT

from rig.gap.hypotheses.library import LIBRARY
from rig.model.effect_stages import EFFECT_STAGES

ENTRIES = ("rig/model/effect_stages/table.py", "rig/gap/hypotheses/library.py", "rig/gap/answer/words")
"""Where an effect is described."""
CASES = ("rig/blind_check", "rig/qualify/benchmarks")
"""What draws cases and puts effects into records by laws of its own: such a table says what is drawn, not what is true
of an effect."""
NAMES = {*LIBRARY, *EFFECT_STAGES}


def lists_of_effects(path: Path) -> list[int]:
    """Lines where two effects or more stand in one list, set, tuple or table."""
    found = []
    for node in ast.walk(ast.parse(path.read_text())):
        parts = node.elts if isinstance(node, (ast.List, ast.Set, ast.Tuple)) else []
        parts = node.keys if isinstance(node, ast.Dict) else parts
        words = {part.value for part in parts if isinstance(part, ast.Constant) and isinstance(part.value, str)}
        if len(words & NAMES) > 1:
            found.append(node.lineno)
    return found


def test_no_room_keeps_a_list_of_effects() -> None:
    elsewhere = [
        path
        for path in (ROOT / "rig").rglob("*.py")
        if not path.relative_to(ROOT).as_posix().startswith((*ENTRIES, *CASES))
    ]
    assert not {path.relative_to(ROOT).as_posix(): lines for path in elsewhere if (lines := lists_of_effects(path))}


def test_a_list_would_be_seen() -> None:
    assert lists_of_effects(ROOT / ENTRIES[0])


def test_what_makes_all_later_is_exact() -> None:
    late = [stage for stage in EFFECT_STAGES.values() if stage.late != (0.0, 0.0)]
    assert late
    assert all(stage.exact for stage in late)

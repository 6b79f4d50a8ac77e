"""A public constant's name means one number in the whole house."""

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest
from conftest import ROOT

ROOMS = [ROOT / room for room in ("rig", "drivers", "hil")]
PLANTS = ROOT / "hil" / "reference"
"""Each plant is another rig, with numbers of its own."""
EACH_FORMAT = {"VERSION"}
"""Of the file that a module writes."""


def numbers(body: list[ast.stmt]) -> Iterator[tuple[str, object]]:
    """Name and value of each public constant that is written as a number, or as numbers in a tuple."""
    for node in body:
        target = node.targets[0] if isinstance(node, ast.Assign) else getattr(node, "target", None)
        value = getattr(node, "value", None)
        if not isinstance(target, ast.Name) or not target.id.isupper() or target.id.startswith("_") or value is None:
            continue
        parts = (ast.Constant, ast.Tuple, ast.BinOp, ast.UnaryOp, ast.operator, ast.unaryop, ast.expr_context)
        inside = list(ast.walk(value))
        words = any(isinstance(part, ast.Constant) and not isinstance(part.value, int | float) for part in inside)
        if not words and all(isinstance(part, parts) for part in inside):
            yield target.id, eval(ast.unparse(value))


def several(sources: dict[Path, str]) -> dict[str, list[str]]:
    """Each name that has several values, and the places where it is written."""
    found = defaultdict(list)
    for path, text in sources.items():
        for name, value in numbers(ast.parse(text).body):
            found[name].append((value, str(path)))
    return {
        name: [place for _, place in written] for name, written in found.items() if len({one for one, _ in written}) > 1
    }


def test_no_name_has_two_numbers() -> None:
    files = [file for room in ROOMS for file in sorted(room.rglob("*.py")) if not file.is_relative_to(PLANTS)]
    found = several({file.relative_to(ROOT): file.read_text() for file in files})
    assert not {name: places for name, places in found.items() if name not in EACH_FORMAT}
    assert set(found) >= EACH_FORMAT


@pytest.mark.parametrize(("one", "other", "shared"), [("3.0", "2 * 2", True), ("(1, 2)", "(1, 2)", False)])
def test_what_differs_is_seen(one: str, other: str, shared: bool) -> None:
    assert bool(several({Path("a"): f"FAR = {one}", Path("b"): f"FAR: Final = {other}"})) is shared

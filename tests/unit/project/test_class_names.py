"""A public class name means one thing in the whole house."""

import ast
from collections import defaultdict
from functools import cache
from pathlib import Path

from conftest import ROOT

PUBLIC = ROOT / "rig" / "public"
FAMILIES = ROOT / "hil" / "reference"
EACH_FAMILY = {"Physics", "RigLaw", "TimingLaw", "ReadingLaw", "Stepped"}
"""What each plant family brings of its own, under the same name: `hil.reference.families` asks for it by that."""


@cache
def classes() -> dict[str, list[Path]]:
    """Each public class of the rooms, and where it is written. `import pamrig` gives the classes of the rooms under
    their own names, so of two that share one the user's stands for the room's, and counts where no room has that."""
    found = defaultdict(list)
    for path in sorted(file for room in ("rig", "hil", "drivers") for file in (ROOT / room).rglob("*.py")):
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found[node.name].append(path)
    return found


def of_the_house(name: str, places: list[Path]) -> list[Path]:
    """The places that count against each other."""
    rooms = [path for path in places if not path.is_relative_to(PUBLIC)]
    return [path for path in rooms if not (name in EACH_FAMILY and path.is_relative_to(FAMILIES))]


def test_no_two_classes_share_a_name() -> None:
    shared = {name: found for name, places in classes().items() if len(found := of_the_house(name, places)) > 1}
    assert not shared, {name: [str(path.relative_to(ROOT)) for path in places] for name, places in shared.items()}


def test_what_a_family_may_repeat_is_repeated() -> None:
    found = classes()
    assert not [name for name in EACH_FAMILY if len(found[name]) < 2]


def test_what_the_public_package_shares_with_a_room_is_the_same_thing() -> None:
    shared = {name for name, places in classes().items() if len({path.is_relative_to(PUBLIC) for path in places}) > 1}
    assert shared == {"Record", "Diagnosis", "Identified", "Validation", "Comparison"}

"""Hunts below the folder of records, as `pamrig gap hunt` keeps them: what was run, why, and what was still possible
after it."""

import json
from pathlib import Path
from typing import Any, Final

from rig.config import finite, read_text
from rig.errors import RigError
from rig.service.web.files.records import spelt

_FILE: Final = "hunt.json"
_MOST: Final = 20
_MOST_BYTES: Final = 1_000_000


def hunts(logs: Path) -> list[dict[str, Any]]:
    """The newest first; one whose file cannot be read is left out."""
    found = (_hunt(folder) for folder in sorted(_folders(logs), key=lambda each: each.name, reverse=True)[:_MOST])
    return [hunt for hunt in found if hunt is not None]


def _folders(logs: Path) -> list[Path]:
    try:
        return [item for item in logs.iterdir() if not item.is_symlink() and (item / _FILE).is_file()]
    except OSError:
        return []


def _hunt(folder: Path) -> dict[str, Any] | None:
    try:
        kept = json.loads(read_text(folder / _FILE, _MOST_BYTES))
        hunt = {
            "name": spelt(folder.name),
            "ended": str(kept["ended"]),
            "steps": [_step(step) for step in kept["steps"]],
        }
        json.dumps(hunt, ensure_ascii=False).encode()  # halves of characters cannot be sent
    except (RigError, ValueError, LookupError, TypeError, OverflowError, RecursionError):
        return None
    return hunt


def _step(kept: dict[str, Any]) -> dict[str, Any]:
    possible = [{"name": str(name), "probability": finite(chance)} for name, chance in kept["set"]]
    step = {"sweep": str(kept["sweep"]), "why": str(kept["why"]), "minutes": finite(kept["minutes"])}
    return step | {"done": bool(kept["records"]), "possible": possible}

"""Hunts below the folder of records, as `pamrig gap hunt` keeps them: what was run, why, and what was still possible
after it."""

import json
from pathlib import Path
from typing import Any, Final

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
        with (folder / _FILE).open(encoding="utf-8") as file:
            kept = json.loads(file.read(_MOST_BYTES))
        return {"name": folder.name, "ended": str(kept["ended"]), "steps": [_step(step) for step in kept["steps"]]}
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _step(kept: dict[str, Any]) -> dict[str, Any]:
    possible = [{"name": str(name), "probability": float(chance)} for name, chance in kept["set"]]
    told = {"sweep": str(kept["sweep"]), "why": str(kept["why"]), "minutes": float(kept["minutes"])}
    return told | {"done": bool(kept["records"]), "possible": possible}

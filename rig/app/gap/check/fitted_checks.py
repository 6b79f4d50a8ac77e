"""What `pamrig gap check further` and `odds` fit to: folders of scored checks, and the answers beside the scores."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from rig.blind_check.folder import CheckFolder, read_json
from rig.blind_check.row import Scored, read_scored
from rig.errors import RecordError


def checks_of(folders: Sequence[Path]) -> list[CheckFolder]:
    """RecordError when a folder holds no scored check, or is there twice: its cases would count twice."""
    for folder in folders:
        if not any((folder / "scores").glob("*.json")):
            raise RecordError(f"{folder}: no scored check is there (`pamrig gap check` makes one)")
    if len({folder.resolve() for folder in folders}) < len(folders):
        raise RecordError("a check is there twice; name each check once")
    return [CheckFolder(folder) for folder in folders]


def answers_of(folder: CheckFolder) -> Iterator[tuple[str, Scored, Mapping[str, Any]]]:
    """Of each scored case its token, its score, and what was answered to each way of asking; RecordError when an answer
    is missing or is none."""
    for path in sorted((folder.root / "scores").glob("*.json")):
        scored, place = read_scored(path), folder.answer(path.stem)
        said = read_json(place)
        modes = said.get("modes") if isinstance(said, dict) else None
        if not isinstance(modes, dict) or not all(isinstance(modes.get(mode), dict) for mode in scored.rows):
            asked = ", ".join(scored.rows)
            raise RecordError(f"{place}: is not what a blind check writes: an answer to each of {asked}")
        yield path.stem, scored, modes

"""What `pamrig gap study further` and `odds` fit to: folders of scored checks, and the answers beside the scores."""

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from rig.app.gap.levels import origin
from rig.blind_check.folder import CheckFolder, read_json
from rig.blind_check.generate import open_labels
from rig.blind_check.row import Scored, read_scored
from rig.errors import RecordError
from rig.gap.settings import Origin


def checks_of(folders: Sequence[Path]) -> list[CheckFolder]:
    """RecordError when a folder holds no scored check, or is there twice: its cases would count twice."""
    for folder in folders:
        if not any((folder / "scores").glob("*.json")):
            raise RecordError(f"{folder}: no scored check is there (`pamrig gap check` makes one)")
    if len({folder.resolve() for folder in folders}) < len(folders):
        raise RecordError("a check is there twice; name each check once")
    return [CheckFolder(folder) for folder in folders]


def origin_of(study: str, folders: Sequence[CheckFolder], left_out: Sequence[str]) -> Origin:
    """Where what is fitted to these checks comes from; of one whose labels are not at hand no seed is known."""
    words = [f"pamrig gap study {study}", *(folder.root.name for folder in folders)]
    words += [f"--leave-out {name}" for name in left_out]
    of_each = [next(iter(scored.rows.values())).family for folder in folders for _, scored, _ in answers_of(folder)]
    families = [family for family in of_each if family not in left_out]
    seeds = []
    for folder in folders:
        with contextlib.suppress(RecordError):
            seeds.append(open_labels(folder)[1])
    return origin(" ".join(words), seeds, sorted(set(families)), f"{len(families)} cases")


def answers_of(folder: CheckFolder) -> Iterator[tuple[str, Scored, Mapping[str, Any]]]:
    """Of each scored case its token, its score, and what was answered to each way of asking; RecordError when an answer
    is missing or is none."""
    for path in sorted((folder.root / "scores").glob("*.json")):
        scored, place = read_scored(path), folder.answer(path.stem)
        answer = read_json(place)
        modes = answer.get("modes") if isinstance(answer, dict) else None
        if not isinstance(modes, dict) or not all(isinstance(modes.get(mode), dict) for mode in scored.rows):
            asked = ", ".join(scored.rows)
            raise RecordError(f"{place}: is not what a blind check writes: an answer to each of {asked}")
        yield path.stem, scored, modes

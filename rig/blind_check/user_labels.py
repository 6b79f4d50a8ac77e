"""Records that somebody else brings: answered like any question, scored by labels in a file of their own.

Labels are JSON: name of the question -> list of {"effect": NAME}, empty or "none" for a healthy rig; an optional
"ratio" in the first entry says the gap over the floor, else the diagnosis' own figure stands for it, with pressures
where it was asked so. A name that the library does not have is an effect that nobody can name.
"""

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rig.blind_check.check import families_of_levels, result_from
from rig.blind_check.folder import CheckFolder, read_json, require_answers
from rig.blind_check.row import CaseKind, EffectFact, Facts, Scored, Truth
from rig.blind_check.score import score_mode
from rig.errors import RecordError
from rig.gap.hypotheses.library import LIBRARY, NONE, UNKNOWN


def score_own(folder: CheckFolder, labels_path: Path) -> dict[str, Any]:
    """The result of answered questions under somebody's labels; RecordError when one is missing or a label cannot be
    read."""
    labels = read_json(labels_path)
    if not isinstance(labels, dict) or not labels:
        raise RecordError(f"{labels_path}: expected a mapping from question to a list of effects")
    cases = [_scored(folder, str(name), label_of(name, entry, labels_path)) for name, entry in sorted(labels.items())]
    sha256 = hashlib.sha256(json.dumps(labels, sort_keys=True, separators=(",", ":")).encode()).hexdigest()
    return {"sealed_sha256": sha256} | result_from(cases, 0, families_of_levels(folder))


@dataclass(frozen=True)
class OwnLabel:
    """What somebody says of their records."""

    truth: Truth
    ratio: float | None
    """Gap over floor, where they know it."""


def label_of(name: str, entry: Any, where: Path) -> OwnLabel:
    """One entry of the labels; RecordError where it is none."""
    if not isinstance(entry, list) or not all(isinstance(part, dict) and "effect" in part for part in entry):
        raise RecordError(f'{where}: {name}: expected a list of {{"effect": NAME}}, empty for a healthy rig')
    effects = [str(part["effect"]) for part in entry if part["effect"] != NONE]
    ratio = entry[0].get("ratio") if entry else None
    if ratio is not None and (not isinstance(ratio, int | float) or not 0.0 <= ratio < math.inf):
        raise RecordError(f"{where}: {name}: ratio: expected a number, the gap over the floor, and found {ratio!r}")
    return OwnLabel(Truth(_kind(effects), tuple(effects), 0), ratio)


def _kind(effects: Sequence[str]) -> CaseKind:
    if not effects:
        return CaseKind.NONE
    if any(effect not in LIBRARY for effect in effects):
        return CaseKind.FOREIGN
    return CaseKind.SINGLE if len(effects) == 1 else CaseKind.PAIR


def _scored(folder: CheckFolder, name: str, label: OwnLabel) -> Scored:
    token = name.replace("/", "_")
    require_answers(folder, [token])
    answer = read_json(folder.answer(token))
    facts = _facts(label, answer)
    rows = {mode: score_mode(mode, reply, label.truth, facts) for mode, reply in answer["modes"].items()}
    return Scored(rows, answer["naive"], answer["sandbox_layers"])


def _facts(label: OwnLabel, answer: Mapping[str, Any]) -> Facts:
    modes = answer["modes"]
    diagnosis = modes.get("pressures", next(iter(modes.values()))).get("diagnosis") or {"gap": {}}
    ratio = label.ratio if label.ratio is not None else diagnosis["gap"].get("ratio", 0.0)
    stages = {effect: LIBRARY[effect].stage if effect in LIBRARY else UNKNOWN for effect in label.truth.effects}
    return Facts({effect: EffectFact(stage, "") for effect, stage in stages.items()}, ratio)

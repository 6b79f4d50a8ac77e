"""What `pamrig gap study intervals`, `odds` and `temperature` fit to: folders of scored checks, and the answers beside
the scores."""

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rig.app.gap.calibrating import known_families, origin
from rig.blind_check.folder import CheckFolder, read_json
from rig.blind_check.generate import open_labels
from rig.blind_check.modes import MODES
from rig.blind_check.row import Row, Scored, facts_of, read_scored
from rig.errors import RecordError
from rig.gap.answer.findings import STATED
from rig.gap.hypotheses.inverse_problems import ANGLE, PRESSURES
from rig.gap.hypotheses.library import LIBRARY, NONE, UNKNOWN
from rig.gap.priors import Fitted, fitted
from rig.gap.provenance import Origin
from rig.model.slots import AHEAD


def to_fit(folders: Sequence[Path], priors: Path | None, left_out: Sequence[str]) -> tuple[Fitted, list[CheckFolder]]:
    """The levels to go on from (`priors`, or those shipped) and the checks to fit them to. ConfigError when a family
    that is left out is not there."""
    known_families((), left_out)
    return fitted(priors) if priors else fitted(), checks_of(folders)


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


@dataclass(frozen=True)
class JudgedFactor:
    """One factor of one answer, and what really acts on it."""

    reference: str
    """By which the floor was known."""
    family: str
    acting: tuple[str, ...]
    """Effects, of the library or not."""
    probability: Mapping[str, float]
    """As stated, of each hypothesis; those next to impossible are not there."""
    effects: Mapping[str, float]
    """Of each effect of the library that may act on the factor, those next to impossible too."""
    alone: float
    """Stated probability that nothing acts on the factor that this one goes together with; 1 where it goes with
    none."""
    after_nothing: bool
    """It is the angle, and nothing was thought to act ahead of the monitors."""


def judged_factors(folder: CheckFolder, left_out: Sequence[str]) -> Iterator[JudgedFactor]:
    """Of every clear case both factors, or the angle alone where it was judged alone; those on which only raw samples
    show something tell nothing. Without the families `left_out`."""
    for _, scored, answers in answers_of(folder):
        stages = {name: fact.stage for name, fact in facts_of(scored.facts).effects.items()}
        for mode, row in scored.rows.items():
            if row.family not in left_out and _tells(row) and not MODES[mode].withheld:
                yield from _of_answer(answers[mode]["diagnosis"], row.family, stages)


def _tells(row: Row) -> bool:
    return row.error is None and (row.is_clear or not row.has_cause)


def _of_answer(diagnosis: Mapping[str, Any], family: str, stages: Mapping[str, str]) -> Iterator[JudgedFactor]:
    factors, reference = diagnosis["evidence"]["factors"], diagnosis["gap"]["floor_source"]
    ranking = diagnosis.get("ranking", [])
    for name in (PRESSURES, ANGLE):
        acting = [effect for effect in stages if PRESSURES not in factors or _acts_on(name, effect, stages[effect])]
        if name in factors and not any(effect in LIBRARY and LIBRARY[effect].signature for effect in acting):
            alone = factors[ANGLE]["probability"].get(NONE, 0.0) if name == PRESSURES else 1.0
            after_nothing = name == ANGLE and PRESSURES in factors and not factors[PRESSURES]["found"]
            probability = factors[name]["probability"]
            effects = {one["effect"]: min(one["probability"], STATED) for one in ranking if one["judged_on"] == name}
            effects |= {effect: chance for effect, chance in probability.items() if effect not in (NONE, UNKNOWN)}
            yield JudgedFactor(reference, family, tuple(acting), probability, effects, alone, after_nothing)


def _acts_on(factor: str, effect: str, stage: str) -> bool:
    """Whether an effect shows on a factor: where the library has it, by what its laws act on (a shift of P0 lies in the
    muscles and shows in the pressures)."""
    ahead = LIBRARY[effect].upstream if effect in LIBRARY else stage in AHEAD
    return ahead == (factor == PRESSURES)

"""What `pamrig gap study intervals` does: how unsure it is what is left of a gap, and how large an effect is, from
checks of development cases.

Every case tells what was said to be left and what was left on records that the diagnosis never got; and what size was
said and which it was.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from rig.app.gap.study.fitted_checks import answers_of, origin_of
from rig.blind_check.folder import CheckFolder, read_truth
from rig.blind_check.row import CaseKind, EffectFact, Row, facts_of
from rig.errors import RecordError
from rig.gap.answer.facts import RAW
from rig.gap.answer.how_far.prediction_interval import Shrunk, fit_spread
from rig.gap.answer.how_far.size_intervals import NamedSize, deviation_of, fit_reach, reference_of
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.priors import Fitted, Prior, Reach
from rig.gap.reference.kinds import ReferenceKind

LEAST_CASES = 20
"""Fewer tell nothing of the outermost twentieths."""


def with_intervals(levels: Fitted, folders: Sequence[CheckFolder], left_out: Sequence[str]) -> Fitted:
    """The levels with the spread of what is left and the reach of sizes, as these checks' cases show them, without
    those of the families `left_out`. RecordError where there are too few."""
    found = [case for folder in folders for case in _cases(levels, folder, left_out)]
    if len(found) < LEAST_CASES:
        raise RecordError(
            f"{len(found)} cases name an effect whose shrinking was seen on untouched records; at least {LEAST_CASES} "
            "are needed"
        )
    reaches = _reaches(levels, folders, left_out)
    made = origin_of("intervals", folders, left_out)
    return replace(
        levels,
        prediction=fit_spread(*zip(*found, strict=True)),
        reaches={**levels.reaches, **reaches},
        provenance=levels.provenance.renewed({"prediction": made, **{f"reaches.{name}": made for name in reaches}}),
    )


def _reaches(levels: Fitted, folders: Sequence[CheckFolder], left_out: Sequence[str]) -> dict[str, Reach]:
    """How far sizes may be off, by what stood for the rig, where there are enough cases."""
    found: dict[str, list[NamedSize]] = {}
    for folder in folders:
        for reference, one in _sizes(levels, folder, left_out):
            found.setdefault(reference, []).append(one)
    return {reference: fit_reach(cases) for reference, cases in found.items() if len(cases) >= LEAST_CASES}


def _sizes(levels: Fitted, folder: CheckFolder, left_out: Sequence[str]) -> Iterator[tuple[str, NamedSize]]:
    """For each size of a rightly named effect that both laws have: what stood for the rig, and what was said. The
    answers must be by these `levels`."""
    for token, row, diagnosis in _answers(folder, left_out):
        facts = facts_of(read_truth(folder.truth(token))[0]).effects
        reference = reference_of(ReferenceKind(diagnosis["reference"]))
        for cause in diagnosis["causes"]:
            fact = facts.get(cause["effect"])
            one = None if fact is None else _sized(cause, fact, levels.reach_of(reference), levels.prior)
            if one is not None:
                yield reference, replace(one, family=row.family)


def _sized(cause: Mapping[str, Any], fact: EffectFact, reach: Reach, prior: Prior) -> NamedSize | None:
    number = None if cause["judged_on"] in RAW else cause["parameters"].get(fact.library_parameter)
    if not fact.size or number is None or number["high"] is None or number["high"] <= number["low"]:
        return None
    half = max(number["high"] - number["value"], number["value"] - number["low"])  # one end may be the law's own
    rho = _roughness(cause, prior)
    return NamedSize(number["value"], deviation_of(number["value"], half, rho, reach), rho, fact.size)


def _cases(levels: Fitted, folder: CheckFolder, left_out: Sequence[str]) -> Iterator[tuple[Shrunk, float, str]]:
    """For each case and way of asking that named something: what was said, the mean square (deg^2) that was left, and
    the plant family."""
    for _, row, diagnosis in _answers(folder, left_out):
        if row.realised_ef is None or row.ef_interval is None:
            continue
        shrunk = _shrunk(diagnosis, levels.prior)
        closed = shrunk.before_deg**2 - shrunk.floor_deg**2
        yield shrunk, shrunk.floor_deg**2 + (1.0 - min(row.realised_ef, 1.0)) * closed, row.family


def _answers(folder: CheckFolder, left_out: Sequence[str]) -> Iterator[tuple[str, Row, Mapping[str, Any]]]:
    """For each clear case of the library's effects and way of asking: the token, the scored row, the diagnosis;
    none of those that were refused."""
    for token, scored, answers in answers_of(folder):
        for mode, row in scored.rows.items():
            if row.family not in left_out and _of_library(row) and "diagnosis" in answers[mode]:
                yield token, row, answers[mode]["diagnosis"]


def _of_library(row: Row) -> bool:
    return row.kind in (CaseKind.SINGLE, CaseKind.PAIR) and row.is_clear


def _shrunk(diagnosis: Mapping[str, Any], prior: Prior) -> Shrunk:
    left = tuple(one["gap_after_deg"] ** 2 for one in diagnosis["evidence"]["records"])
    added = [cause for cause in diagnosis["causes"] if cause["judged_on"] not in RAW and cause["effect"] in LIBRARY]
    rho = max(_roughness(cause, prior) for cause in added)
    return Shrunk(diagnosis["gap"]["rms_deg"], diagnosis["gap"]["floor_deg"], left, rho)


def _roughness(cause: Mapping[str, Any], prior: Prior) -> float:
    """Of the law by which an effect was named, as it goes into the model; where none of it does, of its first."""
    effect, added = LIBRARY[cause["effect"]], cause["added_to_model"]
    law = effect.laws[0] if added is None else effect.law_of(added["effect"], added["parameters"])
    return effect.roughness(prior, law)

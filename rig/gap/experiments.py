"""The diagnosis of a session together with the experiments that followed it on the same rig.

The session says whether there is something; experiments say which of the effects it is. What they say is by how much
session and experiments together, one size for both, prefer an effect over what the session alone does. No earlier day
holds records of an experiment's kind: where there are days, both are compared with a fingerprint of those; else with
the session's own reference.
"""

from collections.abc import Sequence
from dataclasses import replace

from rig.errors import RecordError
from rig.gap.answer.result import Diagnosis
from rig.gap.evidence.posterior import effect_evidence
from rig.gap.pipeline import Grounds, answer, weigh
from rig.gap.question import ExperimentEvidence, Question
from rig.gap.reference.faster_records import known_hz
from rig.gap.reference.kinds import ReferenceKind
from rig.identify.response.fingerprint import fingerprint_of
from rig.record import Record

MOST_DAYS = 2
"""Of earlier days, the last so many describe the rig for experiments: what a fingerprint costs grows with the square of
its records. More: slower."""


def answer_with(question: Question, experiments: Sequence[Sequence[Record]]) -> tuple[Diagnosis, Grounds]:
    """The diagnosis of a question's records and of those of later experiments. RecordError and ModelError as
    `rig.gap.pipeline.answer`, and where the days are too short to expect an experiment by them."""
    if not question.days:
        question = replace(question, known_hz=known_hz(question.records))
    records = [record for some in experiments for record in some]
    if not records:
        return answer(question)
    return answer(replace(question, experiments=_added_by(_for_experiments(question), records)))


def _added_by(question: Question, records: Sequence[Record]) -> ExperimentEvidence:
    """The evidence in the records of experiments once that of the session is known."""
    named = [replace(record, name=f"{number}_{record.name}") for number, record in enumerate(records, 1)]
    before, after = _effect_evidence(question), _effect_evidence(replace(question, records=[*question.records, *named]))
    return {
        factor: {name: nats - before[factor][name] for name, nats in after[factor].items() if name in before[factor]}
        for factor in before.keys() & after.keys()
    }


def _effect_evidence(question: Question) -> ExperimentEvidence:
    """What the question's records say of the effects on each factor."""
    _, _, posteriors = weigh(question)
    return {posterior.problem.name: effect_evidence(posterior) for posterior in posteriors if not posterior.given}


def _for_experiments(question: Question) -> Question:
    """The question by a reference that expects any record, and up to which excitation the rig is known by it."""
    if not question.days:
        return _without_kept_records(question)
    if question.model is None:
        raise RecordError("no model: experiments that no earlier day holds are judged by a model with a fingerprint")
    described = [record for day in question.days[-MOST_DAYS:] for record in day]
    known = replace(question.model, fingerprint=None)
    known = replace(known, fingerprint=fingerprint_of(described, known))
    if known.fingerprint is None:
        raise RecordError("--baseline: too short to describe the rig by; a hunt needs some minutes of records")
    known = replace(known, fingerprint=replace(known.fingerprint, day=""))
    return replace(
        question, model=known, days=[], kind=ReferenceKind.FINGERPRINT, sister=False, known_hz=known_hz(described)
    )


def _without_kept_records(question: Question) -> Question:
    """The question by the response model alone: session and experiments are compared with one reference, and no file
    keeps records of an experiment."""
    if question.kind is not ReferenceKind.FINGERPRINT or question.model is None or question.model.fingerprint is None:
        return question
    described = replace(question.model.fingerprint, day="")
    return replace(question, model=replace(question.model, fingerprint=described))

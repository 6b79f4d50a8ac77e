"""The diagnosis of a session together with the experiments that followed it on the same rig.

Against a fingerprint or a simulator all records count together. No earlier day holds records of an experiment's kind:
there the first session is compared with the days, the experiments with a fingerprint of those days, and what they say
counts as if it had been known before.
"""

from collections.abc import Sequence
from dataclasses import replace

from rig.errors import RecordError
from rig.gap.answer.result import Diagnosis
from rig.gap.evidence.posterior import heard
from rig.gap.pipeline import Grounds, Question, Said, answer
from rig.gap.reference.build import Kind
from rig.gap.reference.fast import known_hz
from rig.identify.fingerprint import fingerprint_of
from rig.record import Record

MOST_DAYS = 2
"""Of earlier days, the last so many describe the rig for experiments: what a fingerprint costs grows with the square of
its records. More: slower."""


def answer_with(question: Question, experiments: Sequence[Sequence[Record]]) -> tuple[Diagnosis, Grounds]:
    """The diagnosis of a question's records and of those of later experiments. RecordError and ModelError as
    `rig.gap.pipeline.answer`, and where the days are too short to expect an experiment by them."""
    if not question.days:
        later = [_named(record, number) for number, some in enumerate(experiments, 2) for record in some]
        return answer(replace(question, records=[*question.records, *later], known_hz=known_hz(question.records)))
    return answer(replace(question, said=_said_by(question, [record for some in experiments for record in some])))


def _said_by(question: Question, records: Sequence[Record]) -> Said:
    """What records of sweeps that no earlier day holds say, against a fingerprint of those days."""
    if not records:
        return {}
    if question.model is None:
        raise RecordError("no model: experiments that no earlier day holds are judged by a model with a fingerprint")
    described = [record for day in question.days[-MOST_DAYS:] for record in day]
    known = replace(question.model, fingerprint=None)
    known = replace(known, fingerprint=fingerprint_of(described, known))
    if known.fingerprint is None:
        raise RecordError("--baseline: too short to describe the rig by; a hunt needs some minutes of records")
    asked = replace(
        question,
        model=known,
        records=records,
        days=[],
        kind=Kind.FINGERPRINT,
        sister=False,
        known_hz=known_hz(described),
    )
    _, grounds = answer(asked)
    return {posterior.stand.name: heard(posterior) for posterior in grounds.posteriors if not posterior.given}


def _named(record: Record, number: int) -> Record:
    """The record under a name of its own: the same sweep may come twice."""
    return replace(record, name=f"step_{number}_{record.name}")

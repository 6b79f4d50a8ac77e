"""How sure an answer is as a whole, and what the rest is given to, in a sentence."""

from rig.gap.answer.facts import JUDGED_BESIDE, Judged
from rig.gap.answer.result import Diagnosis
from rig.gap.answer.settings import SURE, WORTH
from rig.gap.answer.words.effects import noun_of
from rig.gap.answer.words.sizes import percent
from rig.gap.hypotheses.library import NONE, UNKNOWN
from rig.gap.settings import EVEN_CHANCE


def how_sure(diagnosis: Diagnosis) -> str:
    """The confidence as what it is: how probable it is that all of this is right."""
    verdict = diagnosis.verdict.replace("_", " ")
    sentence = f"{percent(diagnosis.confidence)} that this is right as a whole (verdict: {verdict})"
    return f"{sentence}{_otherwise(diagnosis)}."


def likelier(diagnosis: Diagnosis) -> str:
    """What is more probable than the whole answer, and how probable, for its first line; empty where nothing is."""
    what, chance = _rival(diagnosis)
    if diagnosis.confidence > EVEN_CHANCE or chance <= diagnosis.confidence:
        return ""
    return f"{percent(chance)} are for {what}"


def _otherwise(diagnosis: Diagnosis) -> str:
    """What most of the rest is given to where the answer is not sure, or that the notes say it."""
    if diagnosis.confidence > SURE:
        return ""
    what, chance = _rival(diagnosis)
    if chance >= WORTH * (1.0 - diagnosis.confidence):
        return f"; {percent(chance)} are for {what}"
    return "; the notes say what it may be otherwise" if diagnosis.notes else ""


def _rival(diagnosis: Diagnosis) -> tuple[str, float]:
    """The most probable alternative to the answer, in words, and its probability: another hypothesis on one factor, or
    something unknown beside what is named there. All else is as in the answer, so that both probabilities can be
    added."""
    rivals = [
        (
            {NONE: _nothing(diagnosis, factor), UNKNOWN: "something unknown"}.get(name, noun_of(name)),
            _instead(diagnosis, judged, chance),
        )
        for factor, judged in diagnosis.evidence.factors.items()
        for name, chance in judged.probability.items()
        if name not in _answered(diagnosis, factor)
    ]
    rivals += [
        ("something unknown beside it", diagnosis.confidence * judged.unknown_beside / (1.0 - judged.unknown_beside))
        for factor, judged in diagnosis.evidence.factors.items()
        if judged.unknown_beside < EVEN_CHANCE and UNKNOWN not in _answered(diagnosis, factor)
    ]
    return max(rivals, key=lambda rival: rival[1], default=("", 0.0))


def _instead(diagnosis: Diagnosis, factor: Judged, chance: float) -> float:
    """Probability of the whole answer if it had another hypothesis, of this `chance`, on this factor."""
    return diagnosis.confidence * chance / factor.right if factor.right > 0.0 else 0.0


def _nothing(diagnosis: Diagnosis, factor: str) -> str:
    """That nothing acts on a factor, beside what the answer says of the other one."""
    return "nothing more" if any(cause.judged_on != factor for cause in diagnosis.causes) else "nothing at all"


def _answered(diagnosis: Diagnosis, factor: str) -> set[str]:
    """What the answer holds for true of a factor, or, of one that is judged beside an effect, beside that."""
    channel, _, given = factor.partition(JUDGED_BESIDE)
    here = {cause.effect for cause in diagnosis.causes if cause.judged_on == channel}
    return here - {given} or {NONE}

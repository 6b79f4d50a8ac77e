"""What to record next, or why no sweep is proposed, in a sentence. No number is computed here."""

from rig.gap.answer.result import Diagnosis
from rig.gap.answer.words.effects import EFFECT_WORDS, noun_of
from rig.gap.plan.experiment import Experiment
from rig.gap.reference.kinds import ReferenceKind


def what_to_record(diagnosis: Diagnosis, experiment: Experiment) -> str:
    """What to record, and what it tells apart; that these are open where the answer has not said so."""
    mentioned = {name for cause in diagnosis.causes for name in (cause.effect, *cause.ambiguous_with)}
    names = " and ".join(map(noun_of, experiment.separates))
    open_before = mentioned.issuperset(experiment.separates)
    start = f"to tell {names} apart" if open_before else f"{names} leave these records alike; to tell them apart"
    what = experiment.why(diagnosis.channels)
    return f"{start}, record {what}: they differ by {experiment.weakest:.1f} standard deviations there."


def why_no_next(diagnosis: Diagnosis) -> str:
    """Why no sweep is proposed, and what would make one possible."""
    found = [factor for factor in diagnosis.evidence.factors.values() if factor.found]
    likely = [[name for name in factor.names if name in EFFECT_WORDS] for factor in found]
    alike = next((names for names in likely if len(names) > 1), [])
    if not alike:
        return "these records leave no effects that a sweep would tell apart"
    sentence = f"no sweep as large as these records is known that would tell {' and '.join(map(noun_of, alike))} apart"
    if diagnosis.reference is ReferenceKind.SESSIONS:
        return sentence
    return f"{sentence}; several earlier days (each with --baseline DAY) may make one possible"

"""What the records show beside the causes of the gap, in sentences. No number is computed here."""

from rig.gap.answer.facts import Verdict
from rig.gap.answer.observations import MONITORS_ALONE, STUCK, USUAL
from rig.gap.answer.result import Diagnosis, Observation
from rig.gap.answer.words.compared import than
from rig.gap.answer.words.effects_without_valves import words_of
from rig.gap.raw_tests.signature import MONITOR


def of_single_samples(diagnosis: Diagnosis) -> str:
    """What single samples show where nothing else is found: a part of the answer, however little of the gap it is."""
    found = [_sentence(seen, diagnosis) for seen in diagnosis.observations if _is_of_samples(seen)]
    return f"Single samples show more: {'; '.join(found)}." if found else ""


def seen_beside(diagnosis: Diagnosis) -> str:
    """What was seen beside the causes; without what an answer that nothing is found says itself."""
    observations = diagnosis.observations
    if diagnosis.verdict is Verdict.NONE:
        observations = [seen for seen in observations if not (_is_of_samples(seen) or seen.test.startswith(MONITOR))]
    if diagnosis.verdict is Verdict.UNKNOWN and not diagnosis.named:  # there it is the answer
        observations = [seen for seen in observations if seen.test != MONITORS_ALONE]
    sentences = [_sentence(seen, diagnosis) + _no_cause(seen) for seen in observations]
    return "; ".join(sentences) + "." if sentences else ""


def _is_of_samples(seen: Observation) -> bool:
    return seen.test == STUCK or (seen.effect is not None and seen.test != USUAL)


def _sentence(seen: Observation, diagnosis: Diagnosis) -> str:
    """A finding that is no cause of the gap, without a full stop."""
    words = None if seen.effect is None else words_of(seen.effect, diagnosis.channels)
    text = seen.text if words is None or not seen.parameters else words.sentence(dict(seen.parameters))
    if seen.test == USUAL:
        text = text.replace("{than}", than(diagnosis))
    elif "{than}" in text:
        text = seen.text
    return f"{text[:1].lower()}{text[1:]}"


def _no_cause(seen: Observation) -> str:
    """That a finding beside the causes is none, and why."""
    if seen.test == USUAL:
        return " (as much of it as simulators usually lack of healthy rigs, and no cause of the gap)"
    return "" if seen.effect is None else " (no cause of the gap)"

"""That nothing is found, and how far off the angle is all the same, in sentences. No number is computed here."""

from rig.gap.answer.facts import Retuning
from rig.gap.answer.result import Diagnosis
from rig.gap.answer.words.compared import SOURCES, from_model, no_effect, than
from rig.gap.answer.words.effects import capital
from rig.gap.answer.words.retuning import absorbed, moves
from rig.gap.answer.words.sizes import degrees
from rig.gap.raw_tests.signature import MONITOR
from rig.gap.reference.kinds import ReferenceKind
from rig.gap.settings import ABOVE_FLOOR, LARGE_GAP


def nothing_found(diagnosis: Diagnosis) -> str:
    """That nothing is found; of the angle alone where a pressure monitor is not heard, which is said first."""
    tuning = diagnosis.retuning
    if tuning is not None and from_model(diagnosis) and absorbed(diagnosis) and moves(tuning, diagnosis.channels):
        sentence = _its_own(diagnosis, tuning)
    else:
        sentence = _nothing(diagnosis)
    unheard = "; ".join(seen.text for seen in diagnosis.observations if seen.test.startswith(MONITOR))
    if not unheard:
        return sentence
    return f"{capital(unheard)}. By the angle alone {sentence[:1].lower()}{sentence[1:]}"


def _nothing(diagnosis: Diagnosis) -> str:
    gap = diagnosis.gap
    size_of, usual = degrees(gap.rms_deg), degrees(gap.floor_deg)
    if gap.rms_deg > LARGE_GAP * gap.floor_deg:
        return _far_and_nothing(diagnosis)
    if from_model(diagnosis):
        described = diagnosis.reference is ReferenceKind.FINGERPRINT
        who = "The description of the rig in the model file" if described else "The simulator"
        start = f"{who} says what these records show"
        rest = f"it is {size_of} deg off (rms), and {usual} deg is {SOURCES[gap.floor_source]}."
    else:
        start = f"Nothing has changed that these records show: they are as {than(diagnosis).removeprefix('than ')}"
        rest = f"the angle differs by {size_of} deg (rms), and {usual} deg is {SOURCES[gap.floor_source]}."
    if gap.ratio <= ABOVE_FLOOR and any(factor.found for factor in diagnosis.evidence.factors.values()):
        start = f"Nothing stands above {SOURCES[gap.floor_source]}"
        rest += " Something smaller than that is likely there all the same: it has a shape that is not usual."
    elif gap.rms_deg > gap.floor_deg:
        rest += " What is above that is of the kind that may differ anyhow: offset, gain, lag and width of the loop."
    elif from_model(diagnosis):
        rest += " A cause that moves the angle by much less than that need not show."
    return f"{start}; {rest}"


def _its_own(diagnosis: Diagnosis, tuning: Retuning) -> str:
    """That the simulator's own parameters say what no effect need."""
    gap = diagnosis.gap
    return (
        f"The simulator is {degrees(gap.rms_deg)} deg off (rms), and its own parameters explain that: fitted to these "
        f"records again, it is {degrees(tuning.after_deg)} deg off, and no effect that it lacks is needed. "
        f"What closes most of it: {moves(tuning, diagnosis.channels)[0]}. "
        "Whether the rig is built so, or something acts on it that looks "
        f"the same (Re-tuning, below), these records do not tell; {degrees(gap.floor_deg)} deg is "
        f"{SOURCES[gap.floor_source]}."
    )


def _far_and_nothing(diagnosis: Diagnosis) -> str:
    """Neither an effect nor something unknown is likelier than that nothing is wrong, and yet the gap is large."""
    gap = diagnosis.gap
    far = f"{degrees(gap.rms_deg)} deg (rms), {gap.rms_deg / gap.floor_deg:.0f} times {SOURCES[gap.floor_source]}"
    if from_model(diagnosis):
        start, other = f"The simulator is off by {far}", "a simulator that misses more than usual"
        then = "Identify it on a healthy day of this rig"
    else:
        start, other = f"The angle differs by {far}", "a day that is unlike the others"
        then = "Record a healthy day more: if it is like this one, the rig is as it was"
    return (
        f"{start}; and yet {no_effect(diagnosis)} is likelier than {other} in its offset, gain, lag or width of the "
        f"loop. {then}."
    )

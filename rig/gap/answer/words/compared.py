"""What an answer is compared with, in sentences, and that nothing stands out beside it. No number is computed here."""

from rig.channels import Channels
from rig.gap.answer.facts import ABSORBED_SHARE, Retuning
from rig.gap.answer.result import Diagnosis, Interval
from rig.gap.answer.words.sizes import degrees, percent, size
from rig.gap.raw_tests.signature import MONITOR
from rig.gap.reference.kinds import Kind
from rig.gap.settings import ABOVE_FLOOR, FAR

SOURCES = {
    "sessions": "what the earlier days differ by",
    "session": "what days of a rig usually differ by",
    "fingerprint": "what a rig usually differs by from the description in its model file",
    "uncorrected": "what a rig usually differs by from the description in its model file",
    "simulator": "what a simulator usually misses of the rig that it was identified on",
    "sister": "what a simulator usually misses of another rig of the build",
}
LEAST_TOLD = 0.05
"""Part of what re-tuning closes from which on a number is told behind a move. Less: numbers that nobody needs."""
FEW = 4
"""Effects that are named in a sentence; of more their number is enough."""


def from_model(diagnosis: Diagnosis) -> bool:
    """The records are compared with what a model says, and not with what the rig answered on another day, be it the one
    that a fingerprint keeps."""
    kept = diagnosis.reference is Kind.FINGERPRINT and diagnosis.evidence.sessions > 0
    return not diagnosis.reference.by_days and not kept


def than(diagnosis: Diagnosis) -> str:
    if from_model(diagnosis):
        return "than the simulator says"
    if diagnosis.reference is Kind.FINGERPRINT:
        return "than when the model was identified"
    return "than on the earlier days" if diagnosis.reference is Kind.SESSIONS else "than on the earlier day"


def error(diagnosis: Diagnosis) -> str:
    if from_model(diagnosis):
        return "the simulator's error"
    if diagnosis.reference is Kind.FINGERPRINT:
        return "the difference from what the rig answered then"
    return f"the difference from the earlier day{'s' if diagnosis.reference is Kind.SESSIONS else ''}"


def no_effect(diagnosis: Diagnosis) -> str:
    """No effect of the library; where not all were asked about, none of those, which are named while they are few."""
    few = f" ({', '.join(diagnosis.only)})" if len(diagnosis.only) <= FEW else ""
    return f"none of the effects asked about{few}" if diagnosis.only else "no effect of the library"


def reference(diagnosis: Diagnosis) -> str:
    name = {
        Kind.SESSIONS: "the earlier days",
        Kind.SESSION: "the one earlier day",
        Kind.FINGERPRINT: "the description of the rig in the model file (its fingerprint)",
        Kind.SIMULATOR: "the simulator itself",
    }[diagnosis.reference]
    if diagnosis.reference is Kind.FINGERPRINT and diagnosis.evidence.sessions:
        name = (
            "what the rig answered to these sweeps when the model was identified (the fingerprint in its file keeps it)"
        )
    because = f", {diagnosis.reference_because}" if diagnosis.reference_because else ""
    gap = diagnosis.gap
    usual = f"{degrees(gap.floor_deg)} deg is {SOURCES[gap.floor_source]}"
    return f"{name}{because}. The angle is {degrees(gap.rms_deg)} deg rms off; {usual}."


def absorbed(diagnosis: Diagnosis) -> bool:
    """A gap above the usual one that goes when the simulator's own parameters are fitted again."""
    gap, tuning = diagnosis.gap, diagnosis.retuning
    return tuning is not None and tuning.closes_fraction >= ABSORBED_SHARE and gap.rms_deg > gap.floor_deg


def moves(tuning: Retuning, channels: Channels) -> list[str]:
    """What moves as the simulator is fitted again, what closes most first: each parameter, without those whose move is
    too small to be seen in the digits that a person is told, and the curve and loop as a whole, which are the muscles'
    where the rig has any. Its share of what is closed is told where each is a part of the whole: two that work against
    each other close more than all of it, one after the other."""
    told = []
    for one in tuning.moved:
        half, move = 0.5 * (one.high - one.low), one.after - one.before
        here = size(Interval(one.before, one.before - half, one.before + half, one.unit), signed=True, move=move)
        there = size(Interval(one.after, one.low, one.high, one.unit), signed=True, move=move)
        told += [] if here == there else [(one.share, f"{one.name} goes from {here} to {there}")]
    if tuning.muscles >= LEAST_TOLD:
        whose = "the muscles'" if channels.has_valves else "its"
        told.append((tuning.muscles, f"{whose} own curve and loop change"))
    ordered = sorted(told, key=lambda line: -line[0])
    parts = tuning.closes_fraction > 0.0 and all(share <= 1.0 for share, _ in ordered)
    return [f"{text} ({percent(share)} of that)" if parts and share >= LEAST_TOLD else text for share, text in ordered]


def nothing(diagnosis: Diagnosis) -> str:
    """That nothing is found; of the angle alone where a pressure monitor is not heard, which is said first."""
    tuning = diagnosis.retuning
    if tuning is not None and from_model(diagnosis) and absorbed(diagnosis) and moves(tuning, diagnosis.channels):
        said = _its_own(diagnosis, tuning)
    else:
        said = _nothing(diagnosis)
    if not (dead := "; ".join(one.text for one in diagnosis.observations if one.test.startswith(MONITOR))):
        return said
    return f"{dead[:1].upper()}{dead[1:]}. By the angle alone {said[:1].lower()}{said[1:]}"


def _nothing(diagnosis: Diagnosis) -> str:
    gap = diagnosis.gap
    size_of, usual = degrees(gap.rms_deg), degrees(gap.floor_deg)
    if gap.rms_deg > FAR * gap.floor_deg:
        return _far_and_nothing(diagnosis)
    if from_model(diagnosis):
        described = diagnosis.reference is Kind.FINGERPRINT
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

"""What an answer is compared with, in sentences. No number is computed here."""

from rig.gap.answer.facts import SIGNATURE
from rig.gap.answer.result import Cause, Diagnosis
from rig.gap.answer.words.sizes import degrees
from rig.gap.reference.kinds import ReferenceKind

SOURCES = {
    "sessions": "what the earlier days differ by",
    "session": "what days of a rig usually differ by",
    "fingerprint": "what a rig usually differs by from the description in its model file",
    "uncorrected": "what a rig usually differs by from the description in its model file",
    "simulator": "what a simulator usually misses of the rig that it was identified on",
    "sister": "what a simulator usually misses of another rig of the build",
}
_AS_NOISE = ("quantisation", "sensor_noise")
"""Effects that a fingerprint's noise says were not there."""
MOST_NAMED = 4
"""Effects that are named in a sentence; of more their number is enough."""


def from_model(diagnosis: Diagnosis) -> bool:
    """The records are compared with what a model says, and not with what the rig answered on another day, be it the one
    that a fingerprint keeps."""
    kept = diagnosis.reference is ReferenceKind.FINGERPRINT and diagnosis.evidence.sessions > 0
    return not diagnosis.reference.by_days and not kept


def than(diagnosis: Diagnosis) -> str:
    """The end of a comparison: "than ..."."""
    if from_model(diagnosis):
        return "than the simulator says"
    if diagnosis.reference is ReferenceKind.FINGERPRINT:
        return "than when the model was identified"
    return "than on the earlier days" if diagnosis.reference is ReferenceKind.SESSIONS else "than on the earlier day"


def before(diagnosis: Diagnosis, cause: Cause) -> str:
    """That it was not so before; of what the samples show beside a fingerprint, which keeps their noise and nothing
    else of them, that nobody knows."""
    if (
        diagnosis.reference is ReferenceKind.FINGERPRINT
        and cause.judged_on == SIGNATURE
        and cause.effect not in _AS_NOISE
    ):
        return "whether that was so when the model was identified, its file does not say"
    return f"that was not so {than(diagnosis).removeprefix('than ')}"


def error(diagnosis: Diagnosis) -> str:
    """What the gap is called, by what it is compared with."""
    if from_model(diagnosis):
        return "the simulator's error"
    if diagnosis.reference is ReferenceKind.FINGERPRINT:
        return "the difference from what the rig answered then"
    return f"the difference from the earlier day{'s' if diagnosis.reference is ReferenceKind.SESSIONS else ''}"


def no_effect(diagnosis: Diagnosis) -> str:
    """No effect of the library; where not all were asked about, none of those, which are named while they are few."""
    few = f" ({', '.join(diagnosis.only)})" if len(diagnosis.only) <= MOST_NAMED else ""
    return f"none of the effects asked about{few}" if diagnosis.only else "no effect of the library"


def reference(diagnosis: Diagnosis) -> str:
    """What it is compared with and why, how far off the angle is, and how far is usual."""
    name = {
        ReferenceKind.SESSIONS: "the earlier days",
        ReferenceKind.SESSION: "the one earlier day",
        ReferenceKind.FINGERPRINT: "the description of the rig in the model file (its fingerprint)",
        ReferenceKind.SIMULATOR: "the simulator itself",
    }[diagnosis.reference]
    if diagnosis.reference is ReferenceKind.FINGERPRINT and diagnosis.evidence.sessions:
        name = (
            "what the rig answered to these sweeps when the model was identified (the fingerprint in its file keeps it)"
        )
    because = f", {diagnosis.reference_because}" if diagnosis.reference_because else ""
    gap = diagnosis.gap
    usual = f"{degrees(gap.floor_deg)} deg is {SOURCES[gap.floor_source]}"
    return f"{name}{because}. The angle is {degrees(gap.rms_deg)} deg rms off; {usual}."

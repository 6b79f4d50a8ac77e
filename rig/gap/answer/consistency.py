"""What an answer may not say at once. A pure function of its JSON, for tests and for the blind check to count.

An answer contradicts itself when it names an effect whose addition closes nothing, says "explained" and that the
simulator gets no better, reports a gap that is below the floor and by no other measure above it, puts a cause first
that explains less than another, is surer of a cause than a note that doubts it leaves it, or is surer as a whole than
of what it says.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

from rig.gap.answer.facts import RAW
from rig.gap.hypotheses.inverse_problems import PRESSURES
from rig.gap.hypotheses.library import UNKNOWN
from rig.gap.settings import EITHER_CHANCE, LARGE_GAP

SAME_NUMBER = 1.001
"""Values closer than this are the same number."""


def contradictions(diagnosis: Mapping[str, Any]) -> list[str]:
    """Every way in which a diagnosis (its JSON) contradicts itself, a line each; none when it does not."""
    causes = list(diagnosis["causes"])
    named = [cause for cause in causes if cause["effect"] != UNKNOWN]
    unknown = [cause for cause in causes if cause["effect"] == UNKNOWN]
    return [
        *_verdict(diagnosis["verdict"], named, unknown),
        *_closing(diagnosis, named),
        *_floor(diagnosis),
        *_order(causes),
        *_numbers(diagnosis, causes),
        *_taken_back(causes),
    ]


def _verdict(verdict: str, named: Sequence[Any], unknown: Sequence[Any]) -> list[str]:
    wanted = ("partly_explained" if unknown else "explained") if named else ("unknown" if unknown else "none")
    if verdict == wanted:
        return []
    return [f"the verdict is {verdict}, and the causes ({len(named)} named, {len(unknown)} unknown) say {wanted}"]


def _closing(diagnosis: Mapping[str, Any], named: Sequence[Any]) -> list[str]:
    """Named effects close something, and so does the whole."""
    doubts = [
        f"{cause['effect']} is named and closes nothing of what it was judged on"
        for cause in named
        if cause["judged_on"] not in RAW and not cause["explained_fraction"] > 0.0
    ]
    gap = diagnosis["gap"]
    # of what was judged on the pressures, theirs must close and the angle's gap need not
    on_angle = [cause for cause in named if cause["judged_on"] not in (*RAW, PRESSURES)]
    if named and gap["after_deg"] > SAME_NUMBER * gap["rms_deg"]:
        doubts.append(
            f"{diagnosis['verdict']}, and the simulator gets worse: {gap['rms_deg']:.3g} to {gap['after_deg']:.3g} deg"
        )
    if on_angle and len(on_angle) == len(named) and not gap["after_deg"] < gap["rms_deg"]:
        doubts.append("effects are named on the angle, and the simulator gets no better")
    return doubts


def _floor(diagnosis: Mapping[str, Any]) -> list[str]:
    """Something is found only where something stands above what is usual: the gap, or a factor by its own measure."""
    gap, evidence = diagnosis["gap"], diagnosis.get("evidence", {})
    if diagnosis["verdict"] == "none" or gap["rms_deg"] > gap["floor_deg"]:
        return []
    factors = list(evidence.get("factors", {}).values())
    signatures = [signature for signature in evidence.get("signatures", []) if signature.get("found")]
    if any(one["found"] or one["gap"] > LARGE_GAP * one["floor"] for one in factors) or signatures:
        return []
    size, usual = f"{gap['rms_deg']:.3g} deg", f"{gap['floor_deg']:.3g} deg"
    return [f"{diagnosis['verdict']} at a gap of {size}, below the usual {usual}, by no other measure"]


def _order(causes: Sequence[Any]) -> list[str]:
    """Named ones first, those of the smoothed records by what they leave; `where` follows the first."""
    names = [cause["effect"] for cause in causes]
    doubts = ["an unknown stands before a named effect"] if UNKNOWN in names and any(
        name != UNKNOWN for name in names[names.index(UNKNOWN) :]
    ) else []  # fmt: skip
    judged = [cause for cause in causes if cause["effect"] != UNKNOWN and cause["judged_on"] not in RAW]
    for first, second in pairwise(judged):
        if (
            first["gap_after_deg"] > SAME_NUMBER * second["gap_after_deg"]
            and first["explained_fraction"] < second["explained_fraction"]
        ):
            doubts.append(f"{first['effect']} stands before {second['effect']} and explains less")
    doubled = {name for name in names if name != UNKNOWN and names.count(name) > 1}
    return [*doubts, *(f"{name} is named twice" for name in sorted(doubled))]


def _numbers(diagnosis: Mapping[str, Any], causes: Sequence[Any]) -> list[str]:
    """Intervals hold their values, probabilities are some, no cause is its own alternative."""
    doubts = []
    gap = diagnosis["gap"]
    low, high = gap.get("after_low_deg"), gap.get("after_high_deg")
    if low is not None and high is not None and not low / SAME_NUMBER <= gap["after_deg"] <= high * SAME_NUMBER:
        doubts.append(f"{gap['after_deg']:.3g} deg are left, outside of {low:.3g} to {high:.3g} deg")
    for cause in causes:
        outside = [name for name, one in cause["parameters"].items() if not one["low"] <= one["value"] <= one["high"]]
        doubts += [f"{cause['effect']}: {name} lies outside its own interval" for name in outside]
        if cause["effect"] in cause["ambiguous_with"]:
            doubts.append(f"{cause['effect']} may also be itself")
        if not 0.0 <= cause["confidence"] <= 1.0:
            doubts.append(f"{cause['effect']}: a confidence of {cause['confidence']:.3g}")
        if diagnosis.get("confidence", 0.0) > SAME_NUMBER * cause["confidence"]:
            doubts.append(f"{diagnosis['confidence']:.2f} as a whole, {cause['confidence']:.2f} for {cause['effect']}")
    if causes and diagnosis["where"].get("stage") != causes[0]["stage"]:
        doubts.append(f"it lies in {diagnosis['where'].get('stage')}, and the first cause in {causes[0]['stage']}")
    return doubts


def _taken_back(causes: Sequence[Any]) -> list[str]:
    """A confidence above what the notes that take its cause back leave of it."""
    return [
        f"{cause['effect']} with a confidence of {cause['confidence']:.2f}, and a note takes it back: {note}"
        for cause in causes
        for note in cause.get("doubted_by", [])
        if cause["confidence"] > EITHER_CHANCE
    ]

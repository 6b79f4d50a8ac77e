"""How far the gap shrinks with the named causes in the simulator, and what stays, in sentences. No number is computed
here."""

from rig.gap.answer.facts import Verdict
from rig.gap.answer.result import Diagnosis
from rig.gap.answer.words.causes import in_pressures, unexplained
from rig.gap.answer.words.compared import SOURCES, error
from rig.gap.answer.words.sizes import degrees


def how_far_it_closes(diagnosis: Diagnosis) -> str:
    """From what to what the gap falls with the named causes in the simulator."""
    gap = diagnosis.gap
    before, after = gap.rms_deg, gap.after_deg
    with_it = "that" if len(diagnosis.named) == 1 else "these"
    if all(cause.is_raw for cause in diagnosis.named):
        return (
            f"It lies in the single samples: without it these are {degrees(after)} deg off instead of "
            f"{degrees(before)}; the smoothed angle, {degrees(gap.smoothed_deg)} deg off, is not helped by it."
        )
    remaining, between = _after(diagnosis) if after < before else (degrees(before), "")
    if remaining == degrees(before):
        start = "It shows in the pressures;" if in_pressures(diagnosis) else f"With {with_it} in it"
        return f"{start} {error(diagnosis)} in the angle, {degrees(before)} deg, hardly changes."
    further = f"; under other sweeps {between} deg are likely (90 %)" if between else ""
    return (
        f"With {with_it} in it {error(diagnosis)} falls from {degrees(before)} to {remaining} deg "
        f"on {_judged_on(diagnosis)} that the fit has not seen{further}."
    )


def what_stays(diagnosis: Diagnosis) -> str:
    """What is left with the named effects in it, and why."""
    gap = diagnosis.gap
    after, usual = gap.after_deg, gap.floor_deg
    usually = f"where {degrees(usual)} deg are {SOURCES[gap.floor_source]}"
    if after <= usual:
        return f"{degrees(after)} deg, no more than the {degrees(usual)} deg that are {SOURCES[gap.floor_source]}."
    if diagnosis.verdict in (Verdict.UNKNOWN, Verdict.PARTLY_EXPLAINED):
        return f"{degrees(after)} deg, {usually}; the rest is what {unexplained(diagnosis)}."
    if all(cause.is_raw for cause in diagnosis.named):
        return (
            f"{degrees(after)} deg in the smoothed angle, {usually}; no simulator takes out what those samples leave."
        )
    return (
        f"{degrees(after)} deg, {usually}; the rest is how roughly the law of the effect and the "
        "simulator's own class repeat this rig."
    )


def _judged_on(diagnosis: Diagnosis) -> str:
    """What a fit is judged on, see `rig.gap.answer.how_far.halves`."""
    return "records" if len(diagnosis.evidence.records) > 1 else "the half of the record"


def _after(diagnosis: Diagnosis) -> tuple[str, str]:
    """What is left, and its interval where there is one ("LOW to HIGH"), both to the same digit. The digit follows from
    the smallest of the interval's width, how far the gap falls, and a quarter of what is left."""
    gap = diagnosis.gap
    low, high = gap.after_low_deg, gap.after_high_deg
    if not low < high:
        return degrees(gap.after_deg), ""
    # a digit fewer, and 1.8 would fall to 2, or 25 be told as 20
    width = min(high - low, gap.rms_deg - gap.after_deg, 0.25 * gap.after_deg)
    remaining, least, most = (degrees(value, width) for value in (gap.after_deg, low, high))
    return remaining, f"{least} to {most}" if least != most else ""

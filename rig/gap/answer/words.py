"""The answers in a sentence each, for the terminal and the page. No number is computed here."""

from rig.gap.answer.result import Cause, Diagnosis

SOURCES = {
    "sessions": "repeated healthy sessions",
    "periods": "the periods of one healthy session (less sure: days differ more than periods)",
    "noise": "the sensor's noise (unsure: no repeats and no periods)",
    "model": "the model's own misfit (unsure: no healthy session was given)",
}
FAR = 3.0
"""Floors by which a model must miss the healthy rig for that to be worth a line."""
NOTHING = {
    "sessions": "no gap beyond what healthy sessions differ by",
    "periods": "no gap beyond what the periods of one healthy session differ by",
    "noise": "no gap beyond the sensor's noise",
    "model": "nothing beyond what the model itself may miss, and without healthy sessions nothing smaller can be seen",
}
STAGES = {
    "timing": "in the timing",
    "valve": "in the valves",
    "muscle": "in the muscles",
    "joint": "in the joint",
    "sensor": "in the angle sensor or its converter",
}


def answers(diagnosis: Diagnosis) -> dict[str, str]:
    """Question -> answer: verdict, where, which, how far, the model itself, what next."""
    told = {"Verdict:": _verdict(diagnosis)}
    if diagnosis.causes:
        told["Where:"] = _where(diagnosis)
        told["Which:"] = _which(diagnosis)
    if any(cause.effect != "unknown" for cause in diagnosis.causes):
        told["How far:"] = _how_far(diagnosis)
    misfit = diagnosis.evidence.get("model_misfit_deg")
    if misfit is not None and misfit > FAR * diagnosis.gap["floor_deg"]:
        told["Model:"] = (
            f"as it stands it misses the healthy sessions by {misfit:.3g} deg rms. That is no part of the gap, which "
            "is what changed "
            "since; `pamrig identify` on the healthy sessions makes it smaller."
        )
    if diagnosis.next_experiment:
        names = ", ".join(diagnosis.next_experiment["separates"])
        ratio = diagnosis.next_experiment["expected_ratio"]
        told["Next:"] = (
            f"to tell {names} apart: {diagnosis.next_experiment['why']}. They should differ by {ratio:.1f} floors "
            "there."
        )
    return told


def _verdict(diagnosis: Diagnosis) -> str:
    gap = diagnosis.gap
    size = f"the gap is {gap['rms_deg']:.3g} deg rms against a floor of {gap['floor_deg']:.3g} deg (ratio {gap['ratio']:.1f}), by {SOURCES[gap['floor_source']]}"  # noqa: E501
    words = {
        "none": NOTHING[gap["floor_source"]],
        "explained": "explained",
        "partly_explained": "partly explained",
        "unknown": "a gap that no effect of the library explains",
    }
    return f"{words[diagnosis.verdict]}, confidence {diagnosis.confidence:.2f}; {size}."


def _where(diagnosis: Diagnosis) -> str:
    shares = diagnosis.where["shares"]
    stages = dict.fromkeys(
        [diagnosis.where["stage"], *(cause.stage for cause in diagnosis.causes if cause.effect != "unknown")]
    )
    text = " and ".join(STAGES[stage] for stage in stages if stage in STAGES) or "somewhere in the chain"
    if shares:
        text += f": {100 * shares['valve']:.0f} % of the angle gap comes through the pressures, {100 * shares['downstream']:.0f} % from behind them"  # noqa: E501
    return text + "."


def _which(diagnosis: Diagnosis) -> str:
    return "; ".join(_name(cause) for cause in diagnosis.causes) + "."


def _name(cause: Cause) -> str:
    if cause.effect == "unknown":
        near = f" (nearest: {', '.join(cause.ambiguous_with)})" if cause.ambiguous_with else ""
        return f"unknown, seen in the {'pressures' if cause.side == 'valve' else 'angle'}{near}"
    numbers = ", ".join(
        f"{name} {number.value:.3g} ({number.low:.3g} to "
        f"{number.high:.3g}){'' if number.unit == '1' else ' ' + number.unit}"
        for name, number in cause.parameters.items()
        if number.high > number.low
    )
    doubt = f", or {' or '.join(cause.ambiguous_with)}" if cause.ambiguous_with else ""
    return f"{cause.effect} ({cause.stage}){doubt}, confidence {cause.confidence:.2f}: {numbers}"


def _how_far(diagnosis: Diagnosis) -> str:
    gap = diagnosis.gap
    if all(cause.side == "signature" for cause in diagnosis.causes):
        cause = diagnosis.causes[0]
        return f"the unsmoothed gap falls from {cause.gap_before_deg:.3g} to {cause.gap_after_deg:.3g} deg rms."
    if gap["explained_fraction"] < 0.0:
        return (
            f"not at all: with this in it the simulator would be {gap['after_deg']:.3g} instead of "
            f"{gap['rms_deg']:.3g} deg rms off. "
            "Something in the answer is wrong; do not use the augmented model."
        )
    return (
        f"on held-out records the gap falls from {gap['rms_deg']:.3g} to {gap['after_deg']:.3g} deg rms; "
        f"{100 * min(gap['explained_fraction'], 1.0):.0f} % of what stands above the floor is explained."
    )

"""Scoring one case: the opened label beside what was answered, and the stated shrinkage tried on records nobody was
given.

Produces plain rows; counting them is `tally`. Nothing here looks at more than one case.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from rig.blind_check.modes import MODES
from rig.blind_check.source import Named, records_of
from rig.errors import RigError
from rig.gap.answer.consistency import contradictions
from rig.gap.answer.facts import SWALLOWED
from rig.gap.hypotheses.library import LIBRARY, effect_class
from rig.gap.raw_tests.levels import loudness
from rig.record import Column, Record

ALSO_RIGHT: Final = {"co_contraction": {"valve"}, "leak": {"valve"}}
"""Muscle effects that show on the valve side (gap.md): both places count as right."""
UNPREDICTABLE: Final = {"quantisation", "mains_hum", "sensor_noise", "lost_samples", "sensor_dropout"}
"""Effects whose course a simulator cannot repeat, only their strength: their gap is the high-frequency rms."""
EXCITED: Final = 2.0
"""Untouched records show an effect when their rms gap is this many floors; a stop that is never met can neither be
closed nor missed."""
ABSORBED: Final = {
    "sensor_gain", "sensor_offset", "sensor_nonlinearity", "backlash", "gravity_load", "muscle_mismatch",
    "coulomb_friction",
}  # fmt: skip
"""Effects that a fit of the simulator's own parameters swallows, declared before any check: the muscles' curve and loop
are free in it."""
FLAGS: Final = {"unknown", "partly_explained"}
"""Verdicts that say something is there which the library does not hold."""


def score_mode(
    mode: str, answer: Mapping[str, Any], label: Mapping[str, Any], facts: Mapping[str, Any]
) -> dict[str, Any]:
    """One case in one mode as a row: what was true, what was said, what of it was right."""
    said, asked = answer.get("diagnosis") or {"verdict": "error", "gap": {}, "where": {}, "causes": []}, MODES[mode]
    causes = [cause for cause in said["causes"] if cause["effect"] != "unknown"]
    verdict, first = said["verdict"], causes[0] if causes else {}
    row = {
        "mode": mode, "kind": label["kind"], "effects": list(label["effects"]), "baselines": label["baselines"],
        "family": label.get("family", ""), "ratio": facts[asked.ratio], "ratio_pressure": facts["ratio_pressure"],
        "verdict": verdict, "detected": verdict not in ("none", "error"), "flagged": verdict in FLAGS,
        "unknown": verdict == "unknown",
        "named": [cause["effect"] for cause in causes], "set": [first["effect"],
        *first["ambiguous_with"]] if first else [],
        "stage_said": said["where"].get("stage"), "confidence": first.get("confidence"),
        "predicted_ef": said["gap"].get("explained_fraction"),
        "ef_interval": _interval(said["gap"]) if causes else None,
        "contradictions": contradictions(said) if said["gap"] else [], "reference": said.get("reference"),
        "absorbed": asked.retunes and bool(ABSORBED & set(label["effects"])),
        "seconds": answer["seconds"], "cpu_seconds": answer.get("cpu_seconds"), "error": answer.get("error"),
    }  # fmt: skip
    return row if label["kind"] == "none" else row | _right(row, first, facts, asked.pressures) | _retuned(said, row)


def _retuned(said: Mapping[str, Any], row: Mapping[str, Any]) -> dict[str, Any]:
    """Of an effect that a fit of the simulator's own parameters swallows: is that said, which one moved, and what would
    look the same?"""
    retuning = said.get("retuning") or {"closes_fraction": 0.0, "parameters": []}
    alike = {*row["set"], *retuning.get("looks_like", [])}
    swallowed = retuning["closes_fraction"] >= SWALLOWED and bool(retuning["parameters"])
    return {"absorbed_right": swallowed and bool(alike & set(row["effects"]))}


def _interval(gap: Mapping[str, Any]) -> tuple[float, float] | None:
    """The explained fraction's interval by the stated rms that is left, lower end first. None without one (a mark in
    the raw samples has no course to add), or without a gap."""
    low, high = gap.get("after_low_deg"), gap.get("after_high_deg")
    span = gap["rms_deg"] ** 2 - gap["floor_deg"] ** 2 if low is not None else 0.0
    if low is None or high is None or span <= 0.0 or low == high:
        return None
    return (gap["rms_deg"] ** 2 - high**2) / span, (gap["rms_deg"] ** 2 - low**2) / span


def _right(
    row: Mapping[str, Any], first: Mapping[str, Any], facts: Mapping[str, Any], pressures: bool
) -> dict[str, Any]:
    """What of a row's answer fits the truth."""
    truths, effects = row["effects"], facts["effects"]
    stages = {fact["stage"] for fact in effects.values()}.union(*(ALSO_RIGHT.get(effect, set()) for effect in truths))
    right = {"stage_right": row["stage_said"] in stages, "stages": sorted(fact["stage"] for fact in effects.values())}
    two = row["named"][:2]
    if row["kind"] == "single":
        right["exact"] = two[:1] == truths
        right["class"] = any(_same_class(name, truths[0], pressures) for name in two[:1])
        right["in_set"] = truths[0] in row["set"]
        right["size_error"] = _size_error(first, truths[0], effects[truths[0]]) if first else None
        right["size_held"] = _size_held(first, truths[0], effects[truths[0]]) if first else None
    if row["kind"] == "pair":
        right["weakest"] = min(fact.get("ratio", facts["ratio_angle"]) for fact in effects.values())
        right["both"] = set(truths) <= set(two)
        right["both_class"] = all(any(_same_class(name, truth, pressures) for name in two) for truth in truths)
    return right


def realised(
    model: Any, answer: Mapping[str, Any], label: Mapping[str, Any], untouched: Named, healthy: Sequence[Named]
) -> float | None:
    """Explained fraction (G - E) / (G - F) on records that the diagnosis never got, by its augmented model.

    Mean squares over all of them: G of the case against the mean healthy day, E after the model's own change is taken
    off, F between healthy days. Without a cause that can be added, or when the augmented model runs away, nothing is
    explained: 0. None when these records do not show the effect (G below EXCITED floors).
    """
    added = answer.get("added") or []
    days = [{record.name: record for record in records_of(day)} for day in healthy]
    stochastic = any(effect in UNPREDICTABLE for effect in label["effects"])
    gap = left = floor = 0.0
    for record in records_of(untouched):
        change = _model_change(model, added, answer.get("mean_exponent"), record)
        part = (loudness if stochastic else _course)(_angle(record), [_angle(day[record.name]) for day in days], change)
        gap, left, floor = gap + part[0], left + part[1], floor + part[2]
    return (gap - left) / (gap - floor) if gap > EXCITED**2 * floor else None


def _model_change(
    model: Any, added: Sequence[Mapping[str, Any]], mean_exponent: float | None, record: Record
) -> Column:
    """What the added effects (and another law of the mean pressure with them) change in the simulated angle (deg),
    shape (n,); nothing when either simulation fails."""
    from rig.gap.answer.augment import with_mean_exponent
    from rig.model.kernels import simulate
    from rig.model.parameters import AddedEffect

    with_causes = replace(model, effects=[AddedEffect(each["effect"], dict(each["parameters"])) for each in added])
    if mean_exponent is not None:
        with_causes = with_mean_exponent(with_causes, mean_exponent)
    start = float(_angle(record)[0])
    try:
        before, after = (simulate(each, record, start_deg=start).angle_deg for each in (model, with_causes))
    except RigError:
        return np.zeros(len(record))
    return np.zeros(len(record)) if before is None or after is None else np.asarray(after - before)


def _course(case: Column, healthy: Sequence[Column], change: Column) -> tuple[float, float, float]:
    """Mean squares (G, E, F) of the angle's course; F is scaled to the mean of all healthy days as reference."""
    mean, n = np.mean(healthy, axis=0), len(healthy)
    others = [float(np.mean((day - (mean * n - day) / (n - 1)) ** 2)) for day in healthy]
    scale = (1 + 1 / n) / (1 + 1 / (n - 1))
    return (
        float(np.mean((case - mean) ** 2)),
        float(np.mean((case - mean - change) ** 2)),
        scale * float(np.mean(others)),
    )


def _angle(record: Record) -> Column:
    if record.angle_deg is None:
        raise RigError(f"{record.name}: has no angle")
    return record.angle_deg


def _same_class(name: str, truth: str, pressures: bool) -> bool:
    return name == truth or (
        name in LIBRARY and truth in LIBRARY and effect_class(name, pressures) == effect_class(truth, pressures)
    )


def _size_error(cause: Mapping[str, Any], truth: str, fact: Mapping[str, Any]) -> float | None:
    """Relative error of the size where the right name was given and both laws have that number in common."""
    number = cause["parameters"].get(fact["library_parameter"]) if cause["effect"] == truth else None
    return None if number is None else abs(number["value"] - fact["size"]) / abs(fact["size"])


def _size_held(cause: Mapping[str, Any], truth: str, fact: Mapping[str, Any]) -> bool | None:
    """Whether the stated interval of the size holds the true one, where there is one and it can be compared."""
    number = cause["parameters"].get(fact["library_parameter"]) if cause["effect"] == truth else None
    if number is None or number.get("low") is None:
        return None
    return bool(number["low"] <= fact["size"] <= number["high"])

"""Scoring one case: the opened label beside what was answered, and the stated shrinkage tried on records nobody was
given.

Produces rows; counting them is `statistics`. Nothing here looks at more than one case.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from rig.blind_check.modes import MODES
from rig.blind_check.row import CaseKind, EffectFact, Facts, Row, Truth
from rig.blind_check.source import Named, records_of
from rig.columns import rms
from rig.errors import RigError
from rig.gap.answer.consistency import contradictions
from rig.gap.answer.facts import Verdict
from rig.gap.answer.settings import ABSORBED_SHARE
from rig.gap.hypotheses.library import LIBRARY, UNKNOWN, effect_class
from rig.record import Column, Record

UNPREDICTABLE: Final = {name for name, effect in LIBRARY.items() if effect.signature}
"""Effects whose course a simulator cannot repeat, only their strength: their gap is the high-frequency rms."""
EXCITED: Final = 2.0
"""Untouched records show an effect when their rms gap is this many floors; a stop that is never met can neither be
closed nor missed."""
ABSORBED: Final = {name for name, effect in LIBRARY.items() if effect.absorbed}
"""Effects that a fit of the simulator's own parameters absorbs."""
FLAGS: Final = {Verdict.UNKNOWN, Verdict.PARTLY_EXPLAINED}
"""Verdicts that say something is there which the library does not hold."""


def score_mode(mode: str, answer: Mapping[str, Any], truth: Truth, facts: Facts) -> Row:
    """One case in one mode as a row: what was true, what was said (the JSON of an answer), what of it was right."""
    diagnosis = answer.get("diagnosis") or {"verdict": "error", "gap": {}, "where": {}, "causes": []}
    asked = MODES[mode]
    causes = [cause for cause in diagnosis["causes"] if cause["effect"] != UNKNOWN]
    verdict, first = diagnosis["verdict"], causes[0] if causes else {}
    row = Row(
        kind=truth.kind,
        effects=truth.effects,
        ratio=facts.ratio(asked.against),
        mode=mode,
        baselines=truth.baselines,
        family=truth.family,
        ratio_pressure=facts.ratio_pressure,
        verdict=verdict,
        detected=verdict not in (Verdict.NONE, "error"),
        flagged=verdict in FLAGS,
        unknown=verdict == Verdict.UNKNOWN,
        named=tuple(cause["effect"] for cause in causes),
        names=(first["effect"], *first["ambiguous_with"]) if first else (),
        stage_said=diagnosis["where"].get("stage"),
        confidence=first.get("confidence"),
        predicted_ef=diagnosis["gap"].get("explained_fraction"),
        ef_interval=_interval(diagnosis["gap"]) if causes else None,
        contradictions=tuple(contradictions(diagnosis)) if diagnosis["gap"] else (),
        reference=diagnosis.get("reference"),
        absorbed=asked.retunes and bool(ABSORBED & set(truth.effects)),
        seconds=answer["seconds"],
        cpu_seconds=answer.get("cpu_seconds"),
        error=answer.get("error"),
    )
    if truth.kind is CaseKind.NONE:
        return row
    return replace(_right(row, first, facts, asked.pressures), absorbed_right=_retuned(diagnosis, row))


def _retuned(diagnosis: Mapping[str, Any], row: Row) -> bool:
    """Of an effect that a fit of the simulator's own parameters absorbs: is that said, which one moved, and what would
    look the same?"""
    retuning = diagnosis.get("retuning") or {"closes_fraction": 0.0, "parameters": []}
    alike = {*row.names, *retuning.get("looks_like", [])}
    absorbed = retuning["closes_fraction"] >= ABSORBED_SHARE and bool(retuning["parameters"])
    return absorbed and bool(alike & set(row.effects))


def _interval(gap: Mapping[str, Any]) -> tuple[float, float] | None:
    """The explained fraction's interval by the stated rms that is left, lower end first. None without one (a finding in
    the raw samples has no course to add), or without a gap."""
    low, high = gap.get("after_low_deg"), gap.get("after_high_deg")
    span = gap["rms_deg"] ** 2 - gap["floor_deg"] ** 2 if low is not None else 0.0
    if low is None or high is None or span <= 0.0 or low == high:
        return None
    return (gap["rms_deg"] ** 2 - high**2) / span, (gap["rms_deg"] ** 2 - low**2) / span


def _right(row: Row, first: Mapping[str, Any], facts: Facts, pressures: bool) -> Row:
    """The row with what of its answer fits the truth."""
    also = (LIBRARY[effect].also_right for effect in row.effects if effect in LIBRARY)
    stages = {fact.stage for fact in facts.effects.values()}.union(*also)
    row = replace(
        row,
        stage_right=row.stage_said in stages,
        stages=tuple(sorted(fact.stage for fact in facts.effects.values())),
    )
    if row.kind is CaseKind.SINGLE:
        return _right_single(row, first, facts.effects[row.effects[0]], pressures)
    return _right_pair(row, facts, pressures) if row.kind is CaseKind.PAIR else row


def _right_single(row: Row, first: Mapping[str, Any], fact: EffectFact, pressures: bool) -> Row:
    truth = row.effects[0]
    return replace(
        row,
        exact=row.named[:1] == (truth,),
        class_right=any(_same_class(name, truth, pressures) for name in row.named[:1]),
        in_set=truth in row.names,
        size_error=_size_error(first, truth, fact) if first else None,
        size_held=_size_held(first, truth, fact) if first else None,
    )


def _right_pair(row: Row, facts: Facts, pressures: bool) -> Row:
    two = row.named[:2]
    ratios = (facts.ratio_angle if fact.ratio is None else fact.ratio for fact in facts.effects.values())
    return replace(
        row,
        weakest=min(ratios),
        both=set(row.effects) <= set(two),
        both_class=all(any(_same_class(name, truth, pressures) for name in two) for truth in row.effects),
    )


def realised(
    model: Any, answer: Mapping[str, Any], truth: Truth, untouched: Named, healthy: Sequence[Named]
) -> float | None:
    """Explained fraction (G - E) / (G - F) on records that the diagnosis never got, by its augmented model.

    Mean squares over all of them: G of the case against the mean healthy day, E after the model's own change is taken
    off, F between healthy days; of what moves where each record took its own zero, which says nothing of the rest.
    Without a cause that can be added, or when the augmented model runs away, nothing is
    explained: 0. None when these records do not show the effect (G below EXCITED floors).
    """
    added = answer.get("added") or []
    days = [{record.name: record for record in records_of(day)} for day in healthy]
    stochastic = any(effect in UNPREDICTABLE for effect in truth.effects)
    gap = left = floor = 0.0
    for record in records_of(untouched):
        change = _model_change(model, added, answer.get("mean_exponent"), record)
        columns = [_angle(record), *(_angle(day[record.name]) for day in days), change]
        if record.zeroed:
            columns = [column - np.mean(column) for column in columns]
        case, *others, change = columns
        part = (_noise if stochastic else _course)(case, others, change)
        gap, left, floor = gap + part[0], left + part[1], floor + part[2]
    return (gap - left) / (gap - floor) if gap > EXCITED**2 * floor else None


def _model_change(
    model: Any, added: Sequence[Mapping[str, Any]], mean_exponent: float | None, record: Record
) -> Column:
    """What the added effects (and another law of the mean pressure with them) change in the simulated angle (deg),
    shape (n,); nothing when either simulation fails."""
    from rig.gap.answer.how_far.augment import with_mean_exponent
    from rig.model.parameters import AddedEffect
    from rig.model.simulation import simulate

    with_causes = replace(model, effects=[AddedEffect(each["effect"], dict(each["parameters"])) for each in added])
    if mean_exponent is not None:
        with_causes = with_mean_exponent(with_causes, mean_exponent)
    start = float(_angle(record)[0])
    try:
        before, after = (simulate(each, record, start_deg=start).angle_deg for each in (model, with_causes))
    except RigError:
        return np.zeros(len(record))
    return np.zeros(len(record)) if before is None or after is None else np.asarray(after - before)


def _noise(case: Column, healthy: Sequence[Column], change: Column) -> tuple[float, float, float]:
    """(G, E, F) of the noise's rms (deg^2): case against healthy days, what is left with `change` (deg) added to these,
    and between them."""
    levels = [_noise_deg(day) for day in healthy]
    base, now = float(np.mean(levels)), _noise_deg(case)
    rows = min(len(change), *(len(day) for day in healthy))
    predicted = float(np.mean([_noise_deg(day[:rows] + change[:rows]) for day in healthy]))
    return (now - base) ** 2, (now - predicted) ** 2, float(np.var(levels))


def _noise_deg(angle_deg: Column) -> float:
    """Rms of white noise (deg) that would have the second differences of these angles (n,)."""
    second = np.diff(angle_deg, 2)
    return rms(second[np.isfinite(second)]) / math.sqrt(6.0)


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


def _size_error(cause: Mapping[str, Any], truth: str, fact: EffectFact) -> float | None:
    """Relative error of the size where the right name was given and both laws have that number in common."""
    number = _size_said(cause, truth, fact)
    return None if number is None or fact.size is None else abs(number["value"] - fact.size) / abs(fact.size)


def _size_held(cause: Mapping[str, Any], truth: str, fact: EffectFact) -> bool | None:
    """Whether the stated interval of the size holds the true one, where there is one and it can be compared."""
    number = _size_said(cause, truth, fact)
    if number is None or fact.size is None or number.get("low") is None:
        return None
    return bool(number["low"] <= fact.size <= number["high"])


def _size_said(cause: Mapping[str, Any], truth: str, fact: EffectFact) -> Mapping[str, Any] | None:
    return cause["parameters"].get(fact.library_parameter) if cause["effect"] == truth else None

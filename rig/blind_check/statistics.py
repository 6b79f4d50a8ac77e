"""Counting scored cases: every row of the goals with its interval, by effect, stage, strength and mode, and what a leak
would look like."""

import itertools
import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final

import numpy as np

from rig.blind_check.rates import Rate
from rig.blind_check.row import CaseKind, Row
from rig.gap.hypotheses.library import NONE

RATIO_EDGES: Final = (0.0, 1.0, 2.0, 3.0, 5.0, 100.0)
"""Gap over floor at which the classes of the table begin and end."""
NEARLY_ALL: Final = 0.01
"""Nearer to all than this is all."""
CLOSE: Final = 0.05
"""Predicted and realised explained fraction agree within this."""
SHUFFLES: Final = 200
"""Times that labels are shuffled: the mean is known to 7 % of the spread of one shuffle (1 / sqrt 200)."""
BINS: Final = 5
"""Of stated confidence. More: too few cases in each for a rate; fewer: over- and under-confidence cancel."""


def mode_result(rows: Sequence[Row]) -> dict[str, Any]:
    """Every figure of the goals for the rows of one mode, rates as k, n and interval."""
    clear = [row for row in rows if row.is_clear]
    every, foreign = _kind(clear, CaseKind.SINGLE), _kind(clear, CaseKind.FOREIGN)
    single, absorbed = [row for row in every if not row.absorbed], [row for row in every if row.absorbed]
    pair = [row for row in rows if row.is_sized_pair]
    return {
        **_detection_rates(rows, clear),
        **_naming_rates(single),
        "set_size": mean(len(row.names) for row in single if row.names),
        **_closing_figures(single),
        "size_error": _median(_seen(row.size_error for row in single)),
        "size_held": Rate.of(row.size_held for row in single if row.size_held is not None).to_json(),
        "absorbed_right": rate(absorbed, lambda row: row.absorbed_right),
        "contradictions": rate(rows, lambda row: row.contradictions),
        "contradicting": _counted(sentence for row in rows for sentence in row.contradictions),
        "unknown_flagged": rate(foreign, _flagged),
        "unknown_flagged_strictly": rate(foreign, lambda row: row.unknown),
        "known_kept": Rate.of(not row.flagged for row in single if row.detected).to_json(),
        "known_kept_strictly": Rate.of(not row.unknown for row in single if row.detected).to_json(),
        "withheld_flagged": Rate(0, 0).to_json(),
        "pairs_both": rate(pair, lambda row: row.both),
        "pairs_both_class": rate(pair, lambda row: row.both_class),
        "seconds_median": _median(_seen(row.seconds for row in rows)),
        "cpu_seconds_median": _median(_seen(row.cpu_seconds for row in rows)),
        "seconds_worst": max(_seen(row.seconds for row in rows), default=None),
        "errors": rate(rows, lambda row: row.error),
    }  # fmt: skip


def _detection_rates(rows: Sequence[Row], clear: Sequence[Row]) -> dict[str, Any]:
    """How often a gap is found where there is none, and where there is one."""
    none = _kind(rows, CaseKind.NONE)
    return {
        "false_alarms": rate(none, _detected),
        "false_alarms_by_baselines": {
            str(days): rate((row for row in none if row.baselines == days), _detected) for days in (3, 6)
        },
        "detected_ratio_2": rate((row for row in rows if row.has_cause and row.ratio >= 2.0), _detected),
        "detected": rate((row for row in clear if row.has_cause), _detected),
    }


def _naming_rates(single: Sequence[Row]) -> dict[str, Any]:
    """How often the one effect of a case is placed and named."""
    return {
        "stage": rate(single, lambda row: row.stage_right),
        "class_first": rate(single, lambda row: row.class_right),
        "exact_first": rate(single, lambda row: row.exact),
        "truth_in_set": rate(single, lambda row: row.in_set),
    }


def _closing_figures(single: Sequence[Row]) -> dict[str, Any]:
    """How far gaps shrink, as stated and as it came out on untouched records."""
    both = [
        (row, row.predicted_ef, row.realised_ef)
        for row in single
        if row.realised_ef is not None and row.predicted_ef is not None and row.named
    ]
    intervals = [(row.ef_interval, realised) for row, _, realised in both if row.ef_interval is not None]
    return {
        "gap_closed": _closed(single),
        "gap_closed_by_effect": {effect: _closed(some) for effect, some in _by_effect(single).items()},
        "ef_within_0.05": Rate.of(abs(realised - predicted) <= CLOSE for _, predicted, realised in both).to_json(),
        "ef_pairs": [[predicted, realised] for _, predicted, realised in both],
        "interval_holds": Rate.of(_holds(stated, realised) for stated, realised in intervals).to_json(),
        "interval_width": _median([high - low for (low, high), _ in intervals]),
    }


def _holds(stated: tuple[float, float], realised: float) -> bool:
    """The stated interval of the explained fraction holds the realised one; nobody is asked for more than all of it."""
    low, high = stated
    return bool(low <= min(realised, 1.0) <= max(high, 1.0 if high > 1.0 - NEARLY_ALL else high))


def _detected(row: Row) -> bool:
    return row.detected


def _flagged(row: Row) -> bool:
    return row.flagged


def _counted(items: Iterable[str]) -> dict[str, int]:
    return dict(Counter(items).most_common())


def breakdown(rows: Sequence[Row]) -> dict[str, Any]:
    """Singles at CLEAR by effect and by stage, all singles by strength, foreign ones by effect, and the confusion
    matrix."""
    single = _kind(rows, CaseKind.SINGLE)
    clear = [row for row in single if row.is_clear]
    foreign = [row for row in _kind(rows, CaseKind.FOREIGN) if row.is_clear]
    by_stage: dict[str, list[Row]] = {}
    for row in clear:
        by_stage.setdefault(row.stages[0], []).append(row)
    return {
        "by_effect": {effect: _short(some) for effect, some in _by_effect(clear).items()},
        "by_stage": {stage: _short(some) for stage, some in sorted(by_stage.items())},
        "by_ratio": {
            f"{low:g}..{high:g}": _short([row for row in single if low <= row.ratio < high])
            | _detection(single, low, high)
            for low, high in itertools.pairwise(RATIO_EDGES)
        },
        "unknown_by_effect": {effect: rate(some, _flagged) for effect, some in _by_effect(foreign).items()},
        "confusion": _confusion(clear),
        "reliability": reliability(clear),
    }


def withheld_result(rows: Sequence[Row]) -> dict[str, Any]:
    """The library without the truth's class: flagged, and where. Beside it those that lost another class only."""
    clear = [row for row in _kind(rows, CaseKind.SINGLE) if row.is_clear]
    gone, other = [row for row in clear if row.truth_withheld], [row for row in clear if not row.truth_withheld]
    return {
        "flagged": rate(gone, _flagged),
        "flagged_strictly": rate(gone, lambda row: row.unknown),
        "stage": rate(gone, lambda row: row.stage_right),
        "not_another_name": Rate.of(row.flagged or not row.detected for row in gone).to_json(),
        "kept_when_another_class_is_gone": Rate.of(not row.flagged for row in other if row.detected).to_json(),
        "flagged_by_effect": {effect: rate(some, _flagged) for effect, some in _by_effect(gone).items()},
    }


def naive_result(answers: Sequence[tuple[Row, str]], same_class: Callable[[str, str], bool]) -> dict[str, Any]:
    """The same first figures for a baseline that answers each row with one name, or with none."""
    single = [(row.effects[0], named) for row, named in answers if row.kind is CaseKind.SINGLE and row.is_clear]
    return {
        "false_alarms": Rate.of(named != NONE for row, named in answers if not row.has_cause).to_json(),
        "detected": Rate.of(named != NONE for row, named in answers if row.has_cause and row.is_clear).to_json(),
        "class_first": Rate.of(same_class(named, truth) for truth, named in single).to_json(),
        "exact_first": Rate.of(named == truth for truth, named in single).to_json(),
    }


def shuffled_control(rows: Sequence[Row], seed: int) -> dict[str, Any]:
    """The exact names against labels shuffled among the cases: what chance reaches. A leak into the answers cannot
    move this one, and a score near it says that the answers know nothing.
    """
    single = [row for row in _kind(rows, CaseKind.SINGLE) if row.is_clear]
    random = np.random.default_rng(seed)
    truths = [row.effects[0] for row in single]
    hits = [
        sum(
            bool(row.names) and row.names[0] == truths[k]
            for row, k in zip(single, random.permutation(len(truths)), strict=True)
        )
        for _ in range(SHUFFLES)
    ]
    return {
        "exact_first_mean": mean(hit / len(single) for hit in hits) if single else None,
        "n": len(single),
        "rounds": SHUFFLES,
    }


def reliability(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Stated confidence of the first name against how often it was right, in BINS of equal numbers of cases."""
    stated = [(row.confidence, bool(row.exact)) for row in rows if row.confidence is not None]
    stated.sort(key=lambda one: one[0])
    parts = [part for part in np.array_split(np.arange(len(stated)), BINS) if len(part)]
    return [
        {
            "stated": mean(stated[i][0] for i in part),
            "right": Rate.of(stated[i][1] for i in part).to_json(),
        }
        for part in parts
    ]


def _short(rows: Sequence[Row]) -> dict[str, Any]:
    return _naming_rates(rows) | {"gap_closed": _closed(rows)}


def _detection(rows: Sequence[Row], low: float, high: float) -> dict[str, Any]:
    return {"detected": rate((row for row in rows if low <= row.ratio < high), _detected)}


def _confusion(rows: Sequence[Row]) -> dict[str, dict[str, int]]:
    """Truth -> what was named first (or the verdict without a name) -> how often."""
    matrix: dict[str, dict[str, int]] = {}
    for row in rows:
        named = row.names[0] if row.names else row.verdict
        line = matrix.setdefault(row.effects[0], {})
        line[named] = line.get(named, 0) + 1
    return {truth: dict(sorted(line.items(), key=lambda item: -item[1])) for truth, line in sorted(matrix.items())}


def _kind(rows: Sequence[Row], kind: CaseKind) -> list[Row]:
    return [row for row in rows if row.kind is kind]


def _by_effect(rows: Sequence[Row]) -> dict[str, list[Row]]:
    return {
        effect: [row for row in rows if row.effects[0] == effect] for effect in sorted({row.effects[0] for row in rows})
    }


def rate(rows: Iterable[Row], right: Callable[[Row], object]) -> dict[str, Any]:
    """How many of the rows are right, as JSON."""
    return Rate.of(bool(right(row)) for row in rows).to_json()


def _seen(values: Iterable[float | None]) -> list[float]:
    return [value for value in values if value is not None]


def _closed(rows: Sequence[Row]) -> float | None:
    """Median explained fraction on untouched records that show the effect; a case without a stated cause closes
    nothing."""
    return _median(_seen(row.realised_ef for row in rows))


def mean(values: Iterable[float]) -> float | None:
    """None of nothing."""
    seen = list(values)
    return math.fsum(seen) / len(seen) if seen else None


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if len(values) else None

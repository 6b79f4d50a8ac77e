"""Counting scored cases: every row of the goals with its interval, by effect, stage, strength and mode, and what a leak
would look like."""

import itertools
import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from rig.blind_check.rates import Rate

Row = Mapping[str, Any]
CLEAR: Final = 3.0
"""Gap over floor from which on the goals hold."""
RATIO_EDGES: Final = (0.0, 1.0, 2.0, 3.0, 5.0, 100.0)
SIZED: Final = 0.95
"""How closely a size meets its wanted ratio."""
SAME: Final = 0.01
"""Nearer to all than this is all."""
CLOSE: Final = 0.05
"""Predicted and realised explained fraction agree within this."""


def mode_result(rows: Sequence[Row]) -> dict[str, Any]:
    """Every figure of the goals for the rows of one mode, rates as k, n and interval."""
    clear = [row for row in rows if row["ratio"] >= CLEAR]
    every, none = _kind(clear, "single"), _kind(rows, "none")
    single, absorbed = [row for row in every if not row["absorbed"]], [row for row in every if row["absorbed"]]
    foreign = _kind(clear, "foreign")
    pair = [row for row in _kind(rows, "pair") if row["weakest"] >= SIZED * CLEAR]
    both = [
        row for row in single if row["realised_ef"] is not None and row["predicted_ef"] is not None and row["named"]
    ]
    sizes = [row["size_error"] for row in single if row["size_error"] is not None]
    return {
        "false_alarms": _rate(none, "detected"),
        "false_alarms_by_baselines": {str(n): _rate([row for row in none if row["baselines"] == n],
        "detected") for n in (3, 6)},
        "detected_ratio_2": _rate([row for row in rows if row["kind"] != "none" and row["ratio"] >= 2.0], "detected"),
        "detected": _rate([row for row in clear if row["kind"] != "none"], "detected"),
        "stage": _rate(single, "stage_right"),
        "class_first": _rate(single, "class"),
        "exact_first": _rate(single, "exact"),
        "truth_in_set": _rate(single, "in_set"),
        "set_size": _mean(len(row["set"]) for row in single if row["set"]),
        "gap_closed": _closed(single),
        "gap_closed_by_effect": {effect: _closed(some) for effect, some in _by_effect(single).items()},
        "ef_within_0.05": Rate.of(abs(row["realised_ef"] - row["predicted_ef"]) <= CLOSE for row in both).to_json(),
        "ef_pairs": [[row["predicted_ef"], row["realised_ef"]] for row in both],
        "interval_holds": Rate.of(_holds(row) for row in both if row["ef_interval"] is not None).to_json(),
        "interval_width": _median(
            [row["ef_interval"][1] - row["ef_interval"][0] for row in both if row["ef_interval"] is not None]
        ),
        "size_error": _median(sizes),
        "size_held": Rate.of(row["size_held"] for row in single if row["size_held"] is not None).to_json(),
        "absorbed_right": _rate(absorbed, "absorbed_right"),
        "contradictions": _rate(rows, "contradictions"),
        "contradicting": _counted(sentence for row in rows for sentence in row["contradictions"]),
        "unknown_flagged": _rate(foreign, "flagged"),
        "unknown_flagged_strictly": _rate(foreign, "unknown"),
        "known_kept": Rate.of(not row["flagged"] for row in single if row["detected"]).to_json(),
        "known_kept_strictly": Rate.of(not row["unknown"] for row in single if row["detected"]).to_json(),
        "withheld_flagged": Rate(0, 0).to_json(),
        "pairs_both": _rate(pair, "both"),
        "pairs_both_class": _rate(pair, "both_class"),
        "seconds_median": _median(_values(rows, "seconds")),
        "cpu_seconds_median": _median(_values(rows, "cpu_seconds")),
        "seconds_worst": max(_values(rows, "seconds"), default=None),
        "errors": _rate(rows, "error"),
    }  # fmt: skip


def _holds(row: Row) -> bool:
    """The stated interval of the explained fraction holds the realised one; nobody is asked for more than all of it."""
    low, high = row["ef_interval"]
    return bool(low <= min(row["realised_ef"], 1.0) <= max(high, 1.0 if high > 1.0 - SAME else high))


def _counted(items: Iterable[str]) -> dict[str, int]:
    return dict(Counter(items).most_common())


def breakdown(rows: Sequence[Row]) -> dict[str, Any]:
    """Singles at CLEAR by effect and by stage, all singles by strength, foreign ones by effect, and the confusion
    matrix."""
    single = _kind(rows, "single")
    clear = [row for row in single if row["ratio"] >= CLEAR]
    foreign = [row for row in _kind(rows, "foreign") if row["ratio"] >= CLEAR]
    by_stage: dict[str, list[Row]] = {}
    for row in clear:
        by_stage.setdefault(row["stages"][0], []).append(row)
    return {
        "by_effect": {effect: _short(some) for effect, some in _by_effect(clear).items()},
        "by_stage": {stage: _short(some) for stage, some in sorted(by_stage.items())},
        "by_ratio": {
            f"{low:g}..{high:g}": _short([row for row in single if low <= row["ratio"] < high])
            | _detection(single, low, high)
            for low, high in itertools.pairwise(RATIO_EDGES)
        },
        "unknown_by_effect": {effect: _rate(some, "flagged") for effect, some in _by_effect(foreign).items()},
        "confusion": _confusion(clear),
        "reliability": reliability(clear),
    }


def withheld_result(rows: Sequence[Row]) -> dict[str, Any]:
    """The library without the truth's class: flagged, and where. Beside it those that lost another class only."""
    clear = [row for row in _kind(rows, "single") if row["ratio"] >= CLEAR]
    gone, other = [row for row in clear if row["truth_withheld"]], [row for row in clear if not row["truth_withheld"]]
    return {
        "flagged": _rate(gone, "flagged"),
        "flagged_strictly": _rate(gone, "unknown"),
        "stage": _rate(gone, "stage_right"),
        "not_another_name": Rate.of(row["flagged"] or not row["detected"] for row in gone).to_json(),
        "kept_when_another_class_is_gone": Rate.of(not row["flagged"] for row in other if row["detected"]).to_json(),
        "flagged_by_effect": {effect: _rate(some, "flagged") for effect, some in _by_effect(gone).items()},
    }


def naive_result(
    rows: Sequence[Row], named: Callable[[Row], str], same_class: Callable[[str, str], bool]
) -> dict[str, Any]:
    """The same first figures for a baseline that answers with one name."""
    single = [row for row in _kind(rows, "single") if row["ratio"] >= CLEAR]
    return {
        "false_alarms": Rate.of(named(row) != "none" for row in _kind(rows, "none")).to_json(),
        "detected": Rate.of(
            named(row) != "none" for row in rows if row["kind"] != "none" and row["ratio"] >= CLEAR
        ).to_json(),
        "class_first": Rate.of(same_class(named(row), row["effects"][0]) for row in single).to_json(),
        "exact_first": Rate.of(named(row) == row["effects"][0] for row in single).to_json(),
    }


def shuffled_control(rows: Sequence[Row], seed: int, rounds: int = 200) -> dict[str, Any]:
    """The exact names against labels dealt anew among the cases: what chance reaches. A leak into the answers cannot
    move this one, and a score near it says that the answers know nothing.
    """
    single = [row for row in _kind(rows, "single") if row["ratio"] >= CLEAR]
    random = np.random.default_rng(seed)
    truths = [row["effects"][0] for row in single]
    hits = [
        sum(
            bool(row["set"]) and row["set"][0] == truths[k]
            for row, k in zip(single, random.permutation(len(truths)), strict=True)
        )
        for _ in range(rounds)
    ]
    return {
        "exact_first_mean": _mean(hit / len(single) for hit in hits) if single else None,
        "n": len(single),
        "rounds": rounds,
    }


def reliability(rows: Sequence[Row], bins: int = 5) -> list[dict[str, Any]]:
    """Stated confidence of the first name against how often it was right, in bins of equal numbers of cases."""
    stated = sorted((row for row in rows if row["confidence"] is not None), key=lambda row: float(row["confidence"]))
    parts = [part for part in np.array_split(np.arange(len(stated)), bins) if len(part)]
    return [
        {
            "stated": _mean(float(stated[i]["confidence"]) for i in part),
            "right": Rate.of(stated[i]["exact"] for i in part).to_json(),
        }
        for part in parts
    ]


def _short(rows: Sequence[Row]) -> dict[str, Any]:
    keys = {"stage": "stage_right", "class_first": "class", "exact_first": "exact", "truth_in_set": "in_set"}
    return {name: _rate(rows, key) for name, key in keys.items()} | {"gap_closed": _closed(rows)}


def _detection(rows: Sequence[Row], low: float, high: float) -> dict[str, Any]:
    return {"detected": _rate([row for row in rows if low <= row["ratio"] < high], "detected")}


def _confusion(rows: Sequence[Row]) -> dict[str, dict[str, int]]:
    """Truth -> what was named first (or the verdict without a name) -> how often."""
    matrix: dict[str, dict[str, int]] = {}
    for row in rows:
        said = row["set"][0] if row["set"] else row["verdict"]
        line = matrix.setdefault(row["effects"][0], {})
        line[said] = line.get(said, 0) + 1
    return {truth: dict(sorted(line.items(), key=lambda item: -item[1])) for truth, line in sorted(matrix.items())}


def _kind(rows: Sequence[Row], kind: str) -> list[Row]:
    return [row for row in rows if row["kind"] == kind]


def _by_effect(rows: Sequence[Row]) -> dict[str, list[Row]]:
    return {
        effect: [row for row in rows if row["effects"][0] == effect]
        for effect in sorted({row["effects"][0] for row in rows})
    }


def _rate(rows: Sequence[Row], key: str) -> dict[str, Any]:
    return Rate.of(bool(row[key]) for row in rows).to_json()


def _values(rows: Sequence[Row], key: str) -> list[float]:
    return [row[key] for row in rows if row.get(key) is not None]


def _closed(rows: Sequence[Row]) -> float | None:
    """Median explained fraction on untouched records that show the effect; a case without a stated cause closes
    nothing."""
    return _median(_values(rows, "realised_ef"))


def _mean(values: Iterable[float]) -> float | None:
    seen = list(values)
    return math.fsum(seen) / len(seen) if seen else None


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if len(values) else None

"""The goals of the check as a table: which figure, in which words, and what it should reach in each mode."""

import operator
from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple


class Goal(NamedTuple):
    """One row; a mode without a bound has no goal."""

    key: str
    words: str
    unit: str
    """"%" for shares, else the unit of the number."""
    at_least: bool
    bounds: Mapping[str, float]


def _bounds(
    pressures: float | None, angle: float | None, one: float | None, simulator: float | None
) -> dict[str, float]:
    """By column of the goals: days with pressures, days from the angle, one day or a fingerprint, a simulator alone
    (with pressures)."""
    columns = {
        "pressures": pressures,
        "angle": angle,
        "one_day": one,
        "fingerprint": one,
        "simulator": simulator,
        "own_simulator": simulator,
    }
    return {name: bound for name, bound in columns.items() if bound is not None}


_AFTER_TWO_EXACT: Final = _bounds(0.98, 0.95, 0.95, 0.90)
_AFTER_TWO_PAIRS: Final = _bounds(0.95, 0.80, 0.90, None)

GOALS: Final = (
    Goal("false_alarms_6", "false alarms, 6 baselines", "%", False, _bounds(0.01, 0.01, None, None)),
    Goal("false_alarms_3", "false alarms, 3 baselines", "%", False, _bounds(0.03, 0.03, None, None)),
    Goal("false_alarms", "false alarms", "%", False, _bounds(None, None, 0.03, 0.05)),
    Goal("detected_ratio_2", "detected at ratio >= 2", "%", True, _bounds(0.98, 0.98, 0.95, 0.85)),
    Goal("detected", "detected at ratio >= 3", "%", True, _bounds(0.99, 0.99, 0.98, 0.95)),
    Goal("stage", "stage right", "%", True, _bounds(0.98, 0.90, 0.95, 0.90)),
    Goal("class_first", "class first", "%", True, _bounds(0.97, 0.94, 0.92, 0.85)),
    Goal("exact_first", "exact name first", "%", True, _bounds(0.95, 0.85, 0.88, 0.75)),
    Goal("absorbed_right", "absorbed effects said right", "%", True, _bounds(None, None, None, 0.80)),
    Goal("truth_in_set", "truth in the reported set", "%", True, _bounds(0.95, 0.95, 0.95, 0.93)),
    Goal("set_size", "mean size of the set", "names", False, _bounds(1.25, 1.9, 1.6, 2.5)),
    Goal("gap_closed", "gap closed on untouched records, median", "%", True, _bounds(0.92, 0.90, 0.88, 0.75)),
    Goal("gap_closed_worst", "the same, worst effect", "%", True, _bounds(0.50, 0.50, 0.50, 0.50)),
    Goal("interval_holds", "90 % interval of that holds the realised", "%", True, _bounds(0.85, 0.85, 0.85, 0.85)),
    Goal("interval_width", "its median width", "1", False, _bounds(0.12, 0.15, 0.15, 0.30)),
    Goal("size_error", "size of the effect, median error", "%", False, _bounds(0.03, 0.05, 0.05, 0.10)),
    Goal("size_held", "its 95 % interval holds the truth", "%", True, _bounds(0.90, 0.90, None, None)),
    Goal("unknown_flagged", "unknown flagged", "%", True, _bounds(0.92, 0.90, 0.85, 0.75)),
    Goal("known_kept", "known kept", "%", True, _bounds(0.95, 0.94, 0.92, 0.85)),
    Goal("withheld_flagged", "class withheld from the library: flagged", "%", True, _bounds(0.85, 0.75, 0.75, None)),
    Goal("pairs_both", "pairs, both right", "%", True, _bounds(0.90, 0.45, 0.80, None)),
    Goal("exact_after_two", "exact name first, after two experiments", "%", True, _AFTER_TWO_EXACT),
    Goal("pairs_after_two", "pairs, both right, after two experiments", "%", True, _AFTER_TWO_PAIRS),
    Goal("parted", "experiments that parted what they promised", "%", True, _bounds(0.80, 0.80, 0.80, 0.80)),
    Goal("contradictions", "answers that contradict themselves", "%", False, _bounds(0.0, 0.0, 0.0, 0.0)),
    Goal("seconds_median", "time a case, median", "s", False, _bounds(1.0, 1.0, 1.0, 1.5)),
    Goal("cpu_seconds_median", "the same, time of the processor", "s", False, _bounds(1.0, 1.0, 1.0, 1.5)),
)


def figure(mode: Mapping[str, Any], goal: Goal) -> Any:
    """The measured figure of a goal: a rate as a mapping, a number, or None."""
    if goal.key.startswith("false_alarms_"):
        return mode["false_alarms_by_baselines"][goal.key[-1]]
    if goal.key == "gap_closed_worst":
        return min((value for value in mode["gap_closed_by_effect"].values() if value is not None), default=None)
    return mode.get(goal.key)


def reached(mode: Mapping[str, Any], goal: Goal, name: str) -> bool | None:
    """Whether the figure itself reaches its goal in that mode; None where there is no goal or no case."""
    found = figure(mode, goal)
    value = found["rate"] if isinstance(found, Mapping) else found
    if name not in goal.bounds or value is None:
        return None
    compare: Callable[[float, float], bool] = operator.ge if goal.at_least else operator.le
    return compare(value, goal.bounds[name])


def figure_text(found: Any, unit: str) -> str:
    """A figure as text, with its interval where it is a rate."""
    if isinstance(found, Mapping):
        if found["rate"] is None:
            return "-"
        return (
            f"{100 * found['rate']:.1f} % ({100 * found['low']:.0f}..{100 * found['high']:.0f}; "
            f"{found['k']}/{found['n']})"
        )
    if found is None:
        return "-"
    return f"{100 * found:.1f} %" if unit == "%" else f"{found:.2f} {unit}"


def bound(goal: Goal, name: str) -> str:
    """The goal of one mode as text."""
    if name not in goal.bounds:
        return ""
    value = goal.bounds[name]
    return f"{'>=' if goal.at_least else '<='} {f'{100 * value:g} %' if goal.unit == '%' else f'{value:g} {goal.unit}'}"

"""The three numbers by which lateness, and what else takes time in each tick, is told."""

from collections.abc import Iterable


def quantiles(values: Iterable[float]) -> dict[str, float]:
    """p50, p99 and max, by rank; empty without values."""
    ordered = sorted(values)
    if not ordered:
        return {}
    return {"p50": ordered[len(ordered) // 2], "p99": ordered[len(ordered) * 99 // 100], "max": ordered[-1]}

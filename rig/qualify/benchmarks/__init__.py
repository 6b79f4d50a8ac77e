"""The project's benchmarks, one file each (`catalog` has them all), and the row that each figure is."""

from collections.abc import Mapping, Sequence
from typing import Any


def figure(value: float, unit: str, peer: str = "", peer_value: float | None = None, **more: Any) -> dict[str, Any]:
    """One row of a benchmark; the ratio is value / peer_value.

    More of it: `limit` and `limit_value` (what nothing could better on this machine, in the same unit), `goal`,
    `better="higher"` where more is better, `seeded` for what a seed fixes, and `why` for what has neither a peer nor a
    limit.
    """
    row: dict[str, Any] = {"value": value, "unit": unit}
    if peer:
        row |= {"peer": peer, "peer_value": peer_value, "ratio": value / peer_value if peer_value else None}
    return row | more


def share(outcomes: Sequence[bool], **more: Any) -> dict[str, Any]:
    """Per cent with its Wilson interval; more is better, unless said otherwise."""
    from rig.blind_check.rates import Rate

    rate = Rate.of(outcomes)
    low, high = rate.interval
    return figure(100 * rate.value, "%", of=rate.n, low=100 * low, high=100 * high, **({"better": "higher"} | more))


def cells(row: Mapping[str, Any]) -> list[str]:
    """One row of the table: value, unit (with its interval and what it is a share of, where it says so), peer, its
    value, ratio, limit, how many times as far the value is, goal."""
    limit = row.get("limit_value")
    unit = f"{row.get('unit', '')} ({aside})" if (aside := _aside(row)) else row.get("unit", "")
    shown = [row.get("value"), unit, row.get("peer"), row.get("peer_value"), row.get("ratio"), row.get("limit")]
    return [_cell(cell) for cell in (*shown, row["value"] / limit if limit else None, row.get("goal"))]


def _aside(row: Mapping[str, Any]) -> str:
    spread = [f"{row['low']:.0f} to {row['high']:.0f}"] if "low" in row and "high" in row else []
    return ", ".join(spread + ([f"of {row['of']}"] if "of" in row else []))


def _cell(cell: Any) -> str:
    return f"{cell:.4g}" if isinstance(cell, int | float) else str(cell or "")

"""The project's benchmarks, one file each; see rig.cli.bench."""

from typing import Any


def figure(value: float, unit: str, peer: str = "", peer_value: float | None = None, **more: Any) -> dict[str, Any]:
    """One row of a benchmark; the ratio is value / peer_value."""
    row: dict[str, Any] = {"value": value, "unit": unit}
    if peer:
        row |= {"peer": peer, "peer_value": peer_value, "ratio": value / peer_value if peer_value else None}
    return row | more

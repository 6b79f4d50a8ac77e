"""The JSON of a diagnosis as the page reads it: the gap in whatever unit the rig has."""

from dataclasses import dataclass
from typing import Any

from rig.channels import unit_word


@dataclass(frozen=True)
class DiagnosedDay:
    """One day: its session, when that was recorded (s since 1970), and the JSON of its diagnosis."""

    session: str
    recorded_s: float
    found: dict[str, Any]


def unit_of(found: dict[str, Any]) -> str:
    """Of the gap in the JSON of a diagnosis."""
    return str(found.get("channels", {}).get("output", {}).get("unit", "deg"))


def gap_of(found: dict[str, Any], name: str) -> float | None:
    """A number of the gap (rms, floor, after) under whatever unit its key has; None where it is not there."""
    value = (found.get("gap") or {}).get(f"{name}_{unit_word(unit_of(found))}")
    return float(value) if isinstance(value, int | float) else None

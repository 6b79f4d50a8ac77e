"""An effect of a plant family as an entry of its table, and several of them at once."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from numpy.random import Generator


class EffectLaw(NamedTuple):
    """One effect of a plant. Sizes lie between `low` and `high`, both positive; `signed` ones may be negative too."""

    stage: str
    unit: str
    low: float
    high: float
    signed: bool
    law: Callable[[float, Generator], Any]
    """(signed size, details by chance) -> the family's disturbance."""
    library_parameter: str = ""
    """The library's parameter that means the same as the size; empty where the two laws have no number in common."""
    falling: bool = False
    """A smaller size is the stronger effect (a limit, a ceiling)."""


def merged(healthy: Any, parts: Sequence[Any]) -> Any:
    """Several disturbances at once (named tuples of named tuples; `healthy` is the neutral one).

    Each parameter may be set by one of them only, or by all to the same value.
    """
    total: dict[str, Any] = {}
    for place, neutral in healthy._asdict().items():
        values = [item for part in parts for item in getattr(part, place)._asdict().items()]
        total[place] = neutral._replace(**{name: value for name, value in values if value != getattr(neutral, name)})
    return type(healthy)(**total)

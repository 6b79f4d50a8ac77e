"""What can be wrong with a rig, in three places; each family has laws of its own for them, neutral by default."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple


class Disturbance(NamedTuple):
    """Everything that is wrong at once; a family's neutral laws say that nothing is."""

    timing: Any
    """Between the controller and the regulators' inputs, and in the clock that stamps the readings."""
    rig: Any
    """In regulators, muscles and joint."""
    reading: Any
    """Between the joint and the recorded angle."""


def setter(healthy: Disturbance, place: str) -> Callable[..., Disturbance]:
    """A function that makes a disturbance of parameters of one place: `rig(gain_1=0.1)`."""
    law = getattr(healthy, place)

    def made(**parameters: float) -> Disturbance:
        return healthy._replace(**{place: law._replace(**parameters)})

    return made


def merged(healthy: Disturbance, parts: Sequence[Disturbance]) -> Disturbance:
    """Several disturbances at once. Each parameter may be set by one of them only, or by all to the same value."""
    total: dict[str, Any] = {}
    for place, neutral in healthy._asdict().items():
        values = [item for part in parts for item in getattr(part, place)._asdict().items()]
        total[place] = neutral._replace(**{name: value for name, value in values if value != getattr(neutral, name)})
    return Disturbance(**total)

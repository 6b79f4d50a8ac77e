"""Sizes, angles and shares as a sentence tells them, in the unit that people use."""

import math
from collections.abc import Sequence

from rig.gap.answer.result import Interval
from rig.number_text import rounded

DEVIATIONS = 4.0
"""Standard deviations from end to end of a size's interval (95 %)."""
UNITS: dict[str, Sequence[tuple[float, float, str]]] = {
    "s": ((0.9995, 1e3, "ms"), (math.inf, 1.0, "s")),
    "MPa": ((0.0995, 1e3, "kPa"), (math.inf, 1.0, "MPa")),
    "1": ((math.inf, 100.0, "%"),),
    "1/min": ((math.inf, 100.0, "% a minute"),),
    "deg/min": ((math.inf, 1.0, "deg a minute"),),
}
"""Unit -> the units that it is told in: below which size, times what, called what."""


def size(number: Interval, signed: bool = False, move: float = 0.0) -> str:
    """The size of a fitted number with its unit; its sign is told by a word beside it, unless `signed`. `move`: see
    `rig.number_text.rounded`, in the number's own unit."""
    width = abs(number.high - number.low) if math.isfinite(number.high - number.low) else 0.0
    _, factor, unit = next(
        (line for line in UNITS.get(number.unit, ()) if abs(number.value) < line[0]), (0.0, 1.0, number.unit)
    )
    value = number.value if signed else abs(number.value)
    return f"{rounded(factor * value, factor * width / DEVIATIONS, move=factor * move)} {unit}".rstrip()


def sizes(numbers: Sequence[Interval], signed: bool = False) -> str:
    """Several sizes in a row."""
    return " and ".join(size(number, signed) for number in numbers)


def share(number: Interval) -> str:
    """A share of many at the start of a sentence."""
    return f"About {size(number)}"


def degrees(value: float, width: float = 0.0) -> str:
    """An rms or a difference of angles, without its unit."""
    return rounded(value, width)


def percent(fraction: float) -> str:
    """A share or a probability; no end of the scale is told as one."""
    if fraction > 0.99:
        return "more than 99 %"
    return "less than 1 %" if 0.0 < fraction < 0.01 else f"{100.0 * fraction:.0f} %"

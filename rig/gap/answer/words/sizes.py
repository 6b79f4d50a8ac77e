"""Numbers for people: with a unit that they are told in, and no more digits than they are worth."""

import math
from collections.abc import Sequence

from rig.gap.answer.result import Interval

MOST_DIGITS = 2
"""Significant digits of a number in a sentence; tables beside it have three."""
DEVIATIONS = 4.0
"""Standard deviations from end to end of a size's interval (95 %): a size is told to the digit that its own deviation
leaves standing, as in physics (Particle Data Group, Review of Particle Physics, Introduction 5.3)."""
UNITS: dict[str, Sequence[tuple[float, float, str]]] = {
    "s": ((0.9995, 1e3, "ms"), (math.inf, 1.0, "s")),
    "MPa": ((0.0995, 1e3, "kPa"), (math.inf, 1.0, "MPa")),
    "1": ((math.inf, 100.0, "%"),),
    "1/min": ((math.inf, 100.0, "% a minute"),),
    "deg/min": ((math.inf, 1.0, "deg a minute"),),
}
"""Unit -> the units that it is told in: below which size, times what, called what."""


def rounded(value: float, width: float, move: float = 0.0) -> str:
    """A number to the digit that this width leaves standing (0: any), at most MOST_DIGITS significant ones; of one end
    of a `move`, as many of that, and at most one more of its own."""
    if not math.isfinite(value):
        return "unknown"
    top = _first_digit(value)
    last = top - MOST_DIGITS + 1
    if move:
        last = max(_first_digit(move) - MOST_DIGITS + 1, last - 1)
    if width > 0.0:
        last = max(last, min(math.floor(math.log10(width)), top))
    text = f"{round(value, -last):.{max(-last, 0)}f}"
    return text.lstrip("-") if float(text) == 0.0 else text


def _first_digit(value: float) -> int:
    """The power of ten of its first digit, once it is rounded: 0.998 is 1.0."""
    return 0 if value == 0.0 else math.floor(math.log10(abs(float(f"{value:.{MOST_DIGITS - 1}e}"))))


def size(number: Interval, signed: bool = False, move: float = 0.0) -> str:
    """The size of a fitted number with its unit; its sign is told by a word beside it, unless `signed`. `move`: see
    `rounded`, in the number's own unit."""
    width = abs(number.high - number.low) if math.isfinite(number.high - number.low) else 0.0
    _, factor, unit = next(
        (line for line in UNITS.get(number.unit, ()) if abs(number.value) < line[0]), (0.0, 1.0, number.unit)
    )
    value = number.value if signed else abs(number.value)
    return f"{rounded(factor * value, factor * width / DEVIATIONS, factor * move)} {unit}".rstrip()


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

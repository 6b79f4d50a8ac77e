"""Numbers as people read them: how many of something, and no more digits than they are worth. Standard library only.

A number is told to the digit that its own standard deviation leaves standing, as in physics (Particle Data Group,
Review of Particle Physics, Introduction 5.3). What it is called and in which unit is for whoever tells it.
"""

import math
from typing import Final

IN_A_SENTENCE: Final = 2
"""Significant digits of a number in a sentence; tables beside it have three."""
IN_A_TABLE: Final = 6
"""Of a parameter in a table, which somebody may copy."""
OF_A_DEVIATION: Final = 2
"""Digits of a standard deviation that stands beside its parameter in a table."""


def counted(count: int, one: str, several: str = "") -> str:
    """A number with the noun behind it, which takes an s where it is not one; of several words the last takes it.
    `several` stands in its place where that is not all, as with a verb: "tick was", "ticks were"."""
    return f"{count} {one}" if count == 1 else f"{count} {several or one + 's'}"


def rounded(
    value: float, width: float = 0.0, *, move: float = 0.0, digits: int = IN_A_SENTENCE, of_width: int = 1
) -> str:
    """A number to the first digit (`of_width`: that many) of how surely it is known, `width` in its own unit (0: any),
    at most `digits` significant ones; of one end of a `move`, as many of that, and at most one more of its own.
    "unknown" for one that is not finite."""
    if not math.isfinite(value):
        return "unknown"
    top = _first_digit(value, digits)
    last = top - digits + 1
    if move:
        last = max(_first_digit(move, digits) - digits + 1, last - 1)
    if width > 0.0:
        last = max(last, min(math.floor(math.log10(width)) - of_width + 1, top))
    text = f"{round(value, -last):.{max(-last, 0)}f}"
    return text.lstrip("-") if float(text) == 0.0 else text


def parameter_text(value: float, std: float | None) -> str:
    """A parameter beside its standard deviation, in the same unit, in a table: to the second digit of that; as it was
    given where it has none."""
    if not std or not math.isfinite(std) or not value:
        return f"{value:.{IN_A_TABLE}g}"
    return rounded(value, std, digits=IN_A_TABLE, of_width=OF_A_DEVIATION)


def to_digits(value: float, digits: int) -> float:
    """The nearest number of so many significant digits, for a file that people read too."""
    return float(f"{value:.{digits}g}")


def _first_digit(value: float, digits: int) -> int:
    """The power of ten of its first digit, once it is rounded to so many: 0.998 is 1.0."""
    return 0 if value == 0.0 else math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))

"""From a difference of pressures to the two set-points, and nowhere else: p1 = P0 + dp/2, p2 = P0 - dp/2."""

from typing import Any, TypeVar, cast

T = TypeVar("T")
"""A number, or a column of numbers."""


def around(p0_mpa: float, dp_mpa: T) -> tuple[T, T]:
    """Both muscles' set-points (MPa) for a difference dp = p1 - p2 about the rest pressure P0; a number or a whole
    column."""
    half = cast(Any, dp_mpa) / 2
    return p0_mpa + half, p0_mpa - half

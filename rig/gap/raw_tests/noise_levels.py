"""How much noise an angle has, by medians: white, coloured, and beside a converter's step."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from rig.columns import MAD_TO_STD, filled_in, grouped_median, on_even_steps, rms, white_noise
from rig.gap.raw_tests.settings import NOISE_WINDOW_ROWS
from rig.record import Column, Record
from rig.smoothing import running_mean


def angles_of(records: Sequence[Record]) -> list[Column]:
    """The measured angles, (n,) each; missing values are NaN."""
    return [record.angle_deg for record in records if record.angle_deg is not None]


def span(columns: Sequence[Column]) -> float:
    """From the lowest to the highest value of all columns (n,), in their unit."""
    every = np.concatenate(list(columns))
    return float(np.nanmax(every) - np.nanmin(every))


Measure = Callable[[Sequence[Column]], float]
"""Noise of columns, in their unit."""


def once(measure: Measure) -> Measure:
    """The same, computed once for the same columns: several tests ask it of each day."""
    known: dict[tuple[int, ...], tuple[Sequence[Column], float]] = {}

    def measured(columns: Sequence[Column]) -> float:
        asked = tuple(map(id, columns))
        if asked not in known:
            known[asked] = columns, measure(columns)  # kept, so that no other column gets its identity
        return known[asked][1]

    return measured


def level_deg(angles: Sequence[Column]) -> float:
    """Noise (deg) of angles (n,), by medians: white, or what a short running mean leaves, for noise that a filter has
    coloured; the larger of both."""
    rests = np.concatenate([_rest(angle) for angle in angles])
    middle = grouped_median(np.abs(rests - np.median(rests)))
    plain = MAD_TO_STD * middle / np.sqrt(1.0 - 1.0 / NOISE_WINDOW_ROWS)
    return max(float(plain), white_level_deg(angles))


def level_beside_deg(step_deg: float, angles: Sequence[Column]) -> float:
    """Noise (deg) beside what rounding to a step makes of any angle, step / sqrt(12): by squares, for the median of a
    few values is one of them."""
    power = rms(np.concatenate([_rest(angle) for angle in angles])) ** 2 / (1.0 - 1.0 / NOISE_WINDOW_ROWS)
    return math.sqrt(max(power - step_deg**2 / 12.0, 0.0))


def _rest(angle: Column) -> Column:
    """What a running mean leaves, where nothing is missing within its window."""
    whole = filled_in(on_even_steps(angle))
    beside = running_mean((~np.isfinite(angle)).astype(float), NOISE_WINDOW_ROWS) > 0.5 / NOISE_WINDOW_ROWS
    rest: Column = (whole - running_mean(whole, NOISE_WINDOW_ROWS))[~beside]
    return rest


def white_level_deg(angles: Sequence[Column]) -> float:
    """White noise (deg) of angles (n,), by medians; rows beside an exact repeat left out."""
    return white_noise(angles, without_repeats=True)

"""A measured pressure without what its monitor adds: what an effect changes is computed on that.

A change that is computed on a noisy course is noisy as well: a filter smooths the noise of the earlier day with the
pressure, a delay does not, and fits worse for that alone (docs/decisions/0539).
"""

import numpy as np

from rig.gap.settings import ENVELOPE_HZ, LOUDER_BELOW, TOP_HZ
from rig.record import Column

MEDIAN_POWER = 0.4549
"""Median of a chi-square with one degree of freedom, over its mean: noise has that power in half of its lines."""


def without_noise(measured: Column, described: Column, dt_s: float) -> Column:
    """(n,) a measured course without noise; `described` (n,) is what a description, which has none, says of it.

    Beyond that the course keeps of each line what stands out of noise (Wiener's filter, with the power that the line
    itself shows): out of the median of the lines within ENVELOPE_HZ, or out of what is above TOP_HZ where that is much
    less, for what begins and ends otherwise spreads over the lines as noise does. Nothing above TOP_HZ is kept, where
    nothing is compared.
    """
    beyond = measured - described
    mirrored = np.fft.rfft(np.concatenate([beyond, beyond[::-1]]))  # a cosine transform: its ends need not meet
    hertz = 1.0 / (2.0 * len(beyond) * dt_s)
    top = min(len(mirrored), int(TOP_HZ / hertz) + 1)
    power = np.abs(mirrored) ** 2
    noise = _median_beside(power[1:top], round(ENVELOPE_HZ / hertz))
    if len(above := power[top : 2 * top]):
        noise = np.minimum(noise, LOUDER_BELOW * np.median(above))
    share = np.zeros(len(mirrored))
    share[0] = 1.0  # the mean
    share[1:top] = np.maximum(1.0 - noise / MEDIAN_POWER / np.maximum(power[1:top], 1e-300), 0.0)
    kept: Column = described + np.fft.irfft(share * mirrored, 2 * len(beyond))[: len(beyond)]
    return kept


def _median_beside(power: Column, reach: int) -> Column:
    """(l,) median of the lines (l,) up to `reach` away, those at the ends mirrored."""
    reach = min(reach, len(power) - 1)
    padded = np.pad(power, reach, mode="reflect")
    found: Column = np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1), axis=1)
    return found

"""Noise with a memory, as several families have it: one pole behind white noise. How loud and how slow it is, each
family says."""

import math

import numpy as np
from numpy.random import Generator

from hil.reference.compiling import Array, compiled


@compiled
def one_pole(drive: Array, keep: float, state: float) -> Array:
    """(n,) of `keep` times what was before, at first `state`, and the drive (n,)."""
    out = np.empty_like(drive)
    for k in range(len(drive)):
        state = keep * state + drive[k]
        out[k] = state
    return out


def coloured(n: int, sigma: float, time_s: float, period_s: float, random: Generator) -> Array:
    """Noise of standard deviation `sigma` and correlation time `time_s`, shape (n,)."""
    keep = math.exp(-period_s / time_s)
    drive = random.standard_normal(n) * sigma * math.sqrt(1.0 - keep * keep)
    return np.asarray(one_pole(drive, keep, sigma * float(random.standard_normal())))

"""Compiled inner loops of the diagnosis; those of the response model are `rig.model.response_kernels`.

The effects themselves are compiled from `rig.model.effect_stages` by `rig.model.kernels`; nothing here is an effect.
"""

import numpy as np
from numba import njit

from rig.record import Column


@njit(cache=True, nogil=True)
def whitened(
    residual: Column, modes: Column, to_sizes: Column, precision: Column, scale: float
) -> Column:  # pragma: no cover
    """Residual less its modes, scaled, then the modes' sizes by their precision: (n + m,) whose sum of squares is
    chi-square."""
    n, m = modes.shape
    out = np.empty(n + m)
    sizes = np.zeros(m)
    for i in range(n):
        for j in range(m):
            sizes[j] += to_sizes[i, j] * residual[i]
    for i in range(n):
        left = residual[i]
        for j in range(m):
            left -= modes[i, j] * sizes[j]
        out[i] = left * scale
    for j in range(m):
        out[n + j] = sizes[j] * precision[j]
    return out

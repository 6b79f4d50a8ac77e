"""How well the records determine the parameters: local covariance, correlations, parameters at a bound.

The covariance is that of least squares at the optimum, widened for residuals that follow each other slowly (a model's
misfit is not white noise, and n samples of it count for fewer) and for the error of the angle that each record starts
from.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.identify.search.objective import ChainObjective
from rig.identify.search.space import AT_BOUND, Space, slopes

Table = NDArray[np.float64]
Flags = NDArray[np.bool_]
_NULL = 1e-9
"""A direction in which the residuals move by less than this share of how far they move at most is not determined; the
differences are exact to some 1e-11."""
_SHARE = 1e-3
"""Component of a direction from which on a parameter has a share in it."""
_ALIKE = 0.95
"""Correlation from which two parameters are reported as not told apart."""


@dataclass(frozen=True)
class Uncertainty:
    """Of the free parameters at one point, in the order of the space."""

    std: Table
    """Standard deviations in the unit box, shape (d,); NaN at a bound, infinite where the records do not determine a
    parameter."""
    correlation: Table
    """Shape (d, d); 0 in the rows of parameters at a bound."""
    independent: float
    """To how many independent samples the residuals amount."""

    def alike(self, names: list[str]) -> list[tuple[str, str, float]]:
        """Pairs that the records hardly tell apart, with their correlation."""
        pairs = [(j, i) for i in range(len(names)) for j in range(i) if abs(self.correlation[i, j]) >= _ALIKE]
        return [(names[j], names[i], float(self.correlation[i, j])) for j, i in pairs]


def local_uncertainty(objective: ChainObjective, space: Space, point: Table) -> Uncertainty:
    """Covariance of the free parameters at `point` (d,) from the Jacobian of the residuals there.

    Every record is simulated from its first measured angle, so that this sample's error goes through the whole record:
    it is as large as the residuals are, and what it does to the parameters is added (docs/decisions/0109).
    """
    dimension = len(space)
    jacobian, residual = slopes(objective.residuals, point), objective.residuals(point[np.newaxis])[0]
    inside = np.minimum(point, 1.0 - point) >= AT_BOUND
    independent = independent_samples(residual)
    freedom = max(independent - inside.sum(), 1.0)
    square = float(np.sum(residual**2))
    inverse, blind = inverse_information(jacobian[:, inside])
    through_starts = inverse @ (jacobian[:, inside].T @ objective.start_slopes(point))
    # n residuals that amount to `independent` ones carry that share of the information
    found = inverse * square / freedom + through_starts @ through_starts.T * square / len(residual)
    covariance = np.zeros((dimension, dimension))
    covariance[np.ix_(inside, inside)] = found
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.where(std > 0, std, 1.0)
    known = np.where(inside, std, np.nan)
    known[inside] = spread_within(std[inside], blind)
    return Uncertainty(known, covariance / np.outer(scale, scale), independent)


def inverse_information(jacobian: Table) -> tuple[Table, Flags]:
    """(J'J)^-1 of a Jacobian (n, k) over parameters in the unit box, shape (k, k), and which parameters have a share
    in a direction that no row says anything of, shape (k,). Along such a direction the inverse is large, not infinite.
    """
    if not jacobian.shape[1]:
        return np.zeros((0, 0)), np.zeros(0, dtype=bool)
    _, sizes, directions = np.linalg.svd(np.linalg.qr(jacobian, mode="r"), full_matrices=True)
    sizes = np.concatenate([sizes, np.zeros(len(directions) - len(sizes))])
    least = _NULL * sizes[0] if sizes[0] > 0 else _NULL
    blind = np.any(np.abs(directions[sizes <= least]) > _SHARE, axis=0)
    scaled = directions / np.maximum(sizes, least)[:, np.newaxis]
    return scaled.T @ scaled, blind


def spread_within(std: Table, blind: Flags) -> Table:
    """Standard deviations in the unit box (k,); infinite where a parameter is not determined: one that is `blind`, or
    of which its bounds say more than the records do."""
    return np.where(blind | (std > 1.0), np.inf, std)


def independent_samples(residual: Table) -> float:
    """Of a residual (n,): n / (1 + 2 sum of its autocorrelations up to their first zero): at least 1, at most n."""
    centred = residual - np.mean(residual)
    n = len(centred)
    spectrum = np.abs(np.fft.rfft(centred, 2 * n)) ** 2
    power = np.fft.irfft(spectrum)[:n]
    if power[0] <= 0:
        return float(n)
    correlation = power / power[0]
    negative = np.nonzero(correlation <= 0)[0]
    first_zero = int(negative[0]) if len(negative) else n
    return float(max(n / (1.0 + 2.0 * np.sum(correlation[1:first_zero])), 1.0))

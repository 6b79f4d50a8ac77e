"""How well the records determine the parameters: local covariance, correlations, parameters at a bound.

The covariance is that of least squares at the optimum, widened for residuals that follow each other slowly: a model's
misfit is not white noise, and n samples of it count for fewer.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.identify.search.objective import ChainObjective
from rig.identify.search.space import AT_BOUND, Space

Table = NDArray[np.float64]
_STEP = 1e-5
"""Half the step of the differences, as a share of the range."""
_ALIKE = 0.95
"""Correlation from which two parameters are reported as not told apart."""


@dataclass(frozen=True)
class Uncertainty:
    """Of the free parameters at one point, in the order of the space."""

    std: Table
    """Standard deviations in the unit box, shape (d,); NaN at a bound."""
    correlation: Table
    """Shape (d, d); 0 in the rows of parameters at a bound."""
    independent: float
    """To how many independent samples the residuals amount."""

    def alike(self, names: list[str]) -> list[tuple[str, str, float]]:
        """Pairs that the records hardly tell apart, with their correlation."""
        pairs = [(j, i) for i in range(len(names)) for j in range(i) if abs(self.correlation[i, j]) >= _ALIKE]
        return [(names[j], names[i], float(self.correlation[i, j])) for j, i in pairs]


def local_uncertainty(objective: ChainObjective, space: Space, point: Table) -> Uncertainty:
    """Covariance of the free parameters at `point` (d,) from the Jacobian of the residuals there."""
    dimension = len(space)
    up = np.minimum(point + _STEP * np.eye(dimension), 1.0)
    down = np.maximum(point - _STEP * np.eye(dimension), 0.0)
    rows = objective.residuals(np.concatenate([up, down, point[np.newaxis]]))
    jacobian = ((rows[:dimension] - rows[dimension : 2 * dimension]) / np.diag(up - down)[:, np.newaxis]).T
    residual = rows[-1]
    inside = np.minimum(point, 1.0 - point) >= AT_BOUND
    independent = independent_samples(residual)
    freedom = max(independent - inside.sum(), 1.0)
    variance = float(np.sum(residual**2)) / len(residual) * independent / freedom
    # n residuals that amount to `independent` ones carry that share of the information
    information = jacobian[:, inside].T @ jacobian[:, inside] * (independent / len(residual))
    covariance = np.zeros((dimension, dimension))
    covariance[np.ix_(inside, inside)] = variance * np.linalg.pinv(information, hermitian=True)
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.where(std > 0, std, 1.0)
    return Uncertainty(np.where(inside, std, np.nan), covariance / np.outer(scale, scale), independent)


def independent_samples(residual: Table) -> float:
    """n / (1 + 2 sum of the autocorrelations up to their first zero): at least 1, at most n."""
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

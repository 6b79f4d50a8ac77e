"""One channel group's Gaussian likelihood: lines with a variance each, and patterns whose sizes are unsure.

r ~ N(0, V + P P'), V diagonal, P (l, m) patterns at one standard deviation. Everything is one Woodbury solve in m
dimensions. The level of V is itself known with `degrees` of freedom only, so tails are a t distribution's.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rig.record import Column


@dataclass(frozen=True)
class Gaussian:
    """What is expected of a residual when nothing is wrong."""

    variance: Column
    """(l,) of each line."""
    patterns: Column
    """(l, m) what may differ without being a gap, at one standard deviation."""
    effective: float
    """How many independent lines there are: neighbours and records share their causes."""
    degrees: float
    """Degrees of freedom with which the level of the variance is known."""

    @cached_property
    def _scale(self) -> Column:
        """1 / standard deviation of each line, as if there were `effective` lines."""
        return np.sqrt(self.effective / (len(self.variance) * self.variance))

    @cached_property
    def _weighed(self) -> Column:
        return np.ascontiguousarray(self.patterns * self._scale[:, None])

    @cached_property
    def _root(self) -> Column:
        """(m, m) lower triangle L with L L' = 1 + P' V^-1 P."""
        gram = self._weighed.T @ self._weighed
        return np.asarray(np.linalg.cholesky(gram + np.eye(len(gram))), np.float64)

    @cached_property
    def _inverse_root(self) -> Column:
        return np.asarray(np.linalg.inv(self._root), np.float64)

    def _solved(self, right: Column) -> Column:
        """(1 + P' V^-1 P)^-1 right, of (m,) or (m, k)."""
        out: Column = self._inverse_root.T @ (self._inverse_root @ right)
        return out

    @cached_property
    def log_spread(self) -> float:
        """Half the log determinant of the covariance, against lines of variance 1."""
        share = self.effective / len(self.variance)
        return float(np.sum(np.log(np.diag(self._root))) + 0.5 * share * np.sum(np.log(self.variance)))

    def sizes(self, residual: Column) -> Column:
        """(m,) the patterns' likeliest sizes in a residual (l,), in standard deviations."""
        return self._solved(self._weighed.T @ (residual * self._scale))

    def sizes_with_covariance(self, residuals: Column) -> tuple[Column, Column]:
        """(m, k) the patterns' likeliest sizes in residuals (l, k), in standard deviations, and (m, m) their
        covariance."""
        return self._solved(self._weighed.T @ (residuals * self._scale[:, None])), self._size_covariance

    @cached_property
    def _size_covariance(self) -> Column:
        out: Column = self._inverse_root.T @ self._inverse_root
        return out

    def size_variances(self) -> Column:
        """(m,) variances of those sizes, in squared standard deviations: 1 where a residual says nothing of a
        pattern."""
        out: Column = np.diag(self._size_covariance)
        return out

    def power_of(self, covariance: Column) -> Column:
        """(l,) variance of each line by sizes of the patterns with this covariance (m, m)."""
        out: Column = np.sum((self.patterns @ covariance) * self.patterns, axis=1)
        return out

    def weigh(self, residual: Column) -> Column:
        """(l + m,) whose sum of squares is the residual's chi-square: what is left beside the patterns, then their
        sizes."""
        scaled = residual * self._scale
        sizes = self._solved(self._weighed.T @ scaled)
        return np.concatenate([scaled - self._weighed @ sizes, sizes])

    def chi_square(self, residual: Column) -> float:
        """r' (V + P P')^-1 r."""
        scaled = residual * self._scale
        taken = self._inverse_root @ (self._weighed.T @ scaled)
        return float(scaled @ scaled - taken @ taken)

    def log_density(self, residual: Column) -> float:
        """ln p(residual) but for a constant: a t density of `effective` dimensions and `degrees` degrees of freedom."""
        n, nu = self.effective, self.degrees
        chi = self.chi_square(residual)
        return float(
            math.lgamma(0.5 * (nu + n))
            - math.lgamma(0.5 * nu)
            - 0.5 * n * np.log(nu)
            - 0.5 * (nu + n) * np.log1p(chi / nu)
            - self.log_spread
        )

    def log_slopes(self, residual: Column) -> tuple[Column, Column]:
        """Derivatives of `log_density` by the logarithm of each pattern's size (m,) and of each line's variance
        (l,)."""
        scaled = residual * self._scale
        sizes, inverse = self._solved(self._weighed.T @ scaled), self._size_covariance
        left = scaled - self._weighed @ sizes
        stiff = (self.degrees + self.effective) / (self.degrees + float(left @ left + sizes @ sizes))
        taken = np.sum((self._weighed @ inverse) * self._weighed, axis=1)
        by_line = 0.5 * (stiff * left**2 + taken - self.effective / len(left))
        return stiff * sizes**2 + np.diag(inverse) - 1.0, by_line

    def with_patterns(self, more: Column) -> "Gaussian":
        """The same with further patterns (l, k)."""
        return replace(self, patterns=np.hstack([self.patterns, more]))

    def with_variance(self, more: Column) -> "Gaussian":
        """The same with more variance (l,) on each line."""
        return replace(self, variance=self.variance + more)

"""One channel group's Gaussian likelihood: lines with a variance each, and patterns whose sizes are unsure.

r ~ N(0, V + P P'), V diagonal, P (l, m) patterns at one standard deviation. Everything is one Woodbury solve in m
dimensions. The level of V is itself known with `degrees` of freedom only, so tails are a t distribution's; and by how
much the patterns that days differ in are larger or smaller on this rig is a factor, known with degrees of its own.
"""

import math
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from rig.gap.likelihood.elimination import by_factors
from rig.gap.likelihood.rough_law import RoughLaw
from rig.record import Column

NODES = 15
"""Points of Gauss's rule at which the factor is tried: half a nat at worst. Fewer: residuals far beyond what days bring
are judged by some nats otherwise (seven: up to 30)."""


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
    between_days: int = 0
    """How many of the patterns, the first ones, are what days differ in; they are all larger on one rig than on
    another by a factor of its own."""
    pattern_degrees: float = math.inf
    """Degrees of freedom with which that factor is known."""
    as_well: "Column | None" = None
    """(l,) by how much more the variance may be as well (`Factor.of_its_class`, `Prior.answer`); None: it is as it
    stands."""
    log_chance: float = 0.0
    """ln of how likely that is, against the variance as it stands."""

    @cached_property
    def _scale(self) -> Column:
        """1 / standard deviation of each line, as if there were `effective` lines."""
        return np.sqrt(self.effective / (len(self.variance) * self.variance))

    @cached_property
    def _weighed(self) -> Column:
        return np.ascontiguousarray(self.patterns * self._scale[:, None])

    @cached_property
    def _gram(self) -> Column:
        """(m, m) P' V^-1 P."""
        out: Column = self._weighed.T @ self._weighed
        return out

    @cached_property
    def _root(self) -> Column:
        """(m, m) lower triangle L with L L' = 1 + P' V^-1 P."""
        return np.asarray(np.linalg.cholesky(self._gram + np.eye(len(self._gram))), np.float64)

    @cached_property
    def _inverse_root(self) -> Column:
        return np.asarray(np.linalg.inv(self._root), np.float64)

    def _solved(self, right: Column) -> Column:
        """(1 + P' V^-1 P)^-1 right, of (m,) or (m, k)."""
        out: Column = self._inverse_root.T @ (self._inverse_root @ right)
        return out

    @cached_property
    def _log_lines(self) -> float:
        """Half the log determinant of V, as if there were `effective` lines."""
        return float(0.5 * self.effective * np.mean(np.log(self.variance)))

    def sizes(self, residual: Column) -> Column:
        """(m,) the patterns' likeliest sizes in a residual (l,), in standard deviations."""
        return self._solved(self._weighed.T @ (residual * self._scale))

    def beyond(self, residual: Column) -> Column:
        """(l,) what is left of a residual (l,) once the patterns are as large as they likeliest are."""
        out: Column = residual - self.patterns @ self.sizes(residual)
        return out

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

    def normal(self, slopes: Column, residual: Column) -> tuple[Column, Column]:
        """(k, k) J' (V + P P')^-1 J of slopes J (l, k), and (k,) J' (V + P P')^-1 r: sums of squares, of what is left
        beside the patterns and of their sizes, since most of J may be theirs."""
        both = np.column_stack([slopes, residual]) * self._scale[:, None]
        sizes = self._solved(self._weighed.T @ both)
        left = both - self._weighed @ sizes
        products = left.T @ left + sizes.T @ sizes
        return products[:-1, :-1], products[:-1, -1]

    def chi_square(self, residual: Column) -> float:
        """r' (V + P P')^-1 r of a residual (l,)."""
        scaled = residual * self._scale
        taken = self._inverse_root @ (self._weighed.T @ scaled)
        return float(scaled @ scaled - taken @ taken)

    def log_density(self, residual: Column, law: RoughLaw | None = None) -> float:
        """ln p(residual), of (l,) lines, but for a constant: a t density of `effective` dimensions and `degrees`
        degrees of freedom, over what the days' factor may be; with the patterns of a rough law as well, where one is
        given."""
        factors, log_chances = _factors(self.pattern_degrees)
        own = float(np.logaddexp.reduce(log_chances + self.log_densities(residual, factors, law)))
        if self._looser is None:
            return own
        either = np.logaddexp(own, self.log_chance + self._looser.log_density(residual, law))
        return float(either - np.logaddexp(0.0, self.log_chance))

    @cached_property
    def _looser(self) -> "Gaussian | None":
        return None if self.as_well is None else replace(self, variance=self.variance + self.as_well, as_well=None)

    def log_densities(self, residual: Column, factors: Column, law: RoughLaw | None = None) -> Column:
        """(k,) the same with the patterns that days differ in so many times (k,) as large, and known to be."""
        n, nu = self.effective, self.degrees
        scaled = residual * self._scale
        gram, shown = (self._gram, self._weighed.T @ scaled) if law is None else law.products(self._scale, scaled)
        taken, log_spreads = by_factors(gram, shown, self.between_days, factors)
        chi = scaled @ scaled - taken
        constant = math.lgamma(0.5 * (nu + n)) - math.lgamma(0.5 * nu) - 0.5 * n * np.log(nu)
        out: Column = constant - 0.5 * (nu + n) * np.log1p(np.maximum(chi, 0.0) / nu) - self._log_lines - log_spreads
        return out

    def log_slopes(self, residual: Column) -> tuple[Column, Column]:
        """Derivatives of `log_density` by the logarithm of each pattern's size (m,) and of each line's variance (l,),
        with the days' factor known to be 1."""
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


@cache
def _factors(degrees: float) -> tuple[Column, Column]:
    """(k,) factors that are tried, and ln of how likely they are: log-normal, as unsure as a standard deviation is that
    was found with so many degrees of freedom (its logarithm's own is 1 / sqrt(2 degrees))."""
    if math.isinf(degrees):
        return np.ones(1), np.zeros(1)
    at, weights = np.polynomial.hermite_e.hermegauss(NODES)
    return np.exp(at / math.sqrt(2.0 * degrees)), np.log(weights / np.sum(weights))

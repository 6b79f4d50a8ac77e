"""One side of the chain: its gap, the ways in which healthy days differ there, and how residuals are weighed by them.

Where the numbers come from is in `rig.gap.days.floor`; no effect is known here.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rig.gap.days.kernels import whitened
from rig.identify.descent import square_sum
from rig.record import Column


@dataclass(frozen=True)
class Side:
    """One side of the chain: its gap, its modes, its floor. Columns run over all pairs, one after the other."""

    name: str
    unit: str
    gap: Column
    """(n,) case minus healthy reference, 0 where not measured."""
    modes: Column
    """(n, m) ways in which sessions differ."""
    spread: Column
    """(m,) standard deviation of each mode between sessions."""
    degrees: float
    """Degrees of freedom of `spread`."""
    remainder: float
    """Rms of what sessions differ beside the modes."""
    floor: float
    """Rms of a healthy session against the mean of the baselines, modes and all."""
    source: str
    """sessions, periods, noise or model: what the floor was taken from."""
    records: Column
    """(n,) index of the pair that each row belongs to."""
    rows: float
    """Number of rows that were measured."""
    effective: float
    """Number of independent rows."""
    handed: float = 0.0
    """Rms that the other side's gap is worth on this one, by the response model."""
    doubts: Column | None = None
    """(n, k) changes that may be there or not, one standard deviation each: what the other side hands over and nobody
    knows closer."""

    def rms(self, column: Column) -> float:
        """Root mean square over the measured rows."""
        return float(np.sqrt(square_sum(column) / self.rows))

    def on(self, chosen: Sequence[int]) -> "Side":
        """The same side with the rows of some records only."""
        rows = np.flatnonzero(np.isin(self.records, chosen))
        share = len(rows) / max(len(self.records), 1)
        renamed = np.searchsorted(np.array(chosen), self.records[rows]).astype(float)
        return replace(
            self,
            gap=self.gap[rows],
            modes=self.modes[rows],
            doubts=None if self.doubts is None else self.doubts[rows],
            records=renamed,
            rows=self.rows * share,
            effective=self.effective * share,
        )

    def noise(self, looseness: float = 0.0) -> float:
        """Variance of a row as the fits see it; `looseness` is the rms by which laws are only approximations."""
        return (self.remainder**2 + looseness**2) * self.rows / self.effective

    @cached_property
    def known(self) -> tuple[Column, Column]:
        """(n, m + k) and (m + k,): the modes and the doubts, with their standard deviations."""
        if self.doubts is None:
            return self.modes, self.spread
        return np.hstack([self.modes, self.doubts]), np.concatenate([self.spread, np.ones(self.doubts.shape[1])])

    def mode_sizes(self, column: Column, looseness: float = 0.0) -> Column:
        """(m,) size of each mode in a column: as much as its spread allows."""
        return self._sizes(self.modes, self.spread, column, looseness)

    def beside(self, column: Column, looseness: float = 0.0) -> Column:
        """(n,) what is in a column beside its modes and doubts, each as large as its spread allows."""
        known, spread = self.known
        out: Column = column - known @ self._sizes(known, spread, column, looseness)
        return out

    @cached_property
    def doubt_shares(self) -> Column:
        """(m, k) what each doubt is worth in the modes."""
        if self.doubts is None:
            return np.zeros((self.modes.shape[1], 0))
        return np.column_stack([self.free_sizes(one) for one in self.doubts.T])

    @cached_property
    def _doubts_beside(self) -> Column | None:
        """(n, k) the doubts beside the modes."""
        return None if self.doubts is None else self.doubts - self.modes @ self.doubt_shares

    def without_doubts(self, column: Column, looseness: float) -> Column:
        """(n,) a column that holds no modes, without its doubts, each as large as one standard deviation allows."""
        doubts = self._doubts_beside
        if doubts is None:
            return column
        out: Column = column - doubts @ self._sizes(doubts, np.ones(doubts.shape[1]), column, looseness)
        return out

    def _sizes(self, known: Column, spread: Column, column: Column, looseness: float) -> Column:
        noise = self.noise(looseness)
        return np.asarray(np.linalg.solve(_gram(known, spread, noise), known.T @ column / noise), dtype=np.float64)

    def free_sizes(self, column: Column) -> Column:
        """(m,) size of each mode in a column, by least squares."""
        gram = self.modes.T @ self.modes
        return np.asarray(
            np.linalg.solve(gram + 1e-12 * np.diag(np.diag(gram) + 1e-30), self.modes.T @ column), dtype=np.float64
        )

    def whitened(self, looseness: float = 0.0) -> "Whitener":
        """How to weigh residuals of this side."""
        known, spread = self.known
        noise = self.noise(looseness)
        to_sizes = np.ascontiguousarray(np.linalg.solve(_gram(known, spread, noise), known.T / noise).T)
        return Whitener(np.ascontiguousarray(known), to_sizes, 1.0 / spread, 1.0 / float(np.sqrt(noise)))


def _gram(known: Column, spread: Column, noise: float) -> Column:
    """(k, k) how firmly sizes of known patterns are held: by the rows, and by what is usual."""
    out: Column = known.T @ known / noise + np.diag(1.0 / spread**2)
    return out


@dataclass(frozen=True)
class Whitener:
    """Turns a residual into one whose sum of squares is its chi-square: modes cost what their spread says."""

    modes: Column
    to_sizes: Column
    precision: Column
    scale: float

    def __call__(self, residual: Column) -> Column:
        out: Column = whitened(residual, self.modes, self.to_sizes, self.precision, self.scale)
        return out

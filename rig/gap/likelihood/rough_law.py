"""How a law may be wrong, beside what is expected: its change in each record by itself a little larger or smaller, and
in all of them a little earlier or later.

A pattern that is zero outside of its record need not be written out: its products with the others are sums over that
record. Beside six days' pressures in seven records that is four fifths of the work (docs/decisions/0635).
"""

from dataclasses import dataclass

import numpy as np

from rig.record import Column

Places = np.typing.NDArray[np.intp]


@dataclass(frozen=True)
class RoughLaw:
    """Patterns of a law that is wrong by a share `rho` of what it changes, beside the (l, m) of a Gaussian."""

    columns: Column
    """(l, m + 2): those, then what the law changes, then the pattern of that at another time."""
    ends: Places
    """(r + 1,) the first line of each record, and how many lines there are."""
    rho: float

    def products(self, scale: Column, residual: Column) -> tuple[Column, Column]:
        """(k, k) products of all m + r + 1 patterns, each line `scale` (l,) times, and (k,) theirs with a residual (l,)
        that is scaled already: in the order in which `law_patterns` writes them out."""
        m, records = self.columns.shape[1] - 2, len(self.ends) - 1
        weighed = self.columns * scale[:, None]
        gram, shown, own = weighed.T @ weighed, weighed.T @ residual, weighed[:, m].copy()
        each = np.array([
            own[first:end] @ weighed[first:end] for first, end in zip(self.ends[:-1], self.ends[1:], strict=True)
        ])  # fmt: skip
        law, last = slice(m, m + records), m + records
        whole, heard = np.zeros((last + 1, last + 1)), np.empty(last + 1)
        whole[:m, :m], heard[:m] = gram[:m, :m], shown[:m]
        whole[law, :m] = self.rho * each[:, :m]
        whole[:m, law] = whole[law, :m].T
        np.fill_diagonal(whole[law, law], self.rho**2 * each[:, m])
        heard[law] = self.rho * np.add.reduceat(own * residual, self.ends[:-1])
        whole[last, :m] = whole[:m, last] = self.rho * gram[m + 1, :m]
        whole[last, law] = whole[law, last] = self.rho**2 * each[:, m + 1]
        whole[last, last], heard[last] = self.rho**2 * gram[m + 1, m + 1], self.rho * shown[m + 1]
        return whole, heard

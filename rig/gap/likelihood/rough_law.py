"""How a law may be wrong, beside what is expected: its change in each record by itself a little larger or smaller, and
in all of them a little earlier or later.

A pattern that is zero outside of its record need not be written out: its products with the others are sums over that
record. Beside six days' pressures in seven records that is four fifths of the work (docs/decisions/0635).
"""

from dataclasses import dataclass

import numpy as np

from rig.model.compiled.machine_code import kernel
from rig.record import Column

Places = np.typing.NDArray[np.intp]


@kernel(nogil=True)
def weigh(
    columns: Column, scale: Column, residual: Column, ends: Places
) -> tuple[Column, Column, Column]:  # pragma: no cover
    """The columns (l, k), each line `scale` (l,) times; of every record the products of these with the last but one of
    them, and with a residual (l,): (r, k) each."""
    (rows, k), records = columns.shape, len(ends) - 1
    weighed, own, shown = np.empty((rows, k)), np.zeros((records, k)), np.zeros((records, k))
    for record in range(records):
        for i in range(ends[record], ends[record + 1]):
            moved = scale[i] * columns[i, k - 2]
            for j in range(k):
                weighed[i, j] = scale[i] * columns[i, j]
                own[record, j] += moved * weighed[i, j]
                shown[record, j] += residual[i] * weighed[i, j]
    return weighed, own, shown


@kernel(nogil=True)
def written_out(gram: Column, own: Column, shown: Column, rho: float) -> tuple[Column, Column]:  # pragma: no cover
    """The products of all m + r + 1 patterns and theirs with the residual, from what `weigh` gave and from `gram`
    (m + 2, m + 2)."""
    records, m = own.shape[0], own.shape[1] - 2
    last = m + records
    whole, heard = np.zeros((last + 1, last + 1)), np.zeros(last + 1)
    whole[:m, :m] = gram[:m, :m]
    for record in range(records):
        heard[:m] += shown[record, :m]
        heard[m + record] = rho * shown[record, m]
        heard[last] += rho * shown[record, m + 1]
        whole[m + record, :m] = whole[:m, m + record] = rho * own[record, :m]
        whole[m + record, m + record] = rho * rho * own[record, m]
        whole[m + record, last] = whole[last, m + record] = rho * rho * own[record, m + 1]
    whole[last, :m] = whole[:m, last] = rho * gram[m + 1, :m]
    whole[last, last] = rho * rho * gram[m + 1, m + 1]
    return whole, heard


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
        weighed, own, shown = weigh(self.columns, scale, residual, self.ends)
        made: tuple[Column, Column] = written_out(weighed.T @ weighed, own, shown, self.rho)
        return made

"""Gauss's elimination on the few patterns of a likelihood: compiled, since a diagnosis asks for it some thousand times
and each call of a library's costs more than the sums that it does."""

import math

import numpy as np

from rig.model.compiled.machine_code import kernel
from rig.record import Column


@kernel(nogil=True)
def eliminated(matrix: Column, right: Column, count: int) -> tuple[float, float]:  # pragma: no cover
    """Take the first `count` rows of `matrix` (m, m) = 1 + G, G of squares, out of it and of `right` (m,), in place:
    the rest of both is then beside them. Returns right' matrix^-1 right of these rows and half the log of their
    determinant. Only the lower triangle is read."""
    m = len(right)
    said, log_root, column = 0.0, 0.0, np.empty(m)
    for k in range(count):
        pivot = matrix[k, k]
        if pivot < 1.0:  # by rounding only
            pivot = 1.0
        root = math.sqrt(pivot)
        along = right[k] / root
        said += along * along
        log_root += math.log(root)
        for i in range(k + 1, m):
            column[i] = matrix[i, k] / root
        for i in range(k + 1, m):
            right[i] -= column[i] * along
            for j in range(k + 1, i + 1):
                matrix[i, j] -= column[i] * column[j]
    return said, log_root


@kernel(nogil=True)
def by_factors(gram: Column, shown: Column, days: int, factors: Column) -> tuple[Column, Column]:  # pragma: no cover
    """s' (1 + F G F)^-1 s, s = F shown, and half the log of that determinant, both (k,): the first `days` of the
    patterns with these products (m, m) are so many times (k,) as large, F, the others as they are."""
    m = len(gram)
    others = m - days
    matrix, right = np.empty((m, m)), np.empty(m)
    for i in range(m):  # the others first: what is beside them serves every factor
        a = i + days if i < others else i - others
        right[i] = shown[a]
        for j in range(i + 1):
            matrix[i, j] = gram[a, j + days if j < others else j - others]
        if i < others:
            matrix[i, i] += 1.0
    beside, log_beside = eliminated(matrix, right, others)
    said, log_root = np.empty(len(factors)), np.empty(len(factors))
    scaled, along = np.empty((days, days)), np.empty(days)
    for k in range(len(factors)):
        for i in range(days):
            along[i] = factors[k] * right[others + i]
            for j in range(i + 1):
                scaled[i, j] = factors[k] * factors[k] * matrix[others + i, others + j]
            scaled[i, i] += 1.0
        mine, log_mine = eliminated(scaled, along, days)
        said[k], log_root[k] = beside + mine, log_beside + log_mine
    return said, log_root

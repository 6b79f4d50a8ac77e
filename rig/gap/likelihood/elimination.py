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
def tridiagonal(matrix: Column) -> tuple[Column, Column]:  # pragma: no cover
    """The diagonal (m,) and what stands below it (m - 1,) once all but the first of the rows and columns of a symmetric
    `matrix` (m, m) are turned until nothing is left beside these (Householder; Golub and Van Loan, Matrix Computations,
    2013, 8.3.1). Only the lower triangle is read, and it is written over."""
    m = len(matrix)
    below, mirror, moved = np.zeros(max(m - 1, 0)), np.zeros(m), np.zeros(m)
    for k in range(m - 1):
        square = 0.0
        for i in range(k + 1, m):
            mirror[i] = matrix[i, k]
            square += mirror[i] * mirror[i]
        below[k] = -math.copysign(math.sqrt(square), mirror[k + 1])
        half = square - below[k] * mirror[k + 1]  # half the square of the mirror's normal, below
        if half <= 0.0:
            continue
        mirror[k + 1] -= below[k]
        for i in range(k + 1, m):
            moved[i] = 0.0
        for i in range(k + 1, m):
            for j in range(k + 1, i):
                moved[i] += matrix[i, j] * mirror[j]
                moved[j] += matrix[i, j] * mirror[i]
            moved[i] += matrix[i, i] * mirror[i]
        along = 0.0
        for i in range(k + 1, m):
            moved[i] /= half
            along += moved[i] * mirror[i]
        along /= 2.0 * half
        for i in range(k + 1, m):
            moved[i] -= along * mirror[i]
            for j in range(k + 1, i + 1):
                matrix[i, j] -= mirror[i] * moved[j] + moved[i] * mirror[j]
    return np.diag(matrix).copy(), below


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
    # turned so that s lies along the first pattern, and each pattern shows in the next alone: a factor is one pass then
    turned = np.zeros((days + 1, days + 1))
    turned[1:, 0], turned[1:, 1:] = right[others:], matrix[others:, others:]
    own, shared = tridiagonal(turned)
    said, log_root = np.empty(len(factors)), np.empty(len(factors))
    for k in range(len(factors)):
        square = factors[k] * factors[k]
        pivot, log_pivots, further = 1.0, 0.0, 0.0
        for i in range(days, 0, -1):
            pivot = max(1.0 + square * own[i] - further, 1.0)  # below by rounding only
            log_pivots += math.log(pivot)
            further = (square * shared[i - 1]) ** 2 / pivot
        said[k] = beside + (square * shared[0] * shared[0] / pivot if days else 0.0)
        log_root[k] = log_beside + 0.5 * log_pivots
    return said, log_root

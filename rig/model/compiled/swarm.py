"""Many parameter sets of the modified Bouc-Wen model (11) over many records at once: the kernel under the swarm.

Sixteen particles run side by side in two registers of eight, with their parameters and their state in registers over
the whole record; nothing is allocated, and a block of sixteen that has diverged stops early. `reference_errors` is the
same in plain numpy-free Python, for the tests and for readers.
"""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.model.compiled.lanes import (
    any_below,
    difference,
    fused,
    larger,
    load,
    magnitude,
    negative,
    product,
    spread,
    store,
)
from rig.model.compiled.machine_code import kernel
from rig.record import Column

Table = NDArray[np.float64]
BLOCK = 16
"""Particles that run side by side; a swarm is padded to a multiple."""
LAW = ("lambda1", "lambda2", "xi1", "xi2", "phi1", "phi2", "beta1", "beta2")
"""The parameters of (11), one row each in a table of particles; a ninth row is the offset of the output."""
HOPELESS = 1e12
"""A sum of squares (or a peak) beyond this is reported as this: finite, and worse than anything that is bounded."""
_CHECK_EVERY = 256
"""Steps between two looks at whether a block has diverged."""


@dataclass(frozen=True)
class SwarmInputs:
    """Records laid end to end as the kernel reads them, in the units of the model."""

    u: Column
    """Input over theta's divisor."""
    nu: Column
    """|u_k - u_{k-1}| in units of u; whatever stands at the first row of a record is not used."""
    y: Column
    """Measured output in units of y."""
    ends: NDArray[np.int64]
    """Row after the last of each record, opened by 0: record i is ends[i] .. ends[i + 1]."""
    scored_from: NDArray[np.int64]
    """First row of each record that counts in its error."""

    @property
    def steps(self) -> int:
        """Model steps that one particle takes."""
        return int(self.ends[-1]) - (len(self.ends) - 1)


def lay_inputs(u: Sequence[Column], y: Sequence[Column], divisor_s: float, skip: Sequence[int]) -> SwarmInputs:
    """Inputs from each record's u and y (in the model's units); the first `skip` rows of a record do not count."""
    ends = np.concatenate([[0], np.cumsum([len(column) for column in u])])
    nu = [np.abs(np.diff(column, prepend=column[0])) for column in u]
    start = ends[:-1] + np.maximum(1, skip)
    return SwarmInputs(np.concatenate(u) / divisor_s, np.concatenate(nu), np.concatenate(y), ends, start)


@kernel(inline="always")
def _read_law(table: Any, stride: Any, at: Any) -> Any:
    """The eight parameters of eight particles; those that (11) subtracts come negated."""
    return (
        load(table, at),
        negative(load(table, stride + at)),
        load(table, 2 * stride + at),
        load(table, 3 * stride + at),
        negative(load(table, 4 * stride + at)),
        negative(load(table, 5 * stride + at)),
        negative(load(table, 6 * stride + at)),
        negative(load(table, 7 * stride + at)),
    )


@kernel(inline="always")
def _advance(y: Any, law: Any, u_now: Any, u_last: Any, nu: Any) -> Any:
    """One step of (11) for eight particles."""
    theta = fused(law[1], u_last, u_now)
    keep = fused(fused(law[5], nu, law[4]), magnitude(theta), law[0])
    push = product(fused(law[3], nu, law[2]), theta)
    lean = product(fused(law[7], nu, law[6]), theta)
    return fused(lean, magnitude(y), fused(keep, y, push))


@kernel(nogil=True)
def _errors(
    table: Any, stride: Any, first: Any, last: Any, u: Any, nu: Any, y: Any, ends: Any, scored_from: Any, out: Any
) -> None:
    """Sums of squared errors of the particles first .. last into out[record * stride + particle]."""
    hopeless = spread(HOPELESS)
    for a in range(first, last, BLOCK):
        b = a + BLOCK // 2
        law_a, law_b = _read_law(table, stride, a), _read_law(table, stride, b)
        offset_a, offset_b = load(table, 8 * stride + a), load(table, 8 * stride + b)
        for record in range(len(ends) - 1):
            row = ends[record]
            y_a, y_b = difference(spread(y[row]), offset_a), difference(spread(y[row]), offset_b)
            sum_a, sum_b = spread(0.0), spread(0.0)
            before = spread(u[row])
            row += 1
            while row < ends[record + 1]:
                stop = min(row + _CHECK_EVERY, scored_from[record] if row < scored_from[record] else ends[record + 1])
                for k in range(row, min(stop, ends[record + 1])):
                    now, change, wanted = spread(u[k]), spread(nu[k]), spread(y[k])
                    y_a, y_b = _advance(y_a, law_a, now, before, change), _advance(y_b, law_b, now, before, change)
                    miss_a, miss_b = (
                        difference(difference(wanted, offset_a), y_a),
                        difference(difference(wanted, offset_b), y_b),
                    )
                    sum_a, sum_b = fused(miss_a, miss_a, sum_a), fused(miss_b, miss_b, sum_b)
                    before = now
                row = stop
                if not (any_below(sum_a, hopeless) or any_below(sum_b, hopeless)):
                    break
                if row <= scored_from[record]:
                    sum_a, sum_b = spread(0.0), spread(0.0)
            store(out, record * stride + a, sum_a)
            store(out, record * stride + b, sum_b)


@kernel(nogil=True)
def _peaks(table: Any, stride: Any, first: Any, last: Any, u: Any, nu: Any, ends: Any, out: Any) -> None:
    """Largest |y| of the particles first .. last from rest, into out[record * stride + particle]."""
    hopeless = spread(HOPELESS)
    for a in range(first, last, BLOCK):
        b = a + BLOCK // 2
        law_a, law_b = _read_law(table, stride, a), _read_law(table, stride, b)
        for record in range(len(ends) - 1):
            row = ends[record]
            y_a, y_b, peak_a, peak_b = spread(0.0), spread(0.0), spread(0.0), spread(0.0)
            before = spread(u[row])
            row += 1
            while row < ends[record + 1]:
                for k in range(row, min(row + _CHECK_EVERY, ends[record + 1])):
                    now, change = spread(u[k]), spread(nu[k])
                    y_a, y_b = _advance(y_a, law_a, now, before, change), _advance(y_b, law_b, now, before, change)
                    peak_a, peak_b = larger(magnitude(y_a), peak_a), larger(magnitude(y_b), peak_b)
                    before = now
                row += _CHECK_EVERY
                if not (any_below(peak_a, hopeless) or any_below(peak_b, hopeless)):
                    break
            store(out, record * stride + a, peak_a)
            store(out, record * stride + b, peak_b)


@kernel(nogil=True)
def _courses(
    table: Any, stride: Any, first: Any, last: Any, u: Any, nu: Any, y: Any, ends: Any, kept: Any, out: Any
) -> None:
    """The output of the particles first .. last at the rows `kept` (rising, closed by -1), into out[which * stride +
    particle]."""
    for a in range(first, last, BLOCK):
        b = a + BLOCK // 2
        law_a, law_b = _read_law(table, stride, a), _read_law(table, stride, b)
        offset_a, offset_b = load(table, 8 * stride + a), load(table, 8 * stride + b)
        which = 0
        for record in range(len(ends) - 1):
            row = ends[record]
            y_a, y_b = difference(spread(y[row]), offset_a), difference(spread(y[row]), offset_b)
            before = spread(u[row])
            for k in range(row, ends[record + 1]):
                if k > row:
                    now, change = spread(u[k]), spread(nu[k])
                    y_a, y_b = _advance(y_a, law_a, now, before, change), _advance(y_b, law_b, now, before, change)
                    before = now
                if k == kept[which]:
                    store(out, which * stride + a, y_a)
                    store(out, which * stride + b, y_b)
                    which += 1


def swarm_errors(particles: Table, inputs: SwarmInputs, workers: int = 1) -> Table:
    """Sum of squared errors of each particle on each record, shape (records, particles), in units of y squared; never
    NaN.

    `particles` has the shape (9, particles): the rows of LAW and the offset of the output. Every record starts at its
    first measured output. A diverging set scores HOPELESS.
    """
    table, stride = _padded(particles)
    out = np.full((len(inputs.ends) - 1) * stride, HOPELESS)
    _spread_over(
        workers,
        stride,
        lambda a, b: _errors(table, stride, a, b, inputs.u, inputs.nu, inputs.y, inputs.ends, inputs.scored_from, out),
    )
    return _finite(out.reshape(-1, stride)[:, : particles.shape[1]])


def swarm_courses(particles: Table, inputs: SwarmInputs, rows: NDArray[np.int64]) -> Table:
    """The output of each particle at these rows (rising), offset aside, shape (particles, rows), in units of y; neither
    finite nor bounded where a set diverges. Every record starts at its first measured output."""
    table, stride = _padded(particles)
    out = np.empty(len(rows) * stride)
    kept = np.append(rows, -1)
    _courses(table, stride, 0, stride, inputs.u, inputs.nu, inputs.y, inputs.ends, kept, out)
    return out.reshape(-1, stride)[:, : particles.shape[1]].T


def swarm_peaks(particles: Table, inputs: SwarmInputs) -> Table:
    """Largest |y| of each particle on each record from rest, shape (records, particles), in units of y; never NaN."""
    table, stride = _padded(particles)
    out = np.full((len(inputs.ends) - 1) * stride, HOPELESS)
    _peaks(table, stride, 0, stride, inputs.u, inputs.nu, inputs.ends, out)
    return _finite(out.reshape(-1, stride)[:, : particles.shape[1]])


def reference_errors(particle: Sequence[float], inputs: SwarmInputs) -> list[float]:
    """The sums of one particle, straight from (11): what the kernel must agree with to rounding."""
    lambda1, lambda2, xi1, xi2, phi1, phi2, beta1, beta2, offset = particle
    sums = []
    for record in range(len(inputs.ends) - 1):
        first, last = int(inputs.ends[record]), int(inputs.ends[record + 1])
        y, total = float(inputs.y[first]) - offset, 0.0
        for k in range(first + 1, last):
            nu, theta = float(inputs.nu[k]), float(inputs.u[k]) - lambda2 * float(inputs.u[k - 1])
            y = (
                lambda1 * y
                + (xi1 + xi2 * nu) * theta
                - (phi1 + phi2 * nu) * abs(theta) * y
                - (beta1 + beta2 * nu) * theta * abs(y)
            )
            if k >= inputs.scored_from[record]:
                miss = float(inputs.y[k]) - offset - y
                total += miss * miss  # a power of Python's raises where a product is infinite
        sums.append(total if total < HOPELESS else HOPELESS)
    return sums


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _padded(particles: Table) -> tuple[Table, int]:
    """The particles as one flat row, padded to whole blocks with sets that stay at rest."""
    count = particles.shape[1]
    stride = -(-count // BLOCK) * BLOCK
    table = np.zeros((9, stride))
    table[:, :count] = particles
    return table.reshape(-1), stride


def _spread_over(workers: int, stride: int, run: Any) -> None:
    """Run blocks of particles on so many threads; the kernels hold no interpreter lock."""
    blocks = stride // BLOCK
    share = -(-blocks // max(1, min(workers, blocks))) * BLOCK
    cuts = range(0, stride, share)
    if len(cuts) == 1:
        run(0, stride)
        return
    list(_threads(len(cuts), os.getpid()).map(lambda a: run(a, min(a + share, stride)), cuts))


@cache
def _threads(count: int, _pid: int) -> ThreadPoolExecutor:
    """Threads that stay: the kernel puts a new one beside who made it, and spreads them over the cores too late for a
    work of milliseconds. A forked process has its own."""
    return ThreadPoolExecutor(count)


def _finite(values: Table) -> Table:
    return np.asarray(np.fmin(values, HOPELESS))

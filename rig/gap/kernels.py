"""Compiled inner loops of the diagnosis: the nominal regulator, the carrier of the muscles' response, Maxwell-slip elements.

The effects themselves are compiled from `rig.model.effect_stages` by `rig.model.kernels`; nothing here is an effect.
"""

from math import exp, floor

import numpy as np
from numba import njit

from rig.model.joint_balance import LOOP_RADII_DEG
from rig.record import Column

LAGS_S = (0.02, 0.05, 0.12, 0.3, 1.0, 4.0)
PLAYS_MPA = (0.005, 0.015, 0.04, 0.08, 0.13)
CARRIER_TERMS = 12 + len(PLAYS_MPA)


@njit(cache=True, nogil=True)
def regulated(u: Column, dead_s: float, fill_s: float, exhaust_s: float, dt_s: float) -> Column:  # pragma: no cover
    """A regulator's pressure under set-points u (n,): dead time, then a first-order lag, apart for filling and exhausting."""
    n = len(u)
    out = np.empty(n)
    state = u[0]
    fill, exhaust = 1.0 - exp(-dt_s / fill_s), 1.0 - exp(-dt_s / exhaust_s)
    for i in range(n):
        at = i - dead_s / dt_s
        whole = int(floor(at))  # noqa: RUF046 (numba's floor gives a float)
        part = at - whole
        if whole < 0:
            goal = u[0]
        elif whole >= n - 1:
            goal = u[n - 1]
        else:
            goal = (1.0 - part) * u[whole] + part * u[whole + 1]
        state += (fill if goal > state else exhaust) * (goal - state)
        out[i] = state
    return out


@njit(cache=True, nogil=True)
def carrier_terms(p1: Column, p2: Column, p0: float, dt_s: float, out: Column) -> None:  # pragma: no cover
    """The bank: powers, low-passes and plays of the drive d = (p1 - p2) 2 P0 / (p1 + p2); fills out (n, CARRIER_TERMS)."""
    lags = np.zeros(6)
    keep = np.empty(6)
    for j in range(6):
        keep[j] = 1.0 - exp(-dt_s / LAGS_S[j])
    plays = np.zeros(5)
    for i in range(len(p1)):
        total = max(p1[i] + p2[i], 0.2 * p0)
        d = (p1[i] - p2[i]) * 2.0 * p0 / total
        if i == 0:
            lags[:] = d
            plays[:] = d
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = 1.0, d, d * d, d * d * d
        for j in range(6):
            lags[j] += keep[j] * (d - lags[j])
            out[i, 4 + j] = lags[j]
        slow = lags[1]
        out[i, 10], out[i, 11] = slow * slow, slow * slow * slow
        for j in range(5):
            plays[j] = min(max(plays[j], slow - PLAYS_MPA[j]), slow + PLAYS_MPA[j])
            out[i, 12 + j] = plays[j]


@njit(cache=True, nogil=True)
def carried(p1: Column, p2: Column, p0: float, dt_s: float, weights: Column) -> Column:  # pragma: no cover
    """The carrier's angle (n,): `carrier_terms` times weights, without storing them."""
    out = np.empty(len(p1))
    lags = np.zeros(6)
    keep = np.empty(6)
    for j in range(6):
        keep[j] = 1.0 - exp(-dt_s / LAGS_S[j])
    plays = np.zeros(5)
    for i in range(len(p1)):
        total = max(p1[i] + p2[i], 0.2 * p0)
        d = (p1[i] - p2[i]) * 2.0 * p0 / total
        if i == 0:
            lags[:] = d
            plays[:] = d
        angle = weights[0] + d * (weights[1] + d * (weights[2] + d * weights[3]))
        for j in range(6):
            lags[j] += keep[j] * (d - lags[j])
            angle += weights[4 + j] * lags[j]
        slow = lags[1]
        angle += slow * slow * (weights[10] + weights[11] * slow)
        for j in range(5):
            plays[j] = min(max(plays[j], slow - PLAYS_MPA[j]), slow + PLAYS_MPA[j])
            angle += weights[12 + j] * plays[j]
        out[i] = angle
    return out


@njit(cache=True, nogil=True)
def square_sum(column: Column) -> float:  # pragma: no cover
    """Sum of squares. Not numpy's: a threaded BLAS costs more than it gives on columns of this length."""
    total = 0.0
    for i in range(len(column)):
        total += column[i] * column[i]
    return total


@njit(cache=True, nogil=True)
def whitened(residual: Column, modes: Column, to_sizes: Column, precision: Column, scale: float) -> Column:  # pragma: no cover
    """Residual less its modes, scaled, then the modes' sizes by their precision: (n + m,) whose sum of squares is chi-square."""
    n, m = modes.shape
    out = np.empty(n + m)
    sizes = np.zeros(m)
    for i in range(n):
        for j in range(m):
            sizes[j] += to_sizes[i, j] * residual[i]
    for i in range(n):
        left = residual[i]
        for j in range(m):
            left -= modes[i, j] * sizes[j]
        out[i] = left * scale
    for j in range(m):
        out[n + j] = sizes[j] * precision[j]
    return out


@njit(cache=True, nogil=True)
def normal(slopes: Column, residual: Column, parts: Column, count: int) -> tuple[Column, Column, Column]:  # pragma: no cover
    """For each part of the rows: slopes' slopes (count, k, k), slopes' residual (count, k), residual's residual (count,)."""
    n, k = slopes.shape
    grams, pulls, costs = np.zeros((count, k, k)), np.zeros((count, k)), np.zeros(count)
    for i in range(n):
        part = int(parts[i])
        costs[part] += residual[i] * residual[i]
        for a in range(k):
            pulls[part, a] += slopes[i, a] * residual[i]
            for b in range(k):
                grams[part, a, b] += slopes[i, a] * slopes[i, b]
    return grams, pulls, costs


@njit(cache=True, nogil=True)
def stops(y: Column, radius: float) -> Column:  # pragma: no cover
    """The deflection (n,) of a Maxwell-slip element that slips after `radius`, carried along by y."""
    out = np.empty(len(y))
    state = 0.0
    last = y[0]
    for i in range(len(y)):
        state = min(max(state + y[i] - last, -radius), radius)
        last = y[i]
        out[i] = state
    return out


@njit(cache=True, nogil=True)
def pushed(
    y: Column, push: Column, soft: Column, loop: Column, drag_s: float, sway_s: float, dt_s: float
) -> Column:  # pragma: no cover
    """The joint's angle (n,) when its balance y is pulled `push` degrees further and its friction counts `soft` times (both (n,)).

    The balance is that of `rig.model.effect_stages.joint.balance_again`: Maxwell-slip elements `loop`, drag and mass over the stiffness.
    """
    count = len(loop)
    was, now = np.zeros(count), np.zeros(count)
    out = np.empty(len(y))
    old, rate, last, speed = y[0] + push[0], 0.0, y[0], 0.0
    for i in range(len(y)):
        step = y[i] - last
        pull = y[i] + push[i] + drag_s * step / dt_s + sway_s * sway_s * (step / dt_s - speed) / dt_s
        for j in range(count):
            was[j] = min(max(was[j] + step, -LOOP_RADII_DEG[j]), LOOP_RADII_DEG[j])
            pull += loop[j] * was[j]
        last, speed = y[i], step / dt_s
        drag, mass = soft[i] * drag_s / dt_s, soft[i] * sway_s * sway_s / dt_s
        new = old + rate * dt_s
        for _ in range(12):
            move = new - old
            miss = new + drag * move + mass * (move / dt_s - rate) - pull
            slope = 1.0 + drag + mass / dt_s
            for j in range(count):
                there = now[j] + move
                miss += soft[i] * loop[j] * min(max(there, -LOOP_RADII_DEG[j]), LOOP_RADII_DEG[j])
                slope += soft[i] * loop[j] if abs(there) < LOOP_RADII_DEG[j] else 0.0
            change = miss / slope
            new -= change
            if abs(change) < 1e-7:
                break
        move = new - old
        for j in range(count):
            now[j] = min(max(now[j] + move, -LOOP_RADII_DEG[j]), LOOP_RADII_DEG[j])
        old, rate = new, move / dt_s
        out[i] = new
    return out

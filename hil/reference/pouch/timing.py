"""What becomes of set-points and of readings in time, by this family's laws: waits that go on, regulators that hear in
turns, a clock that is set anew, losses where much changes."""

from typing import Final

import numpy as np
from numpy.random import Generator

from hil.reference.arrival import in_force, read_off
from hil.reference.compiling import Array
from hil.reference.noise import coloured
from hil.reference.pouch.disturbance import TimingLaw

SET_POINT_NOISE_MPA: Final = 0.00010
CONVERTER_MPA: Final = 0.5 / 16_384
"""Code of a set-point's telegram."""
WRITE_S: Final = 0.0012
"""Until a set-point is at the regulator's input, in a healthy rig too."""
WAIT_SPREAD: Final = 0.4
"""Standard deviation of a wait's logarithm."""
WAITED: Final = 0.35
"""Share of the mean delay that is waited for, more and less."""
RATES: Final = 0.5
"""Standard deviation of a clock's rate from one setting to the next, against its mean."""
MOST_LOST: Final = 0.97


def arrivals_s(n: int, period_s: float, law: TimingLaw, random: Generator) -> Array:
    """When each of n set-points, sent once a period, takes effect: shape (n,), never falling. Waits are lognormal, as
    measured on networks (Antoniou and others 2002), and a long one goes on for a while."""
    sent = np.arange(n) * period_s
    if law.delay_s <= 0.0:
        return np.asarray(sent + WRITE_S)
    waits = WAITED * law.delay_s * np.exp(coloured(n, WAIT_SPREAD, law.delay_goes_on_s, period_s, random))
    arrival_s = np.maximum.accumulate(sent + waits)
    return np.asarray(arrival_s + WRITE_S + law.delay_s - float(np.mean(arrival_s - sent)))


def heard(n: int, period_s: float, turns_s: float, turn: int) -> Array:
    """Which of n set-points (rows, shape (n,)) a regulator goes by that hears every other turn: `turn` 0 begins."""
    rows = np.arange(n)
    hears = np.floor(rows * period_s / turns_s + 1e-9).astype(int) % 2 == turn
    hears[0] = True
    return np.asarray(np.maximum.accumulate(np.where(hears, rows, 0)))


def set_points(
    p1_mpa: Array, p2_mpa: Array, substeps: int, period_s: float, law: TimingLaw, random: Generator
) -> tuple[Array, Array]:
    """Both set-points on the internal grid: the newest one that has arrived, at first the first, in a telegram's codes,
    with noise of the reference."""
    n = len(p1_mpa)
    rows = in_force(arrivals_s(n, period_s, law, random), substeps, period_s)
    noisy = []
    for turn, p in enumerate((p1_mpa, p2_mpa)):
        asked = p[heard(n, period_s, law.turns_s, turn)] if law.turns_s > 0.0 else p
        codes = np.floor(asked / CONVERTER_MPA + 0.5) * CONVERTER_MPA
        noisy.append(codes + coloured(n, SET_POINT_NOISE_MPA, 0.008, period_s, random))
    return np.asarray(noisy[0][rows]), np.asarray(noisy[1][rows])


def set_anew_s(t: Array, every_s: float, random: Generator) -> Array:
    """By how many seconds a clock of mean rate 1 is ahead whose rate is set anew now and then, at times of no order: at
    the end by the whole time."""
    times, rates = [0.0], [max(0.1, 1.0 + RATES * float(random.standard_normal()))]
    while times[-1] < t[-1]:
        times.append(times[-1] + float(random.exponential(every_s)) + 0.2)
        rates.append(max(0.1, 1.0 + RATES * float(random.standard_normal())))
    ahead = np.concatenate([[0.0], np.cumsum(np.diff(times) * np.array(rates[:-1]))])
    return np.asarray(np.interp(t, times, ahead) * t[-1] / float(np.interp(t[-1], times, ahead)))


def stamped(columns: Array, period_s: float, law: TimingLaw) -> Array:
    """Readings, shape (m, n), by a clock that is fast by `clock_rate` in the mean, resampled linearly."""
    if law.clock_rate == 0.0:
        return columns
    t = np.arange(columns.shape[1], dtype=np.float64) * period_s
    settings = np.random.default_rng(round(1e6 * law.clock_set_s))
    return read_off(columns, period_s, law.clock_rate * set_anew_s(t, law.clock_set_s, settings))


def chances(angle_deg: Array, share: float, busy: float) -> Array:
    """How likely each reading (n,) is lost, in the mean by that share: telegrams hold what has changed, and the longer
    ones are lost more often."""
    change = np.abs(np.gradient(angle_deg))
    weight = 1.0 - busy + busy * change / max(1e-9, float(np.mean(change)))
    low, high = 0.0, 40.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        if np.mean(np.minimum(MOST_LOST, middle * weight)) < share:
            low = middle
        else:
            high = middle
    return np.asarray(np.minimum(MOST_LOST, high * weight))


def lost(columns: Array, law: TimingLaw, random: Generator) -> Array:
    """Readings (p1, p2, angle), shape (3, n), in whose place the last one stands that came through."""
    if law.lost_share <= 0.0:
        return columns
    n: int = columns.shape[1]
    smooth = np.convolve(columns[2], np.full(9, 1.0 / 9.0), mode="same") if n > 9 else columns[2]
    gone = random.random(n) < chances(smooth, law.lost_share, law.lost_busy)
    gone[0] = False
    last = np.maximum.accumulate(np.where(gone, 0, np.arange(n)))
    for row in columns if law.lost_all > 0.0 else columns[2:]:
        row[:] = row[last]
    return columns

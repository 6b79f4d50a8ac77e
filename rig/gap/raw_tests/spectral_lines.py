"""Lines in the spectrum of what the smoothing takes off the angle: the mains', and any other that stands alone."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, median_filter
from scipy.signal import filtfilt, iirnotch, periodogram

from rig.gap.raw_tests.signature import SMOOTHED, Signature
from rig.gap.records.pairs import SMOOTHING_S
from rig.record import Column, Record

LINES_HZ = (50.0, 60.0)
TONE_FROM_HZ, TONE_AROUND_HZ = 20.0, 8.0
"""Lines are looked for above the motion's own, and compared with what lies within so much around them."""
TONE_CLEAR, TONE_ALONE, TONE_MORE = 6.0, 3.0, 2.0
"""How many times a line's amplitude must exceed what lies around it, every other line (the motion's multiples come in rows), and the
baselines'."""


class Spectrum(NamedTuple):
    """What the smoothing takes off one record's angle."""

    rate_hz: float
    frequency_hz: Column
    power_deg2: Column


def fast_spectra(records: Sequence[Record]) -> list[Spectrum]:
    """The spectrum of each record that has an angle."""
    return [_fast_spectrum(record) for record in records if record.angle_deg is not None]


def mains_line(cases: Sequence[Spectrum], sessions: Sequence[Sequence[Spectrum]]) -> Signature:
    """A line at 50 or 60 Hz that stands out, and more so than in the baselines."""
    best = (0.0, 0.0, 50.0)
    for line in LINES_HZ:
        amplitude, beside = _line(cases, line)
        if amplitude > best[0]:
            best = (amplitude, beside, line)
    amplitude, beside, line = best
    base = max((_line(session, line)[0] for session in sessions), default=0.0)
    found = amplitude > 6.0 * beside and amplitude > 2.0 * base and amplitude > 0.0
    size = float(np.sqrt(max(amplitude**2 - base**2, 0.0)))
    text = f"a line of {amplitude:.3g} deg at {line:.0f} Hz, {base:.3g} deg in the baselines, {beside:.2g} deg beside it"
    return Signature(
        "mains line",
        "mains_hum",
        found,
        amplitude,
        base,
        "deg",
        text,
        {"amplitude_deg": size, "frequency_hz": line},
        0.5 * size**2 if found else 0.0,
        SMOOTHED * 0.5 * size**2 if found else 0.0,
    )


def lone_line(cases: Sequence[Spectrum], sessions: Sequence[Sequence[Spectrum]]) -> Signature:
    """A line that stands alone where no mains line is: no effect of the library makes it, but noise it is not either."""
    grid, own = _usual_spectrum(cases)
    usual = np.zeros_like(own)
    for session in sessions:
        frequency, power = _usual_spectrum(session)
        usual = np.maximum(usual, np.interp(grid, frequency, power, right=0.0))
    stands = np.where(_free_of_mains(grid), own, 0.0)
    k = int(np.argmax(stands))
    around = median_filter(own, max(3, round(TONE_AROUND_HZ / float(grid[1]))), mode="nearest")[k]
    others = float(np.max(np.where(np.abs(grid - grid[k]) > 1.0, stands, 0.0)))
    found = bool(stands[k] > max(TONE_CLEAR**2 * around, TONE_ALONE**2 * others, TONE_MORE**2 * usual[k]))
    amplitude = float(np.sqrt(2.0 * max(own[k] - usual[k], 0.0)))
    text = f"the strongest line that is no mains line: {amplitude:.3g} deg at {grid[k]:.1f} Hz"
    added = 0.5 * amplitude**2 if found else 0.0
    numbers = {"amplitude_deg": amplitude, "frequency_hz": float(grid[k])}
    return Signature(
        "tone", None, found, amplitude, float(np.sqrt(2.0 * usual[k])), "deg", text, numbers, added, SMOOTHED * added
    )


def _usual_spectrum(spectra: Sequence[Spectrum]) -> tuple[Column, Column]:
    """Frequency (Hz) and the median power (deg^2) of records: what only some of them show, their motion, is not in it."""
    grid = max((one.frequency_hz for one in spectra), key=len)
    return grid, np.median([np.interp(grid, one.frequency_hz, one.power_deg2, right=0.0) for one in spectra], axis=0)


def _free_of_mains(frequency_hz: Column) -> NDArray[np.bool_]:
    """Where a line that is not the mains' may stand: above the motion, beside the mains lines and their odd multiples."""
    rate = 2.0 * float(frequency_hz[-1])
    mains = np.array([_alias(multiple * line, rate) for line in LINES_HZ for multiple in (1, 3, 5)])
    near = np.abs(frequency_hz[:, None] - mains).min(axis=1)
    free: NDArray[np.bool_] = (frequency_hz > TONE_FROM_HZ) & (frequency_hz < 0.5 * rate - 1.0) & (near > 1.0)
    return free


def _line(spectra: Sequence[Spectrum], line_hz: float) -> tuple[float, float]:
    """Amplitude of a mains line in the angle and the usual amplitude beside it; 0, 0 when the sampling cannot show it."""
    lines, besides = [], []
    for rate, frequency, power in spectra:
        alias = _alias(line_hz, rate)
        if alias < 8.0 or alias > 0.5 * rate - 1.0:
            continue
        near = np.abs(frequency - alias)
        lines.append(float(power[near < 0.6].max()))
        besides.append(float(np.median(power[(near > 1.0) & (near < 8.0)])))
    if not lines:
        return 0.0, 0.0
    return float(np.sqrt(2 * np.median(lines))), float(np.sqrt(2 * np.median(besides)))


def _fast_spectrum(record: Record) -> Spectrum:
    assert record.angle_deg is not None
    rate = 1.0 / record.period_s
    grid = record.t_s[0] + np.arange(len(record)) / rate
    known = np.isfinite(record.angle_deg)
    angle = np.interp(grid, record.t_s[known], record.angle_deg[known])
    rest = angle - gaussian_filter1d(angle, SMOOTHING_S * rate)
    frequency, power = periodogram(rest, rate, window="hann", scaling="spectrum")
    return Spectrum(rate, frequency, power)


def _alias(line_hz: float, rate_hz: float) -> float:
    """Where a line shows at this sampling."""
    return abs(line_hz - rate_hz * round(line_hz / rate_hz))


def without_line(record: Record, line_hz: float) -> Column:
    """The angle with a narrow notch at the line."""
    assert record.angle_deg is not None
    rate = 1.0 / record.period_s
    alias = _alias(line_hz, rate)
    numerator, denominator = iirnotch(alias, alias / 4.0, rate)
    left: Column = filtfilt(numerator, denominator, record.angle_deg[np.isfinite(record.angle_deg)])
    return left

"""Lines in the spectrum of what the smoothing takes off the angle: the mains', and any other that stands alone."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rig.columns import filled_in
from rig.gap.raw_tests.settings import (
    BESIDE_FROM_HZ,
    BESIDE_TO_HZ,
    HANN_BINS,
    HANN_LOBE,
    HANN_LOSS,
    HIGHEST_MARGIN_HZ,
    LEAST_AMPLITUDE_LEFT,
    LINE_ALONE,
    LINE_CLEAR,
    LINE_MORE,
    LINE_WIDTH_HZ,
    LINES_HZ,
    LOWEST_LINE_HZ,
    MAINS_MULTIPLES,
    NOTCH_WIDTH_HZ,
    SIDEBAND_FROM_HZ,
    SIDEBANDS_ALIKE,
    SMOOTHED_VARIANCE,
    TONE_ALONE,
    TONE_AROUND_HZ,
    TONE_CLEAR,
    TONE_FROM_HZ,
    TONE_MORE,
)
from rig.gap.raw_tests.signature import Signature, Size, on_days
from rig.gap.raw_tests.statistics import about
from rig.identify.response.response_fit import SMOOTHING_S
from rig.record import Column, Record
from rig.smoothing import response_of_smoothing, running_median_at, smoothed


class Spectrum(NamedTuple):
    """One record's angle above what the smoothing leaves of its motion."""

    rate_hz: float
    frequency_hz: Column
    power_deg2: Column
    """As it was before the motion was taken off, where that leaves anything."""


def fast_spectra(records: Sequence[Record]) -> list[Spectrum]:
    """The spectrum of each record that has an angle."""
    return [_fast_spectrum(record) for record in records if record.angle_deg is not None]


def mains_line(cases: Sequence[Spectrum], sessions: Sequence[Sequence[Spectrum]]) -> Signature:
    """A line at 50 or 60 Hz that stands out and alone, and more so than in the baselines."""
    hz, line = max(((hz, _line(cases, hz)) for hz in LINES_HZ), key=lambda each: each[1].amplitude_deg)
    base = max((_line(session, hz).amplitude_deg for session in sessions), default=0.0)
    own, beside = line.amplitude_deg, line.beside_deg
    found = own > max(LINE_CLEAR * beside, LINE_ALONE * line.strongest_deg, LINE_MORE * base)
    size = float(np.sqrt(max(own**2 - base**2, 0.0)))
    on_earlier = on_days(f"{base:.3g} deg", bool(sessions))
    text = f"a line of {own:.3g} deg at {hz:.0f} Hz{on_earlier}, {beside:.2g} deg beside it"
    sizes = {
        "amplitude_deg": about(size, line.spread_deg * own / max(size, 1e-12), 0.0),
        "frequency_hz": Size(hz, hz, hz),
    }
    more = sum(each**2 for each in overtones(cases, hz).values()) if found else 0.0
    beside_it = sidebands_deg2(cases, hz) if found else 0.0
    text += ", which comes and goes" if beside_it else ""
    added = 0.5 * (size**2 + more) + beside_it if found else 0.0
    return Signature(
        "mains line",
        "mains_hum",
        found,
        value=own,
        baseline=base,
        unit="deg",
        text=text,
        sizes=sizes,
        p_value=line.p_value,
        variance_deg2=added,
        smoothed_deg2=SMOOTHED_VARIANCE * added,
    )


def spurious_tone(cases: Sequence[Spectrum], sessions: Sequence[Sequence[Spectrum]]) -> Signature:
    """A line that stands alone where no mains line is: no effect of the library makes it, but noise it is not
    either."""
    grid, own = _usual_spectrum(cases)
    usual = np.zeros_like(own)
    for session in sessions:
        frequency, power = _usual_spectrum(session)
        usual = np.maximum(usual, np.interp(grid, frequency, power, right=0.0))
    free = _free_of_mains(grid)
    stands = np.where(free, own, 0.0)
    k = int(np.argmax(stands))
    around = running_median_at(own, k, max(3, round(TONE_AROUND_HZ / float(grid[1]))))
    others = float(np.max(np.where(np.abs(grid - grid[k]) > BESIDE_FROM_HZ, stands, 0.0)))
    found = bool(stands[k] > max(TONE_CLEAR**2 * around, TONE_ALONE**2 * others, TONE_MORE**2 * usual[k]))
    amplitude = float(np.sqrt(2.0 * max(own[k] - usual[k], 0.0)))
    text = f"the strongest line that is no mains line: {amplitude:.3g} deg at {grid[k]:.1f} Hz"
    added = 0.5 * amplitude**2 if found else 0.0
    half_bin = 0.5 * float(grid[1])
    sizes = {
        "amplitude_deg": about(amplitude, float(np.sqrt(around / np.log(2.0))), 0.0),
        "frequency_hz": Size(float(grid[k]), float(grid[k]) - half_bin, float(grid[k]) + half_bin),
    }
    return Signature(
        "spurious tone",
        None,
        found,
        value=amplitude,
        baseline=float(np.sqrt(2.0 * usual[k])),
        unit="deg",
        text=text,
        sizes=sizes,
        p_value=_by_chance(float(own[k]), around, int(free.sum())),
        variance_deg2=added,
        smoothed_deg2=SMOOTHED_VARIANCE * added,
    )


def _by_chance(power: float, median: float, lines: int) -> float:
    """Probability that the strongest of so many lines of noise is as strong: their power is exponential, its mean
    median / ln 2. 1 where there is none to be looked at."""
    if lines == 0:
        return 1.0
    return float(min(lines * np.exp(-min(np.log(2.0) * power / max(median, 1e-30), 700.0)), 1.0))


def _usual_spectrum(spectra: Sequence[Spectrum]) -> tuple[Column, Column]:
    """Frequency (Hz) and the median power (deg^2) of records: what only some of them show, their motion, is not in
    it."""
    grid = max((one.frequency_hz for one in spectra), key=len)
    return grid, np.median([np.interp(grid, one.frequency_hz, one.power_deg2, right=0.0) for one in spectra], axis=0)


def _free_of_mains(frequency_hz: Column) -> NDArray[np.bool_]:
    """Where a line that is not the mains' may stand: above the motion, beside the mains lines and their multiples."""
    rate = 2.0 * float(frequency_hz[-1])
    mains = np.array([_alias(multiple * line, rate) for line in LINES_HZ for multiple in MAINS_MULTIPLES])
    near = np.abs(frequency_hz[:, None] - mains).min(axis=1)
    free: NDArray[np.bool_] = (
        (frequency_hz > TONE_FROM_HZ) & (frequency_hz < 0.5 * rate - HIGHEST_MARGIN_HZ) & (near > BESIDE_FROM_HZ)
    )
    return free


class _Line(NamedTuple):
    """A line in the angle, over all records that can show it; all 0 when none can."""

    amplitude_deg: float
    beside_deg: float
    """The usual amplitude beside it."""
    strongest_deg: float
    """The strongest line there, above what the motion hides."""
    spread_deg: float
    """Standard deviation of the amplitude: by the noise, and between records."""
    p_value: float


def overtones(cases: Sequence[Spectrum], line_hz: float) -> dict[float, float]:
    """The multiples (Hz) of a mains line that stand out as well, each where no other falls, with their amplitudes
    (deg): rectifiers make the even ones, saturated cores the odd ones, dimmers all."""
    found: dict[float, float] = {}
    for hz in (multiple * line_hz for multiple in MAINS_MULTIPLES[1:]):
        line = _line(cases, hz, margin_hz=0.0)
        if line.amplitude_deg > LINE_CLEAR * line.beside_deg and not _fall_together(cases, hz, (line_hz, *found)):
            found[hz] = line.amplitude_deg
    return found


def _fall_together(cases: Sequence[Spectrum], hz: float, others_hz: Sequence[float]) -> bool:
    """Whether the sampling folds a line onto one of the others in any of the records."""
    return any(
        abs(_alias(hz, case.rate_hz) - _alias(other, case.rate_hz)) < LINE_WIDTH_HZ
        for case in cases
        for other in others_hz
    )


def _line(spectra: Sequence[Spectrum], line_hz: float, margin_hz: float = HIGHEST_MARGIN_HZ) -> _Line:
    """A mains line where the sampling shows it, so far below half its rate."""
    lines, besides, strongest, bins = [], [], [], 0
    for rate, frequency, power in spectra:
        alias = _alias(line_hz, rate)
        if not _shows(alias, rate, margin_hz):
            continue
        near = np.abs(frequency - alias)
        lines.append(_peak(power, np.flatnonzero(near < LINE_WIDTH_HZ)))
        beside = (near > BESIDE_FROM_HZ) & (near < BESIDE_TO_HZ)
        besides.append(float(np.median(power[beside])))
        alone = power[beside & (frequency > LOWEST_LINE_HZ) & ~_paired(frequency, power, alias)]
        strongest.append(float(np.max(alone, initial=0.0)))
        bins += int(np.sum(near < LINE_WIDTH_HZ))
    if not lines:
        return _Line(0.0, 0.0, 0.0, 0.0, 1.0)
    power_deg2, beside_deg2 = float(np.median(lines)), float(np.median(besides))
    between = np.var(np.sqrt(2.0 * np.array(lines)))
    spread = np.sqrt(
        (beside_deg2 / np.log(2.0) + between) * 0.5 * np.pi / len(lines)
    )  # of a median: pi / 2 times a mean's variance
    return _Line(
        float(np.sqrt(2.0 * power_deg2)),
        float(np.sqrt(2.0 * beside_deg2)),
        float(np.sqrt(2.0 * np.median(strongest))),
        float(spread),
        _by_chance(power_deg2, beside_deg2, bins),
    )


def _paired(frequency: Column, power: Column, line_hz: float) -> NDArray[np.bool_]:
    """(n,) which lines are as strong as those as far from the line on its other side: the sidebands of one that comes
    and goes, as with a heater or a motor that is switched."""
    opposite = np.interp(2.0 * line_hz - frequency, frequency, power)
    alike: NDArray[np.bool_] = np.minimum(opposite, power) > SIDEBANDS_ALIKE * np.maximum(opposite, power)
    return alike


def sidebands_deg2(cases: Sequence[Spectrum], line_hz: float) -> float:
    """Mean square of the sidebands of a mains line, over the records that can show it (median); 0 where none stands
    out."""
    found = []
    for rate, frequency, power in cases:
        alias = _alias(line_hz, rate)
        if not _shows(alias, rate, 0.0):
            continue
        near = np.abs(frequency - alias)
        beside = (near > SIDEBAND_FROM_HZ) & (near < BESIDE_TO_HZ) & (frequency > LOWEST_LINE_HZ)
        usual = float(np.median(power[beside])) if beside.any() else 0.0
        leaks = _hann_leak(near / frequency[1]) ** 2 * _peak(power, np.flatnonzero(near < LINE_WIDTH_HZ))
        stand = beside & _paired(frequency, power, alias) & (power > np.maximum(LINE_CLEAR**2 * usual, leaks))
        found.append(float(np.sum(power[stand])) / HANN_BINS)
    return float(np.median(found)) if found else 0.0


def _hann_leak(rows: Column) -> Column:
    """The amplitude that a Hann window leaves of a steady line at most, as a share of it, so many rows off or up to one
    nearer, for the mains wander; all of it within the window's main lobe (Harris 1978)."""
    off = np.maximum(rows - 1.0, HANN_LOBE)
    out: Column = np.where(rows - 1.0 < HANN_LOBE, 1.0, 1.0 / (np.pi * off * (off**2 - 1.0)))
    return out


def _shows(alias_hz: float, rate_hz: float, margin_hz: float) -> bool:
    """Whether the sampling shows a line that it folds to there: above the motion, so far below half its rate."""
    return LOWEST_LINE_HZ <= alias_hz <= 0.5 * rate_hz - margin_hz


def _peak(power: Column, rows: NDArray[np.intp]) -> float:
    """The strongest of these rows, between them by a parabola through the logarithms: a Hann window loses 15 %
    there."""
    k = int(rows[np.argmax(power[rows])])
    if not 0 < k < len(power) - 1:
        return float(power[k])
    before, at, after = np.log(np.maximum(power[k - 1 : k + 2], 1e-30))
    bend = before - 2.0 * at + after
    higher = (before - after) ** 2 / (-8.0 * bend) if bend < 0.0 else 0.0
    return float(power[k] * np.exp(min(higher, HANN_LOSS)))


def _fast_spectrum(record: Record) -> Spectrum:
    assert record.angle_deg is not None
    rate = 1.0 / record.period_s
    grid = record.t_s[0] + np.arange(len(record)) / rate
    known = np.isfinite(record.angle_deg)
    angle = np.interp(grid, record.t_s[known], record.angle_deg[known])
    rest = angle - smoothed(angle, SMOOTHING_S * rate, mirrored=True)
    frequency: Column = np.fft.rfftfreq(len(rest), 1.0 / rate).astype(np.float64)
    kept = 1.0 - response_of_smoothing(SMOOTHING_S * rate, frequency / rate)
    return Spectrum(rate, frequency, _power(rest) / np.maximum(kept, LEAST_AMPLITUDE_LEFT) ** 2)


def _power(column: Column) -> Column:
    """(n // 2 + 1,) of each line under a Hann window, as the mean square of a sine there (Harris 1978)."""
    rows = len(column)
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(rows) / rows)
    power: Column = (np.abs(np.fft.rfft((column - column.mean()) * window)) / window.sum()) ** 2
    power[1 : len(power) if rows % 2 else -1] *= 2.0
    return power


def _alias(line_hz: float, rate_hz: float) -> float:
    """Where a line shows at this sampling."""
    return abs(line_hz - rate_hz * round(line_hz / rate_hz))


def without_lines(record: Record, lines_hz: Sequence[float], width_hz: float = NOTCH_WIDTH_HZ) -> Column:
    """(n,) the angle (deg) with a notch at each line: a narrow one, or what lies within a wider band taken off,
    sidebands and all."""
    assert record.angle_deg is not None
    rate, left = 1.0 / record.period_s, filled_in(record.angle_deg)
    for alias in dict.fromkeys(round(_alias(line_hz, rate), 6) for line_hz in lines_hz):
        left = _notched(left, alias, rate) if width_hz <= NOTCH_WIDTH_HZ else _without_band(left, alias, rate, width_hz)
    return left


def _without_band(column: Column, hz: float, rate_hz: float, width_hz: float) -> Column:
    slow = smoothed(column, SMOOTHING_S * rate_hz, mirrored=True)
    lines = np.fft.rfft(column - slow)
    lines[np.abs(np.fft.rfftfreq(len(column), 1.0 / rate_hz) - hz) < 0.5 * width_hz] = 0.0
    return slow + np.fft.irfft(lines, len(column))


def _notched(column: Column, hz: float, rate_hz: float) -> Column:
    from scipy.signal import filtfilt, iirnotch  # half a second to import, and only where a line was found

    if hz > 0.5 * rate_hz - NOTCH_WIDTH_HZ:  # no room for a notch: every other row turned over, it is what is slow
        turns = np.where(np.arange(len(column)) % 2, -1.0, 1.0)
        rows = rate_hz * np.sqrt(np.log(2.0)) / (np.pi * NOTCH_WIDTH_HZ)
        return column - turns * smoothed(turns * column, float(rows), mirrored=True)
    numerator, denominator = iirnotch(hz, hz / NOTCH_WIDTH_HZ, rate_hz)
    notched: Column = filtfilt(numerator, denominator, column)
    return notched

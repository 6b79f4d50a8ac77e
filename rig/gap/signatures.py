"""Effects that least squares is blind to, found by their marks in the raw records: lattice, repeats, mains line, noise, time stamps, wires.

Each test compares the case with its own baselines by medians and shares, so that a nominal converter's lattice or a nominal level of
noise is no finding. Without a baseline the marks must be plain.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import gaussian_filter1d, median_filter, uniform_filter1d
from scipy.signal import filtfilt, iirnotch, periodogram

from rig.gap.lost import angles_of, repeat_share, share_by_chance
from rig.gap.pairs import SMOOTHING_S, Pair
from rig.log.record import Column, Record

LINES_HZ = (50.0, 60.0)
TONE_FROM_HZ, TONE_AROUND_HZ = 20.0, 8.0
"""Lines are looked for above the motion's own, and compared with what lies within so much around them."""
TONE_CLEAR, TONE_ALONE = 6.0, 3.0
"""How many times a line's amplitude must exceed what lies around it, and every other line: the motion's multiples come in rows."""
LOST_JUMP = 1.2
"""Steps that the row after a repeat must go on by: 2 after a lost sample, 1 + 1/n after n in a row, 1 in a dead spot."""
LEAST_MOVING = 200
"""Rows that must move by more than the lattice before repeats among them count."""
LOST_MORE = 0.25
"""Repeats must exceed those of the baselines by this share of them: on a lattice they come and go with the speed."""
UNEVEN = 1.3
"""Codes of a converter are not quite even."""
SMOOTHED = 0.25
"""Share of a white disturbance's variance that the smoothing lets through, generously."""
CLEAR = 5.0
"""Standard deviations by which a share or a level must stand out."""


@dataclass(frozen=True)
class Signature:
    """One mark: what was looked for, what the case and the baselines show, and the effect it stands for."""

    mark: str
    effect: str | None
    found: bool
    value: float
    baseline: float
    unit: str
    text: str
    numbers: dict[str, float] = field(default_factory=dict)
    variance_deg2: float = 0.0
    """What the effect adds to the mean square of the angle."""
    smoothed_deg2: float = 0.0
    """What of it the smoothing lets through."""


def read_signatures(pairs: Sequence[Pair]) -> list[Signature]:
    """All marks of the case, the absent ones too: what was looked for is part of the evidence."""
    cases = [pair.raw for pair in pairs]
    count = min((len(pair.raw_baselines) for pair in pairs), default=0)
    sessions = [[pair.raw_baselines[k] for pair in pairs] for k in range(count)]
    lattice = _lattice(cases, sessions)
    repeats = _repeats(cases, sessions, lattice)
    hum = _hum(cases, sessions)
    tone = _tone(cases, sessions)
    noise = _noise(cases, sessions, lattice, repeats, [mark for mark in (hum, tone) if mark.found])
    return [lattice, repeats, hum, tone, noise, _stamps(cases, sessions), _common_mode(cases, sessions), *_wires(cases)]


def lattice_step(angles: Sequence[Column]) -> float:
    """Distance of the values that occur; 0 when the values are too many for a lattice to show."""
    steps = []
    for angle in angles:
        inner = angle[(angle > angle.min()) & (angle < angle.max())]  # a clipped sensor repeats its ends
        values = np.unique(np.round(inner, 7))
        if 3 <= len(values) < 0.5 * len(inner):
            gaps = np.diff(values)
            gaps = gaps[gaps > 0.2 * np.median(gaps)]
            steps.append(float(np.median(gaps)))
    return float(np.median(steps)) if len(steps) > 0.5 * len(angles) else 0.0


def _lattice(cases: Sequence[Record], sessions: Sequence[Sequence[Record]]) -> Signature:
    step = lattice_step(angles_of(cases))
    base = max((lattice_step(angles_of(session)) for session in sessions), default=0.0)
    noise = _level(cases)
    found = step > 1.6 * base and step > 1e-3 and (bool(sessions) or step > 3.0 * noise)
    added = max(step**2 - base**2, 0.0) / 12.0
    text = f"the angle takes values {step:.3g} deg apart, the baselines {base:.3g}" if step else "no lattice shows in the angle"
    through = UNEVEN * _rounding(sessions[0] if sessions else cases, step) if found else 0.0
    return Signature(
        "lattice", "quantisation", found, step, base, "deg", text, {"step_deg": step}, added if found else 0.0, through
    )


def _rounding(records: Sequence[Record], step: float) -> float:
    """Mean square of what rounding to the lattice leaves in the smoothed angle: much where the joint stays within one step."""
    parts = []
    for record, angle in zip(records, angles_of(records), strict=True):
        rows = SMOOTHING_S / record.period_s
        course = gaussian_filter1d(angle, max(rows, 1.0))
        parts.append(np.mean(gaussian_filter1d(step * np.round(course / step) - course, max(rows, 0.1)) ** 2))
    return float(np.mean(parts))


def _level(records: Sequence[Record]) -> float:
    return _high_level(angles_of(records))


def _high_level(angles: Sequence[Column]) -> float:
    """Noise by medians: of third differences, and of what a short running mean leaves (for noise that a filter has coloured)."""
    rests = [angle - uniform_filter1d(angle, 7) for angle in angles]
    rest = np.concatenate(rests)
    plain = float(1.4826 * np.median(np.abs(rest - np.median(rest))) / np.sqrt(6.0 / 7.0))
    return max(plain, _white_level(angles))


def _white_level(angles: Sequence[Column]) -> float:
    """White noise by medians of third differences, rows beside an exact repeat left out."""
    parts = []
    for angle in angles:
        third = np.diff(angle, 3)
        still = np.diff(angle) == 0
        beside = still[:-2] | still[1:-1] | still[2:] | np.concatenate([[False], still[:-3]])
        parts.append(third[~beside] if (~beside).sum() > 50 else third)
    together = np.concatenate(parts)
    return float(1.4826 * np.median(np.abs(together - np.median(together))) / np.sqrt(20.0))


def _repeats(cases: Sequence[Record], sessions: Sequence[Sequence[Record]], lattice: Signature) -> Signature:
    least = 1.2 * max(lattice.value, lattice.baseline)
    share, onward, rows = repeat_share(cases, least)
    if rows < LEAST_MOVING and not lattice.found:
        least = 0.0
        share, onward, rows = repeat_share(cases, least)
    usual = [repeat_share(session, least) for session in sessions]
    shares = [one[0] for one in usual]
    base = max(float(np.mean(shares)) if shares else 0.0, share_by_chance(cases, least, max(lattice.value, lattice.baseline)))
    base_onward = float(np.mean([one[1] for one in usual])) if usual else 1.0
    spread = np.sqrt(
        max(base * (1 - base), 1 / max(rows, 1)) / max(rows, 1) + (np.var(shares) if len(shares) > 1 else (0.1 * base) ** 2)
    )
    more = share - base
    jump = (share * onward - base * base_onward) / more if more > 1e-9 else 0.0
    found = (
        rows >= 200
        and (bool(shares) or not lattice.found)
        and more > max(CLEAR * spread, 0.004, LOST_MORE * base)
        and jump > LOST_JUMP
    )
    probability = float(np.clip(more / max(1 - base, 1e-6), 0.0, 0.9))
    moved = float(np.mean([np.mean(np.diff(angle) ** 2) for angle in angles_of(cases)]))
    text = f"{100 * share:.2f} % of the moving rows repeat the row before exactly, {100 * base:.2f} % in the baselines"
    numbers = {"probability": probability}
    added = probability * moved if found else 0.0
    return Signature("repeats", "lost_samples", found, share, base, "1", text, numbers, added)


def _line(records: Sequence[Record], line_hz: float) -> tuple[float, float]:
    """Amplitude of a mains line in the angle and the usual amplitude beside it; 0, 0 when the sampling cannot show it."""
    lines, besides = [], []
    for record in records:
        if record.angle_deg is None:
            continue
        rate = 1.0 / record.period_s
        alias = _alias(line_hz, rate)
        if alias < 8.0 or alias > 0.5 * rate - 1.0:
            continue
        frequency, power = _fast_spectrum(record)
        near = np.abs(frequency - alias)
        lines.append(float(power[near < 0.6].max()))
        besides.append(float(np.median(power[(near > 1.0) & (near < 8.0)])))
    if not lines:
        return 0.0, 0.0
    return float(np.sqrt(2 * np.median(lines))), float(np.sqrt(2 * np.median(besides)))


def _alias(line_hz: float, rate_hz: float) -> float:
    """Where a line shows at this sampling."""
    return abs(line_hz - rate_hz * round(line_hz / rate_hz))


def _fast_spectrum(record: Record) -> tuple[Column, Column]:
    """Frequency (Hz) and power (deg^2) of what the smoothing takes off the angle."""
    assert record.angle_deg is not None
    rate = 1.0 / record.period_s
    grid = record.t_s[0] + np.arange(len(record)) / rate
    known = np.isfinite(record.angle_deg)
    angle = np.interp(grid, record.t_s[known], record.angle_deg[known])
    rest = angle - gaussian_filter1d(angle, SMOOTHING_S * rate)
    frequency, power = periodogram(rest, rate, window="hann", scaling="spectrum")
    return frequency, power


def _tone(cases: Sequence[Record], sessions: Sequence[Sequence[Record]]) -> Signature:
    """A line that stands alone where no mains line is: no effect of the library makes it, but noise it is not either."""

    def powers(records: Sequence[Record]) -> Column:
        spectra = [_fast_spectrum(record) for record in records if record.angle_deg is not None]
        return np.median([np.interp(grid, frequency, power, right=0.0) for frequency, power in spectra], axis=0)

    grid = max((_fast_spectrum(record)[0] for record in cases if record.angle_deg is not None), key=len)
    rate = 2.0 * float(grid[-1])
    own = powers(cases)
    usual = np.max([powers(session) for session in sessions], axis=0) if sessions else np.zeros_like(own)
    beside = median_filter(own, max(3, round(TONE_AROUND_HZ / float(grid[1]))), mode="nearest")
    free = (grid > TONE_FROM_HZ) & (grid < 0.5 * rate - 1.0)
    for line in LINES_HZ:
        for multiple in (1, 3, 5):
            free &= np.abs(grid - _alias(multiple * line, rate)) > 1.0
    stands = np.where(free, own, 0.0)
    k = int(np.argmax(stands))
    others = float(np.max(np.where(np.abs(grid - grid[k]) > 1.0, stands, 0.0)))
    found = bool(own[k] > TONE_CLEAR**2 * max(beside[k], 1e-30) and own[k] > 4.0 * usual[k] and own[k] > TONE_ALONE**2 * others)
    amplitude = float(np.sqrt(2.0 * max(own[k] - usual[k], 0.0)))
    text = f"the strongest line that is no mains line: {amplitude:.3g} deg at {grid[k]:.1f} Hz"
    added = 0.5 * amplitude**2 if found else 0.0
    numbers = {"amplitude_deg": amplitude, "frequency_hz": float(grid[k])}
    return Signature(
        "tone", None, found, amplitude, float(np.sqrt(2.0 * usual[k])), "deg", text, numbers, added, SMOOTHED * added
    )


def _without_line(record: Record, line_hz: float) -> Column:
    """The angle with a narrow notch at the line."""
    assert record.angle_deg is not None
    rate = 1.0 / record.period_s
    alias = _alias(line_hz, rate)
    numerator, denominator = iirnotch(alias, alias / 4.0, rate)
    left: Column = filtfilt(numerator, denominator, record.angle_deg[np.isfinite(record.angle_deg)])
    return left


def _hum(cases: Sequence[Record], sessions: Sequence[Sequence[Record]]) -> Signature:
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


def _noise(
    cases: Sequence[Record],
    sessions: Sequence[Sequence[Record]],
    lattice: Signature,
    repeats: Signature,
    lines: Sequence[Signature],
) -> Signature:
    """More broadband noise than the baselines have; what a lattice or a mains line adds is taken off first."""
    measure = _white_level if repeats.found else _high_level
    strongest = max(lines, key=lambda line: line.value, default=None)
    level = measure(
        [_without_line(record, strongest.numbers["frequency_hz"]) for record in cases] if strongest else angles_of(cases)
    )
    own = level**2 - (lattice.value**2 / 12.0 if lattice.found else 0.0)
    levels = [measure(angles_of(session)) for session in sessions]
    base = float(np.sqrt(np.mean(np.square(levels)))) if levels else 0.0
    spread = max(float(np.std(np.log(levels))) if len(levels) > 1 and min(levels) > 0 else 0.0, 0.03)
    clear = max(0.2, CLEAR * spread)
    found = bool(levels) and base > 0 and own > base**2 * np.exp(2 * clear) and not lattice.found
    size = float(np.sqrt(max(own - base**2, 0.0))) * (_heaviness(cases, sessions) if found else 1.0)
    text = f"noise of {np.sqrt(max(own, 0.0)):.3g} deg rms, {base:.3g} in the baselines"
    return Signature(
        "noise",
        "sensor_noise",
        found,
        float(np.sqrt(max(own, 0.0))),
        base,
        "deg",
        text,
        {"std_deg": size},
        size**2 if found else 0.0,
        SMOOTHED * size**2 if found else 0.0,
    )


def _heaviness(cases: Sequence[Record], sessions: Sequence[Sequence[Record]]) -> float:
    """By how much the added noise's standard deviation exceeds what medians say: 1 for normal noise, more for heavy tails."""

    def power(records: Sequence[Record]) -> tuple[float, float]:
        angles = angles_of(records)
        return float(np.mean(np.concatenate([np.diff(angle, 3) for angle in angles]) ** 2)) / 20.0, _white_level(angles) ** 2

    own, usual = power(cases), np.mean([power(session) for session in sessions], axis=0)
    return float(np.sqrt(np.clip((own[0] - usual[0]) / max(own[1] - usual[1], 1e-12), 1.0, 4.0)))


def _stamps(cases: Sequence[Record], sessions: Sequence[Sequence[Record]]) -> Signature:
    """Jitter, gaps and rate of the time stamps."""

    def periods(records: Sequence[Record]) -> float:
        return float(np.median([np.mean(np.diff(record.t_s)) for record in records]))

    gaps = sum(int(np.sum(np.diff(record.t_s) > 2.5 * record.period_s)) for record in cases)
    jitter = float(np.median([np.std(np.diff(record.t_s)) / record.period_s for record in cases]))
    rate = periods(cases) / periods(sessions[0]) - 1.0 if sessions else 0.0
    text = f"{gaps} gaps in the time stamps, jitter {100 * jitter:.2g} % of the period, mean period {100 * rate:+.3g} % against the baselines"  # noqa: E501
    return Signature("time stamps", None, gaps > 0 or jitter > 0.1, float(gaps), 0.0, "1", text)


def _common_mode(cases: Sequence[Record], sessions: Sequence[Sequence[Record]]) -> Signature:
    """Shift of the mean pressure."""

    def mean(records: Sequence[Record]) -> float:
        return float(
            np.mean(
                [
                    np.nanmean(0.5 * (record.p1_mpa + record.p2_mpa))
                    for record in records
                    if record.p1_mpa is not None and record.p2_mpa is not None
                ]
            )
        )

    measured = all(record.has_pressures for record in cases) and all(
        record.has_pressures for session in sessions for record in session
    )
    if not measured or not sessions:
        return Signature("common mode", None, False, 0.0, 0.0, "MPa", "the mean pressure cannot be compared")
    means = [mean(session) for session in sessions]
    shift = mean(cases) - float(np.mean(means))
    found = abs(shift) > CLEAR * max(float(np.std(means)), 0.0005)
    return Signature(
        "common mode", None, found, shift, 0.0, "MPa", f"the mean pressure lies {1e3 * shift:+.2f} kPa from the baselines'"
    )


def _wires(cases: Sequence[Record]) -> list[Signature]:
    """Monitors that read nothing: below zero, or standing still under a moving command."""
    found = []
    for name, column_of in (("p1", _p1), ("p2", _p2)):
        columns = [column_of(record) for record in cases]
        known = [column[np.isfinite(column)] for column in columns if column is not None]
        if not known:
            continue
        dead = bool(np.median([np.ptp(column) if len(column) else 0.0 for column in known]) < 1e-4)
        low = bool(np.median([np.median(column) if len(column) else 0.0 for column in known]) < -0.02)
        text = f"monitor of {name} {'does not move: broken wire?' if dead else 'reads below zero: broken wire?' if low else 'is alive'}"
        found.append(Signature(f"wire {name}", None, dead or low, 0.0, 0.0, "MPa", text))
    return found


def _p1(record: Record) -> Column | None:
    return record.p1_mpa


def _p2(record: Record) -> Column | None:
    return record.p2_mpa

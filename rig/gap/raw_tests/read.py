"""Effects that least squares is blind to, found by their marks in the raw records: lattice, repeats, mains line, noise, time stamps, wires.

Each test compares the case with its own baselines by medians and shares, so that a nominal converter's lattice or a nominal level of
noise is no finding. Without a baseline the marks must be plain.
"""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import gaussian_filter1d, uniform_filter1d

from rig.gap.raw_tests.lost import angles_of, repeat_share, share_by_chance
from rig.gap.raw_tests.signature import SMOOTHED, Signature
from rig.gap.raw_tests.spectral_lines import fast_spectra, lone_line, mains_line, without_line
from rig.gap.records.pairs import SMOOTHING_S, Pair
from rig.record import Column, Record

LOST_JUMP = 1.2
"""Steps that the row after a repeat must go on by: 2 after a lost sample, 1 + 1/n after n in a row, 1 in a dead spot."""
LEAST_MOVING = 200
"""Rows that must move by more than the lattice before repeats among them count."""
LOST_MORE = 0.25
"""Repeats must exceed those of the baselines by this share of them: on a lattice they come and go with the speed."""
UNEVEN = 1.3
"""Codes of a converter are not quite even."""
CLEAR = 5.0
"""Standard deviations by which a share or a level must stand out."""


def read_signatures(pairs: Sequence[Pair]) -> list[Signature]:
    """All marks of the case, the absent ones too: what was looked for is part of the evidence."""
    cases = [pair.raw for pair in pairs]
    count = min((len(pair.raw_baselines) for pair in pairs), default=0)
    sessions = [[pair.raw_baselines[k] for pair in pairs] for k in range(count)]
    lattice = _lattice(cases, sessions)
    repeats = _repeats(cases, sessions, lattice)
    fast, usual = fast_spectra(cases), [fast_spectra(session) for session in sessions]
    hum, tone = mains_line(fast, usual), lone_line(fast, usual)
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
        [without_line(record, strongest.numbers["frequency_hz"]) for record in cases] if strongest else angles_of(cases)
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

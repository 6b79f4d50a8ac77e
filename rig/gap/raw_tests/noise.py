"""More broadband noise than the baselines have, than a fingerprint knows of, or than rigs usually have; what a step, a
line or a lost sample adds is taken off first."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rig.columns import THIRD_DIFFERENCE_POWER, filled_in, rms, white_noise
from rig.gap.raw_tests.noise_levels import Measure, angles_of, level_deg, white_level_deg
from rig.gap.raw_tests.settings import (
    BESIDE_TO_HZ,
    DAYS_NOISE,
    LEAST_LOUDER,
    MOST_HEAVY,
    NEARLY_ALL_EVEN,
    ROWS_NOISE,
    SLOPE_ROWS,
    SLOPE_S,
    SMOOTHED_VARIANCE,
    STANDS_OUT,
    SWITCHED,
    TESTS,
    UNEVEN_ROWS,
)
from rig.gap.raw_tests.signature import Signature, on_days
from rig.gap.raw_tests.spectral_lines import Spectrum, overtones, sidebands_deg2, without_lines
from rig.gap.raw_tests.statistics import about, between_days, by_chance
from rig.gap.settings import FALSE_ALARM_RATE
from rig.identify.response.response_fit import SMOOTHING_S
from rig.model.resample import is_regular
from rig.record import Column, Record
from rig.smoothing import smoothed


@dataclass(frozen=True)
class KnownNoise:
    """What is known of a rig's noise, for want of earlier days: of rows that are evenly apart."""

    level_deg: float
    """One standard deviation of the white noise of the angle."""
    spread: float = 0.0
    """Standard deviation of its logarithm where it is what rigs usually have; 0: this rig's own, in its fingerprint."""

    @property
    def of_this_rig(self) -> bool:
        return self.spread == 0.0


@dataclass(frozen=True)
class NoNoise:
    """What other tests found in the samples of the case, which is no noise."""

    step: Signature
    held: bool
    """Lost samples read like the ones before them."""
    lines: Sequence[Signature]
    """Those that were found in the `spectra`."""
    spectra: Sequence[Spectrum]


def noise(
    cases: Sequence[Record],
    sessions: Sequence[Sequence[Record]],
    beside: NoNoise,
    known: KnownNoise | None = None,
    level_of: Measure = level_deg,
) -> Signature:
    """The test for sensor noise; what is `beside` it in the samples is taken off first."""
    step, held = beside.step, beside.held
    uneven = any(_elsewhere(case, day) for session in sessions for case, day in zip(cases, session, strict=True))
    even = all(_nearly_even(case) for case in cases)
    described = known if even and not sessions else None
    measure = white_level_deg if held or uneven else level_of
    if described:
        measure = partial(noise_beside_the_motion, cases, without_repeats=held)
    of_step_deg2 = step.value**2 / 12.0 if step.found or described else 0.0
    quiet, switched_deg2 = _without_strongest(beside.lines, cases, beside.spectra)
    own = float(np.sqrt(max(measure(quiet) ** 2 - of_step_deg2, 0.0)))
    by_rows = ROWS_NOISE / np.sqrt(sum(map(len, cases)))
    if described is None:
        against = _against(own, [_as_sampled(measure, cases, session) for session in sessions], 0.0)
    elif described.of_this_rig:
        against = _against(own, [described.level_deg], by_rows)
    else:
        against = _against_usual(own, described, by_rows)
    found = against.plainly and not step.found and own**2 - against.usual**2 > switched_deg2
    usual = f"{against.usual:.3g} deg"
    elsewhere = f", {_whose(described)} {usual}" if described else on_days(usual, bool(sessions))
    heaviness = _heaviness(cases, sessions) if found and sessions else 1.0
    return _signature(own, against, found, heaviness, f"noise of {own:.3g} deg rms{elsewhere}")


def _signature(own: float, against: "_Against", found: bool, heaviness: float, text: str) -> Signature:
    """What is told of a level (deg); of added noise that is not normal, its standard deviation is `heaviness` times
    what the level says."""
    size = heaviness * float(np.sqrt(max(own**2 - against.usual**2, 0.0)))
    return Signature(
        "noise",
        "sensor_noise",
        found,
        value=own,
        baseline=against.usual,
        unit="deg",
        text=text,
        sizes={"std_deg": about(size, against.variance_spread / max(size, 1e-12), 0.0)},
        p_value=against.p_value,
        variance_deg2=size**2 if found else 0.0,
        smoothed_deg2=SMOOTHED_VARIANCE * size**2 if found else 0.0,
    )


@dataclass(frozen=True)
class _Against:
    """A level of noise beside those that are known."""

    usual: float
    """rms of the known levels, deg; 0 without any."""
    plainly: bool
    """The level is louder than days and chance make it."""
    p_value: float | None
    """Probability of so much or more by chance; None where no level is known."""
    variance_spread: float
    """Half the standard deviation (deg2) of the difference between the squares of the level and the usual one."""


def _against(own: float, levels: Sequence[float], unsure: float) -> _Against:
    """A level (deg) beside the known ones. `unsure`: its standard deviation because of its few rows, as a share of it;
    0 where days show by how much levels differ."""
    known = bool(levels) and min(levels) > 0.0 and own > 0.0
    usual = rms(np.array(levels)) if levels else 0.0
    between, degrees = between_days(np.log(levels).tolist() if known else [], DAYS_NOISE)
    days = float(np.hypot(between, unsure))
    louder = float(np.log(own / usual)) if known else 0.0
    plainly = louder > max(LEAST_LOUDER, STANDS_OUT * max(_spread(levels), DAYS_NOISE, unsure))
    p_value = by_chance(louder, days, degrees, len(levels)) if known else None
    spread = days * float(np.hypot(own**2, usual**2 / np.sqrt(max(len(levels), 1))))
    return _Against(usual, bool(plainly), p_value, spread)


def _against_usual(own: float, known: KnownNoise, unsure: float) -> _Against:
    """A level (deg) beside what rigs usually have, on a logarithmic scale; `unsure` as in `_against`."""
    usual, louder = known.level_deg, float(np.log(max(own, 1e-12) / known.level_deg))
    p_value = by_chance(louder, known.spread)
    spread = float(np.hypot(unsure * own**2, known.spread * usual**2))
    return _Against(usual, louder > 0.0 and TESTS * p_value < FALSE_ALARM_RATE, p_value, spread)


def _whose(known: KnownNoise) -> str:
    """Where the usual level comes from, ahead of its number."""
    return "in the fingerprint" if known.of_this_rig else "in rigs usually"


def _without_strongest(
    lines: Sequence[Signature], cases: Sequence[Record], spectra: Sequence[Spectrum]
) -> tuple[list[Column], float]:
    """The angles without the strongest of the lines that were looked for, and without its multiples and sidebands; and
    the mean square (deg2) that its switching may leave further off."""
    strongest = max(lines, key=lambda line: line.value, default=None)
    if strongest is None:
        return angles_of(cases), 0.0
    line_hz = strongest.numbers["frequency_hz"]
    those = [line_hz, *overtones(spectra, line_hz)]
    switched_deg2 = sidebands_deg2(spectra, line_hz)
    if switched_deg2 == 0.0:
        return [without_lines(record, those) for record in cases], 0.0
    return [without_lines(record, those, 2.0 * BESIDE_TO_HZ) for record in cases], SWITCHED * switched_deg2


def noise_beside_the_motion(records: Sequence[Record], angles: Sequence[Column], *, without_repeats: bool) -> float:
    """White noise (deg) of the angles of records as a fingerprint measures it, without what of the motion third
    differences let through."""
    rows = [min(SLOPE_ROWS, SLOPE_S / record.period_s) for record in records]
    motions = [
        _where_it_was_read(record, smoothed(filled_in(angle), over, mirrored=True), over)
        for record, angle, over in zip(records, angles, rows, strict=True)
    ]
    level = white_noise(angles, without_repeats=without_repeats)
    return float(np.sqrt(max(level**2 - white_noise(motions) ** 2, 0.0)))


def _nearly_even(record: Record) -> bool:
    """Nearly all rows are a period apart, as far as UNEVEN_ROWS allows, whatever the clocks add up to."""
    off = np.abs(np.diff(record.t_s) / record.period_s - 1.0)
    return bool(np.quantile(off, NEARLY_ALL_EVEN) <= UNEVEN_ROWS)


def _where_it_was_read(record: Record, motion: Column, rows: float) -> Column:
    """The motion (deg, (n,)) with what rows off their places read of it: its speed times how far each is off."""
    if is_regular(record, record.period_s):
        return motion
    off_s = record.t_s - smoothed(record.t_s, rows, mirrored=True)
    return motion + np.gradient(motion, record.t_s) * off_s


def _as_sampled(measure: Measure, cases: Sequence[Record], session: Sequence[Record]) -> float:
    """The noise of a session as it would show in rows that lie as the case's do. Where these are further apart or less
    even, their differences let some of the motion through. A median of noise and motion together is not the sum of
    theirs, so noise of the session's level is drawn, the same each time, and measured on the motion."""
    level = measure(angles_of(session))
    pairs = [(case, day, _elsewhere(case, day)) for case, day in zip(cases, session, strict=True)]
    if not any(elsewhere for *_, elsewhere in pairs):
        return level
    let_through = measure([_motion(day) for _, day, elsewhere in pairs if elsewhere])
    own = float(np.sqrt(max(level**2 - let_through**2, 0.0)))
    random = np.random.default_rng(1)
    return measure(
        [
            np.interp(case.t_s, day.t_s, _motion(day)) + own * random.standard_normal(len(case))
            if elsewhere
            else filled_in(day.angle_deg)
            for case, day, elsewhere in pairs
            if day.angle_deg is not None
        ]
    )


def _elsewhere(case: Record, day: Record) -> bool:
    """Their rows are not as far apart, or not as even."""
    return not all(is_regular(record, day.period_s) for record in (case, day))


def _motion(day: Record) -> Column:
    """(n,) the angle without what changes from row to row, smoothed as the diagnosis does."""
    assert day.angle_deg is not None
    return smoothed(filled_in(day.angle_deg), SMOOTHING_S / day.period_s)


def _spread(levels: Sequence[float]) -> float:
    return float(np.std(np.log(levels))) if len(levels) > 1 and min(levels) > 0 else 0.0


def _heaviness(cases: Sequence[Record], sessions: Sequence[Sequence[Record]]) -> float:
    """By how much the added noise's standard deviation exceeds what medians say: 1 for normal noise, more for heavy
    tails."""

    def power(records: Sequence[Record]) -> tuple[float, float]:
        angles = angles_of(records)
        mean = float(np.nanmean(np.concatenate([np.diff(angle, 3) for angle in angles]) ** 2)) / THIRD_DIFFERENCE_POWER
        return mean, white_level_deg(angles) ** 2

    own, usual = power(cases), np.mean([power(session) for session in sessions], axis=0)
    return float(np.sqrt(np.clip((own[0] - usual[0]) / max(own[1] - usual[1], 1e-12), 1.0, MOST_HEAVY)))

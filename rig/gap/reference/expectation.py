"""What is expected of a rig without a gap, and how surely: by earlier days, one day, the model file's fingerprint, or the simulator.

An expectation has the two factors of the likelihood: the pressures under the commands, and the angle under the pressures. What is
unsure of each is a set of patterns with their usual sizes, and a remainder with a spectrum. No effect is known here.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.gap.carry import Track
from rig.gap.evidence.gaussian import Gaussian
from rig.gap.evidence.lines import Lines, lines_of
from rig.gap.kernels import CARRIER_TERMS, carrier_terms, stops
from rig.gap.nominal import Nominal
from rig.gap.pairs import Pair
from rig.gap.settings import ENVELOPE_EVEN, ENVELOPE_HZ, TOP_HZ, Levels, Prior
from rig.record import Column

VALVE_PATTERNS = ("offset_mpa", "gain", "lag_s", "curvature_s2", "one_way_s", "bend")
"""What is unsure of each regulator with its monitor, in the order of the columns; see `Levels`."""
ANGLE_PATTERNS = (
    "offset", "gain", "lag_s", "loop", "monitor_mpa", "monitor_mpa", "monitor_gain", "monitor_gain", "mean_law", "drift", "warming",
)  # fmt: skip
"""What is unsure of the angle under the pressures, beside the bank of the response model."""


@dataclass(frozen=True)
class Factor:
    """One factor of the likelihood: its residual without any cause, and how residuals are judged."""

    lines: Lines
    gap: Column
    """(n,) measured minus expected."""
    healthy: Gaussian

    def log_none(self) -> float:
        """ln p of the gap when there is no cause."""
        return self.healthy.log_density(self.lines.of(self.gap))


def pressure_factor(tracks: Sequence[Track], p0_mpa: float, levels: Levels, prior: Prior) -> Factor:
    """Both monitors against what the reference's regulators give under the commands."""
    pairs = [track.pair for track in tracks]
    lines = lines_of([len(p) for p in pairs] * 2, [p.dt_s for p in pairs] * 2, [p.used for p in pairs] * 2, TOP_HZ)
    expected = [track.reference.p1_mpa for track in tracks] + [track.reference.p2_mpa for track in tracks]
    measured = [pair.case.p1_mpa for pair in pairs] + [pair.case.p2_mpa for pair in pairs]
    blocks = [_valve_patterns(column, p0_mpa, pair.dt_s) for column, pair in zip(expected, pairs * 2, strict=True)]
    first, second = np.concatenate(blocks[: len(pairs)]), np.concatenate(blocks[len(pairs) :])
    spread = np.array([levels.valve[name] for name in VALVE_PATTERNS])
    zero = np.zeros_like(first)
    patterns = lines.of(np.vstack([np.hstack([first * spread, zero]), np.hstack([zero, second * spread])]))
    moving = lines.of(np.concatenate([column - p0_mpa for column in expected]))
    swing = max(float(np.ptp(np.concatenate(expected))), 1e-4)
    noise = [line_noise(pair.raw.p1_mpa, pair) for pair in pairs] + [line_noise(pair.raw.p2_mpa, pair) for pair in pairs]
    variance = (
        levels.valve_share**2 * lines.envelope(moving, ENVELOPE_HZ, ENVELOPE_EVEN)
        + (levels.valve_even * swing) ** 2
        + np.square(noise)[lines.record]
    )
    gap = np.concatenate(measured) - np.concatenate(expected)
    return Factor(lines, gap, Gaussian(variance, patterns, prior.effective, prior.degrees))


def line_noise(column: Column | None, pair: Pair) -> float:
    """Standard deviation that a column's own white noise has on every line of the pair's grid; by medians of third differences."""
    if column is None:
        return 0.0
    known = column[np.isfinite(column)]
    third = np.diff(known, 3)
    moved = third[third != 0.0]
    if len(moved) < len(third) // 4 or not len(moved):
        moved = third
    white = float(np.median(np.abs(moved))) / 0.6745 / np.sqrt(20.0) if len(moved) else 0.0
    return white * float(np.sqrt(min(pair.raw.period_s / pair.dt_s, 1.0)))


def _valve_patterns(pressure: Column, p0_mpa: float, dt_s: float) -> Column:
    """(n, 6) in the order of VALVE_PATTERNS, for spreads of 1."""
    speed = np.gradient(pressure, dt_s)
    moved = pressure - p0_mpa
    return np.column_stack(
        [np.ones_like(pressure), moved, -speed, np.gradient(speed, dt_s), -np.abs(speed), moved**2 / p0_mpa]
    )


def angle_factor(
    tracks: Sequence[Track], base: Sequence[Column], nominal: Nominal, driven: bool, levels: Levels, prior: Prior
) -> Factor:
    """The angle against what is expected under its drive: the measured pressures, or the reference's."""
    pairs = [track.pair for track in tracks]
    lines = lines_of([len(p) for p in pairs], [p.dt_s for p in pairs], [p.used for p in pairs], TOP_HZ)
    span = max(float(np.ptp(np.concatenate(list(base)))), 1e-3)
    blocks = [_angle_patterns(track, angle, nominal, driven, span) for track, angle in zip(tracks, base, strict=True)]
    columns = lines.of(np.concatenate(blocks))
    named = len(ANGLE_PATTERNS)
    spread = np.array([levels.angle[name] for name in ANGLE_PATTERNS])
    bank = columns[:, named:]
    size = np.sqrt(np.sum(bank**2, axis=0) / max(float(lines.used.sum()), 1.0))
    bank = bank / np.maximum(size, 1e-9) * (levels.bank * span)
    moving = lines.of(np.concatenate(list(base)))
    noise = np.array([line_noise(pair.raw.angle_deg, pair) for pair in pairs])
    variance = (
        levels.angle_share**2 * lines.envelope(moving, ENVELOPE_HZ, ENVELOPE_EVEN)
        + (levels.angle_even * span) ** 2
        + noise[lines.record] ** 2
    )
    gap = np.concatenate([pair.case.angle_deg - angle for pair, angle in zip(pairs, base, strict=True)])
    patterns = np.hstack([columns[:, :named] * spread, bank])
    return Factor(lines, gap, Gaussian(variance, patterns, prior.effective, prior.degrees))


def _angle_patterns(track: Track, angle: Column, nominal: Nominal, driven: bool, span: float) -> Column:
    """(n, 11 + bank): ANGLE_PATTERNS for spreads of 1, then the terms of the response model beside the drive itself."""
    pair, dt = track.pair, track.pair.dt_s
    p1, p2 = (track.reference.p1_mpa, track.reference.p2_mpa)
    if driven and pair.case.p1_mpa is not None and pair.case.p2_mpa is not None:
        p1, p2 = pair.case.p1_mpa, pair.case.p2_mpa
    width = max(0.1 * float(np.ptp(angle)), 1e-3)
    here = nominal.angle(p1, p2, dt)
    step, share = 0.001, 0.01
    through = [
        (nominal.angle(p1 + step, p2, dt) - here) / step,
        (nominal.angle(p1, p2 + step, dt) - here) / step,
        (nominal.angle(p1 + share * (p1 - nominal.p0_mpa), p2, dt) - here) / share,
        (nominal.angle(p1, p2 + share * (p2 - nominal.p0_mpa), dt) - here) / share,
    ]
    mean = np.maximum(p1 + p2, 0.2 * nominal.p0_mpa) / (2.0 * nominal.p0_mpa)
    through_time = (pair.t_s - pair.t_s.mean()) / max(float(np.ptp(pair.t_s)), 1e-9)
    named = [
        np.full_like(angle, span), angle, -np.gradient(angle, dt), -stops(angle, width), *through, angle * np.log(mean),
        span * through_time, angle * through_time,
    ]  # fmt: skip
    terms = np.empty((len(angle), CARRIER_TERMS))
    carrier_terms(np.ascontiguousarray(p1), np.ascontiguousarray(p2), nominal.p0_mpa, dt, terms)
    drive = terms[:, 1]
    bank = [terms[:, 2], terms[:, 3], *(terms[:, 4 + j] - drive for j in range(6)), *(terms[:, 12 + j] - terms[:, 5] for j in range(5))]
    return np.column_stack([*named, *bank])

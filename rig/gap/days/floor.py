"""What differs between healthy sessions: the floor that a gap must rise above, by side of the chain.

Sessions differ in a few slow ways (offset, gain, lag, width of the loop: the modes) and in a remainder. Each mode has
its own spread, learnt from the baselines and held up by a prior where they are few; the remainder has an rms. No effect
is known here.
"""

from collections.abc import Sequence

import numpy as np

from rig.gap.days.side import Side
from rig.gap.records.pairs import Pair
from rig.gap.records.periods import period_rows
from rig.gap.reference.nominal import Nominal, Reference
from rig.model.response_kernels import stops
from rig.record import Column

MEMORY_S = 1.0
"""Samples closer than this count as one: residuals are coloured."""
PRIOR_SESSIONS = 1.0
"""How many sessions the prior spread of a mode counts for."""
ANGLE_PRIORS = (0.002, 0.003, 0.001, 0.03)
"""Offset (share of the angle's range), gain, lag (s) and loop width (share): usual spread between days of a healthy
rig."""
VALVE_PRIORS = (0.0008, 0.003, 0.001)
"""Offset (MPa), gain and lag (s) of a pressure monitor."""
MODEL_PRIORS = (0.03, 0.08, 0.03, 0.5)
MODEL_VALVE_PRIORS = (0.01, 0.05, 0.05)
"""The same for a model in place of a baseline."""


def angle_modes(pairs: Sequence[Pair], references: Sequence[Reference]) -> Column:
    """(n, 4): offset, gain, lag and loop width of the angle."""
    blocks = []
    for pair, reference in zip(pairs, references, strict=True):
        angle = reference.angle_deg
        width = max(0.1 * float(np.ptp(angle)), 1e-3)
        loop = stops(angle, width)
        blocks.append(
            np.column_stack([np.ones_like(angle), angle, -np.gradient(angle, pair.dt_s), -loop]) * pair.used[:, None]
        )
    return np.concatenate(blocks)


def valve_modes(pairs: Sequence[Pair], references: Sequence[Reference], p0_mpa: float) -> Column:
    """(n, 6): offset, gain and lag of each monitor; rows of valve 1, then of valve 2."""
    halves = []
    for k in (0, 1):
        block = []
        for pair, reference in zip(pairs, references, strict=True):
            pressure = (reference.p1_mpa, reference.p2_mpa)[k]
            block.append(
                np.column_stack([np.ones_like(pressure), pressure - p0_mpa, -np.gradient(pressure, pair.dt_s)])
                * pair.used[:, None]
            )
        halves.append(np.concatenate(block))
    zero = np.zeros_like(halves[0])
    return np.vstack([np.hstack([halves[0], zero]), np.hstack([zero, halves[1]])])


def build_side(
    name: str,
    pairs: Sequence[Pair],
    gap: Column,
    modes: Column,
    deviations: Sequence[Column],
    priors: Column,
    *,
    fallback: float,
    source: str,
    extra: float = 0.0,
) -> Side:
    """A side from its gap and from each baseline session's deviation from the mean of the others (none: `fallback` is
    the floor).

    `extra` is an rms that the remainder gets on top: what the other side explains is known only to a share.
    """
    halves = 2 if name == "valve" else 1
    used = np.concatenate([pair.used for pair in pairs] * halves)
    records = np.concatenate([np.full(len(pair), k) for k, pair in enumerate(pairs)] * halves)
    rows = max(float(used.sum()), 1.0)
    seconds = sum(float(pair.used.sum()) * pair.dt_s for pair in pairs)
    side = Side(
        name,
        "MPa" if name == "valve" else "deg",
        gap * used,
        modes,
        priors,
        0.0,
        fallback,
        fallback,
        source,
        records,
        rows,
        halves * seconds / MEMORY_S,
    )
    count = len(deviations)
    if count < 2:
        total = float(np.sqrt(fallback**2 + np.mean((modes @ np.diag(priors)) ** 2, axis=0).sum()))
        return _replaced(side, priors, PRIOR_SESSIONS, float(np.hypot(fallback, extra)), float(np.hypot(total, extra)))
    fair = (count - 1) * (count + 1) / count**2  # a deviation from the mean of the others, as one from the mean of all
    sizes = np.array([side.free_sizes(deviation * used) for deviation in deviations])
    spread = np.sqrt((PRIOR_SESSIONS * priors**2 + fair * (sizes**2).sum(axis=0)) / (PRIOR_SESSIONS + count - 1))
    left = [side.rms(deviation * used - modes @ size) for deviation, size in zip(deviations, sizes, strict=True)]
    remainder = float(np.sqrt(fair * np.mean(np.square(left))))
    floor = float(np.sqrt(fair * np.mean([side.rms(deviation * used) ** 2 for deviation in deviations])))
    return _replaced(
        side, spread, PRIOR_SESSIONS + count - 1, float(np.hypot(remainder, extra)), float(np.hypot(floor, extra))
    )


def _replaced(side: Side, spread: Column, degrees: float, remainder: float, floor: float) -> Side:
    return Side(
        side.name,
        side.unit,
        side.gap,
        side.modes,
        spread,
        degrees,
        max(remainder, 1e-9),
        max(floor, 1e-9),
        side.source,
        side.records,
        side.rows,
        side.effective,
    )


def period_noise(pairs: Sequence[Pair], columns: Sequence[Column]) -> float | None:
    """Rms by which the periods of periodic records differ; None when no command repeats itself at least twice."""
    parts = []
    for pair, column in zip(pairs, columns, strict=True):
        rows = period_rows(pair.u1_mpa)
        if rows is None:
            continue
        whole = (len(column) // rows) * rows
        folded = column[:whole].reshape(-1, rows)[1:]  # the first period holds the start
        if len(folded) >= 2:
            parts.append(np.mean(np.var(folded - folded.mean(axis=1, keepdims=True), axis=0, ddof=1)))
    return float(np.sqrt(np.mean(parts))) if parts else None


def high_frequency_noise(columns: Sequence[Column]) -> float:
    """White noise of columns from their third differences, by medians."""
    differences = np.concatenate([np.diff(column, 3) for column in columns])
    return float(1.4826 * np.median(np.abs(differences - np.median(differences))) / np.sqrt(20.0))


def angle_gap(pairs: Sequence[Pair], references: Sequence[Column]) -> Column:
    """(n,) case minus reference over all pairs."""
    return np.concatenate([pair.case.angle_deg - reference for pair, reference in zip(pairs, references, strict=True)])


def left_out(pair: Pair, k: int, kind: str) -> tuple[Column, Column]:
    """Session k's column and the mean of the others' (kind p1_mpa, p2_mpa or angle_deg)."""
    own = getattr(pair.sessions[k], kind)
    others = np.mean([getattr(session, kind) for j, session in enumerate(pair.sessions) if j != k], axis=0)
    return own, others


def angle_deviations(pairs: Sequence[Pair], nominal: Nominal, driven: bool) -> list[Column]:
    """(n,) for each session: its angle against the others' mean, brought to its own pressures when `driven`."""
    count = len(pairs[0].sessions)
    found = []
    for k in range(count if count > 1 else 0):
        parts = []
        for pair in pairs:
            own, others = left_out(pair, k, "angle_deg")
            if driven:
                (p1, m1), (p2, m2) = left_out(pair, k, "p1_mpa"), left_out(pair, k, "p2_mpa")
                others = others + nominal.angle(p1, p2, pair.dt_s) - nominal.angle(m1, m2, pair.dt_s)
            parts.append(own - others)
        found.append(np.concatenate(parts))
    return found


def valve_deviations(pairs: Sequence[Pair]) -> list[Column]:
    """(n,) for each session: both pressures against the others' mean, valve 1 then valve 2."""
    count = len(pairs[0].sessions)
    found = []
    for k in range(count if count > 1 else 0):
        parts = []
        for kind in ("p1_mpa", "p2_mpa"):
            for pair in pairs:
                own, others = left_out(pair, k, kind)
                parts.append(own - others)
        found.append(np.concatenate(parts))
    return found

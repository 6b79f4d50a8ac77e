"""Baseline sessions that do not belong to the others: another rig's, or a day with a fault of its own.

One such day among healthy ones would hide every gap below what it differs by. Nothing of the case is looked at here.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rig.gap.records.pairs import Pair, Pairing
from rig.gap.records.partners import named_session
from rig.gap.records.settings import FEWEST_SESSIONS, STRANGER_FAR, STRANGER_LEAST
from rig.record import Column


def without_strangers(pairing: Pairing) -> Pairing:
    """The pairing without sessions that no other comes near, and a note for each; with two sessions that differ so
    much, a note alone."""
    count = pairing.sessions
    if count < 2:
        return pairing
    apart = _distances([pair for pair in pairing.pairs if len(pair.sessions) == count], count)
    nearest = np.min(apart + np.diag(np.full(count, np.inf)), axis=1)
    far = [k for k in range(count) if _is_far(k, nearest)]
    told = far if count >= FEWEST_SESSIONS else far[:1]
    pairing = pairing.noting(*(_note(pairing.pairs[0], k, count, float(nearest[k])) for k in told))
    if count < FEWEST_SESSIONS or not far or len(far) > count - 2:
        return pairing
    kept = [k for k in range(count) if k not in far]
    pairs = [_with_sessions(pair, kept) for pair in pairing.pairs]
    return replace(pairing, pairs=pairs, sessions=len(kept))


def _note(pair: Pair, k: int, count: int, apart: float) -> str:
    who, end = f"{named_session(pair.numbers[k], pair.raw_baselines[k])} differs from every other", "left out"
    if count < FEWEST_SESSIONS:
        who, end = "the two baseline sessions differ", "the floor is as high; a third session would tell which"
    return f"{who} by {100 * apart:.0f} % of the angle's spread or more: another rig, or a day with a fault; {end}"


def _is_far(k: int, nearest: Column) -> bool:
    others = np.delete(nearest, k)
    usual = float(np.median(others)) if len(others) >= FEWEST_SESSIONS - 1 else 0.0
    return bool(nearest[k] > max(STRANGER_LEAST, STRANGER_FAR * usual))


def _distances(pairs: Sequence[Pair], count: int) -> Column:
    """(count, count) rms by which the sessions' angles differ, in shares of the angle's spread."""
    squares, spread = np.zeros((count, count)), 0.0
    for pair in pairs:
        angles = np.array([session.angle_deg for session in pair.sessions]) * pair.used
        squares += np.sum((angles[:, None, :] - angles[None, :, :]) ** 2, axis=2)
        spread += float(np.median(np.var(angles, axis=1))) * angles.shape[1]
    shares: Column = np.sqrt(squares / max(spread, 1e-12))
    return shares


def _with_sessions(pair: Pair, kept: Sequence[int]) -> Pair:
    """The pair with these sessions only, in all that it holds of each."""
    return replace(
        pair,
        sessions=tuple(pair.sessions[k] for k in kept),
        raw_baselines=tuple(pair.raw_baselines[k] for k in kept),
        baseline_dropouts=tuple(pair.baseline_dropouts[k] for k in kept),
        numbers=tuple(pair.numbers[k] for k in kept),
    )

"""Between the two sides of the chain: what the pressures do to the angle, what the joint does to the pressures, and
what is in doubt.

The pressures drive the angle's side, but monitors misread from day to day, causes are known to a standard deviation,
and a joint that moves otherwise squeezes its muscles. No side is judged here.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import lsq_linear

from rig.gap.days.attribute import LOOSENESS
from rig.gap.days.bench import case_pressures
from rig.gap.days.floor import angle_deviations, angle_gap
from rig.gap.days.prepared import Judged, Prepared
from rig.gap.days.side import Side
from rig.gap.days.trigger import STRUCTURE, trigger
from rig.gap.hypotheses.propagate import Applied, angle_under, lay_tracks
from rig.model.response_kernels import regulated
from rig.record import Column

MISREADING = 2.0
"""Thresholds up to which monitors may be off by themselves."""
LAW_SHARE = 0.1
"""Share of what a cause does to offset, gain and lag of the pressures that its law may get wrong."""
ATMOSPHERE_MPA = 0.1013
RECOVERY = (1.0, 0.25)
"""In how much of its time constant a regulator makes up for a squeeze: it is quicker the smaller the error."""
MOST_GROWTH = 0.01
"""Most by which a muscle's pressure rises, shut off, for each degree that the joint squeezes it; relative."""
MEAN_LAWS = ((1.0, 1.0), (1.0, 0.0), (0.5, 0.5), (0.0, 1.0), (0.0, 0.0))
"""(exponent, compliance): what the mean pressure may do, a bounded nuisance."""
MEAN_DOUBT = 0.2
"""Share of what another mean pressure does to the angle that is not known."""
PLAIN_DOUBT = 0.1
"""Doubts smaller than this share of the remainder are none."""
MEAN_MOVED = 0.01
"""Shares of change of the mean pressure below this are none."""


def echo(side: Side, prepared: Prepared) -> Column:
    """(n,) what a joint that moves otherwise than its pressures say does to them: it changes the muscles' volumes.

    A regulator makes up for it with its time constant, so it is the fast part of the angle that the pressures do not
    explain, times the absolute pressure and the growth of the volume with the angle: fitted for each muscle within what
    muscles can do.
    """
    moved = [
        (pair.case.angle_deg - angle_under(*case_pressures(track), track, prepared.nominal)) * pair.used
        for pair, track in zip(prepared.pairs, prepared.tracks, strict=True)
    ]
    half = len(side.gap) // 2
    found = np.zeros(len(side.gap))
    for k, sign in ((0, -1.0), (1, 1.0)):
        tau = max(prepared.nominal.regulators[k][1:])
        columns = np.zeros((len(side.gap), 2))
        for j, share in enumerate(RECOVERY):
            parts = []
            for pair, track, move in zip(prepared.pairs, prepared.tracks, moved, strict=True):
                fast = move - regulated(move, 0.0, share * tau, share * tau, pair.dt_s)
                parts.append(sign * (case_pressures(track)[k] + ATMOSPHERE_MPA) * fast * pair.used)
            columns[k * half : (k + 1) * half, j] = np.concatenate(parts)
        beside = np.column_stack([column - side.modes @ side.free_sizes(column) for column in columns.T])
        growth = lsq_linear(beside.T @ beside + 1e-12 * np.eye(2), beside.T @ side.gap, (0.0, MOST_GROWTH)).x
        found += columns @ growth
    return found


def stripped(prepared: Prepared, valve: Judged) -> tuple[Prepared, list[Column]]:
    """The same with the pressures freed of what their monitors misread, and what is not known about that in the angle.

    What the causes leave in the monitors' usual modes is shared between the day and the causes' laws, which are
    approximations, by what either usually does. (n,) each: one standard deviation of such a share, carried to the
    angle.
    """
    side, left = valve.side, valve.accepted[-1].residual
    law = LAW_SHARE * np.abs(side.free_sizes(side.gap - left))
    day = side.spread**2 / (side.spread**2 + law**2)
    sizes = side.mode_sizes(left)
    misread = side.modes @ (sizes * day)
    if (
        trigger(side, left, LOOSENESS * side.rms(side.gap)).structure <= STRUCTURE
    ):  # beside the modes there is nothing but the monitors' noise
        misread = left - side.modes @ (sizes * (1.0 - day))
    freed = _with_drive(prepared, misread)
    return freed, [
        _angle_change(freed, side.modes[:, j] * law[j] * np.sqrt(day[j]))
        for j in range(len(law))
        if law[j] > 0.02 * side.spread[j]
    ]


def _with_drive(prepared: Prepared, off: Column) -> Prepared:
    """The same, driven by the case's pressures less `off` (n,)."""
    tracks = []
    for track, (first, second) in zip(prepared.tracks, _by_track(prepared, off), strict=True):
        p1, p2 = case_pressures(track)
        tracks.append(replace(track, driven_by=(p1 - first, p2 - second)))
    return replace(prepared, tracks=tracks)


def _by_track(prepared: Prepared, column: Column) -> list[tuple[Column, Column]]:
    """The valve side's rows of each pair: valve 1, valve 2."""
    parts = np.split(column, np.cumsum([len(pair) for pair in prepared.pairs] * 2)[:-1])
    return list(zip(parts[: len(prepared.pairs)], parts[len(prepared.pairs) :], strict=True))


def stiffened(prepared: Prepared) -> Column:
    """(n,) what another mean pressure than the baselines' does to the angle, by a share: they never showed it."""
    parts = []
    for track in prepared.tracks:
        p1, p2 = case_pressures(track)
        mean = 0.5 * (p1 + p2 - track.reference.p1_mpa - track.reference.p2_mpa)
        moved = angle_under(p1, p2, track, prepared.nominal) - angle_under(
            p1 - mean, p2 - mean, track, prepared.nominal
        )
        parts.append(MEAN_DOUBT * moved * track.pair.used)
    return np.concatenate(parts)


def _angle_change(prepared: Prepared, change: Column) -> Column:
    """(n,) what a change of the pressures does to the angle."""
    parts = []
    for track, (first, second) in zip(prepared.tracks, _by_track(prepared, change), strict=True):
        p1, p2 = case_pressures(track)
        moved = angle_under(p1 + first, p2 + second, track, prepared.nominal)
        parts.append((moved - angle_under(p1, p2, track, prepared.nominal)) * track.pair.used)
    return np.concatenate(parts)


def doubts(prepared: Prepared, valve: Judged) -> list[Column]:
    """(n,) each: what one standard deviation of a number of the valve side's causes is worth in the angle."""
    found = []
    for candidate in valve.accepted:
        for name, size, spread in zip(candidate.law.free, candidate.sizes, candidate.spread, strict=True):
            numbers = dict(candidate.applied.numbers) | {name: float(size + spread)}
            numbers |= {other: numbers[owner] for other, owner in candidate.law.tied.items()}
            usual, moved = (
                replace(valve.bench, accepted=()).predicted([Applied(candidate.applied.stage, one)])
                for one in (candidate.applied.numbers, numbers)
            )
            found.append(_angle_change(prepared, moved - usual))
    return found


def misreading(valve: Judged, plain: Side) -> bool:
    """Whether a faint offset, gain or lag of the monitors is but theirs: the angle (`plain`: as commanded) does not
    follow."""
    return faint(valve) and not trigger(plain).found


def faint(valve: Judged) -> bool:
    """Whether the pressures' gap is an offset, gain or lag of the size that monitors may be off by themselves."""
    return valve.trigger.structure <= STRUCTURE and valve.trigger.strength < MISREADING


def monitor_noise(prepared: Prepared, side: Side) -> float:
    """Rms of healthy days beside the modes once each is brought to its own monitors' pressures."""
    days = angle_deviations(prepared.pairs, prepared.nominal, True)
    used = np.concatenate([pair.used for pair in prepared.pairs])
    left = [side.rms(day * used - side.modes @ side.free_sizes(day * used)) for day in days]
    return float(np.sqrt(np.mean(np.square(left)))) if left else 0.0


def doubting(side: Side, doubted: Sequence[Column]) -> Side:
    """The side with changes (n,) that may be there or not: as patterns of their own, the large ones, and in its
    floor."""
    if not doubted:
        return side
    together = np.column_stack(doubted)
    sizes, ways = np.linalg.eigh(together.T @ together / side.rows)
    plain = sizes > (PLAIN_DOUBT * side.remainder) ** 2
    floor = float(np.sqrt(side.floor**2 + max(float(sizes.sum()), 0.0)))
    return replace(side, floor=floor, doubts=together @ ways[:, plain] if plain.any() else None)


def with_mean_law(prepared: Prepared) -> Prepared:
    """The description whose law of the mean pressure leaves least in the angle; baselines cannot tell, as theirs never
    changes."""
    pairs = prepared.pairs
    means = [
        float(np.mean((must(pair.case.p1_mpa) + must(pair.case.p2_mpa)) / (one.p1_mpa + one.p2_mpa)))
        for pair, one in zip(pairs, prepared.references, strict=True)
    ]
    if abs(float(np.mean(means)) - 1.0) < MEAN_MOVED:
        return prepared
    tried = []
    for exponent, compliance in MEAN_LAWS:
        nominal = replace(prepared.nominal, exponent=exponent, compliance=compliance)
        tracks = [
            replace(track, driven_by=one.driven_by)
            for track, one in zip(lay_tracks(pairs, prepared.references, nominal), prepared.tracks, strict=True)
        ]
        gap = angle_gap(pairs, [angle_under(*case_pressures(track), track, nominal) for track in tracks])
        tried.append((float(np.std(gap)), replace(prepared, tracks=tracks, nominal=nominal)))
    return min(tried, key=lambda one: one[0])[1]


def must(column: Column | None) -> Column:
    assert column is not None
    return column

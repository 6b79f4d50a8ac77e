"""Records of the rig beside their baselines, on one regular grid and smoothed: what the diagnosis computes on.

Pairs by name, then by command; says which records pair and which do not. No effect and no verdict is known here.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import gaussian_filter1d

from rig.errors import RecordError
from rig.gap.records.usable import LONGEST_GAP_S, SHORTEST_S, check_scale, hole, reasons, silent_monitor, usable
from rig.record import Column, Record

SMOOTHING_S = 0.012
"""Standard deviation of the symmetric smoothing; the sample time when that is longer."""
GRID_S = 0.01
"""Finest grid on which effects are fitted."""
SAME_COMMAND = 0.1
"""Two commands are the same sweep when their difference is below this share of the command's spread."""

OTHER_P0_MPA = 0.01
"""Sweeps whose commanded P0 differs by more are not the same sweep."""
CLIPPED = 0.1
"""A column that stands at its end for more than this share of the time is said to be clipped."""
SHIFTED_MPA = 0.03
"""A measured P0 that lies this far from the baselines' is said: another commanded P0, or a shift of both pressures."""


@dataclass(frozen=True)
class Session:
    """One run of one sweep on the grid, smoothed; columns of shape (n,), None where not measured."""

    p1_mpa: Column | None
    p2_mpa: Column | None
    angle_deg: Column


@dataclass(frozen=True)
class Pair:
    """A record of the case, its command, and every baseline session's run of the same sweep."""

    name: str
    dt_s: float
    t_s: Column
    u1_mpa: Column
    u2_mpa: Column
    case: Session
    sessions: tuple[Session, ...]
    used: Column
    """1 where the case and its baselines were measured, 0 in holes and at the smoothing's edges."""
    raw: Record
    raw_baselines: tuple[Record, ...]

    def __len__(self) -> int:
        return len(self.t_s)


@dataclass
class Pairing:
    """All pairs, and what was found out while pairing."""

    pairs: list[Pair]
    pressures: bool
    sessions: int
    p0_mpa: float
    notes: list[str] = field(default_factory=list)
    unpaired: list[str] = field(default_factory=list)
    clipped: bool = False
    """A sensor seems clipped: what cuts off a value cannot be told from that."""


def pair_up(
    records: Sequence[Record], baselines: Sequence[Sequence[Record]], p0_mpa: float, *, pressures: bool = True
) -> Pairing:
    """Pair `records` with the records of each baseline session (one inner list a session).

    Raises RecordError when no record can be used. Without any fitting baseline the pairs have no sessions.
    """
    notes: list[str] = []
    fit = [record for record in records if usable(record, notes)]
    if not fit:
        raise RecordError(reasons(notes))
    sessions = [[record for record in session if usable(record, notes, "baseline ")] for session in baselines]
    sessions = _distinct([session for session in sessions if session], fit, notes)
    _say_repeated(fit[0], sessions, notes)
    found = {id(record): [_partner(record, session) for session in sessions] for record in fit}
    kept, unpaired = _fullest(fit, found, sessions, notes)
    for record in kept:
        check_scale(record, found[id(record)])
        told = [hole(record), *(hole(other, "baseline ") for other in found[id(record)] if other is not None)]
        notes.extend(text for text in told if text)
    p0 = _rest_pressure(kept, p0_mpa, notes)
    _say_shift(kept, [partner for record in kept for partner in found[id(record)] if partner is not None], notes)
    pressed = pressures and _all_have_pressures(kept, found, notes)
    pairs = [_pair(record, found[id(record)], p0, pressed) for record in kept]
    return Pairing(pairs, pressed, len(pairs[0].sessions), p0, notes, unpaired, _clipped(pairs, notes))


def _distinct(sessions: list[list[Record]], case: Sequence[Record], notes: list[str]) -> list[list[Record]]:
    """Each day once, and none that is the case itself: a copy would make the floor too low."""

    def contents(records: Sequence[Record]) -> set[bytes]:
        return {np.asarray(record.angle_deg).tobytes() for record in records}

    seen = contents(case)
    kept = []
    for number, session in enumerate(sessions, 1):
        mine = contents(session)
        if mine & seen:
            notes.append(f"baseline session {number} repeats records of the case or of another session; left out")
            continue
        seen |= mine
        kept.append(session)
    return kept


def _say_repeated(record: Record, sessions: Sequence[Sequence[Record]], notes: list[str]) -> None:
    """A sweep that a session holds more than once: two days in one folder would count as one."""
    for number, session in enumerate(sessions, 1):
        same = [other.name for other in session if _same_command(record, other)]
        if len(same) > 1:
            notes.append(
                f"baseline session {number} holds the sweep of {record.name} {len(same)} times ({', '.join(same[:3])}): one of each is "
                "used; if these are several days, give each its own --baseline"
            )


def _partner(record: Record, session: Sequence[Record]) -> Record | None:
    """The record of a session with the same command: the one of that name when it fits, else the best fitting."""
    named = [other for other in session if other.name == record.name]
    for other in [*named, *session]:
        if _same_command(record, other):
            return other
    return None


def _same_command(record: Record, other: Record) -> bool:
    rests = commanded_rest(record), commanded_rest(other)
    if rests[0] is not None and rests[1] is not None and abs(rests[0] - rests[1]) > OTHER_P0_MPA:
        return False
    length = min(record.t_s[-1], other.t_s[-1])
    if length < 0.8 * max(record.t_s[-1], other.t_s[-1]) and length < SHORTEST_S:
        return False
    t = np.linspace(0.0, length, 400)
    mine = np.interp(t, record.t_s - record.t_s[0], record.dp_cmd_mpa)
    theirs = np.interp(t, other.t_s - other.t_s[0], other.dp_cmd_mpa)
    return bool(np.std(mine - theirs) < SAME_COMMAND * np.std(mine) and abs(np.mean(mine - theirs)) < SAME_COMMAND * np.std(mine))


def _fullest(
    records: Sequence[Record], found: dict[int, list[Record | None]], sessions: Sequence[Sequence[Record]], notes: list[str]
) -> tuple[list[Record], list[str]]:
    """Records that pair with every usable session; a session that fits nothing is dropped, and so are records without a partner."""
    fits = [any(found[id(record)][k] is not None for record in records) for k in range(len(sessions))]
    for k, fit in enumerate(fits):
        if not fit:
            names = ", ".join(sorted(record.name for record in sessions[k])[:3])
            rests = {round(rest, 3) for record in sessions[k] if (rest := commanded_rest(record)) is not None}
            where = f" at P0 {', '.join(f'{rest:g}' for rest in sorted(rests))} MPa" if rests else ""
            notes.append(
                f"baseline session {k + 1} pairs with no record (it holds {names}{where}): other sweeps, or another rig's"
            )
    for record in records:
        found[id(record)] = [partner for partner, fit in zip(found[id(record)], fits, strict=True) if fit]
    if not any(fits):
        return list(records), [record.name for record in records] if sessions else []
    paired = [record for record in records if all(partner is not None for partner in found[id(record)])]
    if not paired:  # sessions with different sweeps: keep for each record those that it has, as many as all have
        paired = [record for record in records if any(partner is not None for partner in found[id(record)])]
    unpaired = [record.name for record in records if record not in paired]
    notes.extend(f"{name}: no baseline of this sweep; left out" for name in unpaired)
    least = min(sum(partner is not None for partner in found[id(record)]) for record in paired)
    for record in paired:
        known: list[Record | None] = [partner for partner in found[id(record)] if partner is not None]
        found[id(record)] = known[:least]
    return paired, unpaired


def _rest_pressure(records: Sequence[Record], p0_mpa: float, notes: list[str]) -> float:
    """P0 of the records: from the set-points, or the facts, or the start of the measured pressures, or else the model's."""
    means = [rest for record in records if (rest := commanded_rest(record)) is not None]
    if means:
        return float(np.median(means))
    measured = _measured_rests(records)
    if not measured:
        return p0_mpa
    rest = float(np.round(np.median(measured), 2))
    if abs(rest - p0_mpa) > 0.02:
        notes.append(f"P0 is {rest:g} MPa by the measured pressures, the model was made at {p0_mpa:g} MPa")
    return max(rest, 0.02)


def commanded_rest(record: Record) -> float | None:
    """P0 that the record was commanded around, MPa; None where it does not say."""
    if record.p1_cmd_mpa is not None and record.p2_cmd_mpa is not None:
        return float(np.nanmedian(0.5 * (record.p1_cmd_mpa + record.p2_cmd_mpa)))
    return float(record.facts["p0_mpa"]) if "p0_mpa" in record.facts else None


def _measured_rests(records: Sequence[Record]) -> list[float]:
    return [
        float(np.nanmedian(0.5 * (record.p1_mpa + record.p2_mpa)))
        for record in records
        if record.p1_mpa is not None and record.p2_mpa is not None
    ]


def _say_shift(records: Sequence[Record], partners: Sequence[Record], notes: list[str]) -> None:
    mine, theirs = _measured_rests(records), _measured_rests(partners)
    if mine and theirs and abs(np.median(mine) - np.median(theirs)) > SHIFTED_MPA:
        notes.append(
            f"P0 is {np.median(mine):.2f} MPa by the measured pressures, {np.median(theirs):.2f} MPa in the baselines: recorded around "
            "another P0, or both pressures are shifted"
        )


def _all_have_pressures(records: Sequence[Record], found: dict[int, list[Record | None]], notes: list[str]) -> bool:
    """Pressures count only when case and baselines have both; a monitor that sees nothing is no monitor."""
    silent = next((f"{record.name}: {said}" for record in records if (said := silent_monitor(record))), None)
    if silent and all(record.has_pressures for record in records):
        notes.append(f"{silent}; broken wire? the angle alone is used")
        return False
    case = all(record.has_pressures for record in records)
    base = all(partner is not None and partner.has_pressures for record in records for partner in found[id(record)])
    if case != base and any(found[id(record)] for record in records):
        notes.append(
            f"pressures were measured {'in the case only' if case else 'in the baselines only'}: the angle alone is used"
        )
    return case and base


def _pair(record: Record, partners: Sequence[Record | None], p0_mpa: float, pressures: bool) -> Pair:
    baselines = tuple(partner for partner in partners if partner is not None)
    dt = max(record.period_s, 1e-4)
    stride = max(1, round(GRID_S / dt))
    length = min([record.t_s[-1] - record.t_s[0], *(other.t_s[-1] - other.t_s[0] for other in baselines)])
    fine = np.arange(0.0, length + 0.5 * dt, dt)
    case, holes = _session(record, fine, dt, stride, pressures)
    sessions = []
    for other in baselines:
        session, more = _session(other, fine, dt, stride, pressures)
        sessions.append(session)
        holes |= more
    t = fine[::stride]
    u1, u2 = _commands(record, fine, p0_mpa)
    used = (~holes).astype(float)
    edge = max(1, round(2 * SMOOTHING_S / (dt * stride)))
    used[-edge:] = 0.0
    return Pair(
        record.name, dt * stride, t, u1[::stride].copy(), u2[::stride].copy(), case, tuple(sessions), used, record, baselines
    )


def _commands(record: Record, t: Column, p0_mpa: float) -> tuple[Column, Column]:
    own = record.t_s - record.t_s[0]
    if record.p1_cmd_mpa is not None and record.p2_cmd_mpa is not None:
        return np.interp(t, own, record.p1_cmd_mpa), np.interp(t, own, record.p2_cmd_mpa)
    half = 0.5 * np.interp(t, own, record.dp_cmd_mpa)
    return p0_mpa + half, p0_mpa - half


def _session(record: Record, t: Column, dt: float, stride: int, pressures: bool) -> tuple[Session, "np.typing.NDArray[np.bool_]"]:
    own = record.t_s - record.t_s[0]
    columns: list[Column | None] = []
    holes = np.zeros(len(t), dtype=bool)
    for column in (record.p1_mpa, record.p2_mpa, record.angle_deg):
        if column is None or (not pressures and column is not record.angle_deg):
            columns.append(None)
            continue
        known = np.isfinite(column)
        times = own[known]
        columns.append(_smooth(np.interp(t, times, column[known]), dt)[::stride].copy())
        after = np.clip(np.searchsorted(times, t), 1, len(times) - 1)
        holes |= times[after] - times[after - 1] > max(LONGEST_GAP_S, 3 * dt)
    assert columns[2] is not None
    return Session(columns[0], columns[1], columns[2]), holes[::stride]


def _smooth(column: Column, dt: float) -> Column:
    smooth: Column = gaussian_filter1d(column, SMOOTHING_S / dt, mode="nearest") if dt < SMOOTHING_S else column
    return smooth


def _clipped(pairs: Sequence[Pair], notes: list[str]) -> bool:
    """Whether a sensor repeats its end value while the command moves on."""
    before = len(notes)
    for pair in pairs:
        for what, unit, column in (
            ("the angle", "deg", pair.raw.angle_deg),
            ("the monitor of p1", "MPa", pair.raw.p1_mpa),
            ("the monitor of p2", "MPa", pair.raw.p2_mpa),
        ):
            known = column[np.isfinite(column)] if column is not None else np.zeros(0)
            if not len(known) or np.ptp(known) == 0.0:
                continue
            for end, word in ((known.max(), "upper"), (known.min(), "lower")):
                if (share := np.mean(known == end)) > CLIPPED:
                    notes.append(
                        f"{pair.name}: {what} stays at its {word} end {end:.4g} {unit} for {100 * share:.0f} % of the time: clipped?"
                    )
    return len(notes) > before

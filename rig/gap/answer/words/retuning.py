"""What fitting the simulator's own parameters again would close, which of them moved, and what the named effects close
beyond that, in sentences. No number is computed here."""

from collections.abc import Sequence

from rig.channels import Channels
from rig.gap.answer.facts import ParameterMove, Retuning
from rig.gap.answer.result import Diagnosis, Interval
from rig.gap.answer.settings import ABSORBED_SHARE, AS_MUCH, LEAST_TOLD
from rig.gap.answer.words.causes import in_pressures
from rig.gap.answer.words.compared import MOST_NAMED
from rig.gap.answer.words.effects import capital, noun_of
from rig.gap.answer.words.sizes import degrees, percent, size
from rig.gap.reference.kinds import ReferenceKind

MOST_MOVES = 4
"""Moves that one sentence lists."""
BOTH_VALVES = "valves_"
"""How the name of a move begins that both valves made alike."""
WHOSE = {
    BOTH_VALVES: "both valves'",
    "valve1_": "valve 1's",
    "valve2_": "valve 2's",
    "joint_": "the joint's",
    "sensor_": "the sensor's",
}
"""How a parameter's name begins -> whose it is."""
QUANTITIES = {
    "gain": "gain",
    "offset_mpa": "offset",
    "offset_deg": "offset",
    "tau_s": "time constant",
    "exhaust_ratio": "ratio of exhausting to filling time",
    "omega_rad_per_s": "natural frequency",
    "damping": "damping",
}
"""What follows in it -> what it is, without the unit of the model's file: a sentence has the unit that people use."""


def absorbed(diagnosis: Diagnosis) -> bool:
    """A gap above the usual one that goes when the simulator's own parameters are fitted again."""
    gap, tuning = diagnosis.gap, diagnosis.retuning
    return tuning is not None and tuning.closes_fraction >= ABSORBED_SHARE and gap.rms_deg > gap.floor_deg


def moves(tuning: Retuning, channels: Channels) -> list[str]:
    """What moves as the simulator is fitted again, a text each, what closes most first.

    Parameters of both valves that move alike are one text. Moves that do not show in the printed digits are left out.
    The muscles' parameters stand together as "curve and loop". Shares of what is closed are given where every share is
    at most the whole: of two moves that work against each other one closes more than that.
    """
    shared = []
    for move in _both_valves_as_one(tuning.moved):
        half, by = 0.5 * (move.high - move.low), move.after - move.before
        here = size(Interval(move.before, move.before - half, move.before + half, move.unit), signed=True, move=by)
        there = size(Interval(move.after, move.low, move.high, move.unit), signed=True, move=by)
        shared += [] if here == there else [(move.share, f"{parameter_words(move.name)} goes from {here} to {there}")]
    if tuning.muscles >= LEAST_TOLD:
        whose = "the muscles'" if channels.has_valves else "its"
        shared.append((tuning.muscles, f"{whose} own curve and loop change"))
    ordered = sorted(shared, key=lambda line: -line[0])
    parts = tuning.closes_fraction > 0.0 and all(share <= 1.0 for share, _ in ordered)
    return [f"{text} ({percent(share)} of that)" if parts and share >= LEAST_TOLD else text for share, text in ordered]


def _both_valves_as_one(moved: Sequence[ParameterMove]) -> list[ParameterMove]:
    """The moves, with those of both valves as one where they come from and go to the same value within their
    uncertainty. Late pressures are closed by both together: listed apart, neither would be the first."""
    by_name = {move.name: move for move in moved}
    found: list[ParameterMove] = []
    for move in moved:
        valve, _, quantity = move.name.partition("_")
        first, second = (by_name.get(f"valve{number}_{quantity}") for number in (1, 2))
        if valve not in ("valve1", "valve2") or first is None or second is None or not _alike(first, second):
            found.append(move)
        elif move is first:
            found.append(_together(first, second, f"{BOTH_VALVES}{quantity}"))
    return found


def _alike(first: ParameterMove, second: ParameterMove) -> bool:
    """Whether two moves come from and go to the same, as surely as it is known where they go."""
    width = max(first.high - first.low, second.high - second.low)
    return max(first.low, second.low) <= min(first.high, second.high) and abs(first.before - second.before) <= width


def _together(first: ParameterMove, second: ParameterMove, name: str) -> ParameterMove:
    """Two moves as one: the means of their values, the narrower interval, and the sum of what they close."""
    surer = min(first, second, key=lambda move: move.high - move.low)
    after, half = 0.5 * (first.after + second.after), 0.5 * (surer.high - surer.low)
    before, share = 0.5 * (first.before + second.before), first.share + second.share
    return ParameterMove(name, before, after, after - half, after + half, first.unit, share)


def parameter_words(name: str) -> str:
    """A parameter of a model's file in words: "valve1_offset_mpa" is told in kPa, so that its unit does not belong in
    its name. One of another package keeps its name."""
    whose = next((start for start in WHOSE if name.startswith(start)), "")
    quantity = QUANTITIES.get(name.removeprefix(whose))
    return f"{WHOSE[whose]} {quantity}" if whose and quantity else name


def what_retuning_closes(diagnosis: Diagnosis) -> str:
    """What re-tuning the simulator's own parameters closes, which moved, and what the effects close beyond that; empty
    where it was not tried."""
    if (tuning := diagnosis.retuning) is None:
        return ""
    sentence = f"{_closes(tuning, diagnosis.reference)}{_moved(tuning, diagnosis.channels)}"
    others = [name for name in tuning.looks_like if name not in {cause.effect for cause in diagnosis.causes}]
    if absorbed(diagnosis) and others and not in_pressures(diagnosis):
        sentence += f" In these records any of these would look the same: {_first_of(others)}."
    if diagnosis.reference.by_days or not diagnosis.named or diagnosis.gap.after_deg >= diagnosis.gap.rms_deg:
        return sentence
    return f"{sentence} {_beyond(diagnosis, tuning)}".rstrip()


def _closes(tuning: Retuning, reference: ReferenceKind) -> str:
    """How far the simulator's error falls, without a full stop."""
    before, after = degrees(tuning.before_deg), degrees(tuning.after_deg)
    # the gap is measured against the fingerprint, re-tuning against the parameters without it
    described = reference is ReferenceKind.FINGERPRINT
    whose = "the error of its parameters alone (without the fingerprint)" if described else "its error"
    if tuning.closes_fraction <= 0.0:
        return f"fitting the simulator's own parameters again would not bring {whose} down, {before} deg"
    return (
        f"fitting the simulator's own parameters again would take {whose} from {before} to {after} deg "
        f"({percent(tuning.closes_fraction)} of the mean square)"
    )


def _moved(tuning: Retuning, channels: Channels) -> str:
    """Which parameters moved, as the end of that sentence."""
    if moved := "; ".join(moves(tuning, channels)[:MOST_MOVES]):
        return f": {moved}."
    return f"; no {'valve, ' if channels.has_valves else ''}joint or sensor parameter moves plainly."


def _first_of(effects: Sequence[str]) -> str:
    """The first effects of a list by name, and how many more there are."""
    more = f" and {len(effects) - MOST_NAMED} more" if len(effects) > MOST_NAMED else ""
    return f"{', '.join(map(noun_of, effects[:MOST_NAMED]))}{more}"


def _beyond(diagnosis: Diagnosis, tuning: Retuning) -> str:
    """What the named effects close that re-tuning does not; empty where neither closes anything."""
    gap = diagnosis.gap
    # shares of the error that each was measured on: a fingerprint's and its parameters' are not the same
    more = 1.0 - (gap.after_deg / max(gap.rms_deg, 1e-12)) ** 2 - tuning.closes_fraction
    alone = len(diagnosis.named) == 1
    what, closes = (noun_of(diagnosis.named[0].effect), "closes") if alone else ("what is named", "closes together")
    if abs(more) < AS_MUCH:
        if tuning.closes_fraction < AS_MUCH:
            return ""
        where = "the angle" if in_pressures(diagnosis) else "these records"
        return f"That is as much as {what} {closes}: in {where} the one looks like the other."
    if more < 0.0:
        return f"That closes more than {what} alone: the simulator is also off in what it has."
    if tuning.closes_fraction <= 0.0:
        return f"{capital(what)} {closes} {100 * more:.0f} %."
    return f"Beyond that, {what} {closes} another {100 * more:.0f} %."

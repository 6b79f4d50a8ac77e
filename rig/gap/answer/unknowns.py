"""Where an answer says that something unknown is there: because that is likeliest, or because the named effects leave
too many degrees of the gap."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from rig.gap.answer.findings import Findings, Kept
from rig.gap.answer.kept_effects import dropped_effects, effects_not_kept, share_closed
from rig.gap.answer.result import Cause
from rig.gap.answer.smoothed_gap import SmoothedGap
from rig.gap.evidence.posterior import Posterior
from rig.gap.hypotheses.inverse_problems import ANGLE, PRESSURES
from rig.gap.hypotheses.library import NONE, UNKNOWN
from rig.gap.settings import ABOVE_FLOOR, EITHER_CHANCE, EVEN_CHANCE, LARGE_GAP, LEAST_EXPLAINED


@dataclass(frozen=True)
class Unknowns:
    """What is unknown beside the named effects, or in their place."""

    suspected: list[Cause]
    """By the likelihood."""
    by_degrees: list[Cause]
    """Because of the degrees that are left: without a probability of its own."""
    below_floor: list["Small"]
    """Suspected where nothing stands above the floor: notes, and no causes."""

    @property
    def causes(self) -> list[Cause]:
        """Those that the answer names as causes."""
        return [*self.suspected, *self.by_degrees]

    def notes(self, kept: Sequence[Kept]) -> list[str]:
        """A line for each that is no cause."""
        return [
            f"something small that is not in the library may act{' as well' if kept else ''}, at the "
            f"{small.cause.stage} ({100.0 * small.cause.confidence:.0f} %): {small.why}"
            for small in self.below_floor
        ]


@dataclass(frozen=True)
class Small:
    """Something unknown that is suspected and too small to be a gap."""

    cause: Cause
    why: str


@dataclass(frozen=True)
class _Suspect:
    """Something unknown that the likelihood suspects."""

    cause: Cause
    left: float | None = None
    """What the named effect leaves beyond all that may differ on a healthy rig, in floors; None where no effect is
    named."""


def unknowns(findings: Findings, kept: Sequence[Kept], gap: SmoothedGap) -> Unknowns:
    """What is unknown beside the kept effects, which leave that of the `gap`."""
    suspected = _suspected(findings, kept, gap.before_deg)
    standing, below = list[Cause](), list[Small]()
    for one in suspected:
        if why := _why_no_gap(findings, one, kept, gap):
            below.append(Small(one.cause, why))
        else:
            standing.append(one.cause)
    by_degrees = [] if standing else _larger_part(kept, gap)
    stated = {cause.judged_on for cause in (*(one.cause for one in suspected), *by_degrees)}  # as a cause or in a note
    by_degrees += _beyond_the_class(findings, gap.before_deg, stated)
    return Unknowns(standing, by_degrees, below)


def _why_no_gap(findings: Findings, suspect: _Suspect, kept: Sequence[Kept], gap: SmoothedGap) -> str:
    """Why a suspect is only a note, and no cause: nothing stands above the floor for it. Empty where something does.

    That is so where the named effect leaves nothing beyond all that may differ on the suspect's factor; or where the
    gap goes below the floor with the named effects; or where there was none, neither in the angle nor on the suspect's
    factor. It is never so where nothing is named and not all effects were asked
    about: the suspect may be one of the others.
    """
    if suspect.left is not None and suspect.left <= ABOVE_FLOOR:
        return "beyond all that may differ, nothing is left above the floor"
    if gap.stays_above or (findings.limited and not kept):
        return ""
    if gap.was_above:
        return "with what is named nothing is left above the floor"
    return "" if _stands_out(findings, suspect.cause.judged_on) else "nothing stands above the floor"


def _suspected(findings: Findings, kept: Sequence[Kept], gap_deg: float) -> list[_Suspect]:
    """Something unknown for each factor where that is the likeliest, or stands beside the effect."""
    found = []
    left_out = [id(posterior) for posterior, _ in effects_not_kept(findings, kept)]
    dropped = [id(posterior) for posterior, _ in dropped_effects(findings, kept)]
    for posterior in findings.posteriors:
        useless = id(posterior) in left_out
        if posterior.found and (posterior.fit is None or posterior.beside > EVEN_CHANCE or useless):
            near = sorted(posterior.fits, key=lambda name: -posterior.probability[name])[:2]
            chance = posterior.probability[UNKNOWN] if posterior.fit is None else posterior.beside
            chance = 1.0 - posterior.probability[NONE] if useless else chance
            if id(posterior) in dropped:
                chance = min(chance, EITHER_CHANCE)
            named = kept and not useless
            found.append(_Suspect(_unknown_on(posterior, gap_deg, near, chance), posterior.beyond if named else None))
    return found


def _larger_part(kept: Sequence[Kept], gap: SmoothedGap) -> list[Cause]:
    """Something unknown where the kept effects explain too little of the gap. Where they close nothing of the angle's
    gap and yet explain the pressures, it lies behind the monitors."""
    if not kept or not gap.stays_above:
        return []
    share, weakest = min(((share_closed(one.posterior, one.fit), one) for one in kept), key=lambda pair: pair[0])
    if not gap.is_explained_too_little(share):
        return []
    first = max(kept, key=lambda one: gap.before_deg - one.alone_deg) if gap.shrinks else weakest
    stage, factor = first.fit.effect.stage, first.posterior.problem.name
    if not gap.shrinks and share >= LEAST_EXPLAINED:
        stage, factor = "joint", ANGLE
    return [unknown_cause(stage, factor, gap.before_deg, [first.fit.effect.name])]


def _beyond_the_class(findings: Findings, gap_deg: float, stated: Collection[str]) -> list[Cause]:
    """Something unknown on each factor on which more than LARGE_GAP floors are left, unless it is `stated` already.

    What is left is what neither the likeliest effect nor all that may differ on a healthy rig takes up. No healthy rig
    leaves so much. The likelihood may take it for a law that is rougher than usual, or for a build that its simulator
    misses by more; it is something that has no name (docs/decisions/0661, 0662, 0665).
    """
    judged = {one.problem.name: one for one in findings.posteriors}  # of two effects the second, which knows the first
    return [
        _unknown_on(one, gap_deg, [one.best] if one.fit else [])
        for factor, one in judged.items()
        if factor not in stated and one.beyond > LARGE_GAP
    ]


def unknown_cause(
    stage: str, judged_on: str, gap_deg: float, near: Sequence[str] = (), chance: float = EITHER_CHANCE
) -> Cause:
    """Something unknown, which closes nothing of the gap (rms). `near`: the effects most like it. Without a probability
    of its own it has EITHER_CHANCE."""
    return Cause(UNKNOWN, stage, judged_on, None, {}, gap_deg, gap_deg, 0.0, tuple(near), chance)


def _unknown_on(posterior: Posterior, gap_deg: float, near: Sequence[str], chance: float = EITHER_CHANCE) -> Cause:
    """Something unknown on a factor: at the stage of the nearest effect; without one, or where
    the monitors alone show it, at the valves for the pressures and at the joint for the angle."""
    factor = posterior.problem.name
    nowhere = "valve" if factor == PRESSURES else "joint"
    stage = posterior.fits[near[0]].effect.stage if near and posterior.monitors_alone <= EVEN_CHANCE else nowhere
    return unknown_cause(stage, factor, gap_deg, near, chance)


def _stands_out(findings: Findings, name: str) -> bool:
    """Whether the gap of one factor is above its own floor."""
    factors = (one.plain.factor for one in findings.posteriors if one.problem.name == name)
    return any(factor.rms(factor.gap) > ABOVE_FLOOR * factor.floor for factor in factors)

"""Where an answer says that something unknown is there: because it is the likeliest, or because of the degrees that the
named effects leave."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from rig.gap.answer.findings import Findings, Kept
from rig.gap.answer.kept_effects import dropped_effects, effects_not_kept, share_closed
from rig.gap.answer.result import Cause
from rig.gap.evidence.posterior import Posterior
from rig.gap.hypotheses.inverse_problems import ANGLE, PRESSURES
from rig.gap.hypotheses.library import NONE, UNKNOWN
from rig.gap.settings import ABOVE_FLOOR, EITHER_CHANCE, EVEN_CHANCE, FAR, LEAST_EXPLAINED


@dataclass(frozen=True)
class Unknowns:
    """What is unknown beside the named effects, or in their place."""

    suspected: list[Cause]
    """By the likelihood."""
    by_degrees: list[Cause]
    """By the degrees that are left, which have no probability."""
    below_floor: list["Small"]
    """Suspected where nothing stands above the floor: told in the notes, and no causes."""

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
    """Something unknown that is suspected and is no gap."""

    cause: Cause
    why: str


@dataclass(frozen=True)
class _Suspect:
    """Something unknown that the likelihood suspects."""

    cause: Cause
    left: float | None = None
    """Floors that what is named leaves beyond all that may differ; None where it stands in the place of a name."""


def unknowns(findings: Findings, kept: Sequence[Kept], before: float, after: float, floor: float) -> Unknowns:
    """What is unknown where the kept effects take the gap from `before` to `after`; all in deg, rms."""
    suspected = _suspected(findings, kept, before)
    standing, below = list[Cause](), list[Small]()
    for one in suspected:
        if why := _why_no_gap(findings, one, kept, before, after, floor):
            below.append(Small(one.cause, why))
        else:
            standing.append(one.cause)
    by_degrees = [] if standing else _larger_part(kept, before, after, floor)
    told = {cause.judged_on for cause in (*(one.cause for one in suspected), *by_degrees)}  # as a cause or in a note
    by_degrees += _beyond_the_class(findings, before, told)
    return Unknowns(standing, by_degrees, below)


def _why_no_gap(
    findings: Findings, suspect: _Suspect, kept: Sequence[Kept], before: float, after: float, floor: float
) -> str:
    """Why nothing stands above the floor for what is suspected to be something unknown; empty where something does.
    Nothing does where the named causes leave no gap beyond all that may differ of what it was found on; where they
    leave none at all (rms in deg: `before` and `after`), or there was none, and none in what it was found on. It is
    told in the notes, and is no cause; never where nothing is named and it may be an effect that was not asked
    about."""
    if suspect.left is not None and suspect.left <= ABOVE_FLOOR:
        return "beyond all that may differ, nothing is left above the floor"
    above = ABOVE_FLOOR * floor
    if after > above or (findings.limited and not kept):
        return ""
    if above < before:
        return "with what is named nothing is left above the floor"
    return "" if _stands_out(findings, suspect.cause.judged_on) else "nothing stands above the floor"


def _suspected(findings: Findings, kept: Sequence[Kept], before: float) -> list[_Suspect]:
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
            found.append(_Suspect(_unknown_on(posterior, before, near, chance), posterior.beyond if named else None))
    return found


def _larger_part(kept: Sequence[Kept], before: float, after: float, floor: float) -> list[Cause]:
    """Something unknown that makes up the larger part of a gap: see `explains_too_little`. Where nothing is closed of a
    large one it lies behind the monitors: the pressures are explained."""
    if not kept or after <= ABOVE_FLOOR * floor:
        return []
    share, weakest = min(((share_closed(one.posterior, one.fit), one) for one in kept), key=lambda pair: pair[0])
    if not explains_too_little(before, after, floor, share):
        return []
    first = max(kept, key=lambda one: before - one.alone_deg) if after < before else weakest
    stage, factor = first.fit.effect.stage, first.posterior.problem.name
    if after >= before and share >= LEAST_EXPLAINED:
        stage, factor = "joint", ANGLE
    return [unknown_cause(stage, factor, before, [first.fit.effect.name])]


def _beyond_the_class(findings: Findings, before: float, stated: Collection[str]) -> list[Cause]:
    """Something unknown on each factor of which none is `stated` yet, although a reference that differs in all that it
    may still leaves more than FAR floors, with the likeliest effect in it where that is one: by so much no healthy rig
    misses it, and what the likelihood takes for a law that is rougher than usual, or for a build that is missed by
    more, is something that has no name (docs/decisions/0661, 0662, 0665)."""
    judged = {one.problem.name: one for one in findings.posteriors}  # of two effects the second, which knows the first
    return [
        _unknown_on(one, before, [one.best] if one.fit else [])
        for factor, one in judged.items()
        if factor not in stated and one.beyond > FAR
    ]


def explains_too_little(before: float, after: float, floor: float, share: float) -> bool:
    """Whether effects that take a gap (rms in deg) from `before` to `after` leave something unknown: where they close
    less of it than they leave; or nothing of it, and it is large, or they not even half of what they were found on (the
    least `share` of each)."""
    if after < before:
        return closes_little(before, after, floor)
    return share < LEAST_EXPLAINED or after > FAR * floor


def closes_little(before: float, after: float, floor: float) -> bool:
    """Less than LEAST_EXPLAINED of what stands above the floor, in the degrees that somebody at the rig reads: that
    leaves more unexplained than it explains, however rough a law may be."""
    return before - after < LEAST_EXPLAINED * (before - floor)


def unknown_cause(
    stage: str, judged_on: str, gap_deg: float, near: Sequence[str] = (), chance: float = EITHER_CHANCE
) -> Cause:
    """Something unknown, which closes nothing of the gap (rms); `near`: what is most like it. Where it has no
    probability of its own it is believed half."""
    return Cause(UNKNOWN, stage, judged_on, None, {}, gap_deg, gap_deg, 0.0, tuple(near), chance)


def _unknown_on(posterior: Posterior, gap_deg: float, near: Sequence[str], chance: float = EITHER_CHANCE) -> Cause:
    """The same on a factor: at the stage of what is nearest, and where that is like no effect ahead of the monitors or
    behind them."""
    factor = posterior.problem.name
    nowhere = "valve" if factor == PRESSURES else "joint"
    stage = posterior.fits[near[0]].effect.stage if near and posterior.monitors_alone <= EVEN_CHANCE else nowhere
    return unknown_cause(stage, factor, gap_deg, near, chance)


def _stands_out(findings: Findings, name: str) -> bool:
    """Whether the gap of one factor is above its own floor."""
    factors = (one.plain.factor for one in findings.posteriors if one.problem.name == name)
    return any(factor.rms(factor.gap) > ABOVE_FLOOR * factor.floor for factor in factors)

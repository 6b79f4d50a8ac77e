"""What `pamrig gap study odds` does: the prior odds of no cause, of something unknown, of both factors together, and of
a healthy rig, beside each reference, from checks of development cases.

Every factor of every answer counts: what was said of it, and whether something acts on it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from rig.app.gap.study.fitted_checks import judged_factors, origin_of
from rig.blind_check.folder import CheckFolder
from rig.errors import RecordError
from rig.gap.hypotheses.library import LIBRARY, NONE, UNKNOWN
from rig.gap.prior_fitting.odds import EVERY_ODDS, FactorTruth, Judgement, fit_odds, log_likelihood
from rig.gap.priors import Fitted, Odds
from rig.gap.reference.expected import UNCORRECTED
from rig.gap.reference.kinds import ReferenceKind

LEAST_ODDS_FACTORS = 60
"""Fewer tell nothing of odds that lie some nats apart."""
ALSO_FITTED = {ReferenceKind.SESSION.value: ReferenceKind.SESSIONS.value, UNCORRECTED: ReferenceKind.FINGERPRINT.value}
"""References by whose answers the odds of another are fitted too."""


@dataclass(frozen=True)
class FittedOdds:
    """The odds of one reference, and how much likelier they make what was true, in nats a factor."""

    odds: Odds
    factors: int
    gained: float


def with_odds(
    levels: Fitted, folders: Sequence[CheckFolder], left_out: Sequence[str], only: Sequence[str] = ()
) -> tuple[Fitted, dict[str, FittedOdds]]:
    """The levels with the odds that these checks' cases ask for, which were answered by the odds of `levels`, and the
    fit of each reference that enough factors tell of; without the cases of the families `left_out`, and of the odds
    those in `only`, where there are any. RecordError where there are too few cases."""
    judged: dict[str, dict[str, list[Judgement]]] = {}
    for folder in folders:
        for reference, family, one in _judgements(folder, left_out):
            judged.setdefault(reference, {}).setdefault(family, []).append(one)
    most = max(map(_count, judged.values()), default=0)
    if most < LEAST_ODDS_FACTORS:
        raise RecordError(
            f"{most} factors of clear cases beside one reference are there; at least {LEAST_ODDS_FACTORS} are needed"
        )
    telling = {name: judged.get(ALSO_FITTED.get(name, name), {}) for name in levels.levels}
    fits = {
        name: _fitted(list(some.values()), levels.levels[name].odds, only or EVERY_ODDS)
        for name, some in telling.items()
        if _count(some) >= LEAST_ODDS_FACTORS
    }
    changed = {name: replace(levels.levels[name], odds=fit.odds) for name, fit in fits.items()}
    made = origin_of(" ".join(["odds", *(f"--odds {name}" for name in only)]), folders, left_out)
    parts = [f".{name}" for name in only] or [""]
    provenance = levels.provenance.renewed({f"levels.{name}.odds{part}": made for name in fits for part in parts})
    return replace(levels, levels={**levels.levels, **changed}, provenance=provenance), fits


def _count(families: Mapping[str, Sequence[Judgement]]) -> int:
    return sum(map(len, families.values()))


def _fitted(families: Sequence[Sequence[Judgement]], odds: Odds, free: Sequence[str]) -> FittedOdds:
    found = fit_odds(families, odds, free)
    judged = [one for family in families for one in family]
    before, after = (log_likelihood(judged, odds, one) for one in (odds, found))
    return FittedOdds(found, len(judged), after - before)


def _judgements(folder: CheckFolder, left_out: Sequence[str]) -> Iterator[tuple[str, str, Judgement]]:
    """Of every factor, by whose answers its odds are fitted, the family, and what was said and what was true."""
    for factor in judged_factors(folder, left_out):
        probability, (truth, names) = factor.probability, _true(factor.acting)
        right = sum(probability.get(one, 0.0) for one in names)
        none, unknown = probability.get(NONE, 0.0), probability.get(UNKNOWN, 0.0)
        judgement = Judgement(truth, none, unknown, right, factor.alone, factor.after_nothing)
        yield ALSO_FITTED.get(factor.reference, factor.reference), factor.family, judgement


def _true(acting: Sequence[str]) -> tuple[FactorTruth, list[str]]:
    """What is true where these effects act, and the hypotheses that say so."""
    in_library = [effect for effect in acting if effect in LIBRARY]
    if in_library:
        return FactorTruth.EFFECT, in_library
    return (FactorTruth.UNKNOWN, [UNKNOWN]) if acting else (FactorTruth.NONE, [NONE])

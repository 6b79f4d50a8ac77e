"""What `pamrig gap study temperature` does: how far the evidence between effects is believed, from checks of
development cases of families on which the levels that answered them were not fitted."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.app.gap.study.fitted_checks import judged_factors, origin_of
from rig.blind_check.check import levels_of
from rig.blind_check.folder import CheckFolder
from rig.errors import RecordError
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.prior_fitting.temperature import NamedFactor, fit_temperature, log_likelihood
from rig.gap.priors import Fitted

LEAST_FACTORS = 40
"""With fewer the temperature is known to no better than a factor of two."""


@dataclass(frozen=True)
class FittedTemperature:
    """The temperature, and what it does to the cases that it was fitted to."""

    temperature: float
    factors: int
    gained: float
    """By how much likelier the true names are, nats a factor."""
    held_before: float
    held: float
    """Share of the factors whose set holds the true name."""


def with_temperature(
    levels: Fitted, folders: Sequence[CheckFolder], left_out: Sequence[str]
) -> tuple[Fitted, FittedTemperature]:
    """The levels with the temperature that these checks' cases ask for, which were answered at that of `levels`;
    without the cases of the families `left_out`. RecordError where there are too few, where a check was answered at
    another temperature, or by levels that were fitted on one of its families: there all fits better than on a rig that
    nobody has seen."""
    families: dict[str, list[NamedFactor]] = {}
    for folder in folders:
        named = list(_named(folder, left_out))
        _check_answered(folder, levels.prior.temperature, {family for family, _ in named})
        for family, factor in named:
            families.setdefault(family, []).append(factor)
    count = sum(map(len, families.values()))
    if count < LEAST_FACTORS:
        raise RecordError(
            f"{count} factors with one effect of the library are there; at least {LEAST_FACTORS} are needed"
        )
    stated = levels.prior.temperature
    found = fit_temperature(list(families.values()), stated)
    judged = [one for some in families.values() for one in some]
    fit = FittedTemperature(
        found,
        count,
        log_likelihood(judged, found / stated) - log_likelihood(judged, 1.0),
        float(np.mean([one.held(1.0) for one in judged])),
        float(np.mean([one.held(found / stated) for one in judged])),
    )
    made = {"prior.temperature": origin_of("temperature", folders, left_out)}
    prior = replace(levels.prior, temperature=found)
    return replace(levels, prior=prior, provenance=levels.provenance.renewed(made)), fit


def _check_answered(folder: CheckFolder, temperature: float, families: set[str]) -> None:
    """RecordError where the levels that answered a check, with cases of these families, knew one of them, or had
    another temperature."""
    answered_by = levels_of(folder)
    if known := sorted(families.intersection(answered_by.provenance.families)):
        raise RecordError(
            f"{folder.root}: the levels that answered it were fitted on {', '.join(known)}, where laws fit better than "
            "on another rig: ask by levels of other families (gap calibrate --leave-out), or leave these out "
            "(--leave-out)"
        )
    if answered_by.prior.temperature != temperature:
        raise RecordError(
            f"{folder.root}: it was answered at a temperature of {answered_by.prior.temperature:g}, and --priors has "
            f"{temperature:g}"
        )


def _named(folder: CheckFolder, left_out: Sequence[str]) -> Iterator[tuple[str, NamedFactor]]:
    """The factors on which one effect of the library acts and nothing else, with their family."""
    for factor in judged_factors(folder, left_out):
        if len(factor.acting) == 1 and factor.acting[0] in LIBRARY:
            yield factor.family, _chances(factor.effects, factor.acting[0])


def _chances(effects: Mapping[str, float], true: str) -> NamedFactor:
    others = [chance for name, chance in effects.items() if name != true]
    return NamedFactor(np.array([effects.get(true, 0.0), *others]))

"""The interval of a fitted size: how far one may be off who says how large an effect is.

The likelihood knows the standard deviation d of a number v by noise and by what may differ without being a gap, not
what a law that is not the rig's own makes of it. The number lies within v -+ k s, s^2 = d^2 + (law rho v)^2 for a law
that usually misses the share rho, where k and `law` are fitted as split conformal prediction does (Lei et al., JASA
113, 2018, 1094): k is the quantile of how far the sizes of development cases were off, in s, the mean of the plant
families' (`rig.gap.answer.how_far.prediction_interval` says why). Where nothing describes the rig, its simulator's own
parameters are wrong as well and change a size; such references have numbers of their own.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.gap.answer.result import Interval
from rig.gap.hypotheses.fit import Fit
from rig.gap.hypotheses.library import FREE_JOINT
from rig.gap.plan.next_experiment import spreads
from rig.gap.priors import Reach
from rig.gap.reference.kinds import ReferenceKind
from rig.model.effect_stages import EFFECT_STAGES
from rig.record import Column

SIZE_LEVEL = 0.95
"""Of the interval."""
SIZE_LAW_SHARES = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Shares that are tried."""


@dataclass(frozen=True)
class NamedSize:
    """A number of a rightly named effect of a development case, in the number's unit."""

    value: float
    deviation: float
    """Standard deviation by the likelihood."""
    rho: float
    """Its law's usual error, as a share."""
    truth: float
    family: str = ""
    """Of plants."""


def reference_of(kind: ReferenceKind) -> str:
    """Which of the fitted reaches holds beside a reference."""
    return "simulated" if kind is ReferenceKind.SIMULATOR else "described"


def intervals(fit: Fit, reach: Reach) -> dict[str, Interval]:
    """Fitted numbers with 95 % intervals, within what their law allows; fixed shapes with none. What a law says of the
    joint that it acts on is none of its numbers."""
    known = {number.name: number for number in EFFECT_STAGES[fit.applied.stage].numbers}
    spread = spreads(fit)
    by_name = {}
    numbers = {name: value for name, value in fit.applied.numbers.items() if name not in FREE_JOINT}
    for name, value in numbers.items():
        deviation = spread.get(name, spread.get(fit.law.tied.get(name, ""), 0.0))
        half = half_width(float(value), deviation, fit.effect.roughness(fit.forward.prior, fit.law), reach)
        low, high = fit.law.range_of(name, fit.forward.scales)
        ends = max(float(value) - half, min(low, float(value))), min(float(value) + half, max(high, float(value)))
        by_name[name] = Interval(float(value), *ends, known[name].unit)
    return by_name


def half_width(value: float, deviation: float, rho: float, reach: Reach) -> float:
    """Of the interval of a number, in its unit; none of one that was not fitted."""
    return reach.deviations * float(np.hypot(deviation, reach.law * rho * value)) if deviation > 0.0 else 0.0


def deviation_of(value: float, half: float, rho: float, reach: Reach) -> float:
    """The standard deviation behind the half width of an interval."""
    return float(np.sqrt(max((half / reach.deviations) ** 2 - (reach.law * rho * value) ** 2, 0.0)))


def fit_reach(cases: Sequence[NamedSize]) -> Reach:
    """The share with the narrowest intervals (mean logarithm of their width, as a share of the size), and the reach
    that holds SIZE_LEVEL of the cases of a family, on average over them."""
    tried = [_at(cases, law) for law in SIZE_LAW_SHARES]
    return min(tried, key=lambda found: found[0])[1]


def _at(cases: Sequence[NamedSize], law: float) -> tuple[float, Reach]:
    """(mean logarithm of the relative width, the reach) with this share."""
    value, deviation, rho, truth = np.array([(one.value, one.deviation, one.rho, one.truth) for one in cases]).T
    scale = np.hypot(deviation, law * rho * value) + 1e-12 * np.abs(truth)
    off, of = np.abs(value - truth) / scale, np.array([one.family for one in cases])
    reach = float(np.mean([_quantile(off[of == family]) for family in np.unique(of)]))
    width = float(np.mean(np.log(scale / np.abs(truth)))) + float(np.log(max(reach, 1e-12)))
    return width, Reach(law, reach, len(off))


def _quantile(off: Column) -> float:
    """That holds SIZE_LEVEL of further ones like these (n,); the outermost where there are too few."""
    return float(np.sort(off)[min(int(np.ceil((len(off) + 1) * SIZE_LEVEL)), len(off)) - 1])

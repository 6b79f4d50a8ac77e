"""Something that the library does not hold: the evidence for it by itself, and beside an effect."""

import math
from typing import NamedTuple

import numpy as np

from rig.gap.hypotheses.fit import Fit, ForwardModel
from rig.gap.hypotheses.law_errors import rough_law, rough_lines
from rig.gap.likelihood.gaussian import Gaussian
from rig.gap.likelihood.rough_law import RoughLaw
from rig.gap.settings import BEYOND_DAYS, ENVELOPE_HZ, UNKNOWN_EVEN
from rig.record import Column

SIZES = np.exp(np.linspace(np.log(0.1), np.log(1.5), 6))
"""Sizes of something unknown that are tried, as shares of what is to be explained."""


class WithUnknown(NamedTuple):
    """Log evidence (nats) of an effect with something unknown beside it, in the two parts that it is the sum of."""

    needed: float
    """Of the effect as one of two."""
    unneeded: float
    """As if the unknown were all there is and the effect only said as well, too small to be seen: of every effect
    alike, whatever acts. It speaks for something unknown, and not for the effect."""


def beside(fit: Fit, log_alone: float) -> WithUnknown:
    """Something unknown beside a fitted effect, where it has `log_alone` by itself; with what is thought of a second
    beforehand (`Prior.log_beside`)."""
    forward, factor, lines, prior = fit.forward, fit.forward.factor, fit.forward.factor.lines, fit.forward.prior
    moved, rho = lines.of(fit.change), fit.effect.roughness(prior, fit.law)
    expected = factor.healthy.with_variance(rough_lines(lines, moved, rho, prior))
    law = rough_law(factor.healthy, lines, moved, rho)
    left = log_unknown(forward, expected, factor.gap_lines - moved, law)
    return parts(fit.log_evidence - fit.log_law + left + prior.log_beside, log_alone + prior.log_beside)


def parts(log_both: float, log_unneeded: float) -> WithUnknown:
    """What is beyond the unneeded part counts for the effect."""
    unneeded = min(log_both, log_unneeded)
    if unneeded == log_both:
        return WithUnknown(-math.inf, unneeded)
    return WithUnknown(log_both + math.log(-math.expm1(unneeded - log_both)), unneeded)


def log_unknown(forward: ForwardModel, expected: Gaussian, residual: Column, law: RoughLaw | None = None) -> float:
    """Evidence, beside what is `expected` and a `law` that is rough, that there is something unknown in the residual
    (l,) of the lines: as likely a broad process as more of what days differ in than is ever expected."""
    return float(
        np.logaddexp(_log_broad(forward, expected, residual, law), _log_beyond(expected, residual, law)) - np.log(2.0)
    )


def _log_broad(forward: ForwardModel, expected: Gaussian, residual: Column, law: RoughLaw | None) -> float:
    """Evidence for a broad process of any size: lines like those that are left, blurred."""
    factor, prior = forward.factor, forward.prior
    shape = factor.lines.envelope(residual, ENVELOPE_HZ, UNKNOWN_EVEN)
    share = np.maximum(SIZES * factor.rms_of_lines(residual) / forward.moving, 1e-9)
    log_prior = -0.5 * ((np.log(share) - np.log(prior.share)) / prior.share_spread) ** 2
    logs = [expected.with_variance(level**2 * shape).log_density(residual, law) for level in SIZES]
    width = np.log(SIZES[1] / SIZES[0]) / (prior.share_spread * np.sqrt(2 * np.pi))
    return float(np.logaddexp.reduce(np.array(logs) + log_prior + np.log(width)))


def _log_beyond(expected: Gaussian, residual: Column, law: RoughLaw | None) -> float:
    """Evidence for an offset, a gain or a lag that no effect of the library explains."""
    logs = expected.log_densities(residual, np.array(BEYOND_DAYS), law)
    return float(np.logaddexp.reduce(logs)) - float(np.log(len(BEYOND_DAYS)))

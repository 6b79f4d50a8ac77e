"""The hypotheses of one factor and their probabilities: none, every effect of the library, and something unknown."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from rig.gap.effects import Effect, Law
from rig.gap.hypotheses.fit import Fitted, Scene, fit_effect
from rig.gap.reference.expectation import Factor
from rig.gap.settings import ENVELOPE_HZ, UNKNOWN_EVEN, Prior


@dataclass(frozen=True)
class Posterior:
    """Log evidence of what competes on one factor."""

    none: float
    unknown: float
    fitted: tuple[Fitted, ...]
    """Likeliest first."""

    def probabilities(self, log_none: float = 0.0, log_unknown: float = 0.0) -> dict[str, float]:
        """Name -> probability, for these prior odds of none and of unknown against each effect."""
        names = ["none", "unknown", *(one.effect.name for one in self.fitted)]
        logs = np.array([self.none + log_none, self.unknown + log_unknown, *(one.log_evidence for one in self.fitted)])
        shares = np.exp(logs - logsumexp(logs))
        return dict(zip(names, shares.tolist(), strict=True))


def judge(effects: Sequence[Effect], scene: Scene, shows: Callable[[Law], bool], rough: Scene | None = None, workers: int = 2) -> Posterior:
    """Every hypothesis on one factor."""
    with ThreadPoolExecutor(workers) as pool:
        found = pool.map(lambda effect: fit_effect(effect, scene, shows, rough), effects)
        fitted = sorted((one for one in found if one is not None), key=lambda one: -one.log_evidence)
    return Posterior(scene.factor.log_none(), log_unknown(scene.factor, scene.moving, scene.prior), tuple(fitted))


def log_unknown(factor: Factor, moving: float, prior: Prior) -> float:
    """Evidence of a broad process of any size: lines like those of the gap itself, blurred."""
    gap = factor.lines.of(factor.gap)
    shape = factor.lines.envelope(gap, ENVELOPE_HZ, UNKNOWN_EVEN)
    power = float(np.sqrt(np.sum(gap**2) / max(float(factor.lines.used.sum()), 1.0)))
    levels = np.exp(np.linspace(np.log(0.1), np.log(1.5), 6))
    share = np.maximum(levels * power / moving, 1e-9)
    log_prior = -0.5 * ((np.log(share) - np.log(prior.share)) / prior.share_spread) ** 2
    logs = [factor.healthy.with_variance(level**2 * shape).log_density(gap) for level in levels]
    width = np.log(levels[1] / levels[0]) / (prior.share_spread * np.sqrt(2 * np.pi))
    return float(logsumexp(np.array(logs) + log_prior + np.log(width)))

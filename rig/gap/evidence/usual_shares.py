"""What a simulator usually lacks of a healthy rig: a little of effects that every rig has, and its class has not.

Regulators hold a little, a joint has some mass: beside a simulator alone such an effect is a true finding of any rig,
and none of this one's. So beside a simulator each of these effects competes twice: as a gap, at any size, and as what
is usual, at sizes that healthy rigs show; the latter is nothing. Beforehand it is as likely that any of them is usual
as that any effect is a gap.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rig.gap.hypotheses.fit import Fit
from rig.gap.settings import Prior, UsualShares


@dataclass(frozen=True)
class Usual:
    """An effect of which there is as much as a simulator usually lacks of a healthy rig."""

    effect: str
    probability: float


@dataclass(frozen=True)
class Nothing:
    """That nothing acts, the usual included."""

    log_evidence: float
    usual: Usual | None = None
    """What is likeliest to be there at a usual size, where that is likelier than that nothing is."""


def nothing(log_bare: float, fits: Mapping[str, Fit], effects: int, shares: UsualShares | None) -> Nothing:
    """That nothing acts, where it has this log evidence with nothing usual either, its prior odds included, and so many
    effects could be a gap."""
    logs = {name: fit.log_evidence + log_usual(fit, effects, shares) for name, fit in fits.items()}
    total = float(np.logaddexp.reduce([log_bare, *logs.values()]))
    likeliest = max(logs, key=lambda name: logs[name], default="")
    if not likeliest or logs[likeliest] <= log_bare:
        return Nothing(total)
    return Nothing(total, Usual(likeliest, math.exp(logs[likeliest] - total)))


def log_usual(fit: Fit, effects: int, shares: UsualShares | None) -> float:
    """ln of how much likelier it is beforehand that an effect is there at a usual size than that it is a gap of that
    size, as one of so many effects."""
    return -math.inf if shares is None else _log_usual(fit.effect.name, fit.share, effects, shares, fit.forward.prior)


def _log_usual(name: str, share: float, effects: int, shares: UsualShares, prior: Prior) -> float:
    if name not in shares.scales:
        return -math.inf
    return math.log(effects / len(shares.scales)) + shares.log_density(name, share) - prior.log_density(share)


def least_gap_share(name: str, effects: int, shares: UsualShares | None, prior: Prior) -> float:
    """The share of what moves anyhow (rms) from which on an effect, one of so many, is likelier a gap than usual; 0
    where none of it is usual."""
    if shares is None or name not in shares.scales:
        return 0.0
    tried = np.geomspace(1e-4, 3.0, 400).tolist()
    return max((share for share in tried if _log_usual(name, share, effects, shares, prior) > 0.0), default=0.0)

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

from rig.gap.hypotheses.fit import Fit, ForwardModel
from rig.gap.priors import Prior, UsualSizes
from rig.record import Column


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


def nothing(log_bare: float, fits: Mapping[str, Fit], effects: int, usual: UsualSizes | None) -> Nothing:
    """That nothing acts, where it has this log evidence with nothing usual either, its prior odds included, and so many
    effects could be a gap."""
    logs = {name: fit.log_evidence + log_usual(fit, effects, usual) for name, fit in fits.items()}
    total = float(np.logaddexp.reduce([log_bare, *logs.values()]))
    likeliest = max(logs, key=lambda name: logs[name], default="")
    if not likeliest or logs[likeliest] <= log_bare:
        return Nothing(total)
    return Nothing(total, Usual(likeliest, math.exp(logs[likeliest] - total)))


def log_usual(fit: Fit, effects: int, usual: UsualSizes | None) -> float:
    """ln of how much likelier it is beforehand that an effect is there at a usual size than that it is a gap of that
    size, as one of so many effects."""
    if usual is None or fit.effect.name not in usual.scales:
        return -math.inf
    return _log_usual(fit.effect.name, fit.share, fit.floors, effects, usual, fit.forward.prior)


def _log_usual(name: str, share: float, floors: float, effects: int, usual: UsualSizes, prior: Prior) -> float:
    return math.log(effects / len(usual.scales)) + usual.log_density(name, floors) - prior.log_density(share)


def times_usual(name: str, change: Column, effects: int, forward: ForwardModel) -> float:
    """How many times as large a change (n,) by one of so many effects is as the largest in its proportions that is
    likelier usual than a gap; infinite where none of that effect is usual."""
    usual, prior = forward.usual, forward.prior
    if usual is None or name not in usual.scales:
        return math.inf
    share, floors = forward.share_of(change), forward.floors_of(change)
    tried = np.geomspace(1e-3, 1e3, 600).tolist()
    within = [k for k in tried if _log_usual(name, k * share, k * floors, effects, usual, prior) > 0.0]
    return 1.0 / max(within) if within else math.inf

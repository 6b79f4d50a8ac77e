"""How much records tell of each effect, and of one effect against another: Fisher information, additive over records.

The likelihood's own Gaussian (`rig.gap.reference.expectation`) weighs the lines; what a reference is unsure of is
marginalised once a selection of records is made, since its patterns run through all of them. For lines
z ~ N(D s, V + P P') with records r, G = sum over r of X_r' V_r^-1 X_r with X = [P, D] holds all that is needed: the
information about the sizes s is G_DD - G_DP (1 + G_PP)^-1 G_PD (Schur; Pukelsheim, Optimal Design of Experiments, 1993,
ch. 3).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.gap.hypotheses.inverse_problems import PRESSURES, InverseProblem
from rig.gap.plan.settings import MOST_SEPARATION, ONE_DIRECTION
from rig.gap.priors import Prior
from rig.gap.settings import SESSION_S
from rig.record import Column

Places = np.typing.NDArray[np.intp]


@dataclass(frozen=True)
class Information:
    """What each record of a factor tells of some directions."""

    gram: Column
    """(r, k + m, k + m): of each record, the k patterns that run through several records first."""
    directions: int
    """m of them."""
    seconds: Column
    """(r,) length of each record."""
    prior: Prior
    beside_s: float = 0.0
    """Length of the records that are judged together with these: lines of many records are fewer independent ones."""

    def of(self, chosen: Sequence[int]) -> Column:
        """(m, m) information that these records hold together about the directions, in their own sizes."""
        total = self.gram[list(chosen)].sum(axis=0)
        seconds = self.beside_s + float(self.seconds[list(chosen)].sum())
        total = total * min(1.0, SESSION_S / max(seconds, 1e-9))
        split = total.shape[0] - self.directions
        patterns, mixed, directions = total[:split, :split], total[:split, split:], total[split:, split:]
        out: Column = directions - mixed.T @ np.linalg.solve(np.eye(split) + patterns, mixed)
        return out

    def beside(self, chosen: Sequence[int]) -> "Information":
        """The same where these records are made in any case: each with what they tell."""
        made, lasting = self.gram[list(chosen)].sum(axis=0), self.seconds[list(chosen)].sum()
        return replace(self, gram=made + self.gram, seconds=lasting + self.seconds)

    def distinct(self, owners: Sequence[str]) -> list[int]:
        """Directions without those that are, up to sign and size, nearly another one of the same owner."""
        power = self.of(range(len(self.seconds)))
        size = np.sqrt(np.maximum(np.diag(power), 1e-12))
        alike = np.abs(power / np.outer(size, size))
        kept: list[int] = []
        for k, owner in enumerate(owners):
            if all(owners[j] != owner or alike[j, k] < ONE_DIRECTION for j in kept):
                kept.append(k)
        return kept

    def only(self, kept: Sequence[int]) -> "Information":
        """The same about some of the directions."""
        patterns = self.gram.shape[1] - self.directions
        rows = [*range(patterns), *(patterns + k for k in kept)]
        return replace(self, gram=self.gram[:, rows][:, :, rows], directions=len(kept))


def inform(problem: InverseProblem, moved: Column, anew: Column | None = None, beside_s: float = 0.0) -> Information:
    """The information of every record of a factor about directions (l, m) of its lines; `anew` (l, q) are patterns
    whose sizes are others in each record and monitor, at one standard deviation. `beside_s`: see `Information`."""
    factor, prior = problem.forward.factor, problem.forward.prior
    lines, healthy = factor.lines, factor.healthy
    records = _records(problem)
    lasts = np.array(lines.rows) * np.array(lines.dt_s) / _channels(problem)
    seconds = np.bincount(records, weights=lasts).astype(np.float64)
    density = prior.effective / SESSION_S * seconds.sum() / len(healthy.variance)
    scale, owner = np.sqrt(density / healthy.variance)[:, None], np.array(records)[lines.record]
    own = _own_record(healthy.patterns, owner, len(seconds))
    common = np.hstack([healthy.patterns[:, own < 0], moved]) * scale
    anew = np.zeros((len(scale), 0)) if anew is None else anew
    gram = []
    for k in range(len(seconds)):
        here = owner == k
        alone = np.hstack([healthy.patterns[here][:, own == k], *_by_block(anew[here], lines.record[here])])
        gram.append(_of_record(common[here], alone * scale[here]))
    return Information(np.array(gram), moved.shape[1], seconds, prior, beside_s)


def _by_block(patterns: Column, blocks: Places) -> list[Column]:
    """Patterns (l, q) whose sizes are others in each block of lines (l,): each monitor's are a block of their own."""
    return [patterns * (blocks == block)[:, None] for block in np.unique(blocks)]


def _own_record(patterns: Column, owner: Places, records: int) -> Places:
    """(k,) the one record in which a pattern is anything at all; -1 for those that run through several."""
    touched = np.array([np.any(patterns[owner == record] != 0.0, axis=0) for record in range(records)])
    return np.where(touched.sum(axis=0) == 1, touched.argmax(axis=0), -1)


def _of_record(common: Column, own: Column) -> Column:
    """X' X of a record's lines, without what its own patterns may take of it: they need no place among those of all
    records."""
    mixed = own.T @ common
    out: Column = common.T @ common - mixed.T @ np.linalg.solve(np.eye(own.shape[1]) + own.T @ own, mixed)
    return out


def _channels(problem: InverseProblem) -> int:
    return 2 if problem.name == PRESSURES else 1


def _records(problem: InverseProblem) -> list[int]:
    """Which record each block of lines belongs to: the monitors come one after the other."""
    blocks = len(problem.forward.factor.lines.rows)
    return [block % (blocks // _channels(problem)) for block in range(blocks)]


def separations(information: Column) -> Column:
    """(m, m) in standard deviations: how far direction i at its size lies from direction j at any size; on the
    diagonal, from nothing."""
    power = np.maximum(np.diag(information), 0.0)
    shared = information**2 / np.maximum(power[None, :], 1e-12)
    left = np.sqrt(np.maximum(power[:, None] - shared, 0.0))
    np.fill_diagonal(left, np.sqrt(power))
    return left


def log_odds(separation: float, prior: Prior) -> float:
    """Nats by which the t likelihood of `rig.gap.likelihood.gaussian` prefers the truth over a rival that many standard
    deviations away, in the mean."""
    total = prior.degrees + prior.effective
    return float(0.5 * total * np.log1p(separation**2 / total))


def needed_separation(nats: float, prior: Prior, quantile: float) -> float:
    """Standard deviations at which the log odds pass `nats` with a chance that belongs to the normal `quantile`: they
    scatter by about the separation itself."""
    if nats <= 0.0:
        return 0.0
    from scipy.optimize import brentq  # a tenth of a second to import, and a diagnosis alone plans nothing

    def short(separation: float) -> float:
        scatter = separation / (1.0 + separation**2 / (prior.degrees + prior.effective))
        return log_odds(separation, prior) - quantile * scatter - nats

    return float(brentq(short, quantile, MOST_SEPARATION))

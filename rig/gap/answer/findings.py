"""Everything that an answer is made of, and the evidence that it carries."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.gap.answer.chain import STAGES
from rig.gap.answer.facts import JUDGED_BESIDE, Evidence, Judged, RecordGap, Retuning
from rig.gap.answer.how_far.held_out import HowFar
from rig.gap.evidence.posterior import Posterior
from rig.gap.hypotheses.fit import Fit
from rig.gap.hypotheses.inverse_problems import PRESSURES
from rig.gap.priors import Fitted
from rig.gap.raw_tests.signature import Signature
from rig.gap.reference.expected import Expected
from rig.gap.reference.gaps import rms_of
from rig.model.parameters import Model
from rig.record import Column

STATED = 1e-4
"""A factor states the probabilities of its hypotheses down to this one; those of all effects stand in the ranking."""


@dataclass(frozen=True)
class Findings:
    """Everything that an answer is made of."""

    expected: Expected
    simulator: Model | None
    posteriors: tuple[Posterior, ...]
    signatures: list[Signature]
    retuning: Retuning | None
    settings: Fitted
    misfit_deg: float | None = None
    """How far the simulator as it stands is from the earlier days, where there are any."""
    limited: bool = False
    """Effects that the rig may have were not asked about."""

    @property
    def angle(self) -> Posterior:
        """The angle's factor."""
        return self.posteriors[-1]

    @property
    def pressures(self) -> Posterior | None:
        """The pressures' factor where they were measured."""
        return self.posteriors[0] if self.posteriors[0].problem.name == PRESSURES else None

    @property
    def named(self) -> list[tuple[Posterior, Fit]]:
        """The effects that are the likeliest explanation of their factor, each once, upstream first."""
        found: dict[str, tuple[Posterior, Fit]] = {}
        for posterior in self.posteriors:
            if posterior.found and posterior.fit is not None:
                found.setdefault(posterior.best, (posterior, posterior.fit))
        return list(found.values())


@dataclass(frozen=True)
class Kept:
    """A named effect that the answer keeps, with the factor that it was found on."""

    posterior: Posterior
    fit: Fit
    alone_deg: float
    """Rms of the simulator's error with this effect alone in it."""


def evidence_of(
    findings: Findings, right: Sequence[float], gaps: Sequence[Column], far: HowFar, added: bool
) -> Evidence:
    """What the answer rests on; `right` is how probable what it says of each factor is, `gaps` (n,) the gap of each
    pair's angle, deg."""
    pairs = findings.expected.pairs
    before = [rms_of([gap], [pair]) for gap, pair in zip(gaps, pairs, strict=True)]
    after = [float(np.sqrt(value)) for value in far.per_record_deg2] if added else before
    return Evidence(
        factors={
            _judged_on(posterior): _judged(posterior, chance)
            for posterior, chance in zip(findings.posteriors, right, strict=True)
        },
        signatures=findings.signatures,
        records=[RecordGap(pair.name, one, other) for pair, one, other in zip(pairs, before, after, strict=True)],
        sessions=len(pairs[0].days),
        pressures_used=findings.expected.driven,
        unpaired=findings.expected.pairing.unpaired,
        model_misfit_deg=findings.misfit_deg,
        pairing=findings.expected.pairing.matches,
    )


def _judged_on(posterior: Posterior) -> str:
    return f"{posterior.problem.name}{JUDGED_BESIDE}{posterior.given}" if posterior.given else posterior.problem.name


def _judged(posterior: Posterior, right: float) -> Judged:
    factor = posterior.problem.forward.factor
    return Judged(
        gap=factor.rms(factor.gap),
        floor=factor.floor,
        unit="MPa" if posterior.problem.name == PRESSURES else "deg",
        found=posterior.found,
        probability={name: chance for name, chance in posterior.probability.items() if chance > STATED},
        names=posterior.names,
        unknown_beside=posterior.beside,
        stage_probability=_by_stage(posterior),
        right=right,
    )


def _by_stage(posterior: Posterior) -> dict[str, float]:
    """Probability that the cause lies at each stage."""
    total = dict.fromkeys(STAGES, 0.0)
    for name, fit in posterior.fits.items():
        total[fit.effect.stage] += posterior.probability[name]
    return total

"""What competes on both factors of a question, the pressures and the angle under them, and what the one says of the
other: what a valve does reaches the joint, and what a monitor misreads does not.

The pressures are judged first, then the angle given each hypothesis that they leave likely; its evidence counts for
that hypothesis. The likeliest is followed, and where the joint asks for something beside it, it is heard whether the
monitors alone show what the pressures seem to do.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.gap.evidence.posterior import Posterior, chance_of, judge
from rig.gap.evidence.second import with_second
from rig.gap.hypotheses.inverse_problems import InverseProblem, angle_problem, pressure_problem
from rig.gap.hypotheses.library import NONE, UNKNOWN, Effect, chosen
from rig.gap.question import Question
from rig.gap.reference.expected import Expected, as_referred, read_right
from rig.gap.reference.monitors import misread
from rig.gap.reference.own_days import pressure_days
from rig.gap.settings import EVEN_CHANCE, FAINT, MOST_FAINT, POSSIBLE, STILL_LIKELY, Fitted
from rig.record import Column


@dataclass(frozen=True)
class BothFactors:
    """The effects that compete, by what a question says of them beforehand."""

    question: Question
    effects: Sequence[Effect]

    def judged(self, expected: Expected) -> tuple[Expected, tuple[Posterior, ...]]:
        """What competes on each factor, upstream first; and what was expected of the angle, given what the pressures
        say."""
        if not expected.driven or not self.question.ahead:
            return expected, self._with_second(self._on(self._angle(expected)))
        ahead, under, joint = self._both(expected)
        if ahead.found and joint.found:
            still = as_referred(expected)
            problem = self._angle(still)
            ahead = ahead.as_if_misread(_misread_alone(ahead, joint, problem))
            if ahead.monitors_alone > EVEN_CHANCE:
                return still, (ahead, *self._with_second(self._on(problem)))
        return under, (*self._with_second(ahead), *self._with_second(joint))

    def _both(self, expected: Expected) -> tuple[Posterior, Expected, Posterior]:
        """What competes ahead of the monitors, as the angle says as well; what is expected of the angle given the
        likeliest of it, and what competes there."""
        settings = self.question.settings
        ahead = self._on(pressure_problem(expected, settings))
        days = pressure_days(expected.contexts)
        given = {name: expected_given(ahead, name, expected, days, settings) for name in ahead.likely(STILL_LIKELY)}
        found = {name: self._beside(name, one) for name, one in given.items()}
        faint = _faint(ahead, given, expected, days, settings)
        if len(given) + len(faint) > 1:
            few = _still_open(self.effects, found.values())
            beside_each = found | {name: judge(few, self._angle(one)) for name, one in faint.items()}
            ahead = ahead.with_evidence(_angle_evidence(beside_each, ahead.problem.forward.odds.together))
        best = max((*given, *faint), key=lambda name: ahead.probability[name])
        if best in faint:
            return ahead, faint[best], self._beside(best, faint[best])
        return ahead, given[best], found[best]

    def _angle(self, expected: Expected) -> InverseProblem:
        return angle_problem(expected, self.question.settings)

    def _on(self, problem: InverseProblem, healthy: float = 0.0) -> Posterior:
        told = self.question.experiments.get(problem.name, {})
        return judge(self.effects, _with_withheld(self.question, problem), told, healthy)

    def _beside(self, name: str, expected: Expected) -> Posterior:
        """What competes on the joint beside a hypothesis ahead of the monitors."""
        problem = self._angle(expected)
        return self._on(problem, problem.forward.odds.healthy if name == NONE else 0.0)

    def _with_second(self, alone: Posterior) -> tuple[Posterior, ...]:
        return with_second(self.effects, alone, self.question.experiments.get(alone.problem.name, {}))


def _misread_alone(ahead: Posterior, joint: Posterior, still: InverseProblem) -> float:
    """Probability that what the pressures show is in their monitors alone: that something acts on those and the joint
    moves as if it were not there (`still`), against the likeliest hypothesis ahead of them and what the `joint` then
    asks for beside it. A slow monitor is a slow regulator else, and a friction that undoes it. Beforehand it is as
    likely as something unknown, and that beside something."""
    odds, prior = ahead.problem.forward.odds, ahead.problem.forward.prior
    nothing = judge([], still).log_evidence_of_none
    return chance_of(nothing - joint.log_evidence_beside(odds.together) + odds.unknown + prior.log_beside)


def _angle_evidence(found: Mapping[str, Posterior], together: float) -> dict[str, float]:
    """What the angle says (nats) of the hypotheses ahead of the monitors: its posterior beside each."""
    return {name: one.log_evidence_beside(0.0 if name == NONE else together) for name, one in found.items()}


def _faint(
    ahead: Posterior, given: Mapping[str, Expected], expected: Expected, days: Column, settings: Fitted
) -> dict[str, Expected]:
    """What is expected of the angle by hypotheses ahead of the monitors that are unlikely by the pressures, and that
    read the monitors otherwise than the likeliest: an offset that is really there moves the joint, one of a monitor
    does not, and the pressures alone do not tell these apart."""
    likeliest = next(iter(given.values())).misread
    if likeliest is None:
        return {}
    unlikely = [name for name in ahead.likely(FAINT) if name not in given and name in ahead.fits][:MOST_FAINT]
    made = {name: expected_given(ahead, name, expected, days, settings) for name in unlikely}
    return {name: one for name, one in made.items() if one.misread and one.misread.differs(likeliest)}


def _still_open(effects: Sequence[Effect], found: Iterable[Posterior]) -> list[Effect]:
    """The effects that any of these posteriors holds for possible."""
    possible = {name for one in found for name in one.likely(POSSIBLE)}
    return [effect for effect in effects if effect.name in possible]


def expected_given(ahead: Posterior, name: str, expected: Expected, days: Column, settings: Fitted) -> Expected:
    """What is expected of the angle once a hypothesis holds ahead of the monitors; `days`: the pressures (MPa) of
    the earlier days (n, K). What something unknown does to the pressures, alone or beside an effect, is no error of the
    monitors'."""
    if name == UNKNOWN or ahead.log_odds_beside.get(name, -math.inf) > 0.0:
        return expected
    factor, levels = ahead.forward_of(name).factor, settings.levels[expected.levels]
    return read_right(expected, misread(factor, ahead.residual(name), levels, days))


def _with_withheld(question: Question, problem: InverseProblem) -> InverseProblem:
    """What is thought beforehand of something unknown, with what was thought of the effects that are kept from the
    library."""
    kept_out = [effect for effect in chosen(question.withheld) if not effect.signature]
    acting = sum(any(problem.shows(law) for law in effect.laws) for effect in kept_out)
    if not acting:
        return problem
    odds = problem.forward.odds
    unknown = float(np.logaddexp(odds.unknown, np.log(acting)))
    return replace(problem, forward=replace(problem.forward, odds=replace(odds, unknown=unknown)))

"""Both factors of the likelihood judged together, the pressures and the angle under them: what a valve does reaches the
joint, and what a monitor misreads does not.

The pressures are judged first. Then the angle is judged given each hypothesis that the pressures leave likely, and what
it says counts for that hypothesis. The angle's own answer is the one given the likeliest. Where both factors find
something, one more hypothesis competes: that the monitors alone show it, and the pressures are as they were.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.gap.evidence.posterior import Posterior, chance_of, judge
from rig.gap.evidence.second_cause import with_second
from rig.gap.hypotheses.inverse_problems import InverseProblem, angle_problem, pressure_problem
from rig.gap.hypotheses.library import NONE, UNKNOWN, Effect, chosen
from rig.gap.priors import Fitted
from rig.gap.question import Question
from rig.gap.reference.expected import Expected, as_referred, read_right
from rig.gap.reference.monitors import misread
from rig.gap.reference.own_days import pressure_days
from rig.gap.settings import EVEN_CHANCE, FAINT, MOST_FAINT, POSSIBLE, STILL_LIKELY
from rig.record import Column


@dataclass(frozen=True)
class BothFactors:
    """Judges both factors for one question and the effects that compete."""

    question: Question
    effects: Sequence[Effect]

    def judged(self, expected: Expected) -> tuple[Expected, tuple[Posterior, ...]]:
        """What is expected, with the angle given what the pressures say, and the posterior of each factor, upstream
        first."""
        if not expected.driven or not self.question.any_upstream:
            return expected, self._with_second_cause(self._posterior(self._angle_problem(expected)))
        ahead, under, joint = self._jointly(expected)
        if ahead.found and joint.found:
            still = as_referred(expected)
            problem = self._angle_problem(still)
            ahead = ahead.as_if_misread(_misread_alone(ahead, joint, problem))
            if ahead.monitors_alone > EVEN_CHANCE:
                return still, (ahead, *self._with_second_cause(self._posterior(problem)))
        return under, (*self._with_second_cause(ahead), *self._with_second_cause(joint))

    def _jointly(self, expected: Expected) -> tuple[Posterior, Expected, Posterior]:
        """The posterior ahead of the monitors, by pressures and angle; what is expected given its likeliest hypothesis;
        and the posterior of the angle given that."""
        settings = self.question.settings
        ahead = self._posterior(pressure_problem(expected, settings))
        days = pressure_days(expected.contexts)
        given = {name: expected_given(ahead, name, expected, days, settings) for name in ahead.likely(STILL_LIKELY)}
        found = self._angle_posteriors(given)
        faint = _faint(ahead, given, expected, days, settings)
        if len(given) + len(faint) > 1:
            few = _still_open(self.effects, found.values())
            beside_each = found | {name: judge(few, self._angle_problem(one)) for name, one in faint.items()}
            ahead = ahead.with_evidence(_angle_evidence(beside_each, ahead.problem.forward.odds.together))
        best = max((*given, *faint), key=lambda name: ahead.probability[name])
        if best in faint:
            return ahead, faint[best], self._angle_posterior_given(best, faint[best])
        return ahead, given[best], found[best]

    def _angle_problem(self, expected: Expected) -> InverseProblem:
        return angle_problem(expected, self.question.settings)

    def _posterior(self, problem: InverseProblem, healthy: float = 0.0) -> Posterior:
        experiments = self.question.experiments.get(problem.name, {})
        return judge(self.effects, _with_withheld(self.question, problem), experiments, healthy)

    def _angle_posteriors(self, given: Mapping[str, Expected]) -> dict[str, Posterior]:
        """The posterior of the angle given each hypothesis ahead of the monitors; one for all that leave what is
        expected of it as it was."""
        found: dict[str, Posterior] = {}
        for name, expected in given.items():
            alike = next((other for other in found if given[other] is expected), None)
            found[name] = self._angle_posterior_given(name, expected) if alike is None else found[alike]
        return found

    def _angle_posterior_given(self, name: str, expected: Expected) -> Posterior:
        """The posterior of the angle given a hypothesis ahead of the monitors."""
        problem = self._angle_problem(expected)
        return self._posterior(problem, problem.forward.odds.healthy if name == NONE else 0.0)

    def _with_second_cause(self, alone: Posterior) -> tuple[Posterior, ...]:
        return with_second(self.effects, alone, self.question.experiments.get(alone.problem.name, {}))


def _misread_alone(ahead: Posterior, joint: Posterior, still: InverseProblem) -> float:
    """Probability that the monitors alone show what the pressures seem to do, and the joint moves as if that were not
    there (`still`). It is weighed against the likeliest hypothesis ahead of the monitors together with what the `joint`
    then needs beside it: without this hypothesis a slow monitor would be a slow regulator and a friction that undoes
    it. Its prior odds are those of something unknown times those of something unknown beside an effect."""
    odds, prior = ahead.problem.forward.odds, ahead.problem.forward.prior
    nothing = judge([], still).log_evidence_of_none
    return chance_of(nothing - joint.log_evidence_beside(odds.together) + odds.unknown + prior.log_beside)


def _angle_evidence(found: Mapping[str, Posterior], together: float) -> dict[str, float]:
    """What the angle says (nats) of the hypotheses ahead of the monitors: its posterior beside each."""
    return {name: one.log_evidence_beside(0.0 if name == NONE else together) for name, one in found.items()}


def _faint(
    ahead: Posterior, given: Mapping[str, Expected], expected: Expected, days: Column, settings: Fitted
) -> dict[str, Expected]:
    """What is expected of the angle under hypotheses that are unlikely by the pressures, but take the monitors to read
    otherwise than the likeliest does. An offset of a pressure moves the joint, an offset of its monitor does not, and
    the pressures alone do not tell the two apart."""
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
    """What is expected of the angle if a hypothesis holds ahead of the monitors: under the pressures less what their
    monitors then misread. Something unknown, alone or beside an effect, is taken to be in the pressures and not in the
    monitors. `days`: the pressures (MPa) of the earlier days (n, K)."""
    if name == UNKNOWN or ahead.log_odds_beside.get(name, -math.inf) > 0.0:
        return expected
    factor, levels = ahead.forward_of(name).factor, settings.levels[expected.levels]
    return read_right(expected, misread(factor, ahead.residual(name), levels, days))


def _with_withheld(question: Question, problem: InverseProblem) -> InverseProblem:
    """The problem with the prior odds of the effects that were not asked about added to those of something unknown."""
    kept_out = [effect for effect in chosen(question.withheld) if not effect.signature]
    acting = sum(any(problem.shows(law) for law in effect.laws) for effect in kept_out)
    if not acting:
        return problem
    odds = problem.forward.odds
    unknown = float(np.logaddexp(odds.unknown, np.log(acting)))
    return replace(problem, forward=replace(problem.forward, odds=replace(odds, unknown=unknown)))

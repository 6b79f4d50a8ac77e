"""What a simulator usually lacks of a healthy rig: no gap as large as is usual, a gap beyond, alone and beside another;
and the scales are found again from days whose truth is known."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from support.plants.gap_rigs import model, session

from rig.gap.answer.observations import USUAL
from rig.gap.answer.words.sentences import answers
from rig.gap.diagnosis import diagnose_with_grounds
from rig.gap.evidence.posterior import Posterior
from rig.gap.evidence.second_cause import with_usual
from rig.gap.evidence.usual_sizes import Usual, nothing, times_usual
from rig.gap.hypotheses.library import NONE, chosen
from rig.gap.pipeline import weigh
from rig.gap.plan.capability import capability
from rig.gap.prior_fitting.usual_sizes import Factors, Shown, fit_usual
from rig.gap.priors import Fitted, UsualSizes, fitted
from rig.gap.question import Question
from rig.gap.records.pairs import pair_up
from rig.gap.reference.build import expect
from rig.gap.reference.kinds import ReferenceKind
from rig.model.parameters import AddedEffect

FEW = ("valve_dead_band", "delay", "valve_gain", "sensor_gain", "inertia")
HOLD = UsualSizes({"valve_dead_band": 0.8})
LOUD = AddedEffect("valve_gain", {"gain": 0.12})


def held(width_mpa: float) -> AddedEffect:
    return AddedEffect("valve_dead_band", {"width_mpa": width_mpa, "edge": 1.0})


def settings(usual: UsualSizes | None) -> Fitted:
    known = fitted()
    return replace(known, levels={name: replace(one, usual=usual) for name, one in known.levels.items()})


def pressures(usual: UsualSizes | None, *effects: AddedEffect) -> Sequence[Posterior]:
    """What competes on the pressures of a rig with these effects beside its own simulator."""
    asked = Question(model(), session(61, *effects), [], ReferenceKind.SIMULATOR, library=FEW, settings=settings(usual))
    return [one for one in weigh(asked)[2] if one.problem.name == "pressures"]


@pytest.mark.parametrize("scale", [0.1, 1.0])
def test_a_usual_size_is_somewhere(scale: float) -> None:
    sizes = UsualSizes({"delay": scale})
    whole, _ = quad(lambda log: math.exp(sizes.log_density("delay", math.exp(log))), -25.0, 10.0, limit=200)
    assert whole == pytest.approx(1.0, abs=1e-3)


def test_a_small_hold_is_a_gap_only_where_it_is_not_usual() -> None:
    (bare,) = pressures(None, held(0.003))
    (usual,) = pressures(HOLD, held(0.003))
    assert bare.best == "valve_dead_band"
    assert usual.best == NONE
    assert usual.usual is not None
    assert usual.usual.effect == "valve_dead_band"
    assert usual.usual.probability > 0.9


def test_a_large_hold_is_a_gap_whatever_is_usual() -> None:
    (found,) = pressures(HOLD, held(0.05))
    assert found.best == "valve_dead_band"
    assert found.usual is None


def test_beside_another_cause_what_is_usual_is_no_second_one() -> None:
    both = pressures(None, held(0.004), LOUD)
    (one,) = pressures(HOLD, held(0.004), LOUD)
    assert {posterior.best for posterior in both} == {"valve_dead_band", "valve_gain"}
    assert one.best == "valve_gain"
    assert one.beside < 0.5
    assert one.usual is not None
    assert one.usual.effect == "valve_dead_band"


def test_what_did_not_compete_alone_may_be_usual_beside_another() -> None:
    """A law that leaves more than it changes does not compete by itself, and may fit beside the first cause."""
    (hold,) = pressures(None, held(0.05))
    fit = hold.fits["valve_dead_band"]
    (alone,) = pressures(None, LOUD)
    without = {name: chance for name, chance in alone.probability.items() if name != "valve_dead_band"}
    fits = {name: one for name, one in alone.fits.items() if name != "valve_dead_band"}
    told = with_usual(replace(alone, probability=without, fits=fits), Usual("valve_dead_band", 0.9), fit)
    assert told.fits.keys() <= told.probability.keys()
    assert told.probability["valve_dead_band"] == 0.0
    assert told.best == alone.best


def test_without_anything_usual_nothing_is_as_likely_as_it_was() -> None:
    assert nothing(3.0, {}, 5, None).log_evidence == 3.0
    (healthy,) = pressures(HOLD)
    assert healthy.best == NONE
    assert healthy.usual is None


def test_what_is_usual_is_told_beside_the_answer() -> None:
    found, _ = diagnose_with_grounds(
        model(), session(61, held(0.003)), library=list(FEW), reference="simulator", settings=settings(HOLD)
    )
    assert found.verdict == "none"
    (seen,) = [one for one in found.observations if one.test == USUAL]
    assert seen.effect == "valve_dead_band"
    said = answers(found)["Also seen:"]
    assert "do not" in said
    assert "simulators usually lack of healthy rigs" in said


def days(random: np.random.Generator, scale: float, families: int) -> list[list[Factors]]:
    """Healthy days of families that show a lag as much as half of a normal distribution has it, and no delay."""
    prior, found = fitted().prior, []
    for _ in range(families):
        floors = abs(scale * random.standard_normal())
        share = 0.1 * floors
        # seen as plainly as its size allows: a likelihood of a normal width of 0.2 % of the motion
        nats = 0.5 * (share / 0.002) ** 2 + prior.log_density(share) + math.log(0.002 / share)
        found.append([({"valve_lag": Shown(nats, share, floors), "delay": Shown(-4.0, 0.01, 0.1)}, {})])
    return found


def test_the_scale_of_what_healthy_rigs_show_is_found_again() -> None:
    sizes = fit_usual(days(np.random.default_rng(5), 0.4, 60), fitted().prior)
    assert sizes is not None
    assert set(sizes.scales) == {"valve_lag"}
    assert sizes.scales["valve_lag"] == pytest.approx(0.4, rel=0.35)


def test_where_no_healthy_rig_shows_anything_nothing_is_usual() -> None:
    quiet: list[list[Factors]] = [[({"delay": Shown(-4.0, 0.01, 0.1)}, {"inertia": Shown(-3.0, 0.02, 0.2)})]] * 5
    assert fit_usual(quiet, fitted().prior) is None


def test_a_size_that_is_usual_is_none_that_a_rig_can_tell() -> None:
    """What `gap capability` says can be seen is no smaller than what is usual, and just as large where nothing is."""
    expected = expect(ReferenceKind.SIMULATOR, False, model(), pair_up(session(61), [], model().p0_mpa))
    effects = [effect for effect in chosen(None) if effect.name in FEW]

    def detectable(usual: UsualSizes | None) -> dict[str, float | None]:
        return {one.effect: one.detectable for one in capability(expected, effects, settings(usual)).abilities}

    bare, usual = detectable(None), detectable(HOLD)
    hold, held_back = bare.pop("valve_dead_band"), usual.pop("valve_dead_band")
    assert hold is not None
    assert held_back is not None
    assert held_back > 1.5 * hold
    assert usual == bare


@pytest.mark.parametrize("effects", [5, 12])
def test_so_many_times_the_largest_usual_size_is_a_gap(effects: int) -> None:
    (found,) = pressures(HOLD, held(0.003))
    fit = found.fits["valve_dead_band"]
    change = fit.change * HOLD.scales["valve_dead_band"] / fit.floors
    once = times_usual("valve_dead_band", change, effects, fit.forward)
    assert 0.2 < once < 0.6, "a scale is usual"
    assert times_usual("valve_dead_band", 2.0 * change, effects, fit.forward) == pytest.approx(2.0 * once, rel=0.05)
    assert times_usual("delay", change, effects, fit.forward) == math.inf
    assert times_usual("valve_dead_band", change, effects, replace(fit.forward, usual=None)) == math.inf

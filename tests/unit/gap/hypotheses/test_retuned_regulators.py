"""What is unsure of a simulator's regulators: taken anew where they likeliest are, and through a cause."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from support.plants.gap_rigs import model, session

from rig.gap.diagnosis import diagnose_with_grounds
from rig.gap.hypotheses import fit
from rig.gap.hypotheses.fit import ForwardModel, UncertainParameters, settled
from rig.gap.hypotheses.inverse_problems import pressure_forward
from rig.gap.hypotheses.library import UNKNOWN
from rig.gap.pipeline import Grounds
from rig.gap.priors import BuildSpread, fitted
from rig.gap.records.pairs import pair_up
from rig.gap.reference.build import expect
from rig.gap.reference.kinds import ReferenceKind
from rig.gap.response.causes import Applied, ready
from rig.record import Column, Record


def forward(records: Sequence[Record], kind: ReferenceKind = ReferenceKind.SIMULATOR) -> ForwardModel:
    """The pressures of these records against what the simulator expects."""
    days = [] if kind is ReferenceKind.SIMULATOR else [session(80)]
    return pressure_forward(expect(kind, True, model(), pair_up(records, days, model().p0_mpa)), fitted())


def unsure_of(one: ForwardModel) -> UncertainParameters:
    assert one.unsure is not None
    return one.unsure


def test_nothing_moves_without_a_size_and_the_patterns_are_those_of_the_factor() -> None:
    here = forward(session(81))
    unsure = unsure_of(here)
    moved = unsure.at(np.zeros(2), None)
    assert np.max(np.abs(moved.nonlinear)) < 1e-12
    taken = here.factor.lines.of(moved.patterns) * unsure.spread
    assert taken == pytest.approx(here.factor.healthy.patterns[:, unsure.which], abs=1e-6)


@pytest.mark.parametrize("sizes", [(0.5, 0.0), (-0.4, 0.0), (0.0, 0.3), (0.4, -0.2)])
@pytest.mark.parametrize("cause", [None, Applied("delay", {"delay_s": 0.04})])
def test_what_bends_and_what_is_in_proportion_make_up_the_other_regulators(
    sizes: tuple[float, float], cause: Applied | None
) -> None:
    unsure = unsure_of(forward(session(82)))
    none, there = unsure.at(np.zeros(2), cause), unsure.at(np.array(sizes), cause)
    causes = [] if cause is None else ready([cause], there.response)
    # what the other regulators give under the commands, by steps so small that each is in proportion
    steps = np.linspace(0.0, 1.0, 41)[:-1] + 0.0125
    small = [unsure.at(step * np.array(sizes), cause).patterns @ np.array(sizes) / 40.0 for step in steps]
    whole = there.nonlinear + there.patterns @ np.array(sizes) + there.change(causes) - none.change(causes)
    assert np.max(np.abs(whole - sum(small))) < 0.1 * np.max(np.abs(whole))


@pytest.mark.parametrize("times", [0.6, 1.5])
def test_a_sisters_regulators_leave_nothing_once_they_are_taken_anew(times: float) -> None:
    here = forward(session(83))
    unsure = unsure_of(here)
    other = unsure.at(np.array([times - 1.0, 0.0]), None)
    gap = other.nonlinear + other.patterns @ np.array([times - 1.0, 0.0])  # the records of just such a rig
    rig = replace(here, factor=replace(here.factor, gap=gap))
    found = settled(rig)
    assert found.response.regulators[0][1] == pytest.approx(times * here.response.regulators[0][1], rel=0.15)
    plain = rig.factor.healthy.chi_square(rig.factor.lines.of(gap))
    anew = found.factor.healthy.chi_square(found.factor.lines.of(found.factor.gap))
    assert anew < plain


def test_earlier_days_know_their_regulators() -> None:
    assert forward(session(84), ReferenceKind.SESSION).unsure is None


def by_flow(set_point: Column, seed: int) -> Column:
    """A regulator that no first-order lag follows: it opens in proportion to the error and to its integral, and lets
    air out more slowly than in."""
    pressure, integral, out, dt_s = float(set_point[0]), 0.0, np.empty(len(set_point)), 0.001
    for row, goal in enumerate(set_point):
        for _ in range(5):
            wanted = 20.0 * (goal - pressure) + 200.0 * integral
            flow = min(max(wanted, -0.3), 0.45)
            integral += (goal - pressure) * dt_s if flow == wanted else 0.0
            pressure += flow * dt_s
        out[row] = pressure
    return out + 3e-4 * np.random.default_rng(seed).standard_normal(len(out))


def through_other_regulators(record: Record) -> Record:
    half = 0.5 * np.asarray(record.dp_cmd_mpa)
    return replace(record, p1_mpa=by_flow(0.2 + half, 1), p2_mpa=by_flow(0.2 - half, 2))


def test_a_law_that_leaves_more_than_it_changes_does_not_stand_for_what_a_simulator_misses(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    records = session(71, after=through_other_regulators)
    weighed = []
    for told in (fit.leaves_more_than_it_changes, lambda *_: False):
        monkeypatch.setattr(fit, "leaves_more_than_it_changes", told)
        _, grounds = diagnose_with_grounds(model(), records)
        assert isinstance(grounds, Grounds)
        weighed.append(grounds.posteriors[0].probability)
    with_rule, without = weighed
    rough = "fill_exhaust_asymmetry"
    assert without[rough] > 10.0 * with_rule[rough], "by its roughness alone"
    assert with_rule[UNKNOWN] > 10.0 * with_rule[rough]


def test_what_a_simulator_misses_may_be_more_on_this_build_than_is_usual() -> None:
    """Of a rig without any gap: less than usual is as it is, and the more, the more unlikely a build."""
    from scipy.stats import t as student  # two thirds of a second to import

    factor, spread = forward(session(85)).factor, BuildSpread(0.3, 4.0)
    own = factor.healthy.chi_square(factor.gap_lines) / 5.0  # a healthy record of a quarter of the effective lines
    levels = []
    for times in (0.3, 3.0, 6.0, 12.0):
        usual = replace(factor, healthy=replace(factor.healthy, variance=own * factor.healthy.variance / times**2))
        found = usual.of_its_class(usual, spread).healthy
        more = 0.0 if found.as_well is None else float(np.sum(found.as_well))
        levels.append(float(np.log(np.sqrt(1.0 + more / np.sum(found.variance)))))
        likely = student.logpdf([levels[-1], 0.0], 4.0, 0.0, 0.3)
        assert found.log_chance == pytest.approx(likely[0] - likely[1])
    assert levels[0] == 0.0
    assert np.all(np.diff(levels) > 0.0)
    assert levels[-1] < np.log(12.0), "how unlikely such a build is counts"

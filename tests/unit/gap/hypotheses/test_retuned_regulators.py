"""What is unsure of a simulator's regulators: taken anew where they likeliest are, and through a cause."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from support.gap_rigs import model, session

from rig.gap.hypotheses.fit import Scene, Unsure, settled
from rig.gap.hypotheses.propagate import Applied, ready
from rig.gap.hypotheses.scenes import pressure_scene
from rig.gap.records.pairs import pair_up
from rig.gap.reference.build import Kind, expect
from rig.gap.settings import fitted
from rig.record import Record


def scene(records: Sequence[Record], kind: Kind = Kind.SIMULATOR) -> Scene:
    """The pressures of these records against what the simulator expects."""
    days = [] if kind is Kind.SIMULATOR else [session(80)]
    return pressure_scene(expect(kind, True, model(), pair_up(records, days, model().p0_mpa)), fitted())


def unsure_of(one: Scene) -> Unsure:
    assert one.unsure is not None
    return one.unsure


def test_nothing_moves_without_a_size_and_the_patterns_are_those_of_the_factor() -> None:
    here = scene(session(81))
    unsure = unsure_of(here)
    moved = unsure.at(np.zeros(2), None)
    assert np.max(np.abs(moved.bent)) < 1e-12
    taken = here.factor.lines.of(moved.patterns) * unsure.spread
    assert taken == pytest.approx(here.factor.healthy.patterns[:, unsure.which], abs=1e-6)


@pytest.mark.parametrize("sizes", [(0.5, 0.0), (-0.4, 0.0), (0.0, 0.3), (0.4, -0.2)])
@pytest.mark.parametrize("cause", [None, Applied("delay", {"delay_s": 0.04})])
def test_what_bends_and_what_is_in_proportion_make_up_the_other_regulators(
    sizes: tuple[float, float], cause: Applied | None
) -> None:
    unsure = unsure_of(scene(session(82)))
    none, there = unsure.at(np.zeros(2), cause), unsure.at(np.array(sizes), cause)
    causes = [] if cause is None else ready([cause], there.response)
    # what the other regulators give under the commands, by steps so small that each is in proportion
    steps = np.linspace(0.0, 1.0, 41)[:-1] + 0.0125
    small = [unsure.at(step * np.array(sizes), cause).patterns @ np.array(sizes) / 40.0 for step in steps]
    whole = there.bent + there.patterns @ np.array(sizes) + there.change(causes) - none.change(causes)
    assert np.max(np.abs(whole - sum(small))) < 0.1 * np.max(np.abs(whole))


@pytest.mark.parametrize("times", [0.6, 1.5])
def test_a_sisters_regulators_leave_nothing_once_they_are_taken_anew(times: float) -> None:
    here = scene(session(83))
    unsure = unsure_of(here)
    other = unsure.at(np.array([times - 1.0, 0.0]), None)
    gap = other.bent + other.patterns @ np.array([times - 1.0, 0.0])  # the records of just such a rig
    rig = replace(here, factor=replace(here.factor, gap=gap))
    found = settled(rig)
    assert found.response.regulators[0][1] == pytest.approx(times * here.response.regulators[0][1], rel=0.1)
    plain = rig.factor.healthy.chi_square(rig.factor.lines.of(gap))
    anew = found.factor.healthy.chi_square(found.factor.lines.of(found.factor.gap))
    assert anew < plain


def test_earlier_days_know_their_regulators() -> None:
    assert scene(session(84), Kind.SESSION).unsure is None

"""What may differ in the pressures without being a gap: a joint that moves otherwise than expected pushes air back to
its regulators, one muscle's against the other's; regulators that hold other pressures than a reference knows them at
follow faster or slower."""

from dataclasses import replace

import numpy as np
import pytest
from support.plants.ringing_joint import weighed

from hil.reference.cases import Purpose, bench_of, draw_sheet
from rig.blind_check.source import records_of
from rig.gap.hypotheses.library import NONE
from rig.gap.records.pairs import pair_up
from rig.gap.reference.build import expect
from rig.gap.reference.expectation import motion_doubt
from rig.gap.reference.expected import Expected
from rig.gap.reference.kinds import ReferenceKind
from rig.gap.reference.operating_point import speed_doubt
from rig.record import Column


@pytest.fixture(scope="module")
def beside_a_day() -> Expected:
    """Two records of a healthy day beside another."""
    bench = bench_of(draw_sheet(Purpose.DEVELOPMENT, 909, 10, "mckibben")[0])
    first, second = (records_of(day)[:2] for day in bench.baselines[:2])
    return expect(ReferenceKind.SESSION, False, None, pair_up(second, [first], bench.excitations[0].p0_mpa))


def motion_doubt_at(expected: Expected, deg: float) -> tuple[Column, Column]:
    """Of both valves, where the joint swings by so many degrees at 1 Hz beside what its pressures do to it."""
    moved = []
    for context, base in zip(expected.contexts, expected.base, strict=True):
        pair = context.pair
        angle = base + deg * np.sin(2 * np.pi * pair.dt_s * np.arange(len(pair)))
        moved.append(replace(context, pair=replace(pair, case=replace(pair.case, angle_deg=angle))))
    first, second = np.split(motion_doubt(moved, expected.base, expected.response)[:, 0], 2)
    return first, second


def test_a_joint_that_its_pressures_move_so_pushes_nothing_back(beside_a_day: Expected) -> None:
    assert not np.any(motion_doubt_at(beside_a_day, 0.0))


def test_twice_the_motion_pushes_twice_and_the_valves_against_each_other(beside_a_day: Expected) -> None:
    once, twice = motion_doubt_at(beside_a_day, 1.0), motion_doubt_at(beside_a_day, 2.0)
    for one, two in zip(once, twice, strict=True):
        assert two == pytest.approx(2.0 * one, abs=1e-12)
    assert np.all(np.sign(once[0]) == -np.sign(once[1]))
    assert 1e-6 < float(np.std(once[0])) < 1e-2, "MPa, by a degree at 1 Hz"


def test_what_a_ringing_joint_pushes_back_is_no_gap_of_the_regulators() -> None:
    regulators, joint = weighed()
    assert regulators.best == NONE, "something unknown, with more than 99 %, by what is made up for late alone"
    assert joint.best == "inertia"


def speed_doubt_at(expected: Expected, p1_off_mpa: float, p2_off_mpa: float) -> tuple[Column, Column]:
    """Of both valves, (n, 2) each, where the pressures are as expected but for a constant."""
    shifted = []
    for context in expected.contexts:
        pair, reference = context.pair, context.reference
        case = replace(pair.case, p1_mpa=reference.p1_mpa + p1_off_mpa, p2_mpa=reference.p2_mpa + p2_off_mpa)
        shifted.append(replace(context, pair=replace(pair, case=case)))
    first, second = np.split(speed_doubt(shifted, expected.response), 2)
    return first, second


def test_at_the_pressures_where_they_are_known_they_are_as_quick_as_known(beside_a_day: Expected) -> None:
    for valve in speed_doubt_at(beside_a_day, 0.0, 0.0):
        np.testing.assert_allclose(valve, 0.0, atol=1e-12)


def test_each_regulator_by_its_own_pressure_and_in_proportion(beside_a_day: Expected) -> None:
    first, second = speed_doubt_at(beside_a_day, -0.03, 0.0)
    np.testing.assert_allclose(second, 0.0, atol=1e-12)
    np.testing.assert_allclose(speed_doubt_at(beside_a_day, 0.06, 0.0)[0], -2.0 * first, atol=1e-12)
    assert np.all(np.std(first, axis=0) > 1e-5), "MPa: as slow and as uneven"
    assert abs(float(np.corrcoef(first.T)[0, 1])) < 0.9, "two ways to be otherwise"

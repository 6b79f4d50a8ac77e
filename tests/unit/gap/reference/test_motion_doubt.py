"""A joint that moves otherwise than expected pushes air back to its regulators, one muscle's against the other's."""

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
from rig.record import Column


@pytest.fixture(scope="module")
def beside_a_day() -> Expected:
    """Two records of a healthy day beside another."""
    bench = bench_of(draw_sheet(Purpose.DEVELOPMENT, 909, 10, "mckibben")[0])
    first, second = (records_of(day)[:2] for day in bench.baselines[:2])
    return expect(ReferenceKind.SESSION, False, None, pair_up(second, [first], bench.excitations[0].p0_mpa))


def doubt(expected: Expected, deg: float) -> tuple[Column, Column]:
    """Of both valves, where the joint swings by so many degrees at 1 Hz beside what its pressures do to it."""
    moved = []
    for context, base in zip(expected.contexts, expected.base, strict=True):
        pair = context.pair
        angle = base + deg * np.sin(2 * np.pi * pair.dt_s * np.arange(len(pair)))
        moved.append(replace(context, pair=replace(pair, case=replace(pair.case, angle_deg=angle))))
    first, second = np.split(motion_doubt(moved, expected.base, expected.response)[:, 0], 2)
    return first, second


def test_a_joint_that_its_pressures_move_so_pushes_nothing_back(beside_a_day: Expected) -> None:
    assert not np.any(doubt(beside_a_day, 0.0))


def test_twice_the_motion_pushes_twice_and_the_valves_against_each_other(beside_a_day: Expected) -> None:
    once, twice = doubt(beside_a_day, 1.0), doubt(beside_a_day, 2.0)
    for one, two in zip(once, twice, strict=True):
        assert two == pytest.approx(2.0 * one, abs=1e-12)
    assert np.all(np.sign(once[0]) == -np.sign(once[1]))
    assert 1e-6 < float(np.std(once[0])) < 1e-2, "MPa, by a degree at 1 Hz"


def test_what_a_ringing_joint_pushes_back_is_no_gap_of_the_regulators() -> None:
    regulators, joint = weighed()
    assert regulators.best == NONE, "something unknown, with more than 99 %, by what is made up for late alone"
    assert joint.best == "inertia"

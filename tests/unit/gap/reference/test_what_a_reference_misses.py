"""What a reference is known to miss of its own records it misses of others as well: in the floor, and line by line."""

from dataclasses import replace

import numpy as np
import pytest
from support.plants.gap_rigs import model, session

from rig.gap.diagnosis import diagnose_with_grounds
from rig.gap.hypotheses.inverse_problems import pressure_forward
from rig.gap.likelihood.gaussian import Gaussian
from rig.gap.pipeline import Grounds
from rig.gap.priors import fitted
from rig.identify.response.fingerprint import fingerprint_of
from rig.model.parameters import Model
from rig.model.response.fingerprint_check import fingerprint_checksum

MISSED_MPA = 0.006


def with_fingerprint(missed_mpa: float) -> Model:
    """The simulator with a fingerprint of its rig that says how far its regulators are off, and keeps no records."""
    plain = model()
    made = fingerprint_of(session(70), plain)
    assert made is not None
    said = replace(made, day="", left_out_mpa=(missed_mpa, missed_mpa), misfit_mpa=(0.0, 0.0))
    return replace(plain, fingerprint=replace(said, checksum=fingerprint_checksum(said, plain)))


@pytest.fixture(scope="module", params=["fingerprint", "simulator"])
def answers(request: pytest.FixtureRequest) -> list[tuple[float, Grounds]]:
    """Floor and grounds of a healthy rig, for regulators that are known well and badly."""
    out = []
    for missed_mpa in (0.0, MISSED_MPA):
        found, grounds = diagnose_with_grounds(with_fingerprint(missed_mpa), session(71), reference=request.param)
        assert found.verdict == "none"
        assert isinstance(grounds, Grounds)
        out.append((found.gap.floor_deg, grounds))
    return out


def test_the_floor_is_no_less_than_what_regulators_miss(answers: list[tuple[float, Grounds]]) -> None:
    (sure, _), (unsure, grounds) = answers
    response = grounds.expected.response
    pair = grounds.expected.contexts[0]
    p1, p2, dt_s = pair.reference.p1_mpa, pair.reference.p2_mpa, pair.pair.dt_s
    per_mpa = np.std(response.angle(p1, p2, dt_s)) / np.std(p1 - p2)
    through = np.sqrt(2.0) * MISSED_MPA * per_mpa
    assert unsure == pytest.approx(max(sure, through), rel=0.35)
    assert (unsure > 1.01 * sure) == (through > sure)


def test_what_is_missed_lies_in_the_lines_that_answer(answers: list[tuple[float, Grounds]]) -> None:
    spread = [pressure_forward(grounds.expected, fitted()).factor.healthy.variance for _, grounds in answers]
    ratio = spread[1] / spread[0]
    assert ratio[0] > 1.0
    assert ratio == pytest.approx(ratio[0])


def test_a_level_that_its_own_records_say_is_known_more_surely(answers: list[tuple[float, Grounds]]) -> None:
    """Five times that is rarer than five times what is usual of rigs, once either level is the same."""
    (_, usual), (_, own) = ((floor, pressure_forward(grounds.expected, fitted()).factor) for floor, grounds in answers)
    known = replace(own.healthy, pattern_degrees=np.inf, as_well=None)
    fewer = replace(known, degrees=usual.healthy.degrees)
    assert known.degrees > fewer.degrees
    left = np.sqrt(known.variance)

    def drop(healthy: Gaussian) -> float:
        return healthy.log_density(left) - healthy.log_density(5.0 * left)

    assert drop(known) > drop(fewer) + 5.0

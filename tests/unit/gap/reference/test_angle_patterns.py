"""What may differ in the angle: each pattern is by itself, and together they hold what they held before."""

import numpy as np
import pytest
from support.plants.gap_rigs import baselines, model, session

from rig.gap.hypotheses.scenes import parts_of_angle
from rig.gap.records.pairs import pair_up
from rig.gap.reference.build import Expected, Kind, expect
from rig.gap.reference.expectation import ANGLE_PATTERNS, BANK, Parts
from rig.gap.settings import BuildSpread, fitted

GAIN, LOOP = ANGLE_PATTERNS.index("gain"), ANGLE_PATTERNS.index("loop")


@pytest.fixture(scope="module", params=[Kind.SESSION, Kind.SIMULATOR])
def beside(request: pytest.FixtureRequest) -> Expected:
    days = [list(baselines()[0])] if request.param is Kind.SESSION else []
    return expect(request.param, False, model(), pair_up(session(40), days, model().p0_mpa))


@pytest.fixture
def parts(beside: Expected) -> Parts:
    return parts_of_angle(beside)[0]


def alike(one: np.ndarray, other: np.ndarray) -> float:
    """Cosine of the angle between two patterns; 0 of one that is nothing."""
    return float(abs(one @ other) / max(float(np.linalg.norm(one) * np.linalg.norm(other)), 1e-300))


def test_a_wider_loop_holds_no_gain_and_the_terms_neither(parts: Parts) -> None:
    gain, loop = parts.columns[:, GAIN], parts.columns[:, LOOP]
    assert np.linalg.norm(gain) > 0.0
    assert np.linalg.norm(loop) > 0.0
    assert alike(gain, loop) < 1e-9
    terms = [parts.columns[:, k] for k, name in enumerate(parts.names) if name == BANK]
    assert len(terms) > 5
    assert max(abs(float(term @ gain)) for term in terms) < 1e-9 * float(gain @ gain)
    assert max(abs(float(term @ loop)) for term in terms) < 1e-9 * float(gain @ gain)


def test_all_that_a_joint_rubbing_more_does_is_gain_and_loop(beside: Expected, parts: Parts) -> None:
    response, more = beside.response, []
    for track, base in zip(beside.tracks, beside.base, strict=True):
        angle, dt_s = base - response.zero_deg, track.pair.dt_s
        still = np.zeros_like(angle)
        more.append(response.balanced(angle, still, np.full_like(angle, 1.02), dt_s) - angle)
    wider = parts.lines.of(np.concatenate(more))
    found = np.linalg.lstsq(parts.columns[:, [GAIN, LOOP]], wider, rcond=None)[0]
    left = wider - parts.columns[:, [GAIN, LOOP]] @ found
    # the pattern is of a joint without a mass of its own: what the mass adds is small
    assert np.linalg.norm(left) < 0.05 * np.linalg.norm(wider)


def test_on_another_build_what_may_differ_may_be_several_times_as_much(parts: Parts) -> None:
    levels = fitted().levels["sister"].angle
    known = parts.factor(levels, fitted().prior)
    healthy, wider = known.healthy, known.of_any_build(BuildSpread(0.2, 4.0)).healthy
    once = healthy.patterns[:, GAIN]
    drop = [one.log_density(once) - one.log_density(12.0 * once) for one in (healthy, wider)]
    assert drop[0] > drop[1] + 3.0, "twelve times is rarer where the levels are known to be this build's"
    assert healthy.log_density(once) == pytest.approx(wider.log_density(once), abs=1.5), "once costs nothing"
    assert known.of_any_build(None) is known

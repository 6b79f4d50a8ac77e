"""What may differ in the angle: each pattern is by itself, and together they hold what they held before."""

from dataclasses import replace

import numpy as np
import pytest
from support.plants.gap_rigs import baselines, model, session

from rig.gap.hypotheses.inverse_problems import parts_of_angle
from rig.gap.priors import BuildSpread, fitted
from rig.gap.records.pairs import pair_up
from rig.gap.reference.build import expect
from rig.gap.reference.expectation import Parts
from rig.gap.reference.expected import Expected
from rig.gap.reference.kinds import ReferenceKind
from rig.gap.reference.patterns import ANGLE_PATTERNS, BANK, VISCOUS

GAIN, LOOP = ANGLE_PATTERNS.index("gain"), ANGLE_PATTERNS.index("loop")


@pytest.fixture(scope="module", params=[ReferenceKind.SESSION, ReferenceKind.SIMULATOR])
def beside(request: pytest.FixtureRequest) -> Expected:
    days = [list(baselines()[0])] if request.param is ReferenceKind.SESSION else []
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
    for context, base in zip(beside.contexts, beside.base, strict=True):
        angle, dt_s = base - response.zero_deg, context.pair.dt_s
        still = np.zeros_like(angle)
        more.append(response.balanced(angle, still, np.full_like(angle, 1.02), dt_s) - angle)
    wider = parts.lines.of(np.concatenate(more))
    found = np.linalg.lstsq(parts.columns[:, [GAIN, LOOP]], wider, rcond=None)[0]
    left = wider - parts.columns[:, [GAIN, LOOP]] @ found
    # the pattern is of a joint without a mass of its own: what the mass adds is small
    assert np.linalg.norm(left) < 0.05 * np.linalg.norm(wider)


def test_all_that_more_viscous_friction_does_is_what_days_differ_in() -> None:
    paired = pair_up(session(40), [list(baselines()[0])], model().p0_mpa)
    expected = expect(ReferenceKind.SESSION, False, model(), paired)
    parts, response, less = parts_of_angle(expected)[0], expected.response, []
    slower = replace(response, balance=replace(response.balance, viscous_s=response.balance.viscous_s + 2e-3))
    for context, base in zip(expected.contexts, expected.base, strict=True):
        # solved from the slower joint: what the usual one does otherwise
        angle, dt_s = base - response.zero_deg, context.pair.dt_s
        pulled = 2e-3 * np.gradient(angle, dt_s)
        less.append(slower.balanced(angle, pulled, np.ones_like(angle), dt_s) - angle)
    faster = parts.lines.of(np.concatenate(less))
    named = [parts.names.index(name) for name in ("gain", "lag_s", "loop", VISCOUS)]
    assert share_left(faster, parts.columns[:, named]) < 0.05
    assert share_left(faster, parts.columns[:, named[:-1]]) > 0.08, "and a lag with a wider loop is not all of it"
    assert max(alike(parts.columns[:, named[-1]], parts.columns[:, one]) for one in named[:-1]) < 1e-9


def share_left(column: np.ndarray, patterns: np.ndarray) -> float:
    """Of (l,), beside patterns (l, m); by norms."""
    left = column - patterns @ np.linalg.lstsq(patterns, column, rcond=None)[0]
    return float(np.linalg.norm(left) / np.linalg.norm(column))


def test_a_simulators_viscous_friction_is_asked_for_and_not_doubted() -> None:
    alone = expect(ReferenceKind.SIMULATOR, False, model(), pair_up(session(40), [], model().p0_mpa))
    assert VISCOUS not in parts_of_angle(alone)[0].names
    assert VISCOUS not in fitted().levels["simulator"].angle.patterns


def test_on_another_build_what_may_differ_may_be_several_times_as_much() -> None:
    parts = parts_of_angle(expect(ReferenceKind.SIMULATOR, True, model(), pair_up(session(40), [], model().p0_mpa)))[0]
    levels = fitted().levels["sister"].angle
    known = parts.factor(levels, fitted().prior)
    healthy, wider = known.healthy, known.of_any_build(BuildSpread(0.2, 4.0)).healthy
    once = healthy.patterns[:, GAIN]
    drop = [one.log_density(once) - one.log_density(12.0 * once) for one in (healthy, wider)]
    assert drop[0] > drop[1] + 3.0, "twelve times is rarer where the levels are known to be this build's"
    assert healthy.log_density(once) == pytest.approx(wider.log_density(once), abs=1.5), "once costs nothing"
    assert known.of_any_build(None) is known

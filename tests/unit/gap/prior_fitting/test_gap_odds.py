"""The prior odds: those under which what was true is likeliest, whatever prior the answers were given under."""

import json
from dataclasses import replace
from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner

from rig.app.gap.study.odds import with_odds
from rig.blind_check.folder import CheckFolder
from rig.cli.gap.study import odds
from rig.errors import RecordError
from rig.gap.prior_fitting.odds import EVERY_ODDS, FactorTruth, Judgement, fit_odds, log_likelihood
from rig.gap.priors import Odds, fitted

SHARES = (0.6, 0.1, 0.3)
"""Of factors that hold nothing, something unknown, an effect."""


def drawn(count: int, seed: int, odds: Odds) -> list[Judgement]:
    """Factors judged with evidence that is right on average, under these odds in place of the shares."""
    random, judged = np.random.default_rng(seed), []
    for truth in random.choice(3, count, p=SHARES):
        logs = random.normal(0.0, 1.5, 3) + 2.25 * (np.arange(3) == truth)
        logs += np.array([odds.none, odds.unknown, 0.0])
        stated = np.exp(logs - np.logaddexp.reduce(logs))
        none, unknown, _ = stated
        judged.append(Judgement(FactorTruth(truth), float(none), float(unknown), float(stated[truth])))
    return judged


@pytest.mark.parametrize(("none", "unknown"), [(-1.0, 1.0), (3.0, -3.0)])
def test_odds_come_out_as_often_as_what_they_are_of_is_there(none: float, unknown: float) -> None:
    before = Odds(none, unknown)
    judged = drawn(4000, 1, before)
    found = fit_odds([judged], before)
    assert found.none == pytest.approx(np.log(SHARES[0] / SHARES[2]), abs=0.25)
    assert found.unknown == pytest.approx(np.log(SHARES[1] / SHARES[2]), abs=0.25)
    further = drawn(2000, 2, before)
    assert log_likelihood(further, before, found) > log_likelihood(further, before, before) + 0.03


def test_every_family_counts_alike_however_many_cases_it_brings() -> None:
    one, other = drawn(400, 3, Odds(2.0, 0.0)), drawn(400, 4, Odds(-2.0, 0.0))
    apart = [fit_odds([family], Odds()).none for family in (one, other)]
    assert apart[0] < apart[1] - 1.0
    both = fit_odds([one, other], Odds()).none
    assert apart[0] + 0.5 < both < apart[1] - 0.5
    assert fit_odds([one * 5, other], Odds()).none == pytest.approx(both, abs=0.1)


def test_of_an_effect_its_own_name_counts_and_no_other() -> None:
    """Both say that it is something of the library, one by another name."""
    wrong, right = (
        log_likelihood([Judgement(FactorTruth.EFFECT, 0.1, 0.2, said)], Odds(), Odds()) for said in (0.1, 0.7)
    )
    assert wrong - right == pytest.approx(np.log(0.1 / 0.7), abs=1e-3)


def with_truth(random: np.random.Generator, odds: Odds, more: float) -> Judgement:
    """A factor that holds an effect `more` nats likelier than by these odds, judged by evidence that is right on
    average under odds that know nothing of that."""
    effect = np.exp(more - odds.none)
    truth = FactorTruth.EFFECT if random.random() < effect / (1.0 + effect) else FactorTruth.NONE
    log = random.normal(0.0, 1.5) + (1.1 if truth is FactorTruth.EFFECT else -1.1) - odds.none
    none = 1.0 / (1.0 + np.exp(log))
    return Judgement(truth, none, 0.0, none if truth is FactorTruth.NONE else 1.0 - none)


def two_factors(count: int, seed: int, odds: Odds, together: float) -> list[Judgement]:
    """Of each draw the factor ahead of the monitors, whose share of effects is `together` nats more where the other one
    holds something, judged under odds that know nothing of it."""
    random = np.random.default_rng(seed)
    others = random.random(count) < 0.5
    return [replace(with_truth(random, odds, together * other), alone=1.0 - other) for other in others.astype(float)]


@pytest.mark.parametrize("together", [0.0, 2.0])
def test_how_much_faults_come_together_comes_out(together: float) -> None:
    before = Odds(float(np.log(10.0)), -20.0)
    found = fit_odds([two_factors(6000, 5, before, together)], before)
    assert found.together == pytest.approx(together, abs=0.3)
    assert found.none == pytest.approx(before.none, abs=0.3)


def test_a_factor_beside_which_nothing_was_found_is_judged_as_before() -> None:
    one = Judgement(FactorTruth.EFFECT, 0.9, 0.01, 0.08, alone=1.0)
    assert log_likelihood([one], Odds(), Odds(together=3.0)) == log_likelihood([one], Odds(), Odds())
    beside = replace(one, alone=0.0)
    gained = log_likelihood([beside], Odds(), Odds(together=3.0)) - log_likelihood([beside], Odds(), Odds())
    assert gained == pytest.approx(3.0 - np.log(0.9 + 0.1 * np.exp(3.0)), abs=1e-2)
    assert log_likelihood([beside], Odds(together=3.0), Odds(together=3.0)) == pytest.approx(np.log(0.08), abs=1e-2)


def after_nothing(count: int, seed: int, odds: Odds, healthy: float) -> list[Judgement]:
    """Angles, half of them where nothing was thought ahead of the monitors: of those nothing is `healthy` nats
    likelier, which the odds that judge know nothing of."""
    random = np.random.default_rng(seed)
    return [
        replace(with_truth(random, odds, -healthy * alone), after_nothing=alone)
        for alone in [True, False] * (count // 2)
    ]


@pytest.mark.parametrize("healthy", [-1.5, 0.0, 1.0])
def test_how_likely_a_healthy_rig_is_comes_out_beside_what_is_likely_behind_a_cause(healthy: float) -> None:
    before = Odds(float(np.log(8.0)), -20.0)
    found = fit_odds([after_nothing(3000, 7, before, healthy)], before)
    assert found.healthy == pytest.approx(healthy, abs=0.4)
    assert found.none == pytest.approx(before.none, abs=0.3)


def test_odds_that_are_not_asked_for_stay() -> None:
    before = Odds(3.0, -3.0)
    found = fit_odds([drawn(400, 3, before)], before, ["none"])
    assert found.none != before.none
    assert replace(found, none=before.none) == before
    (only,) = [option for option in odds.params if option.name == "only"]
    assert isinstance(only.type, click.Choice)
    assert tuple(only.type.choices) == EVERY_ODDS


def check_of(folder: Path, cases: int) -> CheckFolder:
    """A scored check in which a healthy rig's angle is called unknown as often as not."""
    for name in ("scores", "answers"):
        (folder / name).mkdir(parents=True)
    for number in range(cases):
        effects = {} if number % 3 else {"backlash": {"stage": "joint", "library_parameter": "width_deg"}}
        row = {"kind": "single" if effects else "none", "effects": [*effects], "ratio": 5.0, "family": "fluidic"}
        sure = 0.9 if number % 2 else 0.4
        angle = {"none": 0.01, "backlash": 0.98, "unknown": 0.01} if effects else {"none": sure, "unknown": 0.99 - sure}
        factors = {"pressures": {"probability": {"none": 1.0}, "found": False}, "angle": {"probability": angle}}
        answer = {"gap": {"floor_source": "session"}, "evidence": {"factors": factors}}
        (folder / "scores" / f"{number}.json").write_text(
            json.dumps(
                {
                    "rows": {"one_day": row},
                    "facts": {"effects": effects, "ratio_angle": 5.0},
                    "naive": {},
                    "sandbox_layers": [],
                }
            )
        )
        (folder / "answers" / f"{number}.json").write_text(json.dumps({"modes": {"one_day": {"diagnosis": answer}}}))
    return CheckFolder(folder)


def test_where_healthy_rigs_got_a_finding_nothing_is_likelier_afterwards(tmp_path: Path) -> None:
    check, shipped = check_of(tmp_path / "check", 60), fitted()
    levels, fits = with_odds(shipped, [check], [])
    assert list(fits) == ["session"], "of the others nothing is told"
    assert fits["session"].factors == 120
    assert fits["session"].gained > 0.0
    before, after = (one.levels["session"].odds for one in (shipped, levels))
    assert after.none + after.healthy > before.none + before.healthy + 0.5, "all of it where nothing was ahead"
    assert {**levels.levels, "session": shipped.levels["session"]} == shipped.levels
    made = levels.provenance.parts["levels.session.odds"]
    assert (made.command, made.seeds, made.families) == ("pamrig gap study odds check", [], ["fluidic"])
    assert made.fitted_on == "60 cases"
    assert levels.provenance == shipped.provenance.renewed({"levels.session.odds": made}), "of its own part alone"
    output = tmp_path / "levels.yaml"
    said = CliRunner().invoke(odds, [str(check.root), "-o", str(output)], catch_exceptions=False)
    assert said.exit_code == 0
    assert "session: no cause" in said.output
    assert fitted(output).levels["session"].odds.none == pytest.approx(fits["session"].odds.none, rel=1e-3)


def test_one_kind_of_odds_alone_has_an_origin_of_its_own(tmp_path: Path) -> None:
    check, shipped = check_of(tmp_path / "check", 60), fitted()
    levels, fits = with_odds(shipped, [check], [], ["healthy"])
    odds_now = fits["session"].odds
    assert replace(odds_now, healthy=shipped.levels["session"].odds.healthy) == shipped.levels["session"].odds
    changed = {path for path, one in levels.provenance.parts.items() if shipped.provenance.parts.get(path) != one}
    assert changed == {"levels.session.odds.healthy"}
    made = levels.provenance.parts["levels.session.odds.healthy"]
    assert made.command == "pamrig gap study odds --odds healthy check"


def test_too_few_factors_are_an_error_and_a_family_can_be_left_out(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="at least 60"):
        with_odds(fitted(), [check_of(tmp_path / "few", 20)], [])
    with pytest.raises(RecordError, match="0 factors"):
        with_odds(fitted(), [check_of(tmp_path / "out", 60)], ["fluidic"])

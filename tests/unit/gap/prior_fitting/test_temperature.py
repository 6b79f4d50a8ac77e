"""How sure names are: the temperature comes out of cases whose truth is known, and moves nothing but names."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from support.plants.gap_rigs import baselines, model, session

from rig.app.gap.calibrating import write
from rig.app.gap.study.temperature import with_temperature
from rig.blind_check.folder import CheckFolder
from rig.cli.gap.study import temperature as command
from rig.errors import RecordError
from rig.gap.evidence.posterior import flattened
from rig.gap.hypotheses.library import NONE, UNKNOWN
from rig.gap.pipeline import answer, weigh
from rig.gap.prior_fitting.temperature import NamedFactor, fit_temperature, log_likelihood
from rig.gap.priors import Fitted, fitted
from rig.gap.question import Question
from rig.gap.reference.kinds import ReferenceKind
from rig.gap.settings import CREDIBLE
from rig.model.parameters import AddedEffect

EFFECTS = 6


def judged(count: int, seed: int, overstated: float) -> list[NamedFactor]:
    """Factors whose evidence is right on average, told as so many times as much; the true name first."""
    random = np.random.default_rng(seed)
    logs = random.normal(0.0, 1.5, (count, EFFECTS)) + 2.25 * (np.arange(EFFECTS) == 0)
    chances = np.exp(overstated * (logs - np.logaddexp.reduce(logs, axis=1)[:, None]))
    return [NamedFactor(0.7 * one / one.sum()) for one in chances]


@pytest.mark.parametrize("overstated", [0.8, 1.0, 2.5])
def test_the_temperature_is_by_how_much_the_evidence_overstates(overstated: float) -> None:
    known = judged(4000, 1, overstated)
    found = fit_temperature([known], 1.0)
    assert found == pytest.approx(overstated, rel=0.1)
    assert fit_temperature([known], 3.0) == pytest.approx(3.0 * overstated, rel=0.1), "of what it was stated at"
    further = judged(4000, 2, overstated)
    assert np.mean([one.held(found) for one in further]) == pytest.approx(CREDIBLE + 0.02, abs=0.03)


def test_every_family_counts_alike_however_many_cases_it_brings() -> None:
    cold, hot = judged(300, 3, 1.0), judged(300, 4, 4.0)
    both = fit_temperature([cold, hot], 1.0)
    assert fit_temperature([cold], 1.0) < both < fit_temperature([hot], 1.0)
    assert fit_temperature([cold * 5, hot], 1.0) == pytest.approx(both, rel=1e-3)


@given(st.lists(st.floats(1e-12, 1.0), min_size=1, max_size=8), st.floats(1.0, 20.0))
def test_hotter_is_flatter_and_nothing_else(chances: list[float], hotter: float) -> None:
    was = np.array(chances)
    now = flattened(was, hotter)
    assert now.sum() == pytest.approx(was.sum())
    assert np.all(np.diff(now[np.argsort(was)]) >= -1e-12), "in their order"
    assert now.max() <= was.max() * (1.0 + 1e-9)
    assert np.allclose(flattened(was, 1.0), was)


def test_of_nothing_nothing_is_made() -> None:
    assert flattened(np.zeros(3), 2.0).tolist() == [0.0, 0.0, 0.0]


def at(temperature: float) -> Fitted:
    return replace(fitted(), prior=replace(fitted().prior, temperature=temperature))


def asked(settings: Fitted) -> Question:
    records = session(93, AddedEffect("gravity_load", {"load_deg": 3.0, "phase_deg": 45.0}))
    return Question(model(), records, [list(day) for day in baselines()], ReferenceKind.SESSIONS, settings=settings)


def test_a_diagnosis_is_as_before_but_for_how_surely_it_tells_effects_apart() -> None:
    cold, hot = (answer(asked(at(temperature)))[0] for temperature in (1.0, 6.0))
    assert (cold.verdict, cold.gap) == (hot.verdict, hot.gap)
    assert [cause.effect for cause in cold.causes] == [cause.effect for cause in hot.causes] == ["gravity_load"]
    assert set(cold.causes[0].ambiguous_with) < set(hot.causes[0].ambiguous_with)
    assert cold.confidence > hot.confidence
    for name, before in cold.evidence.factors.items():
        after = hot.evidence.factors[name].probability
        for kept in (NONE, UNKNOWN):
            assert after.get(kept, 0.0) == pytest.approx(before.probability.get(kept, 0.0))


def test_what_an_experiment_says_is_weighed_once() -> None:
    """Evidence is added before it is divided: what is weighed holds all of it."""
    cold, hot = (weigh(asked(at(temperature)))[2] for temperature in (1.0, 6.0))
    assert [one.probability for one in cold] == [one.probability for one in hot]


def check_of(
    folder: Path, cases: int, family: str = "sleeve", temperature: float = 1.0, fitted_on: str = "fluidic"
) -> CheckFolder:
    """A scored check that is sure of a wrong name in one case of four, answered by levels of one family."""
    for name in ("scores", "answers"):
        (folder / name).mkdir(parents=True)
    for number in range(cases):
        effects = {"backlash": {"stage": "joint", "library_parameter": "width_deg"}}
        row = {"kind": "single", "effects": [*effects], "ratio": 5.0, "family": family}
        sure = 0.02 if number % 4 == 0 else 0.98
        angle = {"none": 0.0, "backlash": sure, "coulomb_friction": 1.0 - sure}
        seldom = {"effect": "inertia", "judged_on": "angle", "probability": 1e-9}
        answer = {
            "gap": {"floor_source": "session"},
            "evidence": {
                "factors": {
                    "pressures": {"probability": {"none": 1.0}, "found": False},
                    "angle": {"probability": angle},
                }
            },
            "ranking": [seldom],
        }
        scored = {"rows": {"one_day": row}, "facts": {"effects": effects, "ratio_angle": 5.0}}
        (folder / "scores" / f"{number}.json").write_text(json.dumps(scored | {"naive": {}, "sandbox_layers": []}))
        (folder / "answers" / f"{number}.json").write_text(json.dumps({"modes": {"one_day": {"diagnosis": answer}}}))
    check, settings = CheckFolder(folder), at(temperature)
    write(replace(settings, provenance=replace(settings.provenance, families=[fitted_on])), check.priors)
    return check


def test_wrong_names_that_were_sure_make_it_hotter(tmp_path: Path) -> None:
    check, settings = check_of(tmp_path / "check", 60), at(1.0)
    levels, fit = with_temperature(settings, [check], [])
    assert fit.factors == 60
    assert levels.prior.temperature == fit.temperature
    right = 0.98 ** (1.0 / fit.temperature)
    wrong = 0.02 ** (1.0 / fit.temperature)
    assert right / (right + wrong) == pytest.approx(0.75, abs=0.05), "as sure as it is right"
    assert fit.gained > 0.0
    assert (fit.held_before, fit.held) == (0.75, 1.0)
    assert levels.provenance.parts["prior.temperature"].command == "pamrig gap study temperature check"
    output = tmp_path / "levels.yaml"
    called = [str(check.root), "--priors", str(check.priors), "-o", str(output)]
    said = CliRunner().invoke(command, called, catch_exceptions=False)
    assert said.exit_code == 0, said.output
    assert "100% of the sets hold them (before 75%)" in said.output
    assert fitted(output).prior.temperature == pytest.approx(fit.temperature, abs=1e-3)


def test_each_check_may_be_answered_by_levels_that_know_the_other_s_family(tmp_path: Path) -> None:
    """As when each family is judged by the others. The second was refused for the family of the first."""
    checks = [check_of(tmp_path / "a", 30, "sleeve", fitted_on="bundle")]
    checks.append(check_of(tmp_path / "b", 30, "bundle", fitted_on="sleeve"))
    _, fit = with_temperature(at(1.0), checks, [])
    assert fit.factors == 60


def test_cases_that_tell_nothing_of_it_are_an_error(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match=r"20 factors .* at least 40"):
        with_temperature(at(1.0), [check_of(tmp_path / "few", 20)], [])
    with pytest.raises(RecordError, match="seen: the levels that answered it were fitted on fluidic"):
        with_temperature(at(1.0), [check_of(tmp_path / "seen", 60, "fluidic")], [])
    with pytest.raises(RecordError, match="0 factors"):
        with_temperature(at(1.0), [check_of(tmp_path / "out", 60)], ["sleeve"])
    with pytest.raises(RecordError, match="warm: it was answered at a temperature of 2, and --priors has 1"):
        with_temperature(at(1.0), [check_of(tmp_path / "warm", 60, temperature=2.0)], [])


def test_no_single_answer_decides() -> None:
    impossible = [NamedFactor(np.array([0.0, 1.0]))]
    assert log_likelihood(impossible, 1.0) == pytest.approx(np.log(1e-4))

"""Scores and counts of the blind check on made-up answers, whose result is known beforehand."""

import json
import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.app.gap.study.absorbed import Absorbed, table
from rig.blind_check.check import result_from
from rig.blind_check.folder import write_json
from rig.blind_check.follow_up import commands_of
from rig.blind_check.generate import left_out
from rig.blind_check.goals import GOALS, bound, figure, figure_text, reached
from rig.blind_check.modes import GROUPS, MODES, asked, names_of
from rig.blind_check.rates import Rate
from rig.blind_check.row import CaseKind, EffectFact, Facts, Round, Row, Scored, Truth, read_scored
from rig.blind_check.score import realised, score_mode
from rig.blind_check.statistics import (
    breakdown,
    mode_result,
    naive_result,
    reliability,
    shuffled_control,
    withheld_result,
)
from rig.blind_check.user_labels import label_of
from rig.errors import RecordError
from rig.gap.hypotheses.library import LIBRARY, effect_class
from rig.model.parameters import Input, Model, MuscleModel, Parameter
from rig.report.check_page import write_page

GAP = {"explained_fraction": 0.95, "rms_deg": 1.0, "floor_deg": 0.2, "ratio": 5.0, "after_deg": 0.3}
KNOWN = ["valve_lag", "backlash", "sensor_gain", "creep", "mains_hum", "coulomb_friction"]


def said(
    *names: str, verdict: str = "explained", ambiguous: tuple[str, ...] = (), stage: str = "", value: float = 0.1
) -> dict:
    causes = [
        {
            "effect": name,
            "ambiguous_with": list(ambiguous) if k == 0 else [],
            "parameters": {"tau_s": {"value": value, "low": value, "high": value}},
            "confidence": 0.9,
            "explained_fraction": 0.95,
            "gap_after_deg": 0.3,
            "judged_on": "angle",
            "stage": stage or (LIBRARY[name].stage if name in LIBRARY else "sensor"),
        }
        for k, name in enumerate(names)
    ]
    where = {"stage": stage or (LIBRARY[names[0]].stage if names and names[0] in LIBRARY else "sensor")}
    return {
        "diagnosis": {"verdict": verdict, "gap": dict(GAP), "where": where, "causes": causes, "notes": []},
        "seconds": 1.0,
    }


def label(*effects: str, kind: str = "") -> Truth:
    return Truth(CaseKind(kind or ("none" if not effects else "single" if len(effects) == 1 else "pair")), effects, 3)


def facts(*effects: str, ratio: float = 5.0, size: float = 0.1) -> Facts:
    stages = {name: EffectFact(LIBRARY[name].stage if name in LIBRARY else "joint", "tau_s", size) for name in effects}
    return Facts(stages, ratio, ratio, ratio)


def row(truth: str, answer: dict, **more: object) -> Row:
    return replace(score_mode("pressures", answer, label(truth), facts(truth)), **({"realised_ef": 0.93} | more))


def test_right_wrong_and_class_of_a_single_effect() -> None:
    right = score_mode("pressures", said("valve_lag", value=0.11), label("valve_lag"), facts("valve_lag"))
    assert (right.exact, right.class_right, right.in_set, right.stage_right, right.detected) == (True,) * 5
    assert right.size_error == pytest.approx(0.1)
    wrong = score_mode("pressures", said("backlash", ambiguous=("valve_lag",)), label("valve_lag"), facts("valve_lag"))
    assert (wrong.exact, wrong.in_set, wrong.stage_right) == (False, True, False)
    alike = next(
        (a, b) for a in LIBRARY for b in LIBRARY if a != b and effect_class(a, False) == effect_class(b, False)
    )
    near = score_mode("angle", said(alike[1]), label(alike[0]), facts(alike[0]))
    assert (near.exact, near.class_right) == (False, True)


def test_silence_and_remainders_are_no_names() -> None:
    nothing = score_mode("pressures", said(verdict="none"), label("backlash"), facts("backlash"))
    assert (nothing.detected, nothing.exact, nothing.in_set) == (False, False, False)
    remainder = score_mode("pressures", said("unknown", verdict="unknown"), label("backlash"), facts("backlash"))
    assert remainder.named == remainder.names == ()
    assert remainder.flagged
    broken = score_mode("pressures", {"error": "RecordError: no", "seconds": 0.1}, label("backlash"), facts("backlash"))
    assert (broken.detected, broken.exact, broken.verdict) == (False, False, "error")


def test_pairs_need_both_names() -> None:
    for names, both in (
        (("valve_lag", "backlash"), True),
        (("backlash", "valve_lag"), True),
        (("valve_lag", "creep", "backlash"), False),
    ):
        scored = score_mode("pressures", said(*names), label("valve_lag", "backlash"), facts("valve_lag", "backlash"))
        assert scored.both is both


def test_a_leak_beside_the_monitor_may_be_placed_on_the_valve_side() -> None:
    for stage, right in (("muscle", True), ("valve", True), ("joint", False)):
        assert score_mode("pressures", said("leak", stage=stage), label("leak"), facts("leak")).stage_right is right


def test_counting_gives_every_figure() -> None:
    rows = [row(name, said(name)) for name in KNOWN] + [
        row("backlash", said("coulomb_friction", verdict="partly_explained"))
    ]
    rows += [
        score_mode("pressures", said(verdict=verdict), label(), facts(ratio=0.0)) for verdict in ("none", "unknown")
    ]
    rows += [
        score_mode("pressures", said("unknown", verdict="unknown"), label("cogging", kind="foreign"), facts("cogging"))
    ]
    result = mode_result(rows)
    assert (result["exact_first"]["k"], result["exact_first"]["n"]) == (6, 7)
    assert (result["false_alarms"]["k"], result["false_alarms"]["n"]) == (1, 2)
    assert (result["unknown_flagged"]["k"], result["unknown_flagged"]["n"]) == (1, 1)
    assert (result["known_kept"]["k"], result["known_kept"]["n"]) == (6, 7)
    assert result["gap_closed"] == pytest.approx(0.93)
    assert result["ef_within_0.05"]["k"] == 7
    parts = breakdown(rows)
    assert parts["confusion"]["backlash"] == {"backlash": 1, "coulomb_friction": 1}
    assert parts["by_ratio"]["5..100"]["exact_first"]["n"] == 7
    for goal in GOALS:
        assert figure_text(figure(result, goal), goal.unit)
        assert bound(goal, "pressures") or bound(goal, "simulator")
    assert reached(result, next(goal for goal in GOALS if goal.key == "exact_first"), "pressures") is False


def test_a_page_of_healthy_cases_alone_is_drawn(tmp_path: Path) -> None:
    rows = [score_mode(mode, said(verdict="none"), label(), facts(ratio=0.0)) for mode in ("pressures", "angle")]
    naive = dict.fromkeys(("always_none", "random", "largest_rmse", "retuned"), "none")
    case = Scored({row.mode: row for row in rows}, dict.fromkeys(("pressures", "angle"), naive), ["audit"])
    result = result_from([case], 1, ("mckibben",)) | {"sealed_sha256": "0"}
    for name in ("page.html", "page.md"):
        write_page(result, tmp_path / name)
    assert "<svg" in (tmp_path / "page.html").read_text()
    assert "| false alarms, 3 baselines | 0.0 % (0..79; 0/1) |" in (tmp_path / "page.md").read_text()


def test_weak_effects_do_not_count_for_names() -> None:
    weak = score_mode("pressures", said("creep"), label("backlash"), facts("backlash", ratio=2.5))
    assert mode_result([weak])["exact_first"]["n"] == 0
    assert mode_result([weak])["detected_ratio_2"]["n"] == 1


def test_shuffled_labels_score_like_chance_and_a_leak_stands_out() -> None:
    """An answering process that knew the labels would score 100 %; against dealt labels even that falls to chance."""
    dealt = random.Random(5)
    truths = [dealt.choice(sorted(LIBRARY)) for _ in range(200)]
    leaky = [row(truth, said(truth)) for truth in truths]
    assert mode_result(leaky)["exact_first"]["rate"] == 1.0
    control = shuffled_control(leaky, seed=1)
    expected = sum((truths.count(name) / 200) ** 2 for name in LIBRARY)
    assert control["exact_first_mean"] == pytest.approx(expected, abs=0.02)
    blind = [row(truth, said(dealt.choice(sorted(LIBRARY)))) for truth in truths]
    assert mode_result(blind)["exact_first"]["high"] < 0.2, "answers that know nothing stay near 1 in 30"


def test_withheld_classes_are_counted_apart() -> None:
    rows = [
        row("backlash", said("unknown", verdict="unknown"), truth_withheld=True),
        row("creep", said("thermal_drift"), truth_withheld=True),
    ]
    rows += [row("valve_lag", said("valve_lag"))]
    result = withheld_result(rows)
    assert (result["flagged"]["k"], result["flagged"]["n"]) == (1, 2)
    assert (result["kept_when_another_class_is_gone"]["k"], result["kept_when_another_class_is_gone"]["n"]) == (1, 1)


def test_naive_baselines_are_scored_by_the_same_rules() -> None:
    result = naive_result([(row(name, said(name)), "none") for name in KNOWN], lambda a, b: a == b)
    assert result["detected"]["k"] == result["exact_first"]["k"] == 0


def test_reliability_bins_hold_all_cases() -> None:
    rows = [row(name, said(name)) for name in KNOWN * 5]
    bins = reliability(rows)
    assert sum(each["right"]["n"] for each in bins) == len(rows)
    assert all(each["stated"] == pytest.approx(0.9) for each in bins)


@pytest.mark.parametrize(
    ("k", "n", "low", "high"),
    [(0, 10, 0.0, 0.2775), (10, 10, 0.7225, 1.0), (50, 100, 0.4038, 0.5962), (1, 120, 0.0015, 0.0457)],
)
def test_wilson_intervals_are_those_of_the_books(k: int, n: int, low: float, high: float) -> None:
    assert Rate(k, n).interval == pytest.approx((low, high), abs=2e-4)


def test_a_rate_of_nothing_is_honest() -> None:
    assert Rate(0, 0).to_json() == {"k": 0, "n": 0, "rate": None, "low": 0.0, "high": 1.0}
    assert str(Rate(0, 0)) == "no cases"


def gain_model() -> Model:
    numbers = {
        "lambda1": 1.0,
        "lambda2": 1.0,
        "xi1": 0.0,
        "xi2": 0.0,
        "phi1": 0.0,
        "phi2": 0.0,
        "beta1": 0.0,
        "beta2": 0.0,
    }
    units = {"theta_divisor_s": 0.005, "u_unit_mpa": 0.2, "y_unit_deg": 1.0, "mean_exponent": 0.0}
    numbers["xi1"] = 0.2
    return Model(
        MuscleModel("mbw", {name: Parameter(value) for name, value in {**numbers, **units}.items()}, Input.PRESSURE)
    )


def columns(gain: float, noise: int) -> dict[str, np.ndarray]:
    t = np.arange(2000) * 0.005
    half = 0.1 * np.sin(np.pi * t)
    angle = gain * 40.0 * np.sin(np.pi * t) + 0.1 * np.random.default_rng(noise).standard_normal(len(t))
    pressures = {"p1_cmd_mpa": 0.2 + half, "p2_cmd_mpa": 0.2 - half, "p1_mpa": 0.2 + half, "p2_mpa": 0.2 - half}
    return {"t_s": t, "dp_cmd_mpa": 2 * half, "angle_deg": angle, **pressures}


@pytest.mark.parametrize(("stated", "expected"), [(None, 0.0), (0.1, 1.0), (0.05, 0.75), (-0.1, -3.0)])
def test_realised_fraction_is_what_the_augmented_model_closes(stated: float | None, expected: float) -> None:
    model = gain_model()
    from rig.blind_check.source import records_of
    from rig.model.simulation import simulate

    swing = np.ptp(simulate(model, records_of({"x": columns(1.0, 0)})[0], start_deg=0.0).angle_deg) / 80.0
    case, days = {"x": columns(1.0 + 0.1 * swing, 1)}, [{"x": columns(1.0, k)} for k in (2, 3, 4)]
    added = [] if stated is None else [{"effect": "sensor_gain", "parameters": {"gain": stated}}]
    found = realised(model, {"added": added}, label("sensor_gain"), case, days)
    assert found == pytest.approx(expected, abs=0.02)


def test_records_that_do_not_show_the_effect_are_no_evidence() -> None:
    case, days = {"x": columns(1.0, 1)}, [{"x": columns(1.0, k)} for k in (2, 3, 4)]
    assert realised(gain_model(), {"added": []}, label("end_stop"), case, days) is None


def test_recommended_sweeps_become_commands(tmp_path: Path) -> None:
    sweep = {
        "p0_mpa": [0.15, 0.3],
        "duration_s": 2.0,
        "records": [{"sine": {"frequency_hz": 4.0, "amplitude_mpa": 0.05}}],
    }
    path = tmp_path / "next.yaml"
    path.write_text(json.dumps(sweep))
    for config in (sweep, json.dumps(sweep, indent=1), str(path)):
        commands = commands_of(config)
        assert len(commands) == 2
        assert {round(float(np.mean(p1 + p2)), 3) for p1, p2, _ in commands.values()} == {0.3, 0.6}


def test_a_third_of_the_questions_lack_a_class_whatever_their_label() -> None:
    own = sum("backlash" in left_out(7, number) for number in range(400))
    assert 90 < own < 180
    assert left_out(7, 3) == left_out(7, 3)
    assert left_out(7, 3) != left_out(8, 3)


def test_a_case_is_asked_the_modes_that_measure_its_gap() -> None:
    every = names_of(GROUPS)
    days, sisters = ({"against": name} for name in ("days", "sisters"))
    assert asked(every, days) == [
        "pressures", "angle", "one_day", "one_day_angle", "fingerprint", "fingerprint_angle",
        "withheld", "withheld_angle", "withheld_one_day", "withheld_fingerprint",
    ]  # fmt: skip
    assert asked(every, sisters) == ["simulator", "simulator_angle", "own_simulator", "own_simulator_angle"]
    assert asked(["pressures", "simulator"], {}) == ["pressures"], "labels that say nothing are measured by days"
    assert {MODES[name].pressures for name in every if name.endswith("angle")} == {False}


def test_what_a_fit_absorbs_is_counted_apart() -> None:
    absorbed = said("sensor_offset", ambiguous=("sensor_gain",)) | {}
    absorbed["diagnosis"]["retuning"] = {"closes_fraction": 0.9, "parameters": [{"name": "xi1"}]}
    right = score_mode("simulator", absorbed, label("sensor_gain"), facts("sensor_gain"))
    assert (right.absorbed, right.absorbed_right, right.exact) == (True, True, False)
    absorbed["diagnosis"]["retuning"]["closes_fraction"] = 0.2
    wrong = score_mode("simulator", absorbed, label("sensor_gain"), facts("sensor_gain"))
    assert not wrong.absorbed_right
    result = mode_result([right, wrong])
    assert (result["absorbed_right"]["k"], result["absorbed_right"]["n"], result["exact_first"]["n"]) == (1, 2, 0)
    assert not score_mode("pressures", absorbed, label("sensor_gain"), facts("sensor_gain")).absorbed


@pytest.mark.parametrize(("low", "high", "holds"), [(0.1, 0.3, True), (0.4, 0.6, False)])
def test_stated_intervals_are_held_against_what_came_true(low: float, high: float, holds: bool) -> None:
    """Of a gap of 1 deg over no floor, 0.93 of the mean square went: an rms of 0.26 deg is left."""
    answer = said("valve_lag")
    answer["diagnosis"]["gap"] |= {
        "rms_deg": 1.0,
        "floor_deg": 0.0,
        "ratio": 5.0,
        "after_low_deg": low,
        "after_high_deg": high,
    }
    answer["diagnosis"]["causes"][0]["parameters"]["tau_s"] |= {"low": 0.08, "high": 0.12}
    result = mode_result([row("valve_lag", answer)])
    assert (result["interval_holds"]["k"], result["interval_holds"]["n"]) == (int(holds), 1)
    assert result["interval_width"] == pytest.approx(high**2 - low**2)
    assert (result["size_held"]["k"], result["size_held"]["n"]) == (1, 1)


def test_own_labels_are_read_or_refused() -> None:
    assert label_of("a", [{"effect": "none"}], Path("l.json")).truth.kind == "none"
    assert label_of("a", [{"effect": "delay"}, {"effect": "backlash"}], Path("l.json")).truth.kind == "pair"
    assert label_of("a", [{"effect": "gremlins"}], Path("l.json")).truth.kind == "foreign"
    with pytest.raises(RecordError, match=r"l\.json: a: expected a list"):
        label_of("a", "delay", Path("l.json"))


def test_answers_that_contradict_themselves_are_counted_with_their_sentences() -> None:
    sound, unsound = said("valve_lag"), said("valve_lag", verdict="none")
    result = mode_result([row("valve_lag", sound), row("valve_lag", unsound)])
    assert (result["contradictions"]["k"], result["contradictions"]["n"]) == (1, 2)
    assert list(result["contradicting"]) == ["the verdict is none, and the causes (1 named, 0 unknown) say explained"]


def test_absorbed_effects_are_told_by_their_median_share() -> None:
    found = [
        Absorbed("fluidic", "delay", 0.2),
        Absorbed("mckibben", "delay", 0.4),
        Absorbed("fluidic", "creep", None),
    ]
    assert list(table(found)) == [("delay", pytest.approx(0.3), 2), ("creep", None, 0)]


def test_scored_cases_are_read_as_they_were_written(tmp_path: Path) -> None:
    again = Round(row("delay", said("delay")), 0.5, 0.9, ("delay", "valve_lag"), parted=True)
    pair = score_mode("angle", said("creep"), label("creep", "delay"), facts("creep", "delay"))
    rows = {"pressures": row("delay", said("valve_lag"), rounds=(again,)), "angle": pair}
    case = Scored(rows, {"angle": {"random": "none"}}, ("audit",), {"effects": {}, "ratio_angle": 5.0}, "t")
    write_json(tmp_path / "t.json", case.to_json())
    assert read_scored(tmp_path / "t.json") == replace(case, rows=rows)


def test_a_check_of_before_there_were_experiments_is_read(tmp_path: Path) -> None:
    """Keys as they stand in files: what came later counts nothing, what nobody reads any more is passed over."""
    old = {"kind": "single", "effects": ["delay"], "ratio": 4.0, "set": ["delay"], "class": True, "gone": 1}
    write_json(tmp_path / "t.json", {"rows": {"one_day": old}, "naive": {}, "sandbox_layers": []})
    found = read_scored(tmp_path / "t.json").rows["one_day"]
    assert (found.names, found.class_right, found.rounds, found.is_nameable) == (("delay",), True, (), True)


@pytest.mark.parametrize("broken", [{}, {"kind": "some", "effects": [], "ratio": 1.0}, {"kind": "none", "effects": 3}])
def test_what_is_no_scored_case_is_refused_in_a_line(tmp_path: Path, broken: dict) -> None:
    write_json(tmp_path / "t.json", {"rows": {"one_day": broken}, "naive": {}, "sandbox_layers": []})
    with pytest.raises(RecordError, match=r"t\.json: is not what a blind check writes"):
        read_scored(tmp_path / "t.json")

"""Identification end to end on data whose truth is known, regulators, the sweep range, validation and the commands."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from conftest import CONFIGS

from rig.errors import ModelError, RecordError
from rig.identify.fit import SearchSettings, identify
from rig.identify.records.data import prepare
from rig.identify.response.valves import identify_valves
from rig.identify.search.space import Space
from rig.identify.search.stability import StabilityTerm, SweepRange, check_bounded, dense_signals
from rig.identify.search.swarm import SwarmSettings
from rig.identify.search.uncertainty import independent_samples
from rig.identify.templates import Template, input_gain, template_model, template_rest
from rig.identify.validate import excited_hz, score, validate
from rig.model.parameters import AddedEffect, Input, Model, Parameter, load_model
from rig.model.simulation import simulate
from rig.record import Record

MODELS = CONFIGS / "models"
TRUTH = load_model(MODELS / "simulated.yaml")
QUICK = SearchSettings(seeds=(1,), swarm=SwarmSettings(iterations=150), workers=1)


def measured(frequency: float = 0.5, amplitude: float = 0.2, seed: int = 1, model: Model = TRUTH) -> Record:
    """What the simulated rig shows under a sine, with noise."""
    time = np.arange(2000) * 0.005
    record = Record(
        f"sine_{frequency:g}hz", time, amplitude * np.sin(2 * np.pi * frequency * time), facts={"p0_mpa": 0.2}
    )
    clean, noise = simulate(model, record), np.random.default_rng(seed)
    return replace(
        clean,
        p1_mpa=clean.p1_mpa + noise.normal(0, 0.0004, 2000),
        p2_mpa=clean.p2_mpa + noise.normal(0, 0.0004, 2000),
        angle_deg=clean.angle_deg + noise.normal(0, 0.03, 2000),
    )


RECORDS = [measured(0.2), measured(0.5), measured(0.8)]


def start(**wish: object) -> Model:
    template = Template(**wish)  # type: ignore[arg-type]
    return template_model(template, input_gain(RECORDS, template.u_unit_mpa))


def test_one_search_that_is_interrupted_ends_the_others() -> None:
    shares: dict[str, float] = {}

    def report(title: str, share: float, _best: float) -> None:
        shares[title] = share
        if title.endswith("seed 1") and len(shares) == 2:  # the one that is waited for, as Ctrl-C strikes who waits
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        identify([measured()], start(), SearchSettings(seeds=(1, 2), workers=2), report=report)
    assert max(shares.values()) < 0.9


def test_the_simulated_rig_is_found_again_from_its_pressures() -> None:
    found = identify(RECORDS, start(drive=Input.PRESSURE, mean_exponent=1.0), QUICK)
    assert found.rmse_deg < 0.12, "the sensor's noise is 0.03, the monitors' adds to it"
    assert found.verdict.bounded
    assert found.search_rmse_deg >= found.rmse_deg
    assert found.unbounded_rmse_deg is not None
    assert found.unbounded_rmse_deg == pytest.approx(found.rmse_deg, rel=1e-3), (
        "the truth is bounded: that costs nothing"
    )
    assert found.valves is not None
    assert found.model.valve.value("valve1_tau_s") == pytest.approx(0.040, rel=0.05)
    for name in ("lambda1", "xi1"):
        parameter = found.model.muscle.parameters[name]
        truth = TRUTH.muscle.value(name)
        assert parameter.std is not None
        assert 0.0 < parameter.std < 0.02 * truth
        assert parameter.value == pytest.approx(truth, abs=4.0 * parameter.std)
    whole = validate(found.model, [measured(0.6, 0.15, 9)], SweepRange())
    assert whole.scores[0].rmse_deg < 0.3
    assert whole.scores[0].command_rmse_deg is not None
    assert whole.scores[0].command_rmse_deg < 0.5


@pytest.mark.parametrize("kind", ["mbw", "bw"])
def test_from_the_command_every_validation_is_far_under_the_papers_four_degrees(kind: str) -> None:
    found = identify(RECORDS, start(kind=kind), QUICK)
    result = validate(found.model, [measured(f, 0.2, 5) for f in (0.3, 0.4, 0.6, 0.7)], SweepRange())
    assert result.verdict.bounded
    assert max(row.rmse_deg for row in result.scores) < 2.0


def test_the_continuous_model_and_the_joint_are_identified_on_the_chain() -> None:
    few = replace(QUICK, optimizer="cma-es", swarm=SwarmSettings(particles=16, iterations=15))
    found = identify([RECORDS[1]], start(kind="bw_continuous", drive=Input.PRESSURE, joint="second_order"), few)
    assert found.rmse_deg < 5.0
    assert {"n", "omega_rad_per_s"} <= set(found.space.names)


def test_an_offset_of_the_sensor_is_found() -> None:
    shifted = replace(RECORDS[1], angle_deg=RECORDS[1].angle_deg + 12.0)
    found = identify([shifted], start(drive=Input.PRESSURE, free_offset=True), QUICK)
    assert found.model.sensor.value("offset_deg") == pytest.approx(12.0, abs=0.5)


def test_a_seed_gives_one_model() -> None:
    short = replace(QUICK, swarm=SwarmSettings(iterations=20), polish=False)
    first, second = (identify([RECORDS[1]], start(), short) for _ in range(2))
    assert first.model == second.model


def test_a_search_without_the_term_may_leave_the_range_and_the_term_brings_it_back() -> None:
    """A parameter set that fits but explodes at 0.8 Hz is priced by the term and named by the verdict."""
    muscle = dict(TRUTH.muscle.parameters) | {"phi1": Parameter(-0.012)}
    wild = replace(TRUTH, muscle=replace(TRUTH.muscle, parameters=muscle))
    verdict = check_bounded(wild, SweepRange(), 60.0)
    assert not verdict.bounded
    assert verdict.failing
    space = Space(start())
    term = StabilityTerm(SweepRange(), start(), 60.0)
    from rig.identify.search.objective import LawTable

    tame = space.point(replace(start(), muscle=replace(start().muscle, parameters=_onto(start(), TRUTH))))
    assert np.all(term.excess(LawTable(start(), space)(tame[np.newaxis])) == 0.0)
    wrong = tame.copy()
    wrong[space.names.index("phi1")] = 0.0
    assert np.all(np.isfinite(excess := term.excess(LawTable(start(), space)(wrong[np.newaxis]))))
    assert np.max(excess) > 1.0


def _onto(template: Model, truth: Model) -> dict[str, Parameter]:
    """The template's parameters at the truth's values."""
    return {
        name: replace(parameter, value=truth.muscle.value(name)) if parameter.free else parameter
        for name, parameter in template.muscle.parameters.items()
    }


def test_the_dense_set_covers_the_range() -> None:
    signals = dense_signals(SweepRange(0.2, 0.8, 0.2))
    assert len(signals) == 13 * 4 * 2 + 3
    assert {0.2, 0.5, 0.8} <= {round(signal.highest_hz, 3) for signal in signals}


def test_regulators_are_found_with_their_limits() -> None:
    time = np.arange(2000) * 0.005
    dp = 0.3 * np.sign(np.sin(2 * np.pi * 0.5 * time))
    shown = simulate(TRUTH, Record("square", time, dp))
    fit = identify_valves([shown], 0.005, 0.2)
    wanted = TRUTH.valve
    for name in ("valve1_tau_s", "valve1_fill_limit_mpa_per_s", "valve2_tau_s", "valve2_exhaust_limit_mpa_per_s"):
        assert fit.stage.value(name) == pytest.approx(wanted.value(name), rel=0.02)
    assert max(fit.rmse_mpa) < 1e-4


@pytest.mark.parametrize(("fill_s", "ratio"), [(0.04, 1.6), (0.08, 0.5)])
def test_regulators_that_fill_and_exhaust_at_different_speeds_are_found(fill_s: float, ratio: float) -> None:
    uneven = {"valve1_tau_s": Parameter(fill_s, "s"), "valve1_exhaust_ratio": Parameter(ratio)}
    rig = replace(TRUTH, valve=replace(TRUTH.valve, parameters=TRUTH.valve.parameters | uneven))
    fit = identify_valves([measured(0.2, model=rig), measured(0.8, model=rig)], 0.005, 0.2)
    assert fit.stage.value("valve1_tau_s") == pytest.approx(fill_s, rel=0.05)
    assert fit.stage.value("valve1_exhaust_ratio") == pytest.approx(ratio, rel=0.05)
    assert fit.stage.value("valve2_exhaust_ratio") == pytest.approx(1.0, abs=0.05)


def test_a_dead_time_ahead_of_the_regulators_is_found() -> None:
    late = replace(TRUTH, effects=[AddedEffect("delay", {"delay_s": 0.06})])
    time = np.arange(2000) * 0.005
    shown = simulate(late, Record("chirp", time, 0.2 * np.sin(2 * np.pi * (0.2 * time + 0.1 * time**2))))
    fit = identify_valves([shown], 0.005, 0.2)
    assert fit.dead_time_s == pytest.approx(0.06)
    assert fit.stage.value("valve1_tau_s") == pytest.approx(0.040, rel=0.05)
    assert identify_valves([RECORDS[1]], 0.005, 0.2).dead_time_s == 0.0


def late_by(dead_s: float, noise_mpa: float, seed: int = 3) -> Record:
    late = replace(TRUTH, effects=[AddedEffect("delay", {"delay_s": dead_s})])
    time, noise = np.arange(2000) * 0.005, np.random.default_rng(seed)
    shown = simulate(late, Record("chirp", time, 0.2 * np.sin(2 * np.pi * (0.2 * time + 0.1 * time**2))))
    assert shown.p1_mpa is not None
    assert shown.p2_mpa is not None
    p1, p2 = (column + noise.normal(0, noise_mpa, 2000) for column in (shown.p1_mpa, shown.p2_mpa))
    return replace(shown, p1_mpa=p1, p2_mpa=p2)


@pytest.mark.parametrize("dead_s", [0.004, 0.008, 0.013, 0.027, 0.0715])
def test_a_dead_time_is_found_between_two_rows(dead_s: float) -> None:
    fit = identify_valves([late_by(dead_s, 0.0004)], 0.005, 0.2)
    assert fit.dead_time_s == pytest.approx(dead_s, abs=3e-4)
    assert fit.stage.value("valve1_tau_s") == pytest.approx(0.040, rel=0.02)


def test_a_dead_time_that_loud_monitors_do_not_tell_from_a_whole_step_is_that() -> None:
    """At 95 %: of 40 seeds 38."""
    found = [identify_valves([late_by(0.02, 0.003, seed)], 0.005, 0.2).dead_time_s for seed in range(8)]
    assert sum(each == 0.02 for each in found) >= 7
    assert found == pytest.approx([0.02] * 8, abs=2e-3)


def test_a_flow_limit_that_was_not_reached_is_said_to_be_unknown() -> None:
    fit = identify_valves([measured(0.2)], 0.005, 0.2)
    assert any("fill_limit" in note and "not reached" in note for note in fit.notes)
    with pytest.raises(RecordError, match="regulators cannot be identified"):
        identify_valves([replace(measured(), p1_mpa=None)], 0.005, 0.2)


def test_the_figures_of_table_4() -> None:
    wanted = np.sin(np.arange(1000) * 0.02)
    exact, mean = score("a", wanted, wanted), score("a", wanted, np.full(1000, wanted.mean()))
    assert (exact.rmse_deg, exact.fit_percent, exact.max_deg) == (0.0, 100.0, 0.0)
    assert mean.fit_percent == pytest.approx(0.0, abs=1e-9)
    off = score("a", wanted, wanted + 0.1)
    assert off.rmse_deg == pytest.approx(0.1)
    assert off.nrmse == pytest.approx(0.1 / np.ptp(wanted))
    blown = score("a", wanted, np.full(1000, np.nan))
    assert blown.diverged
    assert np.isfinite(blown.rmse_deg)


def test_use_outside_the_valid_range_is_warned_of() -> None:
    model = replace(TRUTH, valid=replace(TRUTH.valid, frequency_hz=(0.2, 0.8), amplitude_mpa=0.2))
    inside = validate(model, [measured(0.5)], SweepRange())
    fast = validate(model, [measured(2.0, 0.05)], SweepRange())
    other = validate(replace(model, p0_mpa=0.3), [measured(0.5)], SweepRange())
    assert inside.warnings == []
    assert "excited from" in fast.warnings[0]
    assert "P0 is 0.2 MPa, the model's is 0.3 MPa" in other.warnings[0]


def test_a_short_record_is_not_said_to_be_excited_from_more_to_less() -> None:
    model = replace(TRUTH, valid=replace(TRUTH.valid, frequency_hz=(0.9, 2.0)))
    slow = measured(0.2)
    (said,) = validate(model, [slow.rows(slow.t_s < 7.0)], SweepRange()).warnings
    low, high = (float(part) for part in said.partition("excited from ")[2].partition(" Hz")[0].split(" to "))
    assert low <= high


def test_excited_frequencies() -> None:
    time = np.arange(4000) * 0.005
    low, high = excited_hz(np.sin(2 * np.pi * 0.3 * time) + np.sin(2 * np.pi * 1.2 * time), 0.005)
    assert low == pytest.approx(0.3, abs=0.1)
    assert high == pytest.approx(1.2, abs=0.1)


def test_residuals_that_follow_each_other_count_for_fewer() -> None:
    white = np.random.default_rng(1).normal(size=4000)
    slow = np.convolve(white, np.ones(50) / 50, mode="same")
    assert independent_samples(white) > 2000
    assert independent_samples(slow) < 200


def test_p0_comes_from_the_records() -> None:
    assert template_rest([measured()]) == 0.2
    bare = replace(measured(), facts={})
    assert template_rest([bare]) == pytest.approx(0.2, abs=0.01)
    between = np.full(len(bare), 0.155)
    commanded = replace(measured(), p1_cmd_mpa=between + 0.1, p2_cmd_mpa=between - 0.1)
    assert template_rest([commanded]) == 0.155, "a fact is typed, set-points went to the rig"
    assert template_rest([bare, commanded]) == 0.155, "what one record says stands before what another one measures"


def test_a_model_without_free_parameters_cannot_be_identified() -> None:
    with pytest.raises(ModelError, match="no parameter of the model is free"):
        identify([RECORDS[1]], TRUTH, QUICK)


def _write_csv(record: Record, folder: Path) -> Path:
    rows = np.column_stack([record.t_s, record.dp_cmd_mpa, record.p1_mpa, record.p2_mpa, record.angle_deg])
    file = folder / f"{record.name}.csv"
    np.savetxt(file, rows, delimiter=",", header="t_s,dp_cmd_mpa,p1_mpa,p2_mpa,angle_deg", comments="", fmt="%.6f")
    return file


def test_the_commands_end_to_end(tmp_path: Path) -> None:
    from rig.cli.model.identify import identify as identify_command
    from rig.cli.model.identify import validate as validate_command

    log, model = _write_csv(RECORDS[1], tmp_path), tmp_path / "model.yaml"
    words = [str(log), "-o", str(model), "--seeds", "1", "--iterations", "40", "--json", str(tmp_path / "i.json")]
    done = CliRunner().invoke(
        identify_command, [*words, "--figures", str(tmp_path / "figures")], catch_exceptions=False
    )
    assert done.exit_code == 0
    result = json.loads((tmp_path / "i.json").read_text(encoding="utf-8"))
    assert {"model", "rmse_deg", "evaluations", "seconds", "bounded", "parameters"} <= result.keys()
    assert {"value", "std", "at_bound"} <= result["parameters"]["lambda1"].keys()
    assert len(result["seeds"]["1"]["history"]) == 40
    provenance = load_model(model).provenance
    assert len(provenance.logs[0].sha256) == 64
    assert (tmp_path / "figures" / "sine_0.5hz.png").stat().st_size > 10_000
    checked = CliRunner().invoke(
        validate_command, [str(model), str(log), "--json", str(tmp_path / "v.json")], catch_exceptions=False
    )
    assert checked.exit_code == 0
    row = json.loads((tmp_path / "v.json").read_text(encoding="utf-8"))["records"][0]
    assert {"log", "rmse_deg", "nrmse", "fit_percent", "max_deg"} <= row.keys()
    assert row["rmse_deg"] == pytest.approx(result["rmse_deg"], rel=1e-3)


def test_validate_says_not_so_of_a_model_that_is_not_bounded(tmp_path: Path) -> None:
    from rig.cli.model.identify import validate as validate_command
    from rig.errors import CheckFailed

    log = _write_csv(RECORDS[1], tmp_path)
    with pytest.raises(CheckFailed, match="not bounded over the sweep range"):
        CliRunner().invoke(validate_command, [str(MODELS / "paper_table3.yaml"), str(log)], catch_exceptions=False)


def test_preparing_for_a_model_of_another_period_is_refused() -> None:
    with pytest.raises(RecordError, match="the model works at 20 ms"):
        prepare(RECORDS[0], replace(TRUTH, sample_time_s=0.02))


def test_a_model_that_misses_its_own_records_says_so() -> None:
    off = [replace(record, angle_deg=record.angle_deg + 12.0) for record in RECORDS]
    (told,) = [text for text in identify(off, start(), QUICK).warnings if "misses its own records" in text]
    assert "it lacks something" in told
    assert not any("misses its own records" in text for text in identify(RECORDS, start(), QUICK).warnings)

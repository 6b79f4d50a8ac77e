"""The stages alone, the chain tick by tick, and the chain over whole records: they are one simulator."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import CONFIGS

from rig.errors import ConfigError, ModelError, RecordError
from rig.model.chain import Chain, lay_out
from rig.model.equations import stages
from rig.model.parameters import AddedEffect, Input, Model, Parameter, StageKind, StageModel, load_model, save_model
from rig.model.simulation import simulate
from rig.model.slots import Slot
from rig.record import Record

MODELS = CONFIGS / "models"


@pytest.fixture
def model() -> Model:
    return load_model(MODELS / "simulated.yaml")


def sine(frequency: float = 0.5, amplitude: float = 0.2, seconds: float = 10.0, dt_s: float = 0.005) -> Record:
    time = np.arange(round(seconds / dt_s)) * dt_s
    return Record("sine", time, amplitude * np.sin(2 * np.pi * frequency * time))


def mixed() -> Record:
    time = np.arange(2000) * 0.005
    parts = [(1.0, 1.0), (0.6, 0.3), (0.7, 1.5), (0.1, 4.0)]
    return Record("mixed", time, sum(0.1 * a * np.sin(2 * np.pi * 0.5 * f * time) for a, f in parts))


def test_chain_and_compiled_record_agree_to_the_last_bit(model: Model) -> None:
    model = replace(model, joint=_joint(), effects=[AddedEffect("valve_lag", {"tau_s": 0.05})])
    record, chain = sine(), Chain(model)
    held = np.concatenate([record.dp_cmd_mpa[:1], record.dp_cmd_mpa[:-1]])
    ticks = np.array([chain.step(0.2 + dp / 2, 0.2 - dp / 2) for dp in held.tolist()])
    whole = simulate(model, record)
    assert np.array_equal(ticks[:, 2], whole.angle_deg)
    assert np.array_equal(ticks[:, 0], whole.p1_mpa)


def _joint() -> StageModel:
    from rig.model.parameters import Parameter

    return StageModel("second_order", {"omega_rad_per_s": Parameter(30.0), "damping": Parameter(0.2)})


@pytest.mark.parametrize("frequency", [0.1, 0.2, 0.5, 0.8, 1.0])
def test_the_simulated_rig_is_bounded_and_shows_a_loop(model: Model, frequency: float) -> None:
    record = sine(frequency, 0.2, 20.0)
    angle = simulate(model, record).angle_deg
    assert angle is not None
    assert 35.0 < np.max(np.abs(angle)) < 42.0
    crossing = np.abs(record.dp_cmd_mpa[2000:]) < 0.006
    assert np.ptp(angle[2000:][crossing]) > 5.0, "no hysteresis"


def test_the_simulated_rig_is_bounded_under_the_mixed_sine(model: Model) -> None:
    angle = simulate(model, mixed()).angle_deg
    assert angle is not None
    assert np.max(np.abs(angle)) < 45.0


def test_the_next_row_answers_to_a_set_point(model: Model) -> None:
    """Row k is measured before its set-point is written: a step written in row 10 shows from row 11 on."""
    dp = np.where(np.arange(400) >= 10, 0.1, 0.0)
    simulated = simulate(model, Record("step", np.arange(400) * 0.005, dp))
    assert simulated.p1_mpa is not None
    assert simulated.p1_mpa[10] == pytest.approx(0.2)
    assert simulated.p1_mpa[11] > 0.203


def test_regulators_lag_and_limit_the_flow() -> None:
    params = (1.0, 0.0, 0.1, 1e3, 1e3, 1.0, 1.0, 0.0, 0.1, 0.5, 0.25, 1.0)
    p1, p2, state = [0.1] + [0.2] * 99, [0.1] + [0.2] * 50 + [0.1] * 49, [0.0] * 3
    stages.regulators(p1, p2, [0.0] * 100, state, params, 0.005)
    assert p1[20] == pytest.approx(0.2 - 0.1 * np.exp(-1.0), abs=1e-12), "one time constant after 20 ticks"
    assert p2[1] - p2[0] == pytest.approx(0.5 * 0.005), "filling is limited"
    assert p2[51] - p2[50] == pytest.approx(-0.25 * 0.005), "exhausting is limited apart"


def test_exhausting_takes_its_own_time_constant() -> None:
    params = (1.0, 0.0, 0.1, 1e3, 1e3, 2.0) * 2
    p1, p2, state = [0.1] + [0.2] * 41, [0.2] + [0.1] * 41, [0.0] * 3
    stages.regulators(p1, p2, [0.0] * 42, state, params, 0.005)
    assert p1[20] == pytest.approx(0.2 - 0.1 * np.exp(-1.0), abs=1e-12), "filling: one time constant after 20 ticks"
    assert p2[40] == pytest.approx(0.1 + 0.1 * np.exp(-1.0), abs=1e-12), "exhausting: after twice as many"


def test_a_file_without_a_ratio_exhausts_as_it_fills(tmp_path: Path, model: Model) -> None:
    save_model(model, tmp_path / "older.yaml")
    older = load_model(tmp_path / "older.yaml")
    assert "valve1_exhaust_ratio" not in older.valve.parameters
    one = {f"valve{n}_exhaust_ratio": Parameter(1.0) for n in (1, 2)}
    newer = replace(older, valve=replace(older.valve, parameters=older.valve.parameters | one))
    said, again = simulate(older, sine()), simulate(newer, sine())
    assert np.array_equal(said.p1_mpa, again.p1_mpa)
    assert np.array_equal(said.angle_deg, again.angle_deg)


def test_monitors_are_read_ahead_of_a_leak(model: Model) -> None:
    leaking = replace(model, effects=[AddedEffect("leak", {"loss": 0.2})])
    plain, leaky = simulate(model, sine()), simulate(leaking, sine())
    assert np.array_equal(plain.p1_mpa, leaky.p1_mpa)
    assert np.max(np.abs(plain.angle_deg - leaky.angle_deg)) > 1.0


def test_slots_run_in_order(model: Model) -> None:
    effects = [
        AddedEffect("sensor_gain", {"gain": 0.1}),
        AddedEffect("valve_lag", {"tau_s": 0.1}),
        AddedEffect("delay", {"delay_s": 0.1}),
    ]
    order = [placed.slot for placed in lay_out(replace(model, effects=effects))]
    assert order == sorted(order, key=list(Slot).index)


def test_the_joint_rings_and_settles_on_its_input() -> None:
    y, state = [10.0] * 4000, [1.0, 0.0, 0.0]
    stages.second_order_joint([0.0] * 4000, [0.0] * 4000, y, state, (25.0, 0.1), 0.005)
    assert max(y) == pytest.approx(10.0 * (1 + np.exp(-0.1 * np.pi / np.sqrt(1 - 0.01))), rel=0.01), (
        "overshoot of a damped oscillator"
    )
    assert y[-1] == pytest.approx(10.0, abs=1e-6)


def test_the_continuous_model_follows_its_closed_form() -> None:
    """n = 1, w >= 0, u rising: dw/du = eps - (psi + gamma) w, so w = eps / (psi + gamma) (1 - exp(-(psi + gamma)
    u))."""
    u = np.linspace(0.0, 3.0, 61).tolist()
    y = [0.0] * len(u)
    stages.bouc_wen(list(u), [0.0] * len(u), y, [0.0] * 3, (0.0, 1.0, 2.0, 0.6, 0.3, 1.0, 1.0, 1.0), 0.005)
    assert y == pytest.approx([2.0 / 0.9 * (1 - np.exp(-0.9 * value)) for value in u], abs=1e-6)


def test_the_continuous_model_does_not_depend_on_the_rate() -> None:
    params = (0.2, 1.0, 1.0, 0.5, 0.3, 1.5, 1.0, 1.0)
    peaks = []
    for ticks in (400, 4000):
        u = np.sin(np.linspace(0.0, 4 * np.pi, ticks + 1)).tolist()
        y = [0.0] * len(u)
        stages.bouc_wen(u, [0.0] * len(u), y, [0.0] * 3, params, 0.005)
        peaks.append(y[ticks])
    assert peaks[0] == pytest.approx(peaks[1], abs=1e-4)


def test_irregular_records_come_back_at_their_own_times(model: Model) -> None:
    record = sine(seconds=10.0)
    kept = np.sort(np.random.default_rng(1).permutation(len(record))[: len(record) // 2])
    thinned = record.rows(kept)
    whole, part = simulate(model, record), simulate(model, thinned)
    assert len(part) == len(thinned)
    assert part.angle_deg is not None
    assert np.sqrt(np.mean((part.angle_deg - whole.angle_deg[kept]) ** 2)) < 1.0


def test_measured_pressures_drive_the_muscles(model: Model) -> None:
    truth = simulate(model, sine())
    again = simulate(model, truth, drive=Input.PRESSURE)
    assert np.allclose(again.angle_deg[100:], truth.angle_deg[100:], atol=0.01)
    with pytest.raises(RecordError, match="pressures were not measured"):
        simulate(model, sine(), drive=Input.PRESSURE)


def test_a_monitors_noise_does_not_move_the_muscles(model: Model) -> None:
    """A hysteresis that is shaken loses its loop: a kilopascal of noise, as regulators' monitors have, cost degrees."""
    truth, random = simulate(model, sine(seconds=20.0)), np.random.default_rng(3)
    noisy = replace(
        truth,
        p1_mpa=truth.p1_mpa + 1e-3 * random.standard_normal(len(truth)),
        p2_mpa=truth.p2_mpa + 1e-3 * random.standard_normal(len(truth)),
    )
    again = simulate(model, noisy, drive=Input.PRESSURE)
    assert np.std(again.angle_deg - truth.angle_deg) < 0.01 * np.std(truth.angle_deg)


def test_a_diverging_model_says_where(model: Model) -> None:
    muscle = replace(
        model.muscle,
        parameters={**model.muscle.parameters, "phi1": replace(model.muscle.parameters["phi1"], value=-0.05)},
    )
    with pytest.raises(ModelError, match=r"sine: the model diverges under this input at \d+\.\d+ s"):
        simulate(replace(model, muscle=muscle), sine())


def test_yaml_round_trip(model: Model, tmp_path: Path) -> None:
    model = replace(model, effects=[AddedEffect("valve_lag", {"tau_s": 0.1})])
    save_model(model, tmp_path / "model.yaml")
    assert load_model(tmp_path / "model.yaml") == model


@pytest.mark.parametrize("file", sorted(MODELS.glob("*.yaml")), ids=lambda file: file.stem)
def test_every_model_that_comes_with_pamrig_loads(file: Path) -> None:
    assert lay_out(load_model(file))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("kind: mbw", "kind: mwb", "muscle.kind: unknown kind 'mwb'; did you mean 'mbw'?"),
        ("lambda1:", "lamda1:", "unknown parameter 'lamda1'"),
        ("u_unit_mpa: {value: 0.2,", "u_unit_mpa: {value: 0.0,", "u_unit_mpa: 0 is outside"),
        ("input: pressure", "input: command", "allowed with input 'command': direct"),
        ("lambda1: {value: 0.981,", "lambda1: {value: 1.5,", "outside its own bounds 0 .. 1"),
        ("sample_time_s: 0.005", "sample_time_s: 0.0", "sample_time_s"),
    ],
)
def test_a_broken_model_is_refused_in_one_line(old: str, new: str, said: str, tmp_path: Path) -> None:
    text = (MODELS / "simulated.yaml").read_text(encoding="utf-8")
    assert old in text
    file = tmp_path / "broken.yaml"
    file.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises((ModelError, ConfigError)) as failure:
        load_model(file)
    assert said in str(failure.value)
    assert "\n" not in str(failure.value)


@pytest.mark.parametrize(
    ("effect", "said"),
    [
        (AddedEffect("valve_lagg", {"tau_s": 0.1}), "did you mean 'valve_lag'"),
        (AddedEffect("valve_lag", {"tau": 0.1}), "unknown parameter 'tau'"),
        (AddedEffect("valve_lag", {}), "'tau_s' is missing"),
        (AddedEffect("valve_lag", {"tau_s": -1.0}), "tau_s -1 is outside"),
    ],
)
def test_a_broken_effect_is_refused(model: Model, effect: AddedEffect, said: str) -> None:
    with pytest.raises(ModelError, match=said):
        lay_out(replace(model, effects=[effect]))


@pytest.mark.parametrize("dt_s", [0.0005, 0.001])
def test_a_delay_that_no_stage_can_hold_is_refused_and_the_longest_is_whole(model: Model, dt_s: float) -> None:
    def late(delay_s: float) -> Model:
        return replace(model, sample_time_s=dt_s, effects=[AddedEffect("delay", {"delay_s": delay_s})])

    with pytest.raises(ModelError, match=rf"delay: .* {900} samples of .*; allowed: 798"):
        Chain(late(900 * dt_s))
    chain = Chain(late(798 * dt_s))
    shown = [chain.step(0.3 if tick else 0.2, 0.2)[0] for tick in range(810)]
    assert int(np.argmax(np.array(shown) > 0.2 + 1e-9)) == 1 + 798


def test_a_slow_clock_that_falls_behind_what_a_stage_can_hold_is_refused(model: Model) -> None:
    slow = replace(model, effects=[AddedEffect("clock_drift", {"drift": -0.05})])
    assert simulate(slow, replace(sine(seconds=79.0), p1_mpa=None)).angle_deg is not None
    with pytest.raises(ModelError, match=r"clock_drift: it makes commands 4\.\d+ s late"):
        simulate(slow, replace(sine(seconds=81.0), p1_mpa=None))


@pytest.mark.parametrize("drift", [-0.01, 0.002, 0.01])
def test_a_clock_that_runs_off_follows_the_commands_of_another_time(model: Model, drift: float) -> None:
    """A fast one reads ahead in a record that is known to its end; tick by tick it can only go on as before."""
    record = replace(sine(seconds=20.0), p1_mpa=None)
    warped = replace(record, dp_cmd_mpa=np.interp((1.0 + drift) * record.t_s, record.t_s, record.dp_cmd_mpa))
    off = replace(model, effects=[AddedEffect("clock_drift", {"drift": drift})])
    said, wanted = simulate(off, record).angle_deg, simulate(model, warped).angle_deg
    assert said is not None
    assert wanted is not None
    known = record.t_s < 19.7
    assert said[known] == pytest.approx(wanted[known], abs=0.05)
    chain = Chain(off)
    held = np.concatenate([record.dp_cmd_mpa[:1], record.dp_cmd_mpa[:-1]])
    ticks = np.array([chain.step(0.2 + dp / 2, 0.2 - dp / 2)[2] for dp in held.tolist()])
    soon = known & (record.t_s < 0.03 / max(drift, 1e-3))
    assert ticks[soon] == pytest.approx(wanted[soon], abs=0.3)


def test_a_slow_clock_goes_on_through_the_session_or_begins_anew(model: Model) -> None:
    record = replace(sine(seconds=20.0), p1_mpa=None)
    slow = {"drift": -0.002}
    whole, anew, late = (
        simulate(replace(model, effects=[AddedEffect(name, numbers)]), record, begun_s=100.0).angle_deg
        for name, numbers in (
            ("clock_drift", slow | {"whole_session": 1.0}), ("clock_drift", slow), ("delay", {"delay_s": 0.2})
        )
    )  # fmt: skip
    soon = record.t_s < 1.0
    assert whole[soon] == pytest.approx(late[soon], abs=0.15)
    assert np.max(np.abs(anew[soon] - late[soon])) > 1.0
    far = replace(model, effects=[AddedEffect("clock_drift", slow | {"whole_session": 1.0})])
    with pytest.raises(ModelError, match=r"clock_drift: it makes commands 4\.04 s late"):
        simulate(far, record, begun_s=2000.0)


def test_what_goes_on_through_a_session_begins_a_record_where_it_has_come_to(model: Model) -> None:
    drifts = AddedEffect("sensor_drift", {"rate_deg_min": 6.0, "whole_session": 1.0})
    anew = AddedEffect("sensor_drift", {"rate_deg_min": 6.0})
    record = sine()
    still, late, again = (
        simulate(replace(model, effects=effects), record, begun_s=50.0).angle_deg for effects in ([], [drifts], [anew])
    )
    np.testing.assert_allclose(late - still, 0.1 * (50.0 + record.t_s), atol=1e-9)
    np.testing.assert_allclose(again - still, 0.1 * record.t_s, atol=1e-9)


@pytest.mark.parametrize("first_deg", [10.0, -3.0])
def test_the_sensor_reads_first_what_was_measured_first(model: Model, first_deg: float) -> None:
    """The reading was taken for the joint's angle, and the sensor's zero came on top of it."""
    sensor = StageModel(StageKind.AFFINE, {"gain": Parameter(1.1), "offset_deg": Parameter(10.0, "deg")})
    mounted, record = replace(model, sensor=sensor), sine()
    measured = replace(record, angle_deg=np.full(len(record), first_deg))
    assert simulate(mounted, measured).angle_deg[0] == pytest.approx(first_deg)
    assert simulate(mounted, record, start_deg=first_deg).angle_deg[0] == pytest.approx(first_deg)
    assert simulate(mounted, record).angle_deg[0] == pytest.approx(10.0), "a joint at rest, without an angle"

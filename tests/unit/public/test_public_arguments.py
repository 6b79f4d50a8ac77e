"""The public API under what a person may give it: places and records alike, and wrong arguments in one line."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pamrig
import pytest

from rig.channels import Channel, Channels

MOTOR = Channels(Channel("set_point", "mm", (-50.0, 50.0)), Channel("position", "mm", (-50.0, 50.0)))
SWEEP = {"duration_s": 1.0, "settle_s": 0.1, "records": [{"sine": {"frequency_hz": 1.0, "amplitude_mpa": 0.1}}]}


def test_a_simulated_motor_speaks_of_its_own_channels_and_takes_no_other_rig_s_records() -> None:
    pneumatic = pamrig.load_model("simulated")
    motor = replace(pneumatic, channels=MOTOR)
    (said,) = pamrig.simulate(motor, SWEEP)
    assert said.channels == MOTOR
    assert "position_mm" in said.own_columns()
    assert np.array_equal(pamrig.simulate(motor, said)[0].angle_deg, said.angle_deg)
    for model, other in ((pneumatic, said), (motor, pamrig.simulate(pneumatic, SWEEP))):
        with pytest.raises(pamrig.RecordError, match="they are of different rigs"):
            pamrig.simulate(model, other)


def test_places_and_records_may_stand_in_one_list(tmp_path: Path) -> None:
    (record,) = pamrig.run(SWEEP, out=tmp_path / "a").records
    found = pamrig.compare([tmp_path / "a", record], [record, str(tmp_path / "a")])
    assert (len(found.pairs), found.max_deg, found.only_a) == (2, 0.0, [])


def test_a_mapping_takes_numbers_of_numpy_and_finds_its_waveform_from_here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "w.csv").write_text("t_s,dp_mpa\n0,0\n1,0.1\n")
    monkeypatch.chdir(tmp_path)
    sweep = {"p0_mpa": np.array([0.2]), "records": [{"waveform": {"file": "w.csv", "scale": np.float64(0.5)}}]}
    (said,) = pamrig.simulate("simulated", sweep)
    assert said.dp_cmd_mpa[-1] == pytest.approx(0.05, abs=1e-3)
    assert pamrig.simulated_rig({"delay": {"delay_s": np.float32(0.02)}}, seed=np.int64(3)).seed == 3


def test_a_mapping_finds_each_of_several_waveforms_from_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("v", "w"):
        (tmp_path / f"{name}.csv").write_text("t_s,dp_mpa\n0,0\n1,0.1\n")
    monkeypatch.chdir(tmp_path)
    said = pamrig.simulate("simulated", {"records": [{"waveform": {"file": ["v.csv", Path("w.csv")]}}]})
    assert [record.name for record in said] == ["waveform_v", "waveform_w"]


SHORT = pamrig.Record("short", np.arange(3) * 0.005, np.zeros(3), np.zeros(3))
WRONG: list[tuple[Callable[[], Any], type[Exception], str]] = [
    (lambda: pamrig.read("x", phases="swep"), pamrig.ConfigError, "phases: 'swep' is unknown; allowed: sweep, all"),
    (lambda: pamrig.read(["x"]), pamrig.ConfigError, "read: expected a path"),
    (lambda: pamrig.compare(None, SHORT), pamrig.RecordError, "logs: expected records or places of logs, got None"),
    (lambda: pamrig.compare([], SHORT), pamrig.RecordError, "logs: no record was given"),
    (lambda: pamrig.compare([SHORT], [3]), pamrig.ConfigError, "logs: expected a path .* got 3"),
    (lambda: pamrig.validate("simulated", SHORT.rows(slice(0, 0))), pamrig.RecordError, "short: it has no rows"),
    (lambda: pamrig.validate(None, SHORT), pamrig.ConfigError, "model: expected a path"),
    (lambda: pamrig.validate("simulated", SHORT, sweep_hz=(0.8, 0.2)), pamrig.ConfigError, "range 0.8-0.2 Hz: allowed"),
    (lambda: pamrig.validate("simulated", SHORT, sweep_hz=(0.2,)), pamrig.ConfigError, "expected two frequencies"),
    (lambda: pamrig.simulate("simulated", SHORT, drive="x"), pamrig.ConfigError, "drive: 'x' is unknown"),
    (lambda: pamrig.simulate("simulated", {"records": [object()]}), pamrig.ConfigError, "sweep: cannot represent"),
    (lambda: pamrig.identify(SHORT, drive="x"), pamrig.ConfigError, "drive: 'x' is unknown"),
    (lambda: pamrig.identify(SHORT, seeds=0), pamrig.ConfigError, "identify: seeds: 0 is outside 1 .. 100"),
    (lambda: pamrig.identify(SHORT, particles=0), pamrig.ConfigError, "identify: particles: 0 is outside"),
    (lambda: pamrig.identify(SHORT, seed=-1), pamrig.ConfigError, "identify: seed: -1 is outside"),
    (lambda: pamrig.identify(SHORT, sample_time_s=float("nan")), pamrig.ConfigError, "sample_time_s: nan s; allowed"),
    (lambda: pamrig.simulated_rig(seed=-1), pamrig.ConfigError, "seed: -1 is outside"),
    (lambda: pamrig.simulated_rig(drift=-1.0), pamrig.ConfigError, "drift: -1 1 is outside 0 .. 0.1"),
    (lambda: pamrig.simulated_rig({"delay": {"delay_s": "a"}}), pamrig.ConfigError, "delay_s: expected a number"),
    (
        lambda: pamrig.simulated_rig({"valve_lag": 0.01}),
        pamrig.ConfigError,
        "effects: valve_lag: expected a mapping of its numbers, 'tau_s' among them, got 0.01",
    ),
    (lambda: pamrig.simulated_rig({"lag": 0.01}), pamrig.ModelError, "unknown effect 'lag'"),
    (lambda: pamrig.run({"records": [{"sine": {}}]}), pamrig.ConfigError, r"^sweep: records\[0\].sine: the key"),
    (lambda: pamrig.simulated_rig(["delay"]), pamrig.ConfigError, "effects: expected a mapping"),
    (lambda: pamrig.run(SWEEP, clock="vitual"), pamrig.ConfigError, "clock: 'vitual' is unknown; allowed: real, virt"),
    (lambda: pamrig.run(SWEEP, out=3), pamrig.ConfigError, "out: expected a path as text or Path, got 3"),
    (
        lambda: pamrig.diagnose("simulated", SHORT, "monday"),
        pamrig.ConfigError,
        "baselines: .* got 'monday'",
    ),
    (lambda: pamrig.diagnose("simulated", SHORT, SHORT), pamrig.ConfigError, "baselines: expected a list with one"),
    (lambda: pamrig.diagnose("simulated", SHORT.rows(slice(0, 1))), pamrig.RecordError, "too short, 1 row in 0 s"),
    (lambda: pamrig.diagnose("simulated", SHORT, 3), pamrig.ConfigError, "baselines: expected a list .* got 3"),
    (lambda: pamrig.replay("x", clock="fast"), pamrig.ConfigError, "clock: 'fast' is unknown"),
    (lambda: pamrig.save_model("simulated", "x.yaml"), pamrig.ModelError, "save_model: expected a Model"),
]


@pytest.mark.parametrize(("call", "kind", "said"), WRONG)
def test_a_wrong_argument_is_one_line_and_nothing_runs(
    call: Callable[[], Any], kind: type[Exception], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(kind, match=said) as caught:
        call()
    assert isinstance(caught.value, pamrig.Error)
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []

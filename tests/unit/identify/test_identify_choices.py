"""What identification chooses by itself: what drives the muscles, and the law of the mean pressure; and that it says
so."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from rig.app.model.identifying import StartOptions, start_model
from rig.errors import RecordError
from rig.identify.fit import SearchSettings, identify
from rig.identify.records.data import RecordOptions, best_input, prepare
from rig.identify.records.zero import why_zero_is_free
from rig.identify.response.mean_law import hold, is_free, mean_law
from rig.identify.search.swarm import SwarmSettings
from rig.model.parameters import Input, StageKind, load_model
from rig.model.response.fingerprint_check import fingerprint_trouble
from rig.model.simulation import simulate
from rig.record import Record

RIG = load_model(Path(__file__).parents[3] / "configs" / "models" / "simulated.yaml")
ROWS = 2000
ASKED = StartOptions(None, "mbw", "auto", "rigid", 0.005, None, 0.2, False, None)


def measured(frequency_hz: float, p0_mpa: float = 0.2) -> Record:
    t = np.arange(ROWS) * 0.005
    half = 0.1 * np.sin(2 * np.pi * frequency_hz * t)
    name = f"sine_{frequency_hz:g}hz_{p0_mpa:g}"
    record = Record(name, t, 2 * half, p1_cmd_mpa=p0_mpa + half, p2_cmd_mpa=p0_mpa - half)
    clean, noise = simulate(RIG, record), np.random.default_rng(int(100 * frequency_hz + 1000 * p0_mpa))
    sizes = {"p1_mpa": 4e-4, "p2_mpa": 4e-4, "angle_deg": 0.03}
    columns = {key: getattr(clean, key) + noise.normal(0.0, size, ROWS) for key, size in sizes.items()}
    return replace(clean, **columns)


ONE = measured(0.5)
SEVERAL = [measured(0.5, 0.2), measured(0.2, 0.15), measured(0.8, 0.3)]
BARE = replace(ONE, p1_mpa=None, p2_mpa=None)
STILL = replace(ONE, p1_mpa=np.full(ROWS, 0.2), p2_mpa=np.full(ROWS, 0.2))
DEAD = replace(ONE, p1_mpa=np.full(ROWS, 0.2))
AT_A_RAIL = replace(ONE, p2_mpa=np.random.default_rng(2).normal(-0.05, 4e-4, ROWS))


def test_the_pressures_drive_where_every_record_has_them() -> None:
    drive, why = best_input(SEVERAL, RecordOptions())
    assert drive is Input.PRESSURE
    assert why == "driven by the measured pressures, which every record has; --input command takes the set-points"


@pytest.mark.parametrize(
    ("other", "reason"),
    [
        (BARE, "the pressures were not measured"),
        (replace(ONE, p2_mpa=None), "p2_mpa was not measured"),
        (STILL, "the monitor of p1 does not move (a broken wire?)"),
        (DEAD, "the monitor of p1 does not move (a broken wire?)"),
        (AT_A_RAIL, "the monitor of p2 does not follow its command (a broken wire?)"),
    ],
)
def test_one_record_without_usable_pressures_makes_it_the_command(other: Record, reason: str) -> None:
    drive, why = best_input([ONE, other], RecordOptions())
    assert drive is Input.COMMAND
    assert why.startswith("driven by the command, not by measured pressures: ")
    assert reason in why
    assert "--input command" not in why, "that is what it does"


def test_a_dead_monitor_drives_no_model_whoever_asks_for_it() -> None:
    assert RIG.muscle.input is Input.PRESSURE
    with pytest.raises(RecordError, match=r"the monitor of p1 does not move \(a broken wire\?\); use --input command"):
        prepare(DEAD, RIG)


def test_a_pressure_that_is_held_by_its_set_point_is_alive() -> None:
    assert ONE.p1_cmd_mpa is not None
    held = replace(DEAD, p1_cmd_mpa=np.full(ROWS, 0.2), dp_cmd_mpa=0.2 - ONE.p2_cmd_mpa)
    assert best_input([held], RecordOptions())[0] is Input.PRESSURE


def test_the_law_of_the_mean_pressure_is_identified_where_the_mean_moves() -> None:
    assert mean_law([ONE], Input.PRESSURE, 0.2)[0] == 1.0
    assert mean_law([ONE], Input.COMMAND, 0.2)[0] == 0.0
    for drive in Input:
        exponent, why = mean_law(SEVERAL, drive, 0.2)
        assert exponent is None
        assert "identified, the mean moves from 0.1" in why
    assert mean_law([BARE], Input.PRESSURE, 0.2)[0] == 1.0, "nothing is known of the mean"


def test_what_was_asked_for_is_not_chosen() -> None:
    model, choices = start_model(replace(ASKED, drive="command", mean_exponent=0.5), SEVERAL, RecordOptions())
    assert choices == []
    assert model.muscle.input is Input.COMMAND
    assert model.muscle.value("mean_exponent") == 0.5
    model, choices = start_model(replace(ASKED, kind="bw_continuous"), SEVERAL, RecordOptions())
    assert len(choices) == 1, "model (1) has no law of the mean pressure"


@pytest.mark.parametrize(
    ("p0_mpa", "records", "around"),
    [(0.3, [ONE], "0.20"), (0.2, [ONE], ""), (0.15, SEVERAL, ""), (0.4, SEVERAL, "0.15 and 0.20 and 0.30")],
)
def test_a_p0_that_is_asked_for_and_in_no_record_is_doubted(p0_mpa: float, records: list[Record], around: str) -> None:
    _, choices = start_model(replace(ASKED, p0_mpa=p0_mpa), records, RecordOptions())
    doubted = [line for line in choices if "--p0" in line]
    said = f"P0 is {p0_mpa:g} MPa, as --p0 says; the pressures of these records lie around {around} MPa: is it right?"
    assert doubted == ([said] if around else [])


@pytest.mark.parametrize("drive", ["auto", "command"])
@pytest.mark.parametrize("p0_mpa", [0.0, -3.0, 1e-300])
def test_a_p0_about_which_nothing_moves_is_refused(p0_mpa: float, drive: str) -> None:
    """The model that was written had numbers that are none, and was refused by the next command, or the identification
    ended in a traceback."""
    with pytest.raises(
        RecordError, match=r"P0 is \S+ MPa, as --p0 says; where pressures were measured it is 0.001 MPa"
    ):
        start_model(replace(ASKED, drive=drive, p0_mpa=p0_mpa), [ONE], RecordOptions())
    said = replace(ONE, facts={"p0_mpa": p0_mpa}, p1_cmd_mpa=None, p2_cmd_mpa=None)
    with pytest.raises(RecordError, match="'s fact p0_mpa says"):
        start_model(replace(ASKED, drive=drive), [said], RecordOptions())
    start_model(replace(ASKED, drive=drive), [replace(ONE, facts=said.facts)], RecordOptions())  # set-points say it
    start_model(replace(ASKED, p0_mpa=p0_mpa), [BARE], RecordOptions())


def test_the_exponent_is_held_for_the_search_where_the_response_model_leaves_least() -> None:
    model, choices = start_model(ASKED, SEVERAL, RecordOptions())
    assert len(choices) == 2
    assert is_free(model)
    held = hold(model, [prepare(record, model) for record in SEVERAL])
    assert not is_free(held)
    assert held.muscle.value("mean_exponent") == pytest.approx(1.0, abs=0.1), (
        "near the truth; the last polish goes on from there"
    )


def test_several_p0_are_fitted_as_well_as_one() -> None:
    """With the exponent left at 0 the same search ends at 7 degrees."""
    start, _ = start_model(ASKED, SEVERAL, RecordOptions())
    found = identify(SEVERAL, start, SearchSettings(seeds=(1,), swarm=SwarmSettings(iterations=60), workers=1))
    assert found.rmse_deg < 0.3
    law = found.model.muscle.parameters["mean_exponent"]
    assert law.value == pytest.approx(1.0, abs=0.03)
    assert law.std is not None
    assert "mean_exponent" in found.space.names
    assert found.seed_spread().keys() == set(found.space.names)
    assert found.unbounded_rmse_deg is not None
    assert found.unbounded_rmse_deg <= found.rmse_deg
    assert fingerprint_trouble(found.model) is None


def test_the_command_says_what_it_chose(tmp_path: Path) -> None:
    from rig.cli.model.identify import identify as command

    assert ONE.p1_mpa is not None
    assert ONE.p2_mpa is not None
    columns = {
        "t_s": ONE.t_s,
        "dp_cmd_mpa": ONE.dp_cmd_mpa,
        "p1_mpa": ONE.p1_mpa,
        "p2_mpa": ONE.p2_mpa,
        "angle_deg": ONE.angle_deg,
    }
    rows = np.column_stack([column for column in columns.values() if column is not None])
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header=",".join(columns), comments="", fmt="%.6f")
    words = [
        str(tmp_path / "log.csv"),
        "-o",
        str(tmp_path / "m.yaml"),
        "--seeds",
        "1",
        "--iterations",
        "20",
        "--unbounded",
        "--no-polish",
    ]
    done = CliRunner().invoke(command, [*words, "--json", str(tmp_path / "m.json")], catch_exceptions=False)
    assert done.exit_code == 0
    said = " ".join(done.output.split())
    assert "driven by the measured pressures" in said
    assert "mean_exponent held at 1" in said
    assert "fingerprint from the measured pressures: it misses" in said
    result = json.loads((tmp_path / "m.json").read_text(encoding="utf-8"))
    assert result["input"] == "pressure"
    assert result["mean_exponent"] == 1.0
    model = load_model(tmp_path / "m.yaml")
    assert fingerprint_trouble(model) is None
    assert model.fingerprint is not None
    assert result["fingerprint"]["weights"] == list(model.fingerprint.weights)


def off(record: Record, zero_deg: float) -> Record:
    assert record.angle_deg is not None
    return replace(record, angle_deg=record.angle_deg + zero_deg)


@pytest.mark.parametrize(("share", "found"), [(0.0, False), (0.007, False), (0.015, True), (-0.1, True)])
def test_the_zero_of_the_angle_is_identified_where_it_is_off(share: float, found: bool) -> None:
    """By a share of the angle's range: on both sides of the limit, and of 0."""
    whole = max(float(np.ptp(record.angle_deg)) for record in SEVERAL if record.angle_deg is not None)
    moved = [off(record, share * whole) for record in SEVERAL]
    model, choices = start_model(replace(ASKED, free_offset=None), moved, RecordOptions())
    assert (model.sensor.kind == StageKind.AFFINE) == found
    assert any("zero of the angle: identified" in why for why in choices) == found
    for insisted in (True, False):
        model, choices = start_model(replace(ASKED, free_offset=insisted), moved, RecordOptions())
        assert (model.sensor.kind == StageKind.AFFINE) == insisted
        assert not any("zero of the angle" in why for why in choices)


def test_a_drive_to_one_side_tells_nothing_of_the_zero() -> None:
    """Half a sine: what hysteresis leaves there is a constant as well."""
    half = [record.rows(record.dp_cmd_mpa > 0.0) for record in SEVERAL]
    assert why_zero_is_free([off(record, 10.0) for record in half], Input.PRESSURE, 0.2, 1.0) == ""
    assert why_zero_is_free([off(record, 10.0) for record in SEVERAL], Input.PRESSURE, 0.2, 1.0) != ""

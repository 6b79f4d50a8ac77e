"""A recording as a program, the comparison, and the gate's findings; carrying it out is tested in tests/replay."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.records.made_logs import PERIOD_NS, made_content, made_samples

from rig.app.runs import replaying
from rig.errors import ConfigError, EnvelopeError, RecordError
from rig.log.convert import samples_of, write_content
from rig.log.mcap.columns import Samples
from rig.log.reader import read
from rig.log.replay import compare, departures, onto_period, program_of, timeline
from rig.sample import Phase


def sweep_of(samples: Samples) -> np.ndarray:
    return np.flatnonzero(samples["phase"] == Phase.SWEEP)


def test_the_program_sends_the_recorded_set_points_tick_by_tick() -> None:
    samples = made_samples(1000)
    program = program_of(samples, PERIOD_NS, None, "x")
    rows = sweep_of(samples)
    assert (program.settle_ticks, program.zero_ticks, program.ramp_in_ticks, program.ramp_out_ticks) == (
        100,
        50,
        50,
        100,
    )
    assert (program.rest_p1_mpa, program.rest_p2_mpa) == (0.2, 0.2)
    for index, row in enumerate(rows):
        at = program.at(program.sweep_start + index, (0.2, 0.2))
        assert at == (Phase.SWEEP, samples["p1_cmd_mpa"][row], samples["p2_cmd_mpa"][row])


def test_a_missed_tick_holds_the_set_point_before_it() -> None:
    samples = made_samples(1000, missed_at=500)
    program = program_of(samples, PERIOD_NS, None, "x")
    gap = 500 - sweep_of(samples)[0]
    before, after = samples["p1_cmd_mpa"][499], samples["p1_cmd_mpa"][500]
    assert list(program.p1_cmd_mpa[gap - 1 : gap + 3]) == [before, before, before, after]
    assert len(program.p1_cmd_mpa) == len(sweep_of(samples)) + 2


def test_a_log_of_a_difference_alone_needs_the_rest_pressure(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("t_s,dp_cmd_mpa\n" + "".join(f"{0.005 * k:.3f},{0.01 * k:.2f}\n" for k in range(11)))
    (record,) = read(path)
    samples = samples_of(record, 0)
    with pytest.raises(RecordError, match="--p0"):
        program_of(samples, PERIOD_NS, None, "x")
    program = program_of(samples, PERIOD_NS, 0.3, "x")
    assert list(program.p1_cmd_mpa) == pytest.approx(0.3 + record.dp_cmd_mpa / 2)
    assert (program.settle_ticks, program.zero_ticks, program.ramp_in_ticks, program.ramp_out_ticks) == (
        400,
        100,
        100,
        200,
    )


def test_another_period_is_refused_or_held() -> None:
    samples = made_samples(200)
    with pytest.raises(RecordError, match=r"recorded every 5 ms, the rig ticks every 2\.5 ms; --resample"):
        program_of(samples, PERIOD_NS // 2, None, "x")
    program = program_of(onto_period(samples, PERIOD_NS // 2), PERIOD_NS // 2, None, "x")
    rows = sweep_of(samples)
    assert list(program.p1_cmd_mpa[0:4:2]) == list(samples["p1_cmd_mpa"][rows[:2]])
    assert program.p1_cmd_mpa[0] == program.p1_cmd_mpa[1]


@pytest.mark.parametrize(
    ("phase", "message"), [(Phase.SETTLE, "holds no sweep to replay"), (None, "its ticks do not rise")]
)
def test_what_cannot_be_replayed(phase: Phase | None, message: str) -> None:
    samples = made_samples(200)
    if phase is None:
        samples["tick"][100] = 3
    else:
        samples["phase"][:] = phase
    with pytest.raises(RecordError, match=message):
        timeline(samples, "x")


def test_a_phase_whose_ticks_run_backwards_is_not_replayed() -> None:
    """Of a settling that is less than nothing the sweep began in its middle, without the ramp that leads to it."""
    samples = made_samples(1000)
    samples["tick"][0] = 900
    with pytest.raises(RecordError, match="x: its ticks do not rise"):
        program_of(samples, PERIOD_NS, None, "x")


@pytest.mark.parametrize("first", [5, 500])
def test_a_wrong_tick_number_is_said_before_its_ticks_are_made(first: int) -> None:
    """In the settling, or in the sweep: twenty gigabytes were asked for."""
    samples = made_samples(1000)
    samples["tick"][first:] += np.uint32(3_000_000_000)
    samples["scheduled_ns"][first:] += 3_000_000_000 * PERIOD_NS
    with pytest.raises(RecordError, match=r"x: 1000 rows would become 3e\+09 ticks; .* is a tick wrong\?"):
        program_of(samples, PERIOD_NS, None, "x")


def test_the_comparison_goes_by_the_tick_of_the_sweep() -> None:
    recorded = made_samples(1000)
    replayed = made_samples(1000, missed_at=600)
    replayed = Samples(
        replayed.fields | {"tick": replayed["tick"] + np.uint32(77)}, replayed.log_time_ns, replayed.sequence
    )
    comparison = compare(recorded, replayed, "x")
    assert np.array_equal(comparison.tick - comparison.recorded_tick, np.full(len(comparison.tick), 77))
    assert len(comparison.missed_s) == 1
    assert comparison.command_difference_mpa == pytest.approx(0.0, abs=1e-12)
    facts = compare(
        recorded,
        Samples(recorded.fields | {"angle_deg": recorded["angle_deg"] + 2}, recorded.log_time_ns, recorded.sequence),
        "x",
    ).facts()
    assert (facts["rmse_deg"], facts["max_deg"], facts["mean_deg"]) == pytest.approx((2.0, 2.0, 2.0))


def test_the_gate_names_field_tick_and_difference() -> None:
    reference, moved = made_samples(300), made_samples(300)
    assert departures(reference, moved, {"angle_deg": 0.0, "excitation_raw": 0.0, "tick": 0}) == []
    moved["angle_deg"][200:] += 0.5
    (finding,) = departures(reference, moved, {"angle_deg": 0.1, "p1_mpa": 0.0})
    assert finding.startswith("angle_deg at tick 200: ")
    assert "a difference of 0.5 (allowed 0.1; 100 ticks differ, by up to 0.5)" in finding
    moved["angle_deg"][10] = np.nan
    assert departures(reference, moved, {"angle_deg": 1.0})[0].startswith("angle_deg at tick 10: nan")
    assert departures(reference, reference.rows(slice(0, 299)), {"tick": 0}) == ["299 ticks, the reference has 300"]


def test_where_a_log_begins_is_no_departure() -> None:
    reference = made_samples(100)
    later = Samples(
        reference.fields
        | {"tick": reference["tick"] + np.uint32(9), "scheduled_ns": reference["scheduled_ns"] + 9 * PERIOD_NS},
        reference.log_time_ns,
        reference.sequence,
    )
    assert departures(reference, later, {"tick": 0, "scheduled_ns": 0}) == []


def test_the_envelope_is_checked_before_anything_moves(tmp_path: Path) -> None:
    content = made_content(400)
    content.samples["p1_cmd_mpa"][200] = 0.55
    write_content(content, tmp_path / "run.mcap")
    with pytest.raises(
        EnvelopeError, match=r"run: set-point p1 would be 0\.55 MPa; allowed is 0 \.\. 0\.5 MPa \(sweep, at 0\.600 s\)"
    ):
        replaying.prepare(tmp_path / "run.mcap", None, None, None, resample=False)


def test_a_gate_is_a_mapping_of_numbers(tmp_path: Path) -> None:
    path = tmp_path / "gate.yaml"
    path.write_text("angle_deg: 0.1\ntick: 0\n")
    assert replaying.load_gate(path) == {"angle_deg": 0.1, "tick": 0.0}
    for text in ("- angle_deg\n", "angle_deg: wide\n"):
        path.write_text(text)
        with pytest.raises(ConfigError, match="a gate maps fields to tolerances"):
            replaying.load_gate(path)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{}\n", "names no field: it would let everything through"),
        ("angel_deg: 0.1\n", "unknown field 'angel_deg'; did you mean 'angle_deg'"),
        ("angle_deg: -0.1\n", "angle_deg: -0.1 is below 0: no replay can keep it"),
    ],
)
def test_a_gate_that_cannot_hold_or_cannot_fail_is_refused_before_anything_moves(
    tmp_path: Path, text: str, says: str
) -> None:
    path = tmp_path / "gate.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        replaying.load_gate(path)
    assert str(caught.value).startswith(f"{path}: {says}")


def test_facts_without_a_rest_pressure_use_the_zero_phase(tmp_path: Path) -> None:
    content = made_content(400)
    content.samples["p1_cmd_mpa"][:80] = 0.21
    bare = replace(content, run_facts={"name": "x"})
    write_content(bare, tmp_path / "x.mcap")
    job = replaying.prepare(tmp_path / "x.mcap", None, None, None, resample=False)
    assert job.recordings[0].program.rest_p1_mpa == 0.21

"""Angles to follow: a sweep's YAML in degrees, the way into them from rest, and what is refused."""

import itertools
import math
from pathlib import Path

import pytest

from rig.errors import ConfigError, EnvelopeError
from rig.excite.envelope import check_run
from rig.excite.reference import lead_in
from rig.excite.run_plan import expand
from rig.excite.sweep import load_sweep
from rig.realtime.closed_loop import TrackingProgram
from rig.realtime.guard import Limits
from rig.service.session.run_setup import program_of

PERIOD_NS = 5_000_000
HEAD = "closed_loop: {kp_mpa_per_deg: 0.002, ki_mpa_per_deg_s: 0.1}\nduration_s: 2.0\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "r.yaml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("entry", "name", "peak"),
    [
        ("sine: {frequency_hz: 0.5, amplitude_deg: 25}", "sine_0.5hz_25deg", 25.0),
        ("triangle: {frequency_hz: 0.5, amplitude_deg: 30}", "triangle_0.5hz_30deg", 30.0),
        ("mixed: {frequency_hz: 0.5, amplitude_deg: 10}", "mixed_0.5hz_10deg", 17.8),
        ("staircase: {amplitude_deg: 20, steps: 2, dwell_s: 0.4}", "staircase_2x0.4s_20deg", 20.0),
        ("hold: {amplitude_deg: -15}", "hold_-15deg", 15.0),
    ],
)
def test_the_shapes_of_a_sweep_stand_in_degrees(tmp_path: Path, entry: str, name: str, peak: float) -> None:
    sweep = load_sweep(written(tmp_path, f"{HEAD}records:\n  - {entry}\n"))
    plan = expand(sweep, PERIOD_NS)[0]
    assert sweep.tracks
    assert plan.name == name
    assert plan.tracking is not None
    swept = plan.tracking.reference_deg[plan.ramp_in_ticks :]
    assert len(swept) == len(plan.dp_mpa) == 400
    assert max(abs(angle) for angle in swept) == pytest.approx(peak, rel=0.15)
    assert not any(plan.tracking.feedforward_mpa)


def test_a_table_of_angles_is_a_reference(tmp_path: Path) -> None:
    (tmp_path / "way.csv").write_text("t_s,angle_deg\n0,0\n1,10\n2,0\n", encoding="utf-8")
    plan = expand(load_sweep(written(tmp_path, f"{HEAD}records: [{{waveform: {{file: way.csv}}}}]")), PERIOD_NS)[0]
    assert plan.tracking is not None
    assert plan.name == "angles_way"
    assert plan.tracking.reference_deg[plan.ramp_in_ticks + 100] == pytest.approx(5.0)
    (tmp_path / "way.csv").write_text("t_s,dp_mpa\n0,0\n1,10\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="angle_deg"):
        expand(load_sweep(written(tmp_path, f"{HEAD}records: [{{waveform: {{file: way.csv}}}}]")), PERIOD_NS)


def test_the_lead_in_begins_at_rest_and_arrives_in_motion() -> None:
    step = 0.3
    way = [*lead_in(5.0, step, 200), 5.0, 5.0 + step]
    assert way[0] == 0.0
    assert abs(way[1]) < 0.01
    assert way[200] - way[199] == pytest.approx(step, rel=0.05)
    assert max(abs(b - a) for a, b in itertools.pairwise(way)) < 2 * step
    assert not lead_in(5.0, step, 0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (f"{HEAD}records: [{{sine: {{frequency_hz: 0.5, amplitude_mpa: 0.2}}}}]", "needs amplitude_deg"),
        (f"{HEAD}records: [{{sine: {{frequency_hz: 0.5, amplitude_deg: .nan}}}}]", "amplitude_deg"),
        (f"{HEAD}records: [{{sine: {{frequency_hz: 0.5, amplitude_deg: 10, x: 1}}}}]", "unknown"),
        ("closed_loop: {kp_mpa_per_deg: 7}\nrecords: [{hold: {amplitude_deg: 1}}]", "kp_mpa_per_deg"),
        ("closed_loop: {kp: 0.1}\nrecords: [{hold: {amplitude_deg: 1}}]", "closed_loop"),
    ],
)
def test_what_does_not_fit_is_told(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said) as raised:
        load_sweep(written(tmp_path, text))
    assert "\n" not in str(raised.value)


def test_a_zero_too_short_to_be_taken_is_refused(tmp_path: Path) -> None:
    sweep = load_sweep(written(tmp_path, f"{HEAD}zero_s: 0.02\nrecords: [{{hold: {{amplitude_deg: 1}}}}]"))
    with pytest.raises(ConfigError, match=r"zero_s: 0.02 s; to close the loop at least 0.05 s"):
        expand(sweep, PERIOD_NS)


def test_without_gains_nothing_is_carried_out(tmp_path: Path) -> None:
    plan = expand(load_sweep(written(tmp_path, "records: [{hold: {amplitude_deg: 1}}]")), PERIOD_NS)[0]
    with pytest.raises(EnvelopeError, match="without gains"):
        check_run(plan, Limits(), PERIOD_NS)
    with pytest.raises(ConfigError, match="without gains"):
        program_of(plan, 1)


@pytest.mark.parametrize(("amplitude_deg", "fits"), [(59.0, True), (61.0, False)])
def test_a_reference_outside_the_angles_is_refused(tmp_path: Path, amplitude_deg: float, fits: bool) -> None:
    entry = f"sine: {{frequency_hz: 0.5, amplitude_deg: {amplitude_deg}}}"
    plan = expand(load_sweep(written(tmp_path, f"{HEAD}records: [{{{entry}}}]")), PERIOD_NS)[0]
    limits = Limits(angle_deg=(-60.0, 60.0))
    if fits:
        check_run(plan, limits, PERIOD_NS)
        return
    with pytest.raises(EnvelopeError, match=r"reference would be 60\.\d+ deg; allowed is -60 \.\. 60 deg \(sweep, at"):
        check_run(plan, limits, PERIOD_NS)


def test_the_program_has_reference_and_gains(tmp_path: Path) -> None:
    entry = "sine: {frequency_hz: 0.5, amplitude_deg: 10}"
    plan = expand(load_sweep(written(tmp_path, f"{HEAD}records: [{{{entry}}}]")), PERIOD_NS)[0]
    made = program_of(plan, 3)
    assert isinstance(made, TrackingProgram)
    assert made.settings.ki_mpa_per_deg_s == 0.1
    assert made.ticks == plan.ticks
    first = plan.settle_ticks + plan.zero_ticks + plan.ramp_in_ticks
    assert made.wanted_deg(first + 100) == pytest.approx(10 * math.sin(math.pi * 0.5))

"""The real joint of ../shared/real: irregular stamps, repeated packets, a start-up transient.

Identified on the first half of its sweep, judged on the rest.
"""

import csv
from pathlib import Path

import numpy as np
import pytest

from rig.errors import RecordError
from rig.identify.fit import SearchSettings, identify
from rig.identify.records.data import RecordOptions, prepare
from rig.identify.response.valves import identify_valves
from rig.identify.search.stability import SweepRange
from rig.identify.search.swarm import SwarmSettings
from rig.identify.templates import Template, input_gain, template_model
from rig.identify.validate import validate
from rig.model.parameters import Input, regulator_times_s
from rig.record import Record

RANGE = SweepRange(0.1, 2.5, 0.4)
FIRST_HALF = RecordOptions(resample=True, skip_s=0.5, until_s=10.0)
SECOND_HALF = RecordOptions(resample=True, skip_s=10.0)


@pytest.fixture(scope="module")
def sweep(shared: Path) -> Record:
    """exp3: a push-pull chirp from 0.1 to 5 Hz in 20 s."""
    file = shared / "real" / "porcaro_wrist" / "exp3_sweep_20260211.csv"
    if not file.is_file():
        pytest.skip("the records of the real joint are not part of the project")
    with file.open(encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines))
    column = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    p1, p2 = column["u_cmd_DF_MPa"], column["u_cmd_F_MPa"]
    return Record(
        "exp3", column["t_s"], p1 - p2, column["y_wrist_angle_deg"], p1, p2, column["y_meas_DF_MPa"],
        column["y_meas_F_MPa"]
    )  # fmt: skip


def fit_percent(record: Record, kind: str, joint: str, drive: Input) -> tuple[float, float]:
    """Fit on the first half and on the rest, identified on the first half alone."""
    first = record.rows(record.t_s <= 10.0)
    wish = Template(kind, drive, 0.02, 0.3, 0.4, joint, free_offset=True)
    settings = SearchSettings(
        "pso" if joint == "rigid" else "cma-es",
        (1,),
        SwarmSettings(iterations=300 if joint == "rigid" else 60),
        sweep=RANGE,
        workers=1,
    )
    found = identify([record], template_model(wish, input_gain([first], 0.4)), settings, FIRST_HALF)
    assert found.verdict.bounded
    rest = validate(found.model, [record], RANGE, SECOND_HALF)
    assert any("valid for 0.1 .. 2.5 Hz" in text for text in rest.warnings), (
        "the second half is faster than what was identified"
    )
    return found.scores[0].fit_percent, rest.scores[0].fit_percent


def test_its_period_is_not_the_papers(sweep: Record) -> None:
    with pytest.raises(RecordError, match="sampled every 20"):
        prepare(sweep, template_model(Template()))


def test_its_repeated_packets_are_found(sweep: Record) -> None:
    data = prepare(sweep, template_model(Template(sample_time_s=0.02)), RecordOptions(resample=True))
    assert any("repeat the packet before" in text for text in data.warnings)


def test_its_regulators_answer_late(sweep: Record) -> None:
    """60 to 80 ms between command and pressure: a dead time of two or three ticks and a lag; they exhaust more slowly
    than they fill."""
    fit = identify_valves([sweep.rows(sweep.t_s <= 10.0)], 0.02, 0.3)
    assert 0.02 <= fit.dead_time_s <= 0.06
    fills_s, exhausts_s = regulator_times_s(fit.stage)
    for fill_s, exhaust_s in zip(fills_s, exhausts_s, strict=True):
        assert 0.08 < fit.dead_time_s + 0.5 * (fill_s + exhaust_s) < 0.14
        assert exhaust_s > 1.2 * fill_s
    assert max(fit.rmse_mpa) < 0.02


def test_without_inertia_the_model_is_good_up_to_2_hz_and_not_beyond(sweep: Record) -> None:
    first, rest = fit_percent(sweep, "mbw", "rigid", Input.PRESSURE)
    assert first > 75.0
    assert rest < 50.0


def test_a_second_order_joint_carries_it_further(sweep: Record) -> None:
    first, rest = fit_percent(sweep, "bw", "second_order", Input.PRESSURE)
    assert first > 80.0
    assert rest > 40.0


def test_from_the_command_it_is_worse_than_from_the_pressures(sweep: Record) -> None:
    from_command, _ = fit_percent(sweep, "bw", "rigid", Input.COMMAND)
    from_pressure, _ = fit_percent(sweep, "bw", "rigid", Input.PRESSURE)
    assert from_pressure > from_command + 3.0

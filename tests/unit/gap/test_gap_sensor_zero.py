"""Where a sensor has its zero says nothing of a change: with all angles as much higher the diagnosis is the same."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from support.plants.gap_rigs import baselines, model, session

from rig.gap import diagnose
from rig.gap.answer.result import Diagnosis
from rig.gap.records.own_zero import OWN_ZERO_NOTE
from rig.gap.records.settings import FIRST_ROWS
from rig.model.parameters import AddedEffect
from rig.record import Record
from rig.smoothing import smoothed

HERE_DEG, MOUNTED_DEG = 2.0, 40.0
"""Neither is where the joint rests: records that begin at zero are taken to count from there."""
CHANGES = {
    "nothing": (),
    "thermal_drift": (AddedEffect("thermal_drift", {"rate_per_min": 0.2}),),
    "creep": (AddedEffect("creep", {"share": 0.08, "tau_s": 1.0}),),
    "coulomb_friction": (AddedEffect("coulomb_friction", {"width_deg": 0.3}),),
    "end_stop": (AddedEffect("end_stop", {"high_deg": 20.0}),),
}


def turned(day: Sequence[Record], by_deg: float) -> list[Record]:
    """The records of a sensor that is mounted so much further."""
    return [replace(record, angle_deg=record.angle_deg + by_deg) for record in day]  # type: ignore[operator]


def beside_days(change: str, by_deg: float) -> Diagnosis:
    days = [turned(day, by_deg) for day in baselines()]
    return diagnose(None, turned(session(9, *CHANGES[change]), by_deg), days)


@pytest.mark.parametrize("change", CHANGES)
def test_another_zero_changes_no_answer(change: str) -> None:
    here, there = beside_days(change, HERE_DEG), beside_days(change, MOUNTED_DEG)
    assert there.verdict is here.verdict
    assert [cause.effect for cause in there.causes] == [cause.effect for cause in here.causes]
    assert there.confidence == pytest.approx(here.confidence, abs=0.02)
    assert there.gap.floor_deg == pytest.approx(here.gap.floor_deg, rel=0.01)
    for one, other in zip(here.causes, there.causes, strict=True):
        moved = MOUNTED_DEG - HERE_DEG if one.effect == "end_stop" else 0.0
        for name, number in one.parameters.items():
            at = moved if name == "high_deg" else 0.0
            assert other.parameters[name].value == pytest.approx(number.value + at, rel=0.02, abs=1e-3)


GAIN = AddedEffect("valve_gain", {"gain": 0.05, "balance": 1.0})
SHIFT_DEG = 2.1
"""By which 5 % more of p1 = P0 turn the joint at rest."""


def zeroed(record: Record) -> Record:
    """As pamrig's own loop records it: the angle at rest is taken for zero."""
    assert record.angle_deg is not None
    return replace(record, angle_deg=record.angle_deg - SHIFT_DEG, facts={"angle_zero_deg": SHIFT_DEG})


@pytest.mark.parametrize("days", [0, 1, 3])
def test_a_zero_that_each_record_took_at_rest_is_no_second_cause(days: int) -> None:
    earlier = [[replace(record, facts={"angle_zero_deg": 0.1}) for record in day] for day in baselines()[:days]]
    found = diagnose(model(), session(72, GAIN, after=zeroed), earlier)
    assert [cause.effect for cause in found.causes] == ["valve_gain"]
    assert found.causes[0].parameters["gain"].value == pytest.approx(0.05, rel=0.15)
    if days:  # it counts from each record's own zero, and so does the simulator's angle
        assert found.gap.rms_deg < 0.2 * SHIFT_DEG
        assert found.gap.after_deg < found.gap.floor_deg


CODE_DEG = 0.03


def from_its_first(record: Record) -> Record:
    """As an encoder counts that is switched on before each record, of which its table says nothing."""
    assert record.angle_deg is not None
    codes = np.round(smoothed(record.angle_deg, 4.0) / CODE_DEG)
    return replace(record, angle_deg=CODE_DEG * (codes - float(np.median(codes[:FIRST_ROWS]))))


@pytest.mark.parametrize("days", [0, 3])
def test_nor_is_one_that_no_record_tells_of(days: int) -> None:
    earlier = [[from_its_first(record) for record in day] for day in baselines()[:days]]
    found = diagnose(model(), session(72, GAIN, after=from_its_first), earlier)
    assert [cause.effect for cause in found.causes] == ["valve_gain"]
    assert OWN_ZERO_NOTE in found.notes


def test_a_zero_that_nobody_took_is_a_finding() -> None:
    """Beside a simulator alone what turns the joint by a constant is not told from a sensor's zero; earlier days do."""
    moved = session(72, after=lambda record: turned([record], 3.0)[0])
    alone = diagnose(model(), moved)
    (cause,) = alone.causes
    assert "sensor_offset" in {cause.effect, *cause.ambiguous_with}
    beside = diagnose(model(), moved, [list(day) for day in baselines()])
    assert [cause.effect for cause in beside.causes] == ["sensor_offset"]


def test_re_tuning_counts_the_error_from_the_zero_that_each_record_took() -> None:
    """A shift of 2 deg that nobody can see was the larger part of "the simulator's error" that re-tuning closed."""
    bend = AddedEffect("sensor_nonlinearity", {"square": 0.15})
    found = diagnose(model(), [zeroed(record) for record in session(9, bend)], reference="simulator")
    assert [cause.effect for cause in found.causes] == ["sensor_nonlinearity"]
    assert found.retuning is not None
    assert found.retuning.before_deg == pytest.approx(found.gap.rms_deg, rel=0.1)


def test_samples_that_fall_to_the_sensors_own_zero_fall_to_one_value_whatever_zero_each_record_took() -> None:
    """Neither the angle's zero nor its end, and another value in each record: nothing had fallen."""
    random = np.random.default_rng(4)

    def falling(record: Record) -> Record:
        assert record.angle_deg is not None
        zero_deg = 3.0 + 0.1 * random.standard_normal()
        read = np.where(random.random(len(record)) < 0.01, 0.0, record.angle_deg + zero_deg)
        return replace(record, angle_deg=read - zero_deg, facts={"angle_zero_deg": zero_deg})

    found = diagnose(model(), session(9, after=falling), reference="simulator")
    (cause,) = found.causes
    assert cause.effect == "sensor_dropout"
    assert cause.parameters["probability"].value == pytest.approx(0.01, rel=0.3)
    assert cause.parameters["rail_deg"].value == pytest.approx(-3.0, abs=0.3)

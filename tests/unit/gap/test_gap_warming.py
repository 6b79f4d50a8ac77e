"""A muscle that warms on its own moves the angle and its gain together; a sensor's zero that wanders moves the angle
alone; what goes on through a session is told where the records say when they began."""

from collections.abc import Callable
from dataclasses import replace

import pytest
from support.plants.gap_rigs import session

from rig.gap import diagnose
from rig.gap.answer.words.sentences import headline
from rig.model.effect_stages import EFFECT_STAGES
from rig.model.parameters import AddedEffect
from rig.record import Column, Record

WARMS = AddedEffect("one_muscle_warms", {"rate_per_min": -0.6, "muscle": 2.0})
WANDERS = AddedEffect("sensor_drift", {"rate_deg_min": 8.0})


def test_one_muscle_that_warms_is_no_wandering_sensor() -> None:
    found = diagnose(None, session(222, WARMS), [session(221)])
    assert [cause.effect for cause in found.causes] == ["thermal_drift"]
    numbers = found.causes[0].parameters
    assert numbers["muscle"].value == 2.0
    assert numbers["rate_per_min"].value == pytest.approx(-0.6, rel=0.1)
    assert headline(found)[0].startswith("Muscle 2 gets weaker by ")


def test_a_sensor_that_wanders_is_no_warming_muscle() -> None:
    found = diagnose(None, session(222, WANDERS), [session(221)])
    assert [cause.effect for cause in found.causes] == ["sensor_drift"]


APART_S = 25.0
"""From the start of one record to that of the next."""


def through_the_session(records: list[Record], changed: Callable[[Column, Column], Column]) -> list[Record]:
    """Records with another angle: that of an angle and of the minutes since the first of them began."""
    return [
        replace(
            record,
            angle_deg=changed(angle(record), (record.t_s + k * APART_S) / 60.0),
            facts=dict(record.facts) | {"started_ns": 10**18 + round(k * APART_S * 1e9)},
        )
        for k, record in enumerate(records)
    ]


def angle(record: Record) -> Column:
    assert record.angle_deg is not None
    return record.angle_deg


@pytest.mark.parametrize(
    ("changed", "effect", "number", "rate", "says"),
    [
        (lambda y, minutes: y + 2.0 * minutes, "sensor_drift", "rate_deg_min", 2.0, "The sensor's zero wanders by"),
        (lambda y, minutes: y * (1.0 + 0.05 * minutes), "thermal_drift", "rate_per_min", 0.05, "The motion grows by"),
    ],
)
def test_what_goes_on_from_record_to_record_is_one_cause(
    changed: Callable[[Column, Column], Column], effect: str, number: str, rate: float, says: str
) -> None:
    """It was called a leak, or creep, at 0.8 and 0.99: only through each record by itself was anything let wander."""
    found = diagnose(None, through_the_session(session(222), changed), [session(221)])
    assert [cause.effect for cause in found.causes] == [effect]
    numbers = found.causes[0].parameters
    assert numbers["whole_session"].value == 1.0
    assert numbers[number].value == pytest.approx(rate, rel=0.06)
    assert found.gap.after_deg < 0.3 * found.gap.rms_deg
    first = headline(found)[0]
    assert first.startswith(says)
    assert "through the whole session" in first


def test_what_begins_anew_with_each_record_does_not_go_on() -> None:
    stamped = through_the_session(session(222, WANDERS), lambda y, _: y)
    found = diagnose(None, stamped, [session(221)])
    assert [cause.effect for cause in found.causes] == ["sensor_drift"]
    assert "whole_session" not in found.causes[0].parameters


def test_a_healthy_session_with_its_times_lacks_nothing() -> None:
    assert not diagnose(None, through_the_session(session(222), lambda y, _: y), [session(221)]).causes


UNEQUALLY = AddedEffect("thermal_drift", {"rate_per_min": 0.3, "about_deg": 12.0})
SLIPS = AddedEffect("slipping_sensor", {"share": 0.005})


def test_muscles_that_warm_unequally_are_one_cause() -> None:
    """The motion grows about an angle that is not zero: it was a warming and a drift of the sensor."""
    found = diagnose(None, session(222, UNEQUALLY), [session(221)])
    assert [cause.effect for cause in found.causes] == ["thermal_drift"]
    assert found.causes[0].parameters["about_deg"].value == pytest.approx(12.0, rel=0.15)
    assert " a minute about 1" in headline(found)[0]


def test_a_sensor_that_slips_as_the_joint_moves_is_no_warming() -> None:
    """A joint that goes farther in the same time loses more: it was a muscle that warms, with 0.98."""
    found = diagnose(None, session(222, SLIPS), [session(221)])
    assert [cause.effect for cause in found.causes] == ["sensor_drift"]
    assert found.causes[0].parameters["share"].value == pytest.approx(0.005, rel=0.05)
    assert headline(found)[0].startswith(
        "The sensor's zero wanders upwards as the joint moves, by 0.50 % of its travel"
    )


@pytest.mark.parametrize(
    ("effect", "size", "either"),
    [
        ("sensor_offset", {"offset_deg": 3.0}, "muscle_mismatch"),
        ("sensor_drift", {"rate_deg_min": 8.0}, "thermal_drift"),
        ("slipping_sensor", {"share": 0.005}, "thermal_drift"),
    ],
)
def test_a_shift_of_the_angle_may_be_the_muscles(effect: str, size: dict[str, float], either: str) -> None:
    """Of muscles whose angle goes with the logarithm of the pressures' ratio another force is a pure shift: it was the
    sensor, with 1.00."""
    cause = diagnose(None, session(222, AddedEffect(effect, size)), [session(221)]).causes[0]
    assert cause.effect == EFFECT_STAGES[effect].effect
    assert either in cause.ambiguous_with
    assert 0.5 < cause.confidence < 0.9

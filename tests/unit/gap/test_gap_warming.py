"""A muscle that warms on its own moves the angle and its gain together; a sensor's zero that wanders moves the angle
alone."""

import pytest
from support.plants.gap_rigs import session

from rig.gap import diagnose
from rig.gap.answer.words.sentences import headline
from rig.model.parameters import AddedEffect

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

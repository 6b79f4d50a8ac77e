"""Several things that competing hypotheses must not make of each other: two that undo each other, two that look alike,
tones that no effect makes."""

from dataclasses import replace

import numpy as np
from support.plants.gap_rigs import asked, names, session

from rig.gap.hypotheses.library import LIBRARY
from rig.model.parameters import AddedEffect
from rig.record import Record


def test_monitors_speak_against_a_cause_that_they_would_show() -> None:
    day = session(71, AddedEffect("sensor_offset", {"offset_deg": -4.0}))
    assert asked(day, library=["valve_offset"]).verdict == "unknown"


def test_two_that_look_alike_are_not_named_beside_each_other() -> None:
    said = asked(
        session(75, AddedEffect("backlash", {"width_deg": 1.2}), AddedEffect("coulomb_friction", {"width_deg": 1.2}))
    )
    assert not {"backlash", "coulomb_friction"} <= names(said)
    assert said.verdict != "none"


def with_tone(hertz: float) -> list[Record]:
    def sing(record: Record) -> Record:
        angle = record.angle_deg
        assert angle is not None
        return replace(record, angle_deg=angle + 0.2 * np.sin(2 * np.pi * hertz * record.t_s))

    return session(78, after=sing)


def test_a_tone_that_is_no_mains_line_is_unknown_and_no_noise() -> None:
    said = asked(with_tone(37.0))
    assert said.verdict == "unknown"
    assert any("at 37.0 Hz: no effect of the library does that" in note for note in said.notes)
    assert names(said) == {"unknown"}


def test_a_mains_line_without_that_effect_is_unknown_and_no_noise() -> None:
    said = asked(with_tone(50.0), library=[name for name in LIBRARY if name != "mains_hum"])
    assert said.verdict == "unknown"
    assert names(said) == {"unknown"}

"""The worst that can happen: a joint that is held, valves that stand still, no air, a muscle that has lost half of its
pressure. What a rig most often comes in with is named like anything else, from the simulator alone as well."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from support.plants.gap_rigs import asked, model, session

from rig.errors import ModelError
from rig.gap import diagnose
from rig.gap.answer.result import Diagnosis
from rig.gap.answer.words.sentences import headline
from rig.gap.records.reach import check_reach, is_held
from rig.gap.records.usable import usability
from rig.model.parameters import AddedEffect
from rig.record import Record

ALONE, BESIDE_DAYS = "the simulator alone", "beside days"
ASK: dict[str, Callable[[list[Record]], Diagnosis]] = {
    ALONE: lambda records: diagnose(model(), records),
    BESIDE_DAYS: asked,
}
PLAY = {"coulomb_friction", "backlash"}
"""One class: what either does to a free joint is the same."""


@pytest.mark.parametrize(
    ("stage", "numbers", "reference", "names"),
    [
        ("coulomb_friction", {"width_deg": 22.0}, ALONE, PLAY),
        ("coulomb_friction", {"width_deg": 30.0}, ALONE, PLAY),
        ("coulomb_friction", {"width_deg": 30.0}, BESIDE_DAYS, PLAY),
        ("inertia", {"time_s": 0.25}, ALONE, {"inertia"}),
        ("inertia", {"time_s": 0.25}, BESIDE_DAYS, {"inertia"}),
        ("valve_dead_band", {"width_mpa": 0.1, "edge": 1.0}, ALONE, {"valve_dead_band"}),
        ("valve_dead_band", {"width_mpa": 0.1, "edge": 1.0}, BESIDE_DAYS, {"valve_dead_band"}),
        ("pressure_ceiling", {"ceiling_mpa": 0.15}, BESIDE_DAYS, {"pressure_ceiling"}),
        ("pressure_ceiling", {"ceiling_mpa": 0.11}, ALONE, {"pressure_ceiling"}),
        ("leak_ahead", {"loss": 0.7, "muscle": 1.0}, ALONE, {"leak"}),
        ("fed_leak", {"loss": 0.04, "muscle": 2.0, "supply_mpa": 0.28, "fill_mpa_s": 0.8}, ALONE, {"leak"}),
        ("fed_leak", {"loss": 0.04, "muscle": 2.0, "supply_mpa": 0.28, "fill_mpa_s": 0.8}, BESIDE_DAYS, {"leak"}),
    ],
)
def test_the_worst_of_an_effect_is_named(
    stage: str, numbers: dict[str, float], reference: str, names: set[str]
) -> None:
    found = ASK[reference](session(77, AddedEffect(stage, numbers)))
    assert found.verdict != "none"
    assert found.causes[0].effect in names
    assert found.gap.after_deg < 0.45 * found.gap.rms_deg


def without_air(records: list[Record], angle_deg: float = 0.4) -> list[Record]:
    """What the monitors and the sensor show when nobody opened the supply."""
    random = np.random.default_rng(3)

    def noise(std: float, rows: int) -> np.ndarray:
        return std * random.standard_normal(rows)

    return [
        replace(
            record,
            p1_mpa=noise(3e-4, len(record)),
            p2_mpa=noise(3e-4, len(record)),
            angle_deg=angle_deg + noise(0.03, len(record)),
        )
        for record in records
    ]


@pytest.mark.parametrize("reference", ASK)
def test_a_rig_without_air_is_no_broken_sensor(reference: str) -> None:
    found = ASK[reference](without_air(session(61)))
    assert found.causes[0].effect == "pressure_ceiling"
    low = ("The pressures do not rise above 20 kPa", "The supply stands at 20 kPa only")
    assert headline(found)[0].startswith(low)
    said = [note for note in found.notes if "neither the pressures nor the angle follow their command" in note]
    assert len(said) == 3
    assert all("is there air" in note for note in said)
    assert not any("does not repeat itself" in note or "broken wire" in note for note in found.notes)


@pytest.mark.parametrize("reference", ASK)
def test_valves_that_stand_still_in_some_records_are_something_at_the_valves(reference: str) -> None:
    day = session(62)
    collapsed = [
        replace(record, p1_mpa=record.p1_mpa + 0.12, p2_mpa=record.p2_mpa + 0.12) for record in without_air(day[1:])
    ]
    found = ASK[reference]([day[0], *collapsed])
    assert "unknown" in {cause.effect for cause in found.causes}
    assert max(found.where.chain, key=lambda link: link.share).stage == "valve"


T = np.arange(0.0, 12.0, 0.01)


def test_a_held_joint_is_told_from_another_unit() -> None:
    said = [30.0 * np.sin(T), 12.0 * np.sin(3.0 * T)]
    noise = np.random.default_rng(2).standard_normal(len(T))
    still = [0.05 * noise, 0.05 * noise[::-1]]
    radians = [np.deg2rad(25.0 * np.sin(T - 0.6)), np.deg2rad(10.0 * np.sin(3.0 * T - 0.6))]
    assert is_held(said, still)
    assert not is_held(said, radians)
    with pytest.raises(ModelError, match="other units"):
        check_reach(said, radians)


def test_a_model_that_turns_farther_than_a_joint_has_left_its_range() -> None:
    noise = 0.05 * np.random.default_rng(2).standard_normal(len(T))
    assert is_held([85.0 * np.sin(T)], [noise])
    assert not is_held([95.0 * np.sin(T)], [noise])


def test_a_joint_that_moves_as_usual_is_not_held() -> None:
    assert not is_held([20.0 * np.sin(T)], [10.0 * np.cos(T)])


def test_a_model_that_leaves_its_range_in_one_record_holds_no_joint() -> None:
    noise = np.random.default_rng(2).standard_normal(len(T))
    said, measured = [70.0 * noise / np.ptp(noise) * 2.0, 9.0 * np.sin(T), 8.0 * np.sin(2.0 * T)], [9.0 * np.sin(T)] * 3
    assert not is_held(said, measured)
    assert is_held([said[0]] * 3, measured)


def test_a_day_on_which_nothing_moved_is_no_healthy_one() -> None:
    (record, *_) = without_air(session(61))
    now, earlier = usability(record), usability(record, "baseline ")
    assert now.usable
    assert "is there air" in now.note
    assert not earlier.usable
    assert earlier.note.startswith(f"baseline {record.name}: ")
    assert "broken sensor or loose joint" in earlier.note

"""The diagnosis on a small rig: names, sizes, none, unknown, bad input."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.plants.gap_rigs import asked, baselines, model, names, session

from rig.cli.common import plain
from rig.errors import ModelError, RecordError
from rig.gap import diagnose
from rig.gap.answer.words.sentences import answers
from rig.model.parameters import AddedEffect, Parameter, StageKind, StageModel
from rig.model.simulation import simulate
from rig.record import Column, Record


@pytest.mark.parametrize("pressures", [True, False])
def test_healthy_day_is_no_gap(pressures: bool) -> None:
    for seed in (11, 12):
        found = asked(session(seed), pressures=pressures)
        assert found.verdict == "none"
        assert found.causes == []


@pytest.mark.parametrize(
    ("effect", "numbers", "size"),
    [
        ("delay", {"delay_s": 0.03}, "delay_s"),
        ("valve_gain", {"gain": 0.06}, "gain"),
        ("sensor_lag", {"tau_s": 0.03}, "tau_s"),
        ("sensor_gain", {"gain": -0.05}, "gain"),
        ("backlash", {"width_deg": 1.0}, "width_deg"),
        ("sensor_offset", {"offset_deg": -1.5}, "offset_deg"),
    ],
)
def test_single_effect_is_named_with_its_size(effect: str, numbers: dict[str, float], size: str) -> None:
    found = asked(session(21, AddedEffect(effect, numbers)))
    first = found.causes[0]
    assert effect in ({first.effect, *first.ambiguous_with} if effect == "backlash" else {first.effect})
    assert first.parameters[size].value == pytest.approx(numbers[size], rel=0.12), "friction has a width too"
    assert found.gap.explained_fraction > 0.85
    assert found.verdict == "explained"


def test_pair_of_valve_and_joint_is_found_on_both_sides() -> None:
    found = asked(session(31, AddedEffect("delay", {"delay_s": 0.04}), AddedEffect("backlash", {"width_deg": 1.5})))
    assert "delay" in names(found)
    assert {"coulomb_friction", "backlash"} <= {
        name for cause in found.causes for name in (cause.effect, *cause.ambiguous_with)
    }, "behind the muscles' hysteresis these are alike"
    assert found.where.shares["valve"] + found.where.shares["downstream"] == pytest.approx(1.0)


def test_effect_withheld_from_the_library_is_not_named() -> None:
    records = session(41, AddedEffect("valve_dead_band", {"width_mpa": 0.02, "tau0_s": 0.04}))
    found = asked(records, library=["sensor_gain", "valve_gain", "pressure_ceiling"])
    assert found.verdict in ("unknown", "partly_explained")
    assert "unknown" in names(found)


def test_shares_of_every_breakdown_add_up() -> None:
    found = asked(session(22, AddedEffect("backlash", {"width_deg": 1.0})), library=FEW)
    assert len(found.where.frequency) == len(session(22))
    for line in found.where.frequency:
        assert sum(line.shares.values()) == pytest.approx(1.0)
    for bands in (found.where.phase, found.where.region):
        assert sum(band.share for band in bands) == pytest.approx(1.0)


def test_json_is_plain_and_repeatable() -> None:
    records = session(23, AddedEffect("delay", {"delay_s": 0.03}))
    first, second = (json.dumps(plain(asked(records).to_json()), allow_nan=False) for _ in range(2))
    assert first == second
    assert {"verdict", "gap", "where", "causes", "ranking", "next_experiment"} <= json.loads(first).keys()


def test_a_simulator_alone_names_what_it_lacks() -> None:
    found = diagnose(model(), session(51, AddedEffect("delay", {"delay_s": 0.2})), [])
    assert found.reference == "simulator"
    assert names(found) == {"delay"}
    assert found.causes[0].parameters["delay_s"].value == pytest.approx(0.2, rel=0.1)
    assert found.gap.after_deg < 0.3 * found.gap.rms_deg


def test_nothing_to_compare_with_is_refused() -> None:
    with pytest.raises(ModelError, match="neither a fitting baseline nor a model"):
        diagnose(None, session(51), [])


def test_record_without_excitation_is_refused() -> None:
    still = [replace(record, dp_cmd_mpa=np.zeros(len(record))) for record in session(52)]
    with pytest.raises(RecordError, match="no excitation"):
        asked(still)


FEW = ["delay", "backlash"]
"""What is asked about where the answer is not what is looked at, but what it says of its records."""


def _other_sweeps() -> list[Record]:
    t_s = session(53)[0].t_s
    return [simulate(model(), Record("square", t_s, 0.1 * np.sign(np.sin(9 * t_s))), start_deg=0.0)]


def test_sessions_that_pair_with_nothing_are_an_error_of_the_call() -> None:
    with pytest.raises(
        RecordError,
        match=r"the baseline session pairs with no record: .* the command of square differs .* allowed: 10 %",
    ):
        diagnose(model(), session(54), [_other_sweeps()])


def test_a_session_of_other_sweeps_beside_a_fitting_one_is_said_and_not_used() -> None:
    found = diagnose(model(), session(54), [_other_sweeps(), list(baselines()[0])], library=FEW)
    assert any("baseline session 1 pairs with no record; nearest:" in note for note in found.notes)
    assert found.evidence.sessions == 1


def test_what_pairs_with_what_is_a_table_in_the_answer() -> None:
    table = asked(session(55), library=FEW).to_json()["evidence"]["pairing"]
    assert [(line["record"], line["session"], line["partner"], line["by"]) for line in table[:2]] == [
        ("sine_0.3", 1, "sine_0.3", "name and command"),
        ("sine_0.3", 2, "sine_0.3", "name and command"),
    ]
    assert all(line["off"] < line["limit"] == 0.1 for line in table)


def test_records_without_a_partner_are_named() -> None:
    records = session(55)
    t_s = records[0].t_s
    lonely = simulate(model(), Record("lonely", t_s, 0.1 * np.sin(2.5 * t_s) ** 3), start_deg=0.0)
    found = asked([*records, lonely])
    assert found.evidence.unpaired == ["lonely"]
    assert found.verdict == "none"


def test_holes_and_missing_pressure_are_survived() -> None:
    records = session(56)
    angle = records[0].angle_deg
    assert angle is not None
    angle = angle.copy()
    angle[400:900] = np.nan
    holed = [replace(records[0], angle_deg=angle), replace(records[1], p1_mpa=None), records[2]]
    found = asked(holed)
    assert found.verdict == "none"
    assert not found.evidence.pressures_used
    assert any("the angle alone is used" in note for note in found.notes)


def test_model_in_other_units_is_refused_without_a_baseline() -> None:
    small = [replace(record, angle_deg=np.deg2rad(record.angle_deg)) for record in session(57)]
    with pytest.raises(ModelError, match="other units"):
        diagnose(model(), small, [])


def _worse(day: list[Record], **columns: Callable[[Record], Column]) -> list[Record]:
    """A day whose records have these columns instead of their own."""
    return [replace(record, **{name: made(record) for name, made in columns.items()}) for record in day]  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"p1_mpa": lambda r: 1e3 * r.p1_mpa, "p2_mpa": lambda r: 1e3 * r.p2_mpa}, "p1_mpa reaches .* is it in kPa"),
        ({"angle_deg": lambda r: np.deg2rad(r.angle_deg)}, "is it in radians"),
        ({"angle_deg": lambda r: np.where(r.t_s > 3.0, 1e300, r.angle_deg)}, "angle_deg reaches 1e.300"),
        ({"angle_deg": lambda r: np.full(len(r), 7.0)}, "the angle never moves"),
        (
            {"angle_deg": lambda r: 5.0 * np.random.default_rng(1).standard_normal(len(r))},
            "the angle does not follow its command",
        ),
        ({"p1_mpa": lambda r: r.p2_mpa, "p2_mpa": lambda r: r.p1_mpa}, "runs against its command"),
        ({"t_s": lambda r: 1e3 * r.t_s}, "sampled every 5 s"),
        ({"t_s": lambda r: np.where(r.t_s == r.t_s[-1], 1e9, r.t_s)}, "do not fill its"),
    ],
)
def test_what_cannot_be_is_refused_and_not_named_an_effect(
    columns: dict[str, Callable[[Record], Column]], said: str
) -> None:
    with pytest.raises(RecordError, match=said):
        asked(_worse(session(58), **columns))


def test_refusal_of_many_records_stays_one_short_line() -> None:
    stuck = _worse(session(59), angle_deg=lambda record: np.zeros(len(record)))
    with pytest.raises(RecordError, match=r"; and 87 more$") as refused:
        asked(stuck * 30)
    assert len(str(refused.value)) < 300


def test_a_hundred_records_are_one_diagnosis() -> None:
    day = session(141, AddedEffect("delay", {"delay_s": 0.03}))
    many = [
        replace(record.rows(record.t_s < 2.5), facts={**record.facts, "repeat": k}) for k in range(36) for record in day
    ]
    found = asked(many, library=["delay", "valve_lag", "sensor_lag", "viscous_friction"])
    assert len(many) > 100
    assert names(found) == {"delay"}
    assert found.causes[0].parameters["delay_s"].value == pytest.approx(0.03, rel=0.12)


def test_a_day_that_is_given_twice_counts_once() -> None:
    days = [list(day) for day in baselines()]
    again = [replace(record, source=Path("monday") / "x.mcap") for record in days[0]]
    twice = diagnose(model(), session(151), [*days, again], library=FEW)
    assert twice.evidence.sessions == len(days)
    assert any(f"baseline session {len(days) + 1} (monday) repeats records" in note for note in twice.notes)
    case_too = diagnose(model(), days[0], days, library=FEW)
    assert case_too.evidence.sessions == len(days) - 1, "nor is the case its own baseline"


def test_two_days_in_one_session_are_said() -> None:
    both = [replace(record, name=f"{day}_{record.name}") for day, days in enumerate(baselines()[:2]) for record in days]
    found = diagnose(model(), session(35), [both, list(baselines()[2])], library=FEW)
    assert any("holds the sweep of" in note and "2 times" in note for note in found.notes)
    assert not any("holds the sweep of" in note for note in asked(session(35), library=FEW).notes)


def test_baselines_around_another_commanded_p0_do_not_pair() -> None:
    def around(p0_mpa: float, records: list[Record]) -> list[Record]:
        return [
            replace(record, p1_cmd_mpa=None, p2_cmd_mpa=None, facts={**record.facts, "p0_mpa": p0_mpa})
            for record in records
        ]

    with pytest.raises(RecordError, match=r"p0_mpa is 0.2, not 0.3 \(allowed: 0.01 off\)"):
        diagnose(model(), around(0.2, session(152)), [around(0.3, list(day)) for day in baselines()])


def test_a_measured_p0_far_from_the_baselines_is_said() -> None:
    found = asked(session(153, AddedEffect("co_contraction", {"shift_mpa": 0.05})), library=FEW)
    assert "recorded around another P0, or both pressures are shifted" in found.notes[0]
    question, doubt = list(answers(found).items())[1]
    assert question == "Doubt:"
    assert "recorded around another P0" in doubt


def test_a_model_of_another_rig_is_doubted_first() -> None:
    twice = {"gain": Parameter(2.0), "offset_deg": Parameter(0.0, "deg")}
    other = replace(model(), sensor=StageModel(StageKind.AFFINE, twice))
    found = diagnose(other, session(35), [list(day) for day in baselines()], library=FEW)
    assert found.notes[0].startswith("the model misses the earlier days by")
    assert answers(found)["Doubt:"] == found.notes[0]


def test_what_the_model_itself_misses_is_told_apart_from_the_gap() -> None:
    late = [list(session(160 + k, AddedEffect("delay", {"delay_s": 0.1}))) for k in range(3)]
    found = diagnose(model(), session(170, AddedEffect("delay", {"delay_s": 0.1})), late)
    assert found.verdict == "none"
    assert found.evidence.model_misfit_deg > 1.0
    assert "misses the earlier days" in answers(found)["Model:"]


@pytest.mark.parametrize(
    ("read", "said_of"),
    [
        (lambda r: np.full(len(r), 0.2), "does not move"),
        (lambda r: 0.2 + 0.05 * np.random.default_rng(1).standard_normal(len(r)), "does not follow its command"),
    ],
)
def test_a_monitor_that_hears_nothing_is_no_monitor(read: Callable[[Record], Column], said_of: str) -> None:
    found = asked(_worse(session(154), p1_mpa=read))
    assert any(f"the monitor of p1 {said_of}; broken wire? the angle alone is used" in note for note in found.notes)
    assert found.verdict == "none"
    assert not found.evidence.pressures_used
    said = answers(found)
    start = f"The monitor of p1 {said_of} (a broken wire?). By the angle alone nothing "
    assert said["Answer:"].startswith(start)
    assert "?." not in said.get("Also seen:", "")


def test_a_dead_monitor_at_a_rail_is_no_other_rest_pressure() -> None:
    told = [[replace(record, facts={**record.facts, "p0_mpa": 0.2}) for record in day] for day in baselines()]
    rail = _worse(session(154), p1_mpa=lambda r: np.full(len(r), -0.05))
    assert diagnose(model(), rail, told).verdict == "none"

"""What speaks against a cause: monitors that would show it, causes that undo or mend each other, a simulator that it
makes worse."""

from dataclasses import replace

import numpy as np
import pytest
from gap_rigs import asked, baselines, model, names, session
from hypothesis import given
from hypothesis import strategies as st

from rig.gap.answer.augment import helping, tuned
from rig.gap.days.attribute import fit_effect
from rig.gap.days.compound import makeweight
from rig.gap.days.engine import preferring
from rig.gap.days.findings import Findings, find
from rig.gap.days.side import Side
from rig.gap.days.trigger import trigger
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.hypotheses.propagate import Applied
from rig.model.parameters import AddedEffect
from rig.record import Column, Record

T = np.linspace(0.0, 20.0, 2000)


def found_in(records: list[Record], library: list[str] | None = None) -> Findings:
    return find(model(), records, [list(day) for day in baselines()], True, library)


def test_monitors_speak_against_a_cause_that_they_would_show() -> None:
    day = session(71, AddedEffect("sensor_offset", {"offset_deg": -4.0}))
    blamed = [candidate for candidate in found_in(day, ["valve_offset"]).angle.ranking if len(candidate.residual)]
    assert blamed == []
    assert asked(day, library=["valve_offset"]).verdict == "unknown"


def test_monitors_do_not_speak_against_what_hides_in_their_spread() -> None:
    bench = found_in(session(72, AddedEffect("valve_offset", {"offset_mpa": 0.0016, "balance": 1.0}))).angle.bench
    small, large = (Applied("valve_offset", {"offset_mpa": size, "balance": 1.0}) for size in (0.0016, 0.012))
    assert not bench.ruled_out([small])
    assert bench.ruled_out([large])


def test_causes_that_undo_each_other_are_not_all_there_is() -> None:
    undoing = (
        AddedEffect("valve_offset", {"offset_mpa": 0.02, "balance": 1.0}),
        AddedEffect("sensor_offset", {"offset_deg": -4.6}),
    )
    said = asked(session(73, *undoing), library=["valve_offset", "sensor_offset"])
    assert {"valve_offset", "sensor_offset"} <= names(said)
    assert said.verdict == "partly_explained"
    assert any("undo each other" in note for note in said.notes)


def test_a_cause_that_explains_nothing_by_itself_is_a_makeweight() -> None:
    bench = found_in(session(74, AddedEffect("sensor_gain", {"gain": 0.06}))).angle.bench
    gain, inertia = (fit_effect(LIBRARY[name], bench) for name in ("sensor_gain", "inertia"))
    assert gain is not None
    assert inertia is not None
    assert makeweight([gain, inertia], bench) is inertia
    assert makeweight([gain], bench) is None


def test_two_that_look_alike_are_not_named_beside_each_other() -> None:
    said = asked(
        session(75, AddedEffect("backlash", {"width_deg": 1.2}), AddedEffect("coulomb_friction", {"width_deg": 1.2}))
    )
    assert not {"backlash", "coulomb_friction"} <= names(said)
    assert said.verdict != "none"


def test_the_simulator_does_without_what_makes_it_worse() -> None:
    findings = found_in(session(76, AddedEffect("sensor_gain", {"gain": 0.06})))
    gain, offset = Applied("sensor_gain", {"gain": 0.06}), Applied("sensor_offset", {"offset_deg": 4.0})
    assert helping(model(), [gain, offset], findings.prepared) == [gain]
    assert helping(None, [gain, offset], findings.prepared) == [gain, offset]


@pytest.mark.parametrize("start", [0.045, 0.08])
def test_the_simulator_takes_the_size_that_serves_it(start: float) -> None:
    findings = found_in(session(77, AddedEffect("sensor_gain", {"gain": 0.06})))
    (best,) = tuned(model(), [Applied("sensor_gain", {"gain": start})], [{"gain"}], findings.prepared)
    assert best.numbers["gain"] == pytest.approx(0.06, abs=0.006)


def test_what_speaks_for_one_name_speaks_against_the_others() -> None:
    angle = found_in(session(79, AddedEffect("sensor_gain", {"gain": 0.06}))).angle
    other = next(one for one in angle.ranking if one.effect.name != angle.accepted[0].effect.name)
    judged = preferring(other, angle)
    assert judged.accepted == [other]
    assert judged.ranking[0] is other
    assert judged.names[0] == other.effect.name
    assert sum(judged.chances) == pytest.approx(1.0)
    mine = [angle.chances[angle.ranking.index(other)], judged.chances[0]]
    assert mine[1] >= mine[0]


def test_of_two_causes_on_a_side_the_likelier_comes_first_and_an_unknown_last() -> None:
    day = session(80, AddedEffect("sensor_gain", {"gain": 0.08}), AddedEffect("backlash", {"width_deg": 0.4}))
    findings, said = found_in(day), asked(day)
    alone = dict(zip((one.effect.name for one in findings.angle.ranking), findings.angle.chances, strict=True))
    order = [cause.effect for cause in said.causes if cause.effect != "unknown"]
    assert order == sorted(order, key=lambda name: -alone.get(name, 0.0))
    assert "unknown" not in [cause.effect for cause in said.causes[: len(order)]]


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


def side_of(gap: Column, doubt: Column | None) -> Side:
    """A side of one record with an offset as its only mode, and one doubt."""
    rows = float(len(gap))
    return Side(
        name="angle", unit="deg", gap=gap, modes=np.ones((len(gap), 1)), spread=np.array([0.1]), degrees=3.0,
        remainder=0.1, floor=0.15,
        source="sessions", records=np.zeros(len(gap)), rows=rows, effective=rows / 100.0,
        doubts=None if doubt is None else doubt[:, None],
    )  # fmt: skip


@given(st.floats(0.5, 2.0), st.sampled_from([-1.0, 1.0]))
def test_a_doubt_explains_its_own_pattern_and_no_other(size: float, sign: float) -> None:
    doubt, other = 0.6 * np.sin(T), 0.6 * np.sin(3.1 * T)
    assert trigger(side_of(sign * size * doubt, None)).found
    assert not trigger(side_of(sign * size * doubt, doubt)).found
    assert trigger(side_of(sign * size * other, doubt)).structure == pytest.approx(
        trigger(side_of(sign * size * other, None)).structure, rel=0.02
    )

"""A motor in mm at 7.3 ms from its records to its page: identified, validated and diagnosed in its own words."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from rig.app.model.identifying import SearchOptions, StartOptions, identify_model, sweep_range
from rig.channels import FACT, Channel, Channels
from rig.cli.model.shown import identified_json, validation_json
from rig.errors import RecordError
from rig.gap.answer.result import Diagnosis
from rig.gap.answer.words.sentences import answers
from rig.gap.diagnosis import diagnose_with_grounds
from rig.gap.history.trends import day_of
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.possible_effects import VALVES, possible
from rig.gap.records.cleaning.dropouts import without_dropouts
from rig.identify.fit import Identified
from rig.identify.records.data import RecordOptions
from rig.identify.validate import validate
from rig.own_units import own_text
from rig.record import Record
from rig.report.gap_page import page

MOTOR = Channels(Channel("set_point", "mm", (-50.0, 50.0)), Channel("position", "mm", (-50.0, 50.0)))
PERIOD_S = 0.0073
FOREIGN = re.compile(r"\b(deg|MPa|kPa|angle)\b")


def motor(name: str, hertz: float, seed: int, play_mm: float = 0.0) -> Record:
    """A first-order position loop with a little friction; `play_mm` of play behind it."""
    t = PERIOD_S * np.arange(round(12.0 / PERIOD_S))
    wanted = 40.0 * np.sin(2 * np.pi * hertz * t)
    loop, out = np.zeros_like(t), np.zeros_like(t)
    for k in range(1, len(t)):
        loop[k] = loop[k - 1] + PERIOD_S / 0.05 * (wanted[k - 1] - loop[k - 1])
        out[k] = min(max(out[k - 1], loop[k] - 0.5 * play_mm - 0.3), loop[k] + 0.5 * play_mm + 0.3)
    measured = out + np.random.default_rng(seed).normal(0.0, 0.05, len(t))
    return Record(
        name,
        t,
        MOTOR.working_input(wanted),
        MOTOR.working_output(measured),
        facts={FACT: MOTOR.plain(), "session": "x"},
    )


def day(seed: int, play_mm: float = 0.0) -> list[Record]:
    return [motor(f"sine_{hertz}hz", hertz, seed + number, play_mm) for number, hertz in enumerate((0.25, 0.5, 1.0))]


@pytest.fixture(scope="module")
def found() -> Identified:
    start = StartOptions(None, "mbw", "auto", "rigid", None, None, 0.2, False, None)
    search = SearchOptions("pso", 1, 1, 20, 40, None, True, False)
    records = day(1)
    return identify_model(records, start, search, sweep_range(0.2, 0.8, None, records), RecordOptions(), None)


@pytest.fixture(scope="module")
def told(found: Identified) -> tuple[Diagnosis, str, str]:
    """The diagnosis of 4 mm of play, its sentences, its page."""
    diagnosis, grounds = diagnose_with_grounds(found.model, day(11, play_mm=4.0), [day(21)])
    sentences = " ".join([*answers(diagnosis).values(), *diagnosis.notes])
    return diagnosis, own_text(sentences, diagnosis.channels), page(diagnosis, grounds, found.model)


def test_a_model_is_identified_at_the_records_own_period(found: Identified) -> None:
    assert found.model.sample_time_s == PERIOD_S
    assert found.model.own_channels == MOTOR
    plain = identified_json(found, "model.yaml")  # type: ignore[arg-type]
    assert plain["channels"] == MOTOR.plain()
    assert plain["rmse_mm"] == pytest.approx(2.5 * found.rmse_deg)
    assert "rmse_deg" not in plain
    result = validate(found.model, day(31), sweep_range(0.2, 0.8, None, day(31)))
    assert {"rmse_mm", "max_mm", "fit_percent"} <= set(validation_json(result, found.model)["records"][0])


def test_the_play_is_found_and_told_in_mm(told: tuple[Diagnosis, str, str]) -> None:
    diagnosis, sentences, _ = told
    assert diagnosis.verdict in ("explained", "partly_explained")
    assert diagnosis.causes[0].effect in ("backlash", "coulomb_friction")
    assert " mm" in sentences
    assert not FOREIGN.search(sentences), FOREIGN.search(sentences)


def test_its_page_and_its_json_know_neither_degrees_nor_megapascals(told: tuple[Diagnosis, str, str]) -> None:
    diagnosis, _, html = told
    body = re.sub(r"<style>.*?</style>|<code>.*?</code>|<pre>.*?</pre>|<[^>]*>", " ", html, flags=re.DOTALL)
    assert "position [mm]" in body
    assert not FOREIGN.search(body), body[max(0, FOREIGN.search(body).start() - 80) :][:160]  # type: ignore[union-attr]
    plain = diagnosis.to_json()
    assert plain["gap"]["rms_mm"] == pytest.approx(2.5 * diagnosis.gap.rms_deg)
    assert "rms_deg" not in json.dumps({key: plain[key] for key in ("gap", "where", "causes")})


def test_no_effect_of_valves_is_offered_without_valves(told: tuple[Diagnosis, str, str]) -> None:
    names = possible(MOTOR, day(1))
    assert not any(LIBRARY[name].stage == VALVES or LIBRARY[name].two_muscles for name in names)
    assert {"backlash", "delay", "sensor_gain"} <= set(names)
    assert not {line.effect for line in told[0].ranking} - set(names)


def test_records_of_another_rig_are_refused(found: Identified) -> None:
    other = [Record(one.name, one.t_s, one.dp_cmd_mpa, one.angle_deg) for one in day(1)]
    with pytest.raises(RecordError, match="they are of different rigs"):
        diagnose_with_grounds(found.model, other, [])


def test_a_day_of_a_history_keeps_what_was_said_of_its_records(told: tuple[Diagnosis, str, str]) -> None:
    said = {"Tags": "muscle DMSP-10", "Note": "after the new hose"}
    tagged = replace(told[0], evidence=replace(told[0].evidence, said=said))
    assert day_of("2026-01-01", 0.0, tagged).said == said
    assert day_of("2026-01-01", 0.0, told[0]).said == {}


SLIDE = Channels(Channel("command", "V", (0.0, 10.0)), Channel("position", "mm", (0.0, 300.0)))
"""Neither range has its zero in the middle."""


def slide(seed: int, stop_mm: float = 300.0, fallen: bool = False) -> list[Record]:
    """A slide that follows its command between 60 and 240 mm, in three sweeps; `fallen`: now and then it reads 0 mm."""
    records = []
    for k, hertz in enumerate((0.25, 0.5, 1.0)):
        t = PERIOD_S * np.arange(round(12.0 / PERIOD_S))
        wanted = 3.0 * np.sin(2 * np.pi * hertz * t)
        random = np.random.default_rng(seed + k)
        at = np.minimum(150.0 + 30.0 * np.interp(t - 0.03, t, wanted), stop_mm) + random.normal(0.0, 0.2, len(t))
        at = np.where(random.random(len(t)) < 0.01, 0.0, at) if fallen else at
        facts = {FACT: SLIDE.plain(), "session": f"day_{seed}"}
        records.append(
            Record(f"sine_{hertz}hz", t, SLIDE.working_input(5.0 + wanted), SLIDE.working_output(at), facts=facts)
        )
    return records


@pytest.mark.parametrize(
    ("change", "effect", "number", "place_mm", "said"),
    [
        ({"stop_mm": 200.0}, "end_stop", "high_mm", 200.0, "meets a stop where it reads 20"),
        ({"fallen": True}, "sensor_dropout", "rail_mm", 0.0, ""),
    ],
)
def test_a_place_is_told_where_the_rig_has_it(
    change: dict[str, float], effect: str, number: str, place_mm: float, said: str
) -> None:
    found, _ = diagnose_with_grounds(None, slide(40, **change), [slide(10), slide(20), slide(30)])
    first = found.to_json()["causes"][0]
    assert first["effect"] == effect
    assert first["parameters"][number]["value"] == pytest.approx(place_mm, abs=3.0)
    assert said in own_text(answers(found)["Answer:"], SLIDE)


def test_drop_outs_are_looked_for_where_the_rig_reads_nothing() -> None:
    """0 in its own unit: amid the range, where a slide moves to both sides of it."""
    either = Channels(SLIDE.input, Channel("position", "mm", (-100.0, 300.0)))
    facts = {FACT: either.plain()}
    moved = [
        replace(one, angle_deg=either.working_output(SLIDE.own_output(one.angle_deg) - 150.0), facts=facts)
        for one in slide(1)
    ]
    fallen = [
        replace(one, angle_deg=np.where(np.arange(len(one)) % 97 == 40, either.working_output(0.0), one.angle_deg))
        for one in moved
    ]
    _, found = without_dropouts(fallen)
    rails = [one.rail for mine in found for one in mine]
    assert rails == [pytest.approx(either.working_output(0.0))] * len(fallen)
    assert without_dropouts(moved)[1] == [(), (), ()]


def test_what_is_refused_is_refused_in_the_rigs_own_words() -> None:
    still = [replace(one, dp_cmd_mpa=SLIDE.working_input(np.full(len(one), 3.0))) for one in slide(1)]
    with pytest.raises(RecordError, match=r"the command moves by 0 V; at least 0\.\d+ V are needed"):
        diagnose_with_grounds(None, still, [slide(2)])

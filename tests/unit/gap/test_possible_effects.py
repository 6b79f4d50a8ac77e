"""What a rig says it can have is offered; what it cannot have is neither named nor missed."""

from dataclasses import replace
from pathlib import Path

import pytest
from support.plants.gap_rigs import baselines, model, names, session

from rig.channels import EFFECTS_FACT, PNEUMATIC, Channel, Channels
from rig.errors import ConfigError
from rig.gap import diagnose
from rig.gap.answer.words.sentences import answers
from rig.gap.diagnosis import diagnose_with_grounds
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.possible_effects import possible
from rig.gap.settings import ABOVE_FLOOR
from rig.model.parameters import AddedEffect
from rig.record import Record
from rig.rig_config import load_rig

MOTOR = Channels(Channel("goal", "rad", (-1.0, 1.0)), Channel("position", "rad", (-1.0, 1.0)))
RIG = Path(__file__).resolve().parents[3] / "configs" / "rigs" / "simulated.yaml"


def saying(*words: str) -> list[Record]:
    return [replace(record, facts={EFFECTS_FACT: list(words)}) for record in session(60)[:1]]


def test_without_a_word_a_pneumatic_rig_can_have_them_all() -> None:
    assert possible(PNEUMATIC, session(60)) == list(LIBRARY)


def test_a_rig_without_valves_has_none_of_their_effects() -> None:
    able = possible(MOTOR, [])
    assert {"coulomb_friction", "delay", "stiffness", "creep"} <= set(able)
    assert not [name for name in able if LIBRARY[name].stage == "valve"]
    assert "leak" not in able


def test_names_and_stages_are_said_by_the_records_or_the_call() -> None:
    said = possible(PNEUMATIC, saying("joint", "delay"))
    assert said == [name for name in LIBRARY if LIBRARY[name].stage == "joint" or name == "delay"]
    assert possible(PNEUMATIC, saying("joint"), ["sensor_gain"]) == ["sensor_gain"]
    assert possible(PNEUMATIC, [*saying("joint", "delay"), *saying("joint")]) == possible(PNEUMATIC, saying("joint"))
    assert possible(PNEUMATIC, [], []) == []


@pytest.mark.parametrize(
    ("words", "said"), [(["jiont"], "did you mean 'joint'"), (["delay", 3], "unknown"), ("delay", "a list")]
)
def test_a_word_that_is_neither_is_one_line(words: object, said: str) -> None:
    records = [replace(record, facts={EFFECTS_FACT: words}) for record in session(60)[:1]]
    with pytest.raises(ConfigError, match=f"{records[0].name}: facts: {EFFECTS_FACT}.*{said}"):
        possible(PNEUMATIC, records)


def test_the_rigs_yaml_says_it(tmp_path: Path) -> None:
    place = tmp_path / "rig.yaml"
    text = RIG.read_text(encoding="utf-8").replace("../models", str(RIG.parent.parent / "models"))
    place.write_text(text + "\neffects: [joint, sensor]\n", encoding="utf-8")
    assert load_rig(place).effects == ("joint", "sensor")
    assert load_rig(place).own_facts[EFFECTS_FACT] == ["joint", "sensor"]
    assert EFFECTS_FACT not in load_rig(RIG).own_facts


SLOW = AddedEffect("valve_lag", {"tau_s": 0.04})


def test_what_a_rig_cannot_have_is_neither_named_nor_unknown() -> None:
    day = [list(baselines()[0])]
    found, _ = diagnose_with_grounds(model(), session(301, SLOW), day)
    assert names(found) == {"valve_lag"}
    found, _ = diagnose_with_grounds(model(), session(301, SLOW), day, rig_effects=["joint", "sensor"])
    assert found.verdict == "none"
    assert "pressures" not in found.evidence.factors
    assert {LIBRARY[line.effect].stage for line in found.ranking} <= {"joint", "sensor"}


def test_what_is_only_kept_from_the_library_is_missed() -> None:
    day = [list(baselines()[0])]
    found, _ = diagnose_with_grounds(model(), session(301, SLOW), day, library=["coulomb_friction"])
    assert found.verdict == "unknown"


def test_a_word_of_the_library_that_is_no_effect_is_refused() -> None:
    """It was dropped without a word, and what it was meant for counted as unknown."""
    with pytest.raises(ConfigError, match=r"library: unknown effect or stage 'valve_lagg'"):
        diagnose(model(), session(301, SLOW), library=["valve_lagg"])


def test_what_a_stand_in_was_given_on_purpose_is_no_list_of_what_it_can_have() -> None:
    given = [replace(record, facts={"effects": [{"effect": "delay", "parameters": {}}]}) for record in session(60)[:1]]
    assert possible(PNEUMATIC, given) == list(LIBRARY)


def test_what_may_be_an_effect_that_was_not_asked_about_is_no_note() -> None:
    """Below the floor of a simulator, and plain in the pressures: the full library names it."""
    slow = session(301, AddedEffect("valve_lag", {"tau_s": 0.015}))
    whole, _ = diagnose_with_grounds(model(), slow)
    assert (whole.verdict, names(whole)) == ("explained", {"valve_lag"})
    assert whole.gap.ratio < ABOVE_FLOOR
    found, _ = diagnose_with_grounds(model(), slow, library=["backlash"])
    assert found.verdict == "unknown"
    assert "none of the effects asked about (backlash) explains it" in answers(found)["Answer:"]
    healthy, _ = diagnose_with_grounds(model(), session(303), library=["backlash"])
    assert healthy.verdict == "none"
    said = f"only 1 of the {len(LIBRARY)} effects that the rig can have were asked about"
    assert said in found.notes
    assert said in healthy.notes
    assert said not in whole.notes

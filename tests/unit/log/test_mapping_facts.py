"""A fact of a mapping that others count on is what its name says, or it is refused: a reader takes any other for not
said."""

from pathlib import Path

import pytest

from rig.errors import ConfigError
from rig.log.foreign.mapping import load_mapping


def mapping(folder: Path, facts: str) -> Path:
    path = folder / "mapping.yaml"
    path.write_text(f"columns:\n  t_s: {{source: t}}\n  angle_deg: {{source: a}}\nfacts: {facts}\n")
    return path


@pytest.mark.parametrize(
    ("facts", "said"),
    [
        ("{p0_mpa: '0,15'}", "p0_mpa is '0,15'; allowed: a number"),
        ("{p0_mpa: 0.15 MPa}", "p0_mpa is '0.15 MPa'; allowed: a number"),
        ("{p0_mpa: .nan}", "p0_mpa is nan; allowed: a number"),
        ("{p0_mpa: 1.5}", r"p0_mpa is 1.5; allowed: 0 to 1 MPa \(is it in bar, or in kPa\?\)"),
        ("{p0_mpa: -0.2}", r"p0_mpa is -0.2; allowed: 0 to 1 MPa"),
        ("{p0_mpa: 0,15}", r"15 is no name of a fact; is it behind a comma for a decimal point\?"),
        ("{repeat: second}", "repeat is 'second'; allowed: a whole number from 0"),
    ],
)
def test_a_fact_of_another_kind_is_refused(tmp_path: Path, facts: str, said: str) -> None:
    with pytest.raises(ConfigError, match=f"mapping.yaml: facts: {said}"):
        load_mapping(mapping(tmp_path, facts))


def test_facts_that_are_sound_stand(tmp_path: Path) -> None:
    facts = "{p0_mpa: 0.15, load_kg: 1.5, session: monday, note: 'two, three'}"
    assert load_mapping(mapping(tmp_path, facts)).facts["p0_mpa"] == 0.15

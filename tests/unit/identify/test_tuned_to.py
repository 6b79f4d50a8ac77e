"""What a model's file tells of the records at hand: whether the model was fitted to them."""

import hashlib
from dataclasses import replace
from pathlib import Path

import pytest
from support.plants.gap_rigs import identified, session

from rig.gap import diagnose
from rig.identify.provenance import FITTED_AGAIN, tuned_to
from rig.model.parameters import Model, Provenance, SourceLog
from rig.record import Record


@pytest.fixture
def records(tmp_path: Path) -> list[Record]:
    """Three records, each of a file of its own."""
    return [replace(record, source=_file(tmp_path / record.name)) for record in session(81)]


def _file(path: Path) -> Path:
    path.write_text(path.name, encoding="utf-8")
    return path


def fitted_to(*names: str, text: str = "") -> Model:
    logs = [SourceLog(f"elsewhere/{name}", hashlib.sha256(name.encode()).hexdigest(), name, 0.1) for name in names]
    return replace(identified(), provenance=Provenance(text, logs))


@pytest.mark.parametrize(
    ("names", "text", "said"),
    [
        (("sine_0.3", "sine_0.8", "sine_1.3"), "", "was identified on these very records"),
        (("sine_0.8", "other"), "", "was identified on 1 of these 3 records (sine_0.8)"),
        (("other",), "", "was not tuned to these records"),
        ((), "", "does not say which records it was tuned to"),
        (("other",), FITTED_AGAIN, "was fitted again by a diagnosis; its file does not say to which"),
    ],
)
def test_what_a_model_was_tuned_to_is_said_as_its_file_knows_it(
    names: tuple[str, ...], text: str, said: str, records: list[Record]
) -> None:
    assert tuned_to(fitted_to(*names, text=text), records).startswith(said)


def test_of_records_without_a_file_nobody_knows() -> None:
    assert tuned_to(fitted_to("other"), session(81)) == "does not say which records it was tuned to"


def test_a_model_that_is_asked_about_its_own_records_says_so(records: list[Record]) -> None:
    def noted(model: Model) -> bool:
        return any("the model was identified on these records" in note for note in diagnose(model, records).notes)

    assert noted(fitted_to("sine_0.3", "sine_0.8", "sine_1.3"))
    assert not noted(fitted_to("other"))

"""Results on the page that no diagnosis wrote: they stand as failed, and hide no other."""

import json
import math
from pathlib import Path

import pytest

from rig.service.web.files.diagnoses import Diagnoses
from rig.service.web.files.diagnosis_json import DiagnosedDay
from rig.service.web.files.history import history_json

GOOD = {"verdict": "none", "causes": [], "gap": {"rms_deg": 0.2, "floor_deg": 0.1}}
ASKED = {"session": "monday", "model": "m", "reference": "auto", "recorded_s": 5.0}


def kept(folder: Path, name: str, found: str, **asked: object) -> None:
    (folder / name).mkdir()
    (folder / name / "asked.json").write_text(json.dumps(ASKED | asked))
    (folder / name / "found.json").write_text(found)


@pytest.mark.parametrize("text", [
    "", "[]", '{"causes": [1]}', '{"causes": {"a": 1}}', '{"gap": 5}', '{"channels": 7}', '{"causes": 3}',
])  # fmt: skip
def test_a_result_that_is_none_hides_no_other(tmp_path: Path, text: str) -> None:
    """The list of all of them was an error of the server."""
    kept(tmp_path, "20260102T000000Z", text, session="tuesday", recorded_s="noon")
    kept(tmp_path, "20260101T000000Z", json.dumps(GOOD))
    diagnoses = Diagnoses(tmp_path)
    assert [one["state"] for one in diagnoses.all()] == ["failed", "done"]
    assert [one.session for one in diagnoses.days("m", "auto")] == ["monday"]


@pytest.mark.parametrize("recorded_s", ["noon", None, [], math.inf, 10**400])
def test_a_time_that_is_none_is_the_beginning(tmp_path: Path, recorded_s: object) -> None:
    kept(tmp_path, "20260101T000000Z", json.dumps(GOOD), recorded_s=recorded_s, asked_s=None)
    (day,) = Diagnoses(tmp_path).days("m", "auto")
    assert day.recorded_s == 0.0


def test_a_day_with_a_size_that_is_none_is_left_out_of_the_history() -> None:
    broken = GOOD | {"causes": [{"effect": "play", "parameters": {"play_deg": {"value": 1}}}]}
    told = history_json([DiagnosedDay("monday", 1.0, GOOD), DiagnosedDay("tuesday", 2.0, broken)])
    assert [day["name"] for day in told["days"]] == ["monday"]

"""Diagnoses that fail or are asked for twice, the steps of bringing a rig up, and records looked up by name."""

import asyncio
import time
from pathlib import Path
from typing import Any

import pytest

from rig.app import compose
from rig.errors import ConfigError, RecordError, RigError, StateError
from rig.service.web.files.bringup import SEEN, BringUp, all_steps
from rig.service.web.files.catalogue import Catalogue
from rig.service.web.files.diagnoses import Diagnoses, DiagnosisRequest
from rig.service.web.files.records import SessionFolders

GOOD = {
    "lateness_us": {"p99": 12.0}, "denied": [], "fault": None,
    "loop": {"live": True, "p1_mpa": 0.2, "angle_deg": 1.0},
}  # fmt: skip


def question(reference: str = "auto") -> DiagnosisRequest:
    return DiagnosisRequest("day", "simulated", reference, (), time.time(), 0.0)


def test_a_diagnosis_that_cannot_be_made_says_why_in_one_line(tmp_path: Path) -> None:
    async def scene() -> dict[str, Any]:
        diagnoses = Diagnoses(tmp_path)
        diagnoses.begin(question(), tmp_path / "nothing", tmp_path / "none.yaml", [])
        with pytest.raises(StateError, match="at work"):
            diagnoses.begin(question(), tmp_path, tmp_path, [])
        assert diagnoses.all()[0]["state"] == "at work"
        while diagnoses.all()[0]["state"] == "at work":
            await asyncio.sleep(0.05)
        return diagnoses.all()[0]

    told = asyncio.run(scene())
    assert told["state"] == "failed"
    assert "none.yaml" in told["said"]
    assert "Traceback" not in told["said"]


def test_a_reference_that_is_none_is_refused_and_no_name_leads_out(tmp_path: Path) -> None:
    diagnoses = Diagnoses(tmp_path / "diagnoses")
    with pytest.raises(RigError, match="no such reference"):
        diagnoses.begin(question("--html=/etc/passwd"), tmp_path, tmp_path, [])
    for name in ("", "..", "../x", "/etc/passwd"):
        with pytest.raises(RecordError, match="no such diagnosis"):
            diagnoses.report(name)


def test_the_steps_are_those_of_the_manual_and_each_command_exists(tmp_path: Path) -> None:
    manual = (Path(__file__).parents[4] / "docs" / "how-to" / "bring_up.md").read_text()
    steps = all_steps()
    assert {step.seen for step in steps} <= SEEN.keys()
    for step in steps:
        assert f"## {step.title[0]}." in manual
        assert not step.command or " ".join(step.command.split()[:2]) in manual
    told = BringUp(compose.load(None), tmp_path / "kept.json").to_json(GOOD)
    assert all("{rig}" not in step["command"] for step in told["steps"])


@pytest.mark.parametrize(
    "change",
    [{"denied": ["fifo denied"]}, {"lateness_us": {}}, {"loop": {"live": False}}],
)
def test_what_cannot_be_seen_is_not_said_to_be_done(tmp_path: Path, change: dict[str, Any]) -> None:
    bringup = BringUp(compose.load(None), tmp_path / "kept.json")
    seen = {step["name"]: step["seen"] for step in bringup.to_json(GOOD)["steps"]}
    assert "12 us" in seen["time"]
    assert seen["answer"]
    assert not {step["name"]: step["seen"] for step in bringup.to_json(GOOD | change)["steps"]}["time"]


def test_what_is_confirmed_is_kept_and_taken_back(tmp_path: Path) -> None:
    kept = tmp_path / "kept.json"
    bringup = BringUp(compose.load(None), kept)
    assert bringup.to_json(GOOD)["next"] == "paper"
    bringup.confirm("paper", "browser 12ab", done=True)
    assert BringUp(compose.load(None), kept).to_json(GOOD)["next"] == "dry"
    bringup.confirm("paper", "browser 12ab", done=False)
    assert bringup.to_json(GOOD)["next"] == "paper"
    with pytest.raises(RigError, match="no such step"):
        bringup.confirm("../x", "", done=True)
    kept.write_text("[1")
    assert bringup.to_json(GOOD)["next"] == "paper"


def test_records_are_looked_up_in_listings(tmp_path: Path) -> None:
    logs = tmp_path / "logs"
    (logs / "day").mkdir(parents=True)
    (logs / "day" / "a.mcap").write_bytes(b"")
    (logs / "loose.mcap").write_bytes(b"")
    (tmp_path / "secret.mcap").write_bytes(b"")
    (logs / "link").symlink_to(tmp_path)
    (logs / "day" / "link.mcap").symlink_to(tmp_path / "secret.mcap")
    records = SessionFolders(logs)
    assert {session["name"] for session in records.sessions()} == {"day", "-loose-"}
    assert [file.name for file in records.files("day")] == ["a.mcap"]
    for session, name in (
        ("..", "secret.mcap"),
        ("link", "secret.mcap"),
        ("day", "../../secret.mcap"),
        ("day", "link.mcap"),
    ):
        with pytest.raises(RecordError, match="no such"):
            records.file(session, name)


def test_the_earlier_folder_of_a_catalogue_counts_and_nothing_else_is_in_it(tmp_path: Path) -> None:
    for folder in ("mine", "theirs"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "quick.yaml").write_text(folder)
    (tmp_path / "mine" / "notes.txt").write_text("")
    catalogue = Catalogue("sweep", (tmp_path / "mine", tmp_path / "theirs", tmp_path / "nowhere"))
    assert catalogue.names == ["quick"]
    assert catalogue.path("quick").read_text() == "mine"
    for name in ("", "notes", "../mine/quick", str(tmp_path / "mine" / "quick")):
        with pytest.raises(ConfigError, match="no such sweep"):
            catalogue.path(name)


def test_a_name_in_a_catalogue_that_is_no_utf8_is_spelt_out_and_found(tmp_path: Path) -> None:
    """Half a character has no place in an address: such a sweep could be seen in the list, and was not found."""
    (tmp_path / "bad\udcff.yaml").write_text("name: bad")
    catalogue = Catalogue("sweep", (tmp_path,))
    assert catalogue.names == [r"bad\xff"]
    assert catalogue.path(r"bad\xff").read_text() == "name: bad"

"""What lies in the folder of records can be told to a browser, whatever it is called and holds."""

import json
import os
from pathlib import Path

import pytest

from rig.service.web.files.records import SessionFolders
from rig.service.web.routes.answer import EscapedJson


@pytest.fixture
def records(tmp_path: Path) -> SessionFolders:
    """A session and a record named in Latin-1, as an old disk has them, beside one of today."""
    for folder in (b"Messung_\xfc", b"today"):
        place = os.fsencode(tmp_path) + b"/" + folder
        os.mkdir(place)
        with open(place + b"/gr\xf6\xdfe.mcap", "wb"):
            pass
    return SessionFolders(tmp_path)


def test_names_in_another_encoding_are_listed_and_found_again(records: SessionFolders) -> None:
    told = json.loads(EscapedJson({"sessions": records.sessions()}).body)["sessions"]
    assert {session["name"] for session in told} == {r"Messung_\xfc", "today"}
    for session in told:
        assert os.fsencode(records.file(session["name"], r"gr\xf6\xdfe.mcap").name) == b"gr\xf6\xdfe.mcap"


def test_facts_that_json_lacks_do_not_break_an_answer() -> None:
    told = json.loads(EscapedJson({"a": float("nan"), "b": [float("inf")], "c": "\ud800", "d": {"e": 1.5}}).body)
    assert told == {"a": None, "b": [None], "c": "\ud800", "d": {"e": 1.5}}


def test_a_record_that_goes_away_while_it_is_looked_at_hides_no_other(
    records: SessionFolders, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As the oldest does that the daemon may remove: the list of all sessions was an error of the page."""
    gone = records.root / "today" / "old.mcap"
    listed = Path.glob
    monkeypatch.setattr(Path, "glob", lambda folder, pattern: [*listed(folder, pattern), gone])
    monkeypatch.setattr(Path, "is_file", lambda _: True)  # so it was when it was listed
    assert {session["records"] for session in records.sessions()} == {1}
    assert len(records.files("today")) == 1

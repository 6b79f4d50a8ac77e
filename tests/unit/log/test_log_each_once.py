"""A record that is found twice counts once: as a second measurement a copy would make what is fitted too sure of
itself."""

import logging
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from support.records.made_logs import made_content, made_log

from rig.log.convert import read_content, write_content
from rig.log.exchange import export
from rig.log.reader import read, read_all


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made_log(tmp_path / "day" / "a.mcap", 400)
    return tmp_path / "day"


def said_of(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [record.getMessage() for record in caplog.records if record.levelno == logging.WARNING]


def test_a_copy_beside_its_original(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    shutil.copy(folder / "a.mcap", folder / "b (copy).mcap")
    (record,) = read(folder)
    assert record.source == folder / "a.mcap"
    assert said_of(caplog) == [
        f"{folder / 'b (copy).mcap'}: passed over: the same record as {folder / 'a.mcap'}, which counts once"
    ]


def test_a_file_of_a_folder_that_is_named_as_well(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    """`pamrig identify day day/a.mcap`: its parameters were said to be more certain than by the day alone, and the
    fingerprint's error on a record that it has not seen was that on one that it had."""
    assert len(read_all([folder, folder / "a.mcap", folder])) == 1
    assert len(said_of(caplog)) == 2


def test_the_recording_is_read_and_not_its_table(folder: Path) -> None:
    """By the name of its session, a table of another name came first."""
    export(read_content(folder / "a.mcap"), folder / "0.csv", "csv")
    assert [record.source for record in read(folder)] == [folder / "a.mcap"]


def test_a_link_and_another_kind_of_file(folder: Path) -> None:
    (folder / "linked.mcap").symlink_to(folder / "a.mcap")
    (folder / "under").symlink_to(folder)
    assert len(read(folder)) == 1


def test_repeats_of_a_sweep_stay_where_nothing_tells_them_apart(folder: Path) -> None:
    """As a simulator without noise makes them; they are numbered."""
    content = made_content(400)
    write_content(replace(content, run_facts=dict(content.run_facts) | {"repeat": 2}), folder / "c.mcap")
    assert len(read(folder)) == 2


def test_who_names_one_file_twice_is_told(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    assert len(read_all([folder / "a.mcap"] * 2)) == 1
    assert "which counts once" in said_of(caplog)[0]

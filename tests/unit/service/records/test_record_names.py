"""The plain name is for the complete record; what was stopped or ended in a fault says so in its name."""

from dataclasses import replace
from pathlib import Path

import pytest
from support.records.made_logs import made_content

from rig.log.convert import write_content
from rig.log.mcap.schema import Ended
from rig.service.records.record_names import free, renamed, vacated


def record(path: Path, **result: object) -> Path:
    """A record that ended so."""
    content = made_content(100)
    return write_content(replace(content, result_facts={**content.result_facts, **result}), path)


@pytest.mark.parametrize(
    ("result", "name"),
    [
        ({"ended": "stopped"}, "sine_stopped.mcap"),
        ({"ended": "fault", "fault": "ANGLE_LIMIT: x"}, "sine_fault.mcap"),
        ({"complete": False}, "sine_stopped.mcap"),
    ],
)
def test_a_record_that_is_not_complete_gives_up_its_name(tmp_path: Path, result: dict[str, object], name: str) -> None:
    record(tmp_path / "sine.mcap", **result)
    assert vacated(tmp_path / "sine.mcap") == tmp_path / "sine.mcap"
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_a_complete_record_keeps_it_and_so_does_what_cannot_be_read(tmp_path: Path) -> None:
    record(tmp_path / "sine.mcap", ended="complete")
    (tmp_path / "other.mcap").write_text("not a log")
    assert vacated(tmp_path / "sine.mcap") == tmp_path / "sine_again2.mcap"
    assert vacated(tmp_path / "other.mcap") == tmp_path / "other_again2.mcap"
    assert vacated(tmp_path / "new.mcap") == tmp_path / "new.mcap"


def test_nothing_is_overwritten_on_the_way(tmp_path: Path) -> None:
    (tmp_path / "sine_stopped.mcap").write_text("precious")
    file = record(tmp_path / "sine.mcap", ended="stopped")
    assert renamed(file, Ended.STOPPED) == tmp_path / "sine_stopped_again2.mcap"
    assert (tmp_path / "sine_stopped.mcap").read_text() == "precious"
    (tmp_path / "begun.mcap.partial").touch()
    assert free(tmp_path / "begun.mcap") == tmp_path / "begun_again2.mcap"


def test_a_name_that_leads_nowhere_is_taken_and_one_that_no_disk_takes_is_told_by_who_writes(tmp_path: Path) -> None:
    """The second ended the daemon, as an error in the daemon itself."""
    (tmp_path / "sine.mcap").symlink_to(tmp_path / "gone.mcap")
    assert free(tmp_path / "sine.mcap") == tmp_path / "sine_again2.mcap"
    assert free(tmp_path / ("x" * 300)) == tmp_path / ("x" * 300)

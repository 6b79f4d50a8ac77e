"""The ledger of what a daemon recorded: whole or not at all, and nothing held in memory."""

import errno
import gc
import tracemalloc
from pathlib import Path
from typing import Any

import pytest

from rig.errors import RigError
from rig.service.records.durable_file import DurableFile
from rig.service.records.ledger import Ledger


@pytest.mark.parametrize(
    "text",
    [
        "nonsense",
        '{"path": 1}\n',
        "[]\n",
        '{"path": 1, "device": 1, "inode": 1, "size": 1, "recorded_s": 1}',
        '{"path": "a", "device": 1, "inode": 1, "size": 1, "recorded_s": 1, "operating_s": -Infinity}',
        '{"path": "a", "device": 1, "inode": 1, "size": 1, "recorded_s": 1e300}',
        '{"path": "a", "device": 1, "inode": 1, "size": 1, "recorded_s": NaN}',
    ],
)
def test_a_broken_ledger_is_put_aside_and_nothing_is_ours(tmp_path: Path, text: str) -> None:
    (tmp_path / "records.jsonl").write_text(text)
    ledger = Ledger(DurableFile(tmp_path / "records.jsonl"))
    assert ledger.entries == []
    assert (tmp_path / "records.jsonl").read_text() == text
    (tmp_path / "a.mcap").write_bytes(b"x")
    ledger.add(tmp_path / "a.mcap")
    assert (tmp_path / "records.broken").read_text() == text
    assert [entry.path for entry in Ledger(DurableFile(tmp_path / "records.jsonl")).entries] == [
        str(tmp_path / "a.mcap")
    ]


def test_a_ledger_that_cannot_be_written_says_so(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"x")
    with pytest.raises(RigError, match=r"records.jsonl: cannot be written: No such file"):
        Ledger(DurableFile(tmp_path / "none" / "records.jsonl")).add(tmp_path / "a.mcap")


def test_a_record_that_is_not_there_is_not_written_down(tmp_path: Path) -> None:
    ledger = Ledger(DurableFile(tmp_path / "records.jsonl"))
    ledger.add(tmp_path / "none.mcap")
    assert ledger.entries == []


def test_a_record_whose_folder_is_no_folder_any_more_is_told(tmp_path: Path) -> None:
    """Somebody put a file in its place: it ended the daemon, as an error in the daemon itself."""
    (tmp_path / "folder").write_text("")
    with pytest.raises(RigError, match=r"x\.mcap: cannot be looked at, and is nobody's to remove: Not a directory"):
        Ledger(DurableFile(tmp_path / "records.jsonl")).add(tmp_path / "folder" / "x.mcap")
    assert not (tmp_path / "records.jsonl").exists()


def test_a_month_of_records_costs_the_ledger_no_memory(tmp_path: Path) -> None:
    ledger, files = (
        Ledger(DurableFile(tmp_path / "records.jsonl")),
        [tmp_path / f"sine_0.5hz_r{n}.mcap" for n in range(700)],
    )
    for file in files:
        file.touch()
    for file in files[:100]:
        ledger.add(file)
    tracemalloc.start()
    grown = []
    for start in (100, 300, 500):  # what others in this process keep now and then is not in all of them
        gc.collect()
        before = tracemalloc.get_traced_memory()[0]
        for file in files[start : start + 200]:
            ledger.add(file)
        gc.collect()
        grown.append(tracemalloc.get_traced_memory()[0] - before)
    tracemalloc.stop()
    assert len(ledger.entries) == 700
    assert min(grown) / 200 < 20.0, "bytes a record"


def test_a_full_disk_leaves_no_half_line_in_the_ledger(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ledger = Ledger(DurableFile(tmp_path / "records.jsonl"))
    for name in ("a.mcap", "b.mcap"):
        (tmp_path / name).write_bytes(b"x")
    ledger.add(tmp_path / "a.mcap")
    opened = Path.open

    class Full:
        def __init__(self, file: Any) -> None:
            self._file = file

        def __enter__(self) -> "Full":
            return self

        def __exit__(self, *_: object) -> None:
            self._file.close()

        def write(self, text: str) -> None:
            self._file.write(text[:20])
            raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", lambda path, *more, **named: Full(opened(path, *more, **named)))
        with pytest.raises(RigError, match="No space left"):
            ledger.add(tmp_path / "b.mcap")
    assert [entry.path for entry in ledger.entries] == [str(tmp_path / "a.mcap")]
    ledger.add(tmp_path / "b.mcap")
    assert len(ledger.entries) == 2


def test_a_ledger_that_can_be_read_again_is_not_put_aside(tmp_path: Path) -> None:
    """What was looked at while the state folder was away may have been another daemon's."""
    path, record = tmp_path / "records.jsonl", tmp_path / "a.mcap"
    record.touch()
    ledger = Ledger(DurableFile(path))
    ledger.add(record)
    ours = path.read_text()
    path.write_text("another's")
    assert not ledger.entries
    path.write_text(ours)
    assert [entry.path for entry in ledger.entries] == [str(record)]
    ledger.add(record)
    assert not list(tmp_path.glob("*.broken"))

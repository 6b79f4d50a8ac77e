"""The recorder's writer: names, flushes, full disks, missing packages; and that what is written is what is read."""

import errno
import os
import stat
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from support.records.made_logs import assert_same_content, assert_same_samples, made_content, made_log, made_samples

from rig.errors import RecordError
from rig.log.convert import read_content, write_content
from rig.log.mcap import compression, writer
from rig.log.mcap.columns import pack_columns
from rig.log.mcap.contents import map_file
from rig.log.mcap.salvage import salvage
from rig.log.mcap.writer import RunWriter
from rig.log.reader import read_samples
from rig.log.recover import recover
from rig.sample import SAMPLE_BYTES, WIRES


def packed(count: int) -> list[bytes]:
    return [row.tobytes() for row in pack_columns(made_samples(count).fields, WIRES)]


def put(run: RunWriter, messages: list[bytes], start: int = 0) -> None:
    times = made_samples(start + len(messages)).log_time_ns[start:]
    for number, (message, time_ns) in enumerate(zip(messages, times.tolist(), strict=True), start):
        run.add(message, time_ns, number)


def test_what_is_written_is_what_is_read(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    content = made_log(path, 523, missed_at=100)
    assert_same_content(read_content(path), content)


def test_tick_by_tick_and_in_bulk_give_the_same_samples(tmp_path: Path) -> None:
    run = RunWriter(tmp_path / "run.mcap", {}, {})
    put(run, packed(250))
    run.finish({})
    assert_same_samples(read_samples(tmp_path / "run.mcap"), made_samples(250))


def test_the_name_is_given_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    run = RunWriter(path, {}, {})
    assert [file.name for file in tmp_path.iterdir()] == ["run.mcap.partial"]
    assert run.finish({}) == path
    assert [file.name for file in tmp_path.iterdir()] == ["run.mcap"]


def test_nothing_is_ever_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_text("somebody's")
    with pytest.raises(RecordError, match="exists already"):
        RunWriter(path, {}, {})
    path.unlink()
    run = RunWriter(path, {}, {})
    with pytest.raises(RecordError, match="unfinished recording"):
        RunWriter(path, {}, {})
    path.write_text("somebody's")
    with pytest.raises(RecordError, match=r"stays at .*run\.mcap\.partial"):
        run.finish({})
    assert path.read_text() == "somebody's"
    assert len(read_content_of_partial(path)) == 0


def test_a_conversion_whose_name_was_taken_meanwhile_promises_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It said that the new recording stays beside it, and had removed it."""
    path, link = tmp_path / "run.mcap", os.link

    def taken(draft: Path, target: Path) -> None:
        path.write_text("somebody's")
        link(draft, target)

    monkeypatch.setattr(writer.os, "link", taken)
    with pytest.raises(RecordError, match=r"run\.mcap: exists already; a log is never overwritten$"):
        write_content(made_content(10), path)
    assert [file.read_text() for file in tmp_path.iterdir()] == ["somebody's"]


def read_content_of_partial(path: Path) -> list[int]:
    found = salvage(map_file(path.with_name(path.name + ".partial")))
    assert found.whole
    return [chunk.start for chunk in found.contents.chunks]


@pytest.mark.parametrize("number", [errno.EPERM, errno.ENOSPC, errno.EDQUOT])
def test_finish_works_where_there_are_no_hard_links_and_no_room_for_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    """On a disk whose last inode the recording took, it was whole and told as lost."""

    def refuse(*_: object) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(writer.os, "link", refuse)
    path = tmp_path / "run.mcap"
    assert RunWriter(path, {}, {}).finish({}) == path
    assert path.exists()


def test_finish_works_where_a_folder_cannot_be_synced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On shares of other systems: the recorder died behind every record, and the rig was stopped."""
    sync = os.fsync

    def only_files(descriptor: int) -> None:
        if stat.S_ISDIR(os.fstat(descriptor).st_mode):
            raise OSError(errno.EINVAL, "Invalid argument")
        sync(descriptor)

    monkeypatch.setattr(os, "fsync", only_files)
    path = tmp_path / "run.mcap"
    assert RunWriter(path, {}, {}).finish({}) == path


def test_a_name_that_is_refused_at_the_end_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.EPERM, "Operation not permitted")

    run = RunWriter(tmp_path / "run.mcap", {}, {})
    monkeypatch.setattr(writer.os, "link", refuse)
    monkeypatch.setattr(writer.os, "rename", refuse)
    with pytest.raises(RecordError, match=r"run\.mcap: cannot be written: Operation not permitted"):
        run.finish({})
    assert run.partial.exists()


def test_a_name_that_no_disk_takes_is_refused_and_so_is_one_that_leads_nowhere(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="cannot be written: File name too long"):
        RunWriter(tmp_path / f"{'x' * 300}.mcap", {}, {})
    (tmp_path / "run.mcap").symlink_to(tmp_path / "gone.mcap")
    with pytest.raises(RecordError, match="exists already"):
        RunWriter(tmp_path / "run.mcap", {}, {})


def test_what_was_flushed_is_on_the_disk(tmp_path: Path) -> None:
    run = RunWriter(tmp_path / "run.mcap", {"name": "x"}, {"rig.yaml": b"name: r\n"})
    put(run, packed(300)[:200])
    run.flush()
    put(run, packed(300)[200:], 200)  # never flushed
    found = salvage(map_file(run.partial))
    assert [len(found.contents.chunks), found.contents.facts("pamrig.run")] == [1, {"name": "x"}]
    assert found.contents.attachments == {"rig.yaml": b"name: r\n"}
    run.abort()
    run.abort()
    assert run.partial.exists()


def test_a_flipped_byte_costs_a_second_also_where_nothing_was_flushed(tmp_path: Path) -> None:
    """As in virtual time, where a record of minutes is made between two flushes."""
    run = RunWriter(tmp_path / "run.mcap", {}, {})
    put(run, packed(3000))
    path = run.finish({})
    data = bytearray(path.read_bytes())
    chunks = salvage(map_file(path)).contents.chunks
    data[chunks[len(chunks) // 2].start + 500] ^= 1
    path.write_bytes(data)
    saved = recover(path)
    assert 3000 - 200 <= saved.records < 3000
    assert_same_samples(read_samples(saved.file).rows(slice(0, 1000)), made_samples(3000).rows(slice(0, 1000)))


def test_a_full_disk_loses_nothing_once_it_has_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = RunWriter(tmp_path / "run.mcap", {}, {})
    real_write, room = os.write, [True]

    def write(fd: int, data: bytes) -> int:
        if not room[0]:
            raise OSError(errno.ENOSPC, "No space left on device")
        return real_write(fd, bytes(data[:100]))  # and it takes little at a time

    monkeypatch.setattr(writer.os, "write", write)
    put(run, packed(300)[:100])
    room[0] = False
    with pytest.raises(RecordError, match="No space left"):
        run.flush()
    put(run, packed(300)[100:], 100)
    room[0] = True
    run.finish({"valid": True})
    assert_same_samples(read_samples(tmp_path / "run.mcap"), made_samples(300))


def test_what_does_not_fit_into_memory_is_counted_and_makes_the_run_invalid(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = RunWriter(tmp_path / "run.mcap", {}, {})
    monkeypatch.setattr(writer, "BACKLOG_BYTES", 1000)

    def full(fd: int, data: bytes) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    real_write = os.write
    monkeypatch.setattr(writer.os, "write", full)
    put(run, packed(300)[:100])
    with pytest.raises(RecordError):
        run.flush()
    put(run, packed(300)[100:130], 100)
    assert run.dropped == 30
    monkeypatch.setattr(writer.os, "write", real_write)
    run.finish({"valid": True, "dropped": 1})
    content = read_content(tmp_path / "run.mcap")
    assert content.result_facts == {"valid": False, "dropped": 31, "records": 100}


@pytest.mark.parametrize(("missing", "name"), [(("zstandard",), "lz4"), (("zstandard", "lz4_frame"), "")])
def test_without_compression_packages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, missing: tuple[str, ...], name: str
) -> None:
    for package in missing:
        monkeypatch.setattr(compression, package, None)
    path = tmp_path / "run.mcap"
    content = made_log(path, 200)
    assert_same_content(read_content(path), content)
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert {chunk.compression for chunk in summary.chunk_indexes} == {name}


def test_only_whole_samples_are_taken(tmp_path: Path) -> None:
    run = RunWriter(tmp_path / "run.mcap", {}, {})
    with pytest.raises(ValueError, match=f"{SAMPLE_BYTES} bytes"):
        run.add(b"short", 0, 0)
    run.abort()


def test_a_conversion_that_fails_leaves_no_file(tmp_path: Path) -> None:
    content = made_content(100)
    content.samples.fields["tick"] = np.zeros(3, np.uint32)
    with pytest.raises(ValueError, match="broadcast"):
        write_content(content, tmp_path / "run.mcap")
    assert not list(tmp_path.iterdir())


def test_a_disk_without_room_is_said_of_the_place_that_was_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a conversion the name of a file was told that is gone; of a recording it is where its beginning lies."""

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(writer.os, "fsync", full)
    for unfinished, said in ((".7.writing", "run.mcap"), (".partial", "run.mcap.partial")):
        with pytest.raises(RecordError) as error:
            RunWriter(tmp_path / "run.mcap", {}, {}, unfinished)
        assert str(error.value) == f"{tmp_path / said}: cannot be written: No space left on device"
    assert not list(tmp_path.iterdir())


def test_the_writer_needs_no_numpy() -> None:
    code = (
        "import sys, rig.log.mcap.writer; sys.exit(any(name in sys.modules for name in ('numpy', 'scipy', 'pandas')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_file_that_was_interrupted_as_it_began_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(_: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupted)
    with pytest.raises(KeyboardInterrupt):
        made_log(tmp_path / "x.mcap")
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_becomes_read_only_as_a_record_begins_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What had been begun could not be removed either, and that was no error that a recorder knows."""

    def read_only(*_: object, **__: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr(os, "write", read_only)
    monkeypatch.setattr(Path, "unlink", read_only)
    with pytest.raises(RecordError, match="Read-only file system"):
        RunWriter(tmp_path / "run.mcap", {}, {})


def test_another_s_recording_never_gets_the_name_of_one_that_is_gone(tmp_path: Path) -> None:
    """Folders were exchanged after the last flush: the other's unfinished file was taken for our own, and renamed."""
    mine, other = tmp_path / "mine", tmp_path / "other"
    for folder in (mine, other):
        folder.mkdir()
    run, others = (RunWriter(folder / "run.mcap", {}, {}) for folder in (mine, other))
    put(run, packed(10))
    mine.rename(tmp_path / "moved")
    mine.symlink_to(other, target_is_directory=True)
    with pytest.raises(RecordError, match="was deleted or moved while it was being written"):
        run.finish({"valid": True})
    run.discard()
    assert [file.name for file in other.iterdir()] == ["run.mcap.partial"]
    assert recover(tmp_path / "moved" / "run.mcap.partial", tmp_path / "saved.mcap").records == 10
    others.finish({})


@pytest.mark.parametrize("bytes_left", [0, 100, 100_000])
def test_a_recording_that_somebody_else_cuts_or_makes_longer_gets_no_name(tmp_path: Path, bytes_left: int) -> None:
    """As log rotation with `copytruncate` does: the rest was written behind a hole of zeros, and called valid."""
    run = RunWriter(tmp_path / "run.mcap", {}, {})
    put(run, packed(10))
    run.flush()
    os.truncate(run.partial, bytes_left)
    assert run.gone
    put(run, packed(10))
    with pytest.raises(RecordError, match="was cut or written to by somebody else while it was being written"):
        run.flush()
    with pytest.raises(RecordError, match="was cut or written to"):
        run.finish({"valid": True})
    assert not run.path.exists()

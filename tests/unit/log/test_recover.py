"""Recovery: from any cut and any flipped byte, all complete chunks, nothing false, and a true word on what is
missing."""

import random
from pathlib import Path

import numpy as np
import pytest
from support.records.made_logs import assert_same_content, assert_same_samples, made_content, made_log

from rig.errors import RecordError
from rig.log.check import check
from rig.log.convert import CHUNK_ROWS, LogContent, read_content, write_content
from rig.log.mcap.contents import map_file, walk
from rig.log.recover import recover

ROWS = 1000


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, LogContent, list[tuple[int, int]]]:
    """A sound file, what is in it, and the first and last byte of each chunk."""
    path = tmp_path_factory.mktemp("whole") / "run.mcap"
    content = made_log(path, ROWS)
    starts = [chunk.start for chunk in walk(map_file(path)).chunks]
    ends = [chunk.start + 9 + 28 + 4 + 4 + 8 + len(chunk.packed) for chunk in walk(map_file(path)).chunks]
    return path.read_bytes(), content, list(zip(starts, ends, strict=True))


def rescued(data: bytes, tmp_path: Path) -> tuple[LogContent, object]:
    path = tmp_path / "damaged.mcap.partial"
    path.write_bytes(data)
    result = recover(path)
    assert path.read_bytes() == data, "the damaged file must stay as it is"
    return read_content(result.file), result


def assert_nothing_false(found: LogContent, wanted: LogContent) -> None:
    rows = found.samples.sequence.astype(int)
    assert_same_samples(found.samples, wanted.samples.rows(np.isin(np.arange(len(wanted.samples)), rows)))
    assert set(found.lines) <= set(wanted.lines)
    for name, data in found.attachments.items():
        assert data == wanted.attachments[name]
    for name, value in found.run_facts.items():
        assert value == wanted.run_facts[name]
    assert found.result_facts["valid"] is False


@pytest.mark.parametrize("seed", range(40))
def test_from_a_cut_at_any_byte(
    tmp_path: Path, whole: tuple[bytes, LogContent, list[tuple[int, int]]], seed: int
) -> None:
    data, content, chunks = whole
    cut = random.Random(seed).randrange(chunks[0][0], len(data))
    complete = sum(end <= cut for _, end in chunks)
    if complete == 0:
        (tmp_path / "x.mcap").write_bytes(data[:cut])
        with pytest.raises(RecordError, match="nothing to save: no chunk of samples proves itself"):
            recover(tmp_path / "x.mcap")
        return
    found, _ = rescued(data[:cut], tmp_path)
    assert len(found.samples) == complete * CHUNK_ROWS
    assert_nothing_false(found, content)
    assert found.run_facts == content.run_facts


@pytest.mark.parametrize("seed", range(40))
def test_from_a_flipped_byte(tmp_path: Path, whole: tuple[bytes, LogContent, list[tuple[int, int]]], seed: int) -> None:
    data, content, chunks = whole
    rng = random.Random(1000 + seed)
    place = rng.randrange(len(data))
    damaged = bytearray(data)
    damaged[place] ^= 1 << rng.randrange(8)
    found, result = rescued(bytes(damaged), tmp_path)
    hit = any(start <= place < end for start, end in chunks)
    assert len(found.samples) == ROWS - hit * CHUNK_ROWS
    assert result.lost_records == hit * CHUNK_ROWS  # type: ignore[attr-defined]
    assert_nothing_false(found, content)


@pytest.mark.parametrize("field", ["length", "crc", "name", "size"])
def test_a_broken_head_of_a_chunk_costs_only_that_chunk(
    tmp_path: Path, whole: tuple[bytes, LogContent, list[tuple[int, int]]], field: str
) -> None:
    data, content, chunks = whole
    place = chunks[4][0] + {"length": 2, "size": 9 + 17, "crc": 9 + 25, "name": 9 + 33}[field]
    damaged = bytearray(data)
    damaged[place] ^= 0x01
    found, result = rescued(bytes(damaged), tmp_path)
    assert len(found.samples) == ROWS - CHUNK_ROWS
    (gap,) = result.gaps  # type: ignore[attr-defined]
    assert (gap.records, round(gap.to_s - gap.from_s, 3)) == (CHUNK_ROWS, 0.505)
    assert_nothing_false(found, content)


def test_without_its_first_chunk_the_schema_is_known_all_the_same(
    tmp_path: Path, whole: tuple[bytes, LogContent, list[tuple[int, int]]]
) -> None:
    data, content, chunks = whole
    found, _ = rescued(data[chunks[1][0] : chunks[6][1]], tmp_path)  # nothing but five chunks: no head, no end
    assert len(found.samples) == 6 * CHUNK_ROWS
    assert_nothing_false(found, content)


def test_a_finished_file_stays_as_it_is(tmp_path: Path, whole: tuple[bytes, LogContent, list[tuple[int, int]]]) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(whole[0])
    result = recover(path)
    assert (result.file, result.records, result.damages) == (path, ROWS, ())
    assert [file.name for file in tmp_path.iterdir()] == ["run.mcap"]
    assert path.read_bytes() == whole[0]


def test_the_rescued_log_is_sound_and_says_what_it_is(
    tmp_path: Path, whole: tuple[bytes, LogContent, list[tuple[int, int]]]
) -> None:
    data, _, chunks = whole
    damaged = bytearray(data)
    damaged[chunks[3][0] + 100] ^= 0xFF
    found, result = rescued(bytes(damaged), tmp_path)
    assert found.result_facts["recovered_from"] == "damaged.mcap.partial"
    assert found.result_facts["lost_records"] == CHUNK_ROWS
    assert found.result_facts["lost_seconds"] == pytest.approx(CHUNK_ROWS * 0.005)
    findings = check(result.file)  # type: ignore[attr-defined]
    assert any("samples were lost" in finding for finding in findings)
    assert not any("byte" in finding for finding in findings), "its own frame and CRCs hold"
    with pytest.raises(RecordError, match="exists already"):
        recover(tmp_path / "damaged.mcap.partial")


def test_of_a_cut_recording_what_came_after_the_last_flush_is_not_guessed(
    tmp_path: Path, whole: tuple[bytes, LogContent, list[tuple[int, int]]]
) -> None:
    data, _, chunks = whole
    _, result = rescued(data[: chunks[5][1] - 7], tmp_path)
    assert result.lost_at_the_ends is None  # type: ignore[attr-defined]
    assert result.unsaved_bytes == chunks[5][1] - 7 - chunks[5][0]  # type: ignore[attr-defined]


@pytest.mark.parametrize("data", [b"", b"not a log", bytes(5000), b"\x06" * 5000, b"\x89MCAP0\r\n"])
def test_from_what_is_no_log_nothing_is_saved(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "x.mcap"
    path.write_bytes(data)
    with pytest.raises(RecordError, match="nothing to save"):
        recover(path)
    assert [file.name for file in tmp_path.iterdir()] == ["x.mcap"]


def test_a_log_without_ticks_lost_keeps_everything_else(tmp_path: Path) -> None:
    content = made_content(300)
    write_content(content, tmp_path / "run.mcap")
    (tmp_path / "cut.mcap").write_bytes((tmp_path / "run.mcap").read_bytes()[:-8])  # only the end mark is gone
    result = recover(tmp_path / "cut.mcap")
    found = read_content(result.file)
    kept = {key: found.result_facts[key] for key in content.result_facts if key != "valid"}
    assert kept == {key: value for key, value in content.result_facts.items() if key != "valid"}
    assert_same_content(
        LogContent(found.samples, found.run_facts, {}, found.attachments, found.lines),
        LogContent(content.samples, content.run_facts, {}, content.attachments, content.lines),
    )

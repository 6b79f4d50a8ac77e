"""Log rotation by size and age, and what it must never touch."""

import os
from pathlib import Path

import pytest

from rig.service.rotation import rotate

NOW = 1_000_000.0


def record(path: Path, age_s: float, size: int = 100) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(bytes(size))
    os.utime(path, (NOW - age_s, NOW - age_s))
    return path


def rotated(out: Path, keep_bytes: int = 10**9, keep_s: float = 1e9, current: tuple[Path, ...] = ()) -> list[str]:
    return sorted(path.name for path in rotate(out, keep_bytes, keep_s, current, now_s=lambda: NOW))


def test_old_records_go_and_their_empty_folders(tmp_path: Path) -> None:
    record(tmp_path / "old" / "a.mcap", 100)
    record(tmp_path / "new" / "b.mcap", 1)
    assert rotated(tmp_path, keep_s=50) == ["a.mcap"]
    assert not (tmp_path / "old").exists()
    assert (tmp_path / "new" / "b.mcap").exists()


def test_the_oldest_go_until_the_rest_fits(tmp_path: Path) -> None:
    for age in (4, 3, 2, 1):
        record(tmp_path / f"{age}.mcap", age)
    assert rotated(tmp_path, keep_bytes=250) == ["3.mcap", "4.mcap"]


def test_the_current_file_stays_even_when_it_is_the_oldest(tmp_path: Path) -> None:
    current = record(tmp_path / "current.mcap.partial", 500)
    record(tmp_path / "other.mcap", 400)
    assert rotated(tmp_path, keep_bytes=0, keep_s=10, current=(current,)) == ["other.mcap"]
    assert current.exists()


@pytest.mark.parametrize("name", ["notes.txt", "model.yaml", "a.csv", "mcap"])
def test_what_is_no_record_stays(tmp_path: Path, name: str) -> None:
    record(tmp_path / name, 1e6)
    assert rotated(tmp_path, keep_bytes=0, keep_s=0) == []


def test_a_folder_that_is_not_there_is_no_error(tmp_path: Path) -> None:
    assert rotated(tmp_path / "none") == []

"""What a loss of power must not take: files that are replaced are on the disk before they have their name, and the name
is, too."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from rig.app import compose
from rig.outputs import Kind, write_text
from rig.service.records.kept_file import keep
from rig.service.records.ledger import Ledger
from rig.service.web.files.bringup import BringUp


def forgotten(folder: Path) -> None:
    ledger = Ledger(folder / "kept.jsonl")
    for name in ("one", "two"):
        (folder / name).touch()
        ledger.add(folder / name)
    ledger.forget([str(folder / "one")])


WRITERS: dict[str, Callable[[Path], None]] = {
    "a file of the state folder": lambda folder: keep(folder / "kept.json", "{}"),
    "what an operator confirmed": lambda folder: BringUp(compose.load(None), folder / "kept.json").confirm(
        "dry", "somebody", done=True
    ),
    "a ledger that forgets": forgotten,
    "a calibration": lambda folder: write_text(folder / "kept.yaml", "angle: {}\n", Kind.CALIBRATION),
    "a calibration that is replaced": lambda folder: [
        write_text(folder / "kept.yaml", "angle: {}\n", Kind.CALIBRATION) for _ in "ab"
    ].clear(),
}


@pytest.mark.parametrize("what", WRITERS)
def test_whole_on_the_disk_before_it_has_its_name_and_the_name_after(
    what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[str] = []
    folder = os.path.realpath(tmp_path)

    def told(call: Callable[..., None], word: str) -> Callable[..., None]:
        def listed(*arguments: object, **more: object) -> None:
            call(*arguments, **more)
            done.append("folder" if word == "sync" and place(arguments[0]) == folder else word)

        return listed

    def place(descriptor: object) -> str:
        return os.readlink(f"/proc/self/fd/{descriptor}")

    for name, word in (("fsync", "sync"), ("replace", "name"), ("rename", "name"), ("link", "name")):
        monkeypatch.setattr(os, name, told(getattr(os, name), word))
    WRITERS[what](tmp_path)
    assert done[-3:] == ["sync", "name", "folder"]


def test_a_line_of_the_ledger_is_on_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[str] = []
    monkeypatch.setattr(os, "fsync", lambda descriptor: synced.append(os.readlink(f"/proc/self/fd/{descriptor}")))
    (tmp_path / "record").touch()
    Ledger(tmp_path / "records.jsonl").add(tmp_path / "record")
    assert synced == [os.path.realpath(tmp_path / "records.jsonl")]


def test_a_folder_that_cannot_be_synced_is_no_failure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Some file systems refuse; the file is whole there all the same."""
    opened = os.open

    def refused(path: object, flags: int, *more: int) -> int:
        if flags & os.O_DIRECTORY:
            raise OSError(22, "Invalid argument")
        return opened(path, flags, *more)  # type: ignore[arg-type]

    monkeypatch.setattr(os, "open", refused)
    keep(tmp_path / "kept.json", "{}")
    assert (tmp_path / "kept.json").read_text() == "{}"

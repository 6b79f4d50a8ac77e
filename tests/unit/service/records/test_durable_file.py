"""What a loss of power must not take: files that are replaced are on the disk before they have their name, and the name
is, too."""

import errno
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from rig.app import compose
from rig.errors import RigError
from rig.outputs import OutputKind, write_text
from rig.service.queue.job_queue import Queue
from rig.service.records.durable_file import DurableFile
from rig.service.records.ledger import Ledger
from rig.service.web.files.bringup import BringUp


def forgotten(folder: Path) -> None:
    ledger = Ledger(DurableFile(folder / "kept.jsonl"))
    for name in ("one", "two"):
        (folder / name).touch()
        ledger.add(folder / name)
    ledger.forget([str(folder / "one")])


WRITERS: dict[str, Callable[[Path], None]] = {
    "a file of the state folder": lambda folder: DurableFile(folder / "kept.json").replace("{}"),
    "what an operator confirmed": lambda folder: BringUp(compose.load(None), folder / "kept.json").confirm(
        "dry", "somebody", done=True
    ),
    "a ledger that forgets": forgotten,
    "a calibration": lambda folder: write_text(folder / "kept.yaml", "angle: {}\n", OutputKind.CALIBRATION),
    "a calibration that is replaced": lambda folder: [
        write_text(folder / "kept.yaml", "angle: {}\n", OutputKind.CALIBRATION) for _ in "ab"
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
    Ledger(DurableFile(tmp_path / "records.jsonl")).add(tmp_path / "record")
    assert synced == [os.path.realpath(tmp_path / "records.jsonl")]


def test_a_folder_that_cannot_be_synced_is_no_failure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Some file systems refuse; the file is whole there all the same."""
    opened = os.open

    def refused(path: object, flags: int, *more: int) -> int:
        if flags & os.O_DIRECTORY:
            raise OSError(22, "Invalid argument")
        return opened(path, flags, *more)  # type: ignore[arg-type]

    monkeypatch.setattr(os, "open", refused)
    DurableFile(tmp_path / "kept.json").replace("{}")
    assert (tmp_path / "kept.json").read_text() == "{}"


@pytest.mark.parametrize("name", ["queue.json", "records.jsonl"])
def test_what_cannot_be_read_is_kept_beside_what_could_not_before(
    name: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """The second took the place of the first, and nobody was told of either."""
    path = tmp_path / name
    (tmp_path / "record").touch()
    for text in ("first", "second", "third"):
        path.write_text(text)
        if name == "queue.json":
            assert Queue(DurableFile(path)).left() == []
        else:
            Ledger(DurableFile(path)).add(tmp_path / "record")
    kept = {place.name: place.read_text() for place in tmp_path.glob("*.broken*")}
    assert kept == {
        f"{path.stem}.broken": "first",
        f"{path.stem}.broken2": "second",
        f"{path.stem}.broken3": "third",
    }
    assert f"{path}: cannot be read; it is kept as {path.stem}.broken3, and a new one begun" in caplog.text


def test_a_file_that_cannot_be_put_aside_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> None:
        raise OSError(30, "Read-only file system")

    (tmp_path / "queue.json").write_text("x")
    monkeypatch.setattr(Path, "rename", refused)
    with pytest.raises(RigError, match=r"queue\.json: cannot be read; it cannot be put aside: Read-only file system"):
        Queue(DurableFile(tmp_path / "queue.json"))


def test_a_full_disk_keeps_what_was_there_and_nothing_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    DurableFile(tmp_path / "kept.json").replace("{}")

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(RigError, match=r"kept\.json: cannot be written: No space left on device"):
        DurableFile(tmp_path / "kept.json").replace("[1]")
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("kept.json", "{}")]


@pytest.mark.parametrize("text", ["", "[]", '{"dry": 5}', "\x00"])
def test_what_an_operator_confirmed_is_kept_where_it_cannot_be_read(tmp_path: Path, text: str) -> None:
    """The next step that was confirmed took its place."""
    (tmp_path / "bringup.json").write_text(text)
    steps = BringUp(compose.load(None), tmp_path / "bringup.json")
    assert not any(step["confirmed"] for step in steps.to_json({})["steps"])
    steps.confirm("dry", "somebody", done=True)
    assert (tmp_path / "bringup.broken").read_text() == text
    assert [step["name"] for step in steps.to_json({})["steps"] if step["confirmed"]] == ["dry"]

"""Named memory between processes: who owns it, who may not touch it, what is left of the dead."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from support.shared_names import unused_name

from rig.errors import StateError
from rig.realtime import shared
from rig.realtime.shared import SharedBlock, is_stale, living_owner, sweep_stale

name = pytest.fixture(unused_name)


@pytest.fixture(autouse=True)
def own_folder(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where blocks live in these tests: in the machine's own folder every session that starts sweeps as well."""
    place = tmp_path / "blocks"
    place.mkdir()
    monkeypatch.setattr(shared, "folder", lambda: place)
    return place


def of_a_dead_process(name: str) -> Path:
    """A block whose maker has ended without removing it."""
    place = shared.folder()
    code = f"from pathlib import Path; from rig.realtime import shared; shared.folder = lambda: Path({str(place)!r})"
    subprocess.run([sys.executable, "-c", f"{code}; shared.SharedBlock.create({name!r}, 7, 64)"], check=True)
    return place / f"pamrig-{name}"


def test_two_that_map_a_block_see_the_same_words(name: str) -> None:
    mine = SharedBlock.create(name, 5, 64)
    theirs = SharedBlock.attach(mine.path, 5)
    mine.words[10] = 123
    assert theirs.words[10] == 123
    assert theirs.session == 5
    assert living_owner(mine.path) == os.getpid()


def test_a_fresh_block_is_all_zeros_and_private(name: str) -> None:
    block = SharedBlock.create(name, 5, 100)
    assert not any(block.words[shared.HEADER_WORDS :])
    assert len(block.words) == shared.HEADER_WORDS + 13
    assert block.path.stat().st_mode & 0o077 == 0


def test_a_name_in_use_is_refused(name: str) -> None:
    first = SharedBlock.create(name, 5, 64)
    with pytest.raises(StateError, match=f"in use by process {os.getpid()}"):
        SharedBlock.create(name, 6, 64)
    assert SharedBlock.attach(first.path).session == 5


def test_a_dead_process_s_block_is_replaced(name: str) -> None:
    path = of_a_dead_process(name)
    assert path.exists()
    assert living_owner(path) == 0
    assert SharedBlock.create(name, 6, 64).session == 6


def test_stale_blocks_are_swept_away_and_living_ones_are_not(name: str) -> None:
    dead, kept = of_a_dead_process(name), of_a_dead_process(f"{name}-kept")
    living = SharedBlock.create(f"{name}-living", 5, 64)
    removed = sweep_stale("-kept")
    assert dead in removed
    assert not dead.exists()
    assert kept.exists()
    assert living.path.exists()


def test_a_pid_that_is_another_s_by_now_keeps_nothing_of_the_dead(name: str) -> None:
    path = of_a_dead_process(name)
    words = SharedBlock.attach(path).words
    words[1] = os.getppid()
    assert living_owner(path) == os.getppid(), "who takes it over may be about to"
    words[5] = 0  # made long ago
    assert living_owner(path) == 0
    sweep_stale()
    assert not path.exists()


def test_a_block_whose_owner_lives_in_another_container_is_not_swept_away(name: str) -> None:
    """His pid means nobody here, and the folder may be shared."""
    block = SharedBlock.create(name, 5, 64)
    block.words[1] = 1 << 30
    assert not is_stale(block.path)
    assert block.path not in sweep_stale()
    again = SharedBlock.adopt(block.path, 5)
    block.close()
    again.words[1] = 1 << 30
    assert not is_stale(again.path)
    again.close()
    sweep_stale()
    assert not again.path.exists()


def test_an_owner_of_a_version_that_held_no_lock_is_known_by_his_pid(name: str) -> None:
    path = of_a_dead_process(name)
    block = SharedBlock.attach(path)
    block.words[1], block.words[4], block.words[5] = os.getppid(), 1, 0
    assert not is_stale(path)


def test_what_was_killed_before_it_got_its_name_is_swept_away(name: str) -> None:
    draft = of_a_dead_process(name).rename(shared.folder() / f".pamrig-{name}-1")
    sweep_stale()
    assert not draft.exists()
    draft.touch()
    sweep_stale()
    assert draft.exists(), "it is being made"
    draft.unlink()


def test_sweeping_leaves_alone_what_cannot_be_removed(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    path = of_a_dead_process(name)

    def not_ours(self: Path, missing_ok: bool = False) -> None:
        raise PermissionError(1, "Operation not permitted", str(self))

    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", not_ours)
        assert path not in sweep_stale()
    assert path.exists()


def test_nobody_sees_a_block_before_it_has_an_owner(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A second session that sweeps while the first one is being made must not take its blocks for stale."""
    seen: list[bool] = []
    link = os.link

    def looking(draft: Path, path: Path) -> None:
        seen.append(path.exists())
        link(draft, path)
        seen.append(living_owner(path) == os.getpid())

    monkeypatch.setattr(os, "link", looking)
    SharedBlock.create(name, 5, 64)
    assert seen == [False, True]


def test_a_block_of_another_session_is_stale(name: str) -> None:
    block = SharedBlock.create(name, 0xABC, 64)
    with pytest.raises(StateError, match="belongs to session abc, not def: stale shared memory"):
        SharedBlock.attach(block.path, 0xDEF)


@pytest.mark.parametrize("content", [b"", b"short", bytes(4096), b"PAMRIG" * 100])
def test_what_is_no_block_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "pamrig-foreign"
    path.write_bytes(content)
    with pytest.raises(StateError, match="not a block of pamrig"):
        SharedBlock.attach(path)


def test_a_cut_block_is_refused(name: str) -> None:
    block = SharedBlock.create(name, 5, 4096)
    os.truncate(block.path, 2048)
    with pytest.raises(StateError, match="not a block of pamrig"):
        SharedBlock.attach(block.path)


def test_a_missing_block_is_told_by_its_path() -> None:
    with pytest.raises(StateError, match=r"pamrig-nowhere: no such shared memory"):
        SharedBlock.attach(shared.folder() / "pamrig-nowhere")


def test_no_room_is_one_line_and_leaves_nothing(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", full)
    with pytest.raises(StateError, match="cannot be made: No space left on device"):
        SharedBlock.create(name, 5, 64)
    assert not list(shared.folder().glob(f"*{name}*"))


def test_closing_ends_the_views(name: str) -> None:
    block = SharedBlock.create(name, 5, 64)
    block.close()
    with pytest.raises(ValueError, match="released"):
        _ = block.words[0]


@pytest.fixture
def _in_time() -> Iterator[None]:
    """Who hangs for two seconds is interrupted."""
    before = signal.signal(signal.SIGALRM, lambda *_: pytest.fail("it hangs"))
    signal.setitimer(signal.ITIMER_REAL, 2.0)
    yield
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.usefixtures("_in_time")
@pytest.mark.parametrize("kind", ["pipe", "folder", "link", "dangling link"])
def test_what_anybody_put_into_the_folder_is_neither_waited_for_nor_followed_nor_removed(name: str, kind: str) -> None:
    path, target = shared.folder() / f"pamrig-{name}", of_a_dead_process(f"{name}-target")
    {
        "pipe": lambda: os.mkfifo(path),
        "folder": lambda: path.mkdir(),
        "link": lambda: path.symlink_to(target),
        "dangling link": lambda: path.symlink_to("nowhere"),
    }[kind]()
    try:
        assert living_owner(path) == 0
        assert not is_stale(path)
        assert path not in sweep_stale()
        with pytest.raises(StateError, match="no such shared memory"):
            SharedBlock.attach(path)
        assert os.path.lexists(path)
    finally:
        path.rmdir() if kind == "folder" else path.unlink()


def test_another_user_s_block_is_neither_mapped_nor_removed(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    path = of_a_dead_process(name)
    with monkeypatch.context() as patch:
        patch.setattr(os, "geteuid", lambda: 12345)
        assert not is_stale(path)
        assert path not in sweep_stale()
        with pytest.raises(StateError, match="is not a file of yours: mode -rw-------, user "):
            SharedBlock.attach(path)
    assert path.exists()
    assert is_stale(path)

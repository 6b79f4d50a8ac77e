"""A process whose memory is limited: libraries that would end it, or ask for ever, are not loaded."""

import errno
import importlib
import resource
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from support.run_command import PAMRIG

from rig.cli import ctrl_c, memory_room

SAID = "pamrig: not enough memory for this command (`ulimit -v`, or a limit of its container or service?)\n"
RECORDING = min(Path("tests/replay").glob("*.mcap"), key=lambda path: path.stat().st_size)


def test_a_search_that_gets_too_little_memory_says_so_in_one_line(tmp_path: Path) -> None:
    """With this much LLVM ended the process, `std::bad_alloc`; with a fifth more OpenBLAS asked for memory for ever,
    deaf to SIGTERM."""
    command = f"ulimit -v 460000; {PAMRIG} identify {RECORDING.resolve()} -o {tmp_path / 'm.yaml'}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (2, SAID)
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(("limit", "is_watched"), [(resource.RLIM_INFINITY, False), (1 << 30, True)])
def test_only_where_memory_is_limited_is_it_asked_for(
    limit: int, is_watched: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "meta_path", [*sys.meta_path])
    monkeypatch.setattr(resource, "getrlimit", lambda _: (limit, limit))
    before = len(sys.meta_path)
    memory_room.watch()
    assert (len(sys.meta_path) > before) is is_watched


@pytest.mark.parametrize("more", [0, 1])
def test_a_library_is_loaded_where_there_is_room_and_only_there(more: int, monkeypatch: pytest.MonkeyPatch) -> None:
    free_bytes = memory_room.NEEDS_MB["numpy"] * (1 << 20) - 1 + more

    def mapped(_: int, size_bytes: int, **__: int) -> SimpleNamespace:
        if size_bytes > free_bytes:
            raise OSError(errno.ENOMEM, "Cannot allocate memory")
        return SimpleNamespace(close=lambda: None)

    monkeypatch.setattr("mmap.mmap", mapped)
    monkeypatch.setattr(sys, "meta_path", [*sys.meta_path])
    monkeypatch.setattr(resource, "getrlimit", lambda _: (1 << 30, 1 << 30))
    memory_room.watch()
    if more:
        assert importlib.util.find_spec("colorsys") is not None
        sys.meta_path[0].find_spec("numpy", None)
    else:
        with pytest.raises(MemoryError, match="100 MB"):
            sys.meta_path[0].find_spec("numpy", None)


def test_a_command_whose_own_modules_find_no_memory_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse() -> None:
        raise MemoryError

    monkeypatch.setattr("rig.cli.commands.main", refuse)
    monkeypatch.setattr("atexit.register", lambda *_: None)
    monkeypatch.setattr("signal.signal", lambda *_: None)
    monkeypatch.setattr(sys, "unraisablehook", sys.unraisablehook)
    with pytest.raises(SystemExit) as ended:
        ctrl_c.carry_out_interruptibly(is_heard=False)
    assert (ended.value.code, capsys.readouterr().err) == (2, SAID)

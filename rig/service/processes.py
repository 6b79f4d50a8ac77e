"""What all processes of a rig have in common: how they are started, named, and told apart from the outside."""

import contextlib
import signal
from multiprocessing.process import BaseProcess
from multiprocessing.resource_tracker import ensure_running
from pathlib import Path


def start_process(process: BaseProcess) -> None:
    """Start a process that the terminal's Ctrl-C does not reach, not even before its first line: that is for the one
    who commands."""
    ensure_running()  # multiprocessing's own helper would lift the mask when it is started on the way
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        process.start()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def name_process(name: str) -> None:
    """What `ps` and `top` call this process; the kernel keeps 15 characters."""
    with contextlib.suppress(OSError):
        Path("/proc/self/comm").write_text(f"pamrig-{name}", encoding="ascii")


def is_stopped(pid: int | None) -> bool:
    """The process is in the state T of proc(5)."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0] in ("T", "t")
    except OSError:
        return False

"""The live view's process."""

import multiprocessing
import os
from pathlib import Path

from rig.service.processes import start_process
from rig.service.views import live


def test_a_session_that_is_over_before_it_is_shown_is_no_error(tmp_path: Path) -> None:
    """A reset that came within its first second left a traceback in the daemon's log."""
    arguments = tmp_path / "no-ring", 42, 0, os.getpid()
    process = multiprocessing.get_context("spawn").Process(target=live.show, args=arguments)
    start_process(process)
    process.join()
    assert process.exitcode == 0

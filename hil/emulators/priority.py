"""Emulators keep pace with the loop: where the system allows it, their threads run in real time too, below the loop.

A thread that shares the interpreter with the loop and is set aside by other programs while it holds the interpreter's
lock would hold up the loop for as long. Hardware does not do that, so neither shall its stand-in.
"""

import contextlib
import os
import threading

FIFO_PRIORITY = 45
"""Of SCHED_FIFO: below the loop of a rig (80 by default), above all that is not real-time. An emulator stands for
hardware, which nobody holds up."""


def run_in_real_time() -> None:
    """Real-time priority for the calling thread, or none where that is not allowed."""
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(threading.get_native_id(), os.SCHED_FIFO, os.sched_param(FIFO_PRIORITY))

"""A serial port that is not there: a pseudo-terminal under a name of its own."""

import os
import tty
from pathlib import Path


def plugged_pty(device: Path) -> tuple[int, int]:
    """A new pty with `device` linked to its client end; master and slave, the latter held open so that no client hangs
    up the line."""
    master, slave = os.openpty()
    tty.setraw(slave)
    device.unlink(missing_ok=True)
    device.symlink_to(os.ttyname(slave))
    return master, slave

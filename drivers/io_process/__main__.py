"""`python -m drivers.io_process FD`: an I/O process, started by its owner with the mailbox as descriptor FD and its
pipe as stdin."""

import sys

from drivers.io_process.worker import run

if __name__ == "__main__":
    sys.exit(run(0, int(sys.argv[1])))

"""Commands and programs that need no process from scratch: a process that has imported the packages is forked for each,
which then does what `pamrig WORDS`, or `python -c TEXT`, does in that folder.

Three seconds of the processor a call are imports, machine code that is loaded, and their end. What is about starting,
streams or signals needs the real thing (`support.run_command`).
"""

import gc
import importlib
import json
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

IMPORTED = (
    *("rig.cli.main", "rig.cli.commands", "rig.app.runs.sweeping", "rig.app.runs.tracking", "rig.app.runs.replaying"),
    *("rig.app.records.logs", "rig.identify.fit", "rig.gap.diagnosis", "rig.report.gap_page", "rig.report.log_figures"),
    *("rig.cli.runs.run", "rig.cli.runs.replay", "rig.cli.log", "rig.cli.model", "rig.cli.gap", "rig.app.gap.planning"),
    *("hil.bench", "pamrig._diagnosing", "pamrig._models", "pamrig._rigs", "pamrig._comparing"),
    *("matplotlib.figure", "matplotlib.backends.backend_agg", "matplotlib.backends.backend_svg", "rich.table"),
)
PATIENCE_S = 240.0
"""A process that takes longer is ended."""


class Warm:
    """The process that is forked; it ends with its input."""

    def __init__(self) -> None:
        environment = os.environ | {"MPLBACKEND": "Agg", "OPENBLAS_NUM_THREADS": "1"}
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(
            [sys.executable, __file__], stdin=pipe, stdout=pipe, env=environment, text=True, bufsize=1
        )

    def run(self, call: list[str], folder: Path, *, reader: bool = True) -> tuple[int, str]:
        """Exit status, as `subprocess` has it, and all that was written to stdout and stderr; without a reader stdout
        is a pipe that nobody reads."""
        assert self._process.stdin
        assert self._process.stdout
        print(json.dumps([call, str(folder), reader]), file=self._process.stdin)
        status, written = json.loads(self._process.stdout.readline())
        return status, written

    def close(self) -> None:
        assert self._process.stdin
        assert self._process.stdout
        self._process.stdin.close()
        self._process.wait()
        self._process.stdout.close()


def load_machine_code() -> None:
    """What every simulation runs; without it, each fork reads it from the disk."""
    import numpy as np

    from rig.app import shipped
    from rig.model.parameters import load_model
    from rig.model.simulation import simulate
    from rig.record import Record

    still = Record("still", 0.005 * np.arange(100), np.zeros(100))
    simulate(load_model(shipped.configs() / "models" / "simulated.yaml"), still, start_deg=0.0)


def carry_out(call: list[str]) -> None:
    """`pamrig WORDS`, or `python -c TEXT` where the first word is -c."""
    program, *words = call
    if program == "-c":
        sys.argv = call[:1]
        exec(compile(words[0], "<text>", "exec"), {"__name__": "__main__"})
    else:
        assert program == "pamrig", f"{program}: only pamrig and python are known here"
        sys.argv = call
        sys.modules["rig.cli.main"].main()


def unread() -> int:
    """The end for writing of a pipe whose other end is closed."""
    read_end, write_end = os.pipe()
    os.close(read_end)
    return write_end


def forked(call: list[str], folder: str, output: int, reader: bool) -> int:
    """The status of a process of its own that carries it out; in that process it does not return."""
    if pid := os.fork():
        return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    signal.setitimer(signal.ITIMER_REAL, PATIENCE_S)
    os.chdir(folder)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(output if reader else unread(), 1)
    os.dup2(output, 2)
    carry_out(call)
    sys.exit(0)  # what it raised ends this process as it ends any


def serve() -> None:
    """Fork for every line of the input, until there is none."""
    sys.path[0] = ""
    for name in IMPORTED:
        importlib.import_module(name)
    load_machine_code()
    gc.freeze()  # what is here stays: a fork that ends looks at none of it
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    for line in iter(sys.stdin.readline, ""):
        call, folder, reader = json.loads(line)
        with tempfile.TemporaryFile() as output:
            status = forked(call, folder, output.fileno(), reader)
            output.seek(0)
            answers.write(json.dumps([status, output.read().decode("utf-8", "replace")]) + "\n")


if __name__ == "__main__":
    serve()

"""Fault benches whose rig is held by a command instead of a daemon: `pamrig run` and `replay` with a loop of their own,
calibrating and probing without one."""

import subprocess
import time
from abc import ABC, abstractmethod
from pathlib import Path
from typing import Final

from rig.errors import RigError
from rig.qualify.faults.bench import SAFE_MPA, START_S, FaultBench, Spoilt, named_children
from rig.qualify.faults.wired import ModbusFaultBench, SerialFaultBench, io_processes_of

_INTO_THE_SWEEP_S: Final = 0.3
_LEVELS: Final = "0.3,0.2"
_STEP_S: Final = "3"
"""A step of a valve is held for so long, which is longer than all blows of a trial take."""


class CommandBench(FaultBench, ABC):
    """A process for each trial, and no daemon to ask: what it says is what it wrote to the terminal."""

    above: tuple[str, ...] = ("supervisor", "guardian")
    """Who must be there before anybody is struck, beside those that are."""
    _number = _log_chars = 0

    def ready(self) -> None:
        """A new command, in the middle of its work."""
        self.end()
        self._number += 1
        self.terminals.write(*SAFE_MPA)
        self._log_chars = len(self.log_text()) if self._number > 1 else 0
        self.begin(self.folder / f"trial_{self._number}")
        self.wait(lambda: self._under_way, "the command to hold the rig", START_S)
        time.sleep(_INTO_THE_SWEEP_S)

    @abstractmethod
    def begin(self, out: Path) -> None:
        """Start the command; what it writes goes to `out`."""

    @property
    def _under_way(self) -> bool:
        if not self.alive:
            raise Spoilt(f"the command ended: {self.log_text()[-400:]}")
        return not self.is_safe and {*self.struck, *self.above} <= set(self.pids())

    @property
    def said(self) -> str:
        """All that was written to the terminal in this trial."""
        return " ".join(self.log_text()[self._log_chars :].split())

    def said_of_safe(self, patience_s: float) -> str:
        """What the last line says of the safe state; RigError when it says none."""
        self.wait(lambda: not self.alive, "the command to end", START_S)  # a replay draws first
        return self.wait(self._words, "a word on the safe state", patience_s)

    def _words(self) -> str:
        if not self.is_safe:
            raise RigError(
                f"the command says {self.said[-200:]!r}, and at the valves stands {self.terminals.setpoints}"
            )
        _, found, rest = self.said.rpartition("safe state written by")
        return found and found + rest


class RunBench(CommandBench):
    """Under `pamrig run`."""

    def begin(self, out: Path) -> None:
        """The sweep."""
        self.command("run", str(self.sweep), "--rig", str(self.rig), "--out", str(out), "--force")


class ReplayBench(CommandBench):
    """Under `pamrig replay`, of the same sweep recorded in virtual time."""

    def begin(self, out: Path) -> None:
        """The recording, made when it is first needed."""
        recorded = self.folder / "recorded"
        if not recorded.exists():
            self.command("run", str(self.sweep), "--clock", "virtual", "--out", str(recorded))
            self.wait(lambda: not self.alive, "a recording", START_S)
        target = "--rig", str(self.rig), "-o", str(out)
        self.command("replay", str(recorded), *target, "--clock", "real", "--force")


class RunOverModbus(RunBench, ModbusFaultBench):
    """The same over Modbus."""


class RunOverSerial(RunBench, SerialFaultBench):
    """The same with serial valves, each behind an I/O process."""


class CalibrationBench(CommandBench):
    """Under `pamrig devices calibrate pressures`, while it waits for somebody to read a gauge."""

    struck: tuple[str, ...] = ("supervisor", "guardian", "control")
    at_once: tuple[int, ...] = (2,)

    def begin(self, out: Path) -> None:
        """Up to the first level."""
        target = "--rig", str(self.rig), "-o", f"{out}.yaml"
        levels = "--levels", _LEVELS, "--settle", "0.1", "--yes"
        self.command("devices", "calibrate", "pressures", *target, *levels, stdin=subprocess.PIPE)

    def said_of_safe(self, patience_s: float) -> str:
        """A command that was not struck gives up, and ends as soon as somebody has answered it."""
        if self._daemon is not None and self._daemon.stdin:
            self._daemon.stdin.close()
        return super().said_of_safe(patience_s)

    def _words(self) -> str:
        _, found, why = self.said.rpartition("so it gave up")
        return found + why or super()._words()


class ProbeBench(CalibrationBench):
    """Under `pamrig devices probe --step`, while a valve is stepped."""

    def begin(self, out: Path) -> None:
        """Until a step stands."""
        step = "--step", "--step-mpa", "0.1", "--settle", _STEP_S, "--ticks", "20", "--yes"
        self.command("devices", "probe", "--rig", str(self.rig), *step)


class CalibrationOverModbus(CalibrationBench, ModbusFaultBench):
    """Over Modbus, where the module's own watchdog would be left as well."""


class ProbeOverModbus(ProbeBench, ModbusFaultBench):
    """The same while probing."""


class CalibrationOverSerial(CalibrationBench, SerialFaultBench):
    """With serial valves, whose I/O processes write the safe state when they lose their owner."""

    struck = (*CalibrationBench.struck, "io process 1", "io process 2")
    at_once = (2, 3)

    def pids(self) -> dict[str, int]:
        """There is no loop: the command itself has the I/O processes."""
        held = {"control": self.daemon_pid, **named_children(self.daemon_pid)}
        return held | {f"io process {n}": pid for n, pid in enumerate(io_processes_of(self.daemon_pid), 1)}

"""`pamrig run` as a process: carried out to its end, or watched through the loop's ring while it goes on."""

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import psutil
import pytest

from rig.app.runs.outcome import RunOutcome
from rig.errors import CheckFailed, StateError
from rig.realtime import shared
from rig.realtime.ring import Ring
from rig.sample import Phase

PAMRIG = Path(sys.executable).with_name("pamrig")
SWEEP = """\
name: short
settle_s: 0.4
zero_s: 0.3
ramp_in_s: 0.3
duration_s: 0.6
ramp_out_s: 0.3
records:
  - sine: {frequency_hz: 2.0, amplitude_mpa: 0.1}
"""
LONG = {
    Phase.SETTLE: SWEEP.replace("settle_s: 0.4", "settle_s: 60"),
    Phase.ZERO: SWEEP.replace("zero_s: 0.3", "zero_s: 60"),
    Phase.RAMP_IN: SWEEP.replace("ramp_in_s: 0.3", "ramp_in_s: 60"),
    Phase.SWEEP: SWEEP.replace("duration_s: 0.6", "duration_s: 60"),
    Phase.RAMP_OUT: SWEEP.replace("ramp_out_s: 0.3", "ramp_out_s: 3"),
}
"""Sweeps for what strikes in a phase and ends the run by it: who strikes may come late. The ramp out is carried out."""
PATIENCE_S = 240.0
"""For a process to come to its end, or to where it is waited for, on a machine that does other work too."""
T = TypeVar("T")


def pamrig(
    *arguments: object, cwd: Path | None = None, prepare: Callable[[], None] | None = None
) -> subprocess.CompletedProcess[str]:
    """The command carried out to its end."""
    call = [str(PAMRIG), *map(str, arguments)]
    return subprocess.run(
        call, capture_output=True, text=True, cwd=cwd, preexec_fn=prepare, timeout=PATIENCE_S, check=False
    )


def until(look: Callable[[], T | None]) -> T:
    """What `look` finds, as soon as it finds it."""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        if found := look():
            return found
        time.sleep(0.002)
    raise AssertionError("waited in vain")


def _of_a_terminal() -> None:
    """Whoever runs the tests may have had it ignored."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


class Running:
    """A run on the real clock, watched through its ring."""

    def __init__(self, *arguments: object, under: Sequence[str] = ()) -> None:
        call = [*under, str(PAMRIG), "run", *map(str, arguments)]
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(
            call, stdout=pipe, stderr=pipe, text=True, start_new_session=True, preexec_fn=_of_a_terminal
        )
        self.ring = until(self._ring)

    def _ring(self) -> Ring | None:
        self._goes_on("opened its rig")
        for path in shared.folder().glob("pamrig-*-ring"):
            if shared.living_owner(path) == self.process.pid:
                try:
                    return Ring.attach(path)
                except StateError:  # not complete yet
                    return None
        return None

    def reach(self, phase: Phase) -> None:
        """Return as soon as the loop is in `phase`, which must be long enough that a busy machine does not look past
        it (`LONG`)."""

        def there() -> bool:
            last = self.ring.latest()
            if last is not None and last.phase == phase:
                return True
            self._goes_on(f"was seen in {phase.name}")
            return False

        until(there)

    def goes_on(self, ticks: int) -> None:
        """Return once the loop has carried out so many more."""
        last = self.ring.latest()
        assert last is not None

        def later() -> bool:
            self._goes_on(f"had carried out {ticks} more ticks")
            now = self.ring.latest()
            return now is not None and now.tick >= last.tick + ticks

        until(later)

    def _goes_on(self, until_it: str) -> None:
        """What has ended comes nowhere any more: it is told at once, and not after a patience meant for busy
        machines."""
        if self.process.poll() is not None:
            raise AssertionError(f"the run ended before it {until_it}: {self.process.communicate()[1]}")

    def loop(self) -> psutil.Process:
        """The process that ticks, by its name."""
        return next(child for child in psutil.Process(self.process.pid).children() if child.name() == "pamrig-loop")

    def recorder(self) -> psutil.Process:
        """The process that has the unfinished file open."""

        def writes(child: psutil.Process) -> bool:
            return any(file.path.endswith(".partial") for file in child.open_files())

        return until(lambda: next((c for c in psutil.Process(self.process.pid).children() if writes(c)), None))

    def end(self) -> tuple[int, dict[str, Any], str]:
        """Exit status, result and stderr."""
        out, error = self.process.communicate(timeout=PATIENCE_S)
        assert "Traceback" not in error
        return self.process.returncode, json.loads(out) if out else {}, error

    @property
    def rest(self) -> tuple[float, float]:
        """The set-points that were written last."""
        last = self.ring.latest()
        assert last is not None
        return last.p1_cmd_mpa, last.p2_cmd_mpa


def reproach(outcome: RunOutcome) -> str:
    """The one line by which an outcome that is not good ends its command."""
    with pytest.raises(CheckFailed) as error:
        outcome.judge()
    assert "\n" not in str(error.value)
    return str(error.value)

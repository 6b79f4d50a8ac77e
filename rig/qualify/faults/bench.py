"""A daemon on a faulty simulated rig, in real processes, to which faults can be done: the floor under `pamrig faults`
and its tests.

Everything lies in a folder of its own. The terminals of the rig are in shared memory, so the time until the safe
set-points stand at the valves is measured where it counts.
"""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, Self, TypeVar

from hil.faults import Injection
from hil.terminals import Terminals
from rig.app import shipped
from rig.errors import RigError, StateError
from rig.realtime.shared import folder as shared_folder
from rig.service.client import Client
from rig.service.records import blackbox

T = TypeVar("T")
SAFE_MPA: Final = (0.15, 0.15)
"""Not P0, so that the safe state cannot be mistaken for a moment of the sweep."""
_COUNT_MPA: Final = 0.001
_TRIES: Final = 10
_PATIENCE_S: Final = 40.0
START_S: Final = 150.0
"""For a process to start and come to its work: on a machine that does other work too, imports alone take a minute."""
_LOOK_S: Final = 0.0005
_STAYS_S: Final = 0.05
"""So long the safe set-points must stand before they count, ten periods: a loop that is killed in the middle of a write
may bring its old ones after them."""
_RESET_S: Final = 0.05
"""Between two tries of a reset, which is refused as long as its cause is there."""

RIG: Final = """\
name: faulty
period_ms: 5
safe: {{p1_mpa: 0.15, p2_mpa: 0.15, return_mpa_s: 1.0}}
limits: {{misses_per_s: 20, follow_s: 0.3, frozen_s: 0.3}}
devices:
  main: {{kind: simulated_faulty, model: {model}, seed: 1, terminals: {terminals}}}
roles: {{valve_1: main, valve_2: main, monitor_1: main, monitor_2: main, angle: main}}
"""
SWEEP: Final = """\
settle_s: 0.1
zero_s: 0.05
ramp_in_s: 0.1
duration_s: 60.0
ramp_out_s: 0.1
records: [{sine: {frequency_hz: 0.5, amplitude_mpa: 0.2}}]
"""
CLOSED_LOOP_SWEEP: Final = """\
settle_s: 0.1
zero_s: 0.05
ramp_in_s: 0.5
duration_s: 60.0
ramp_out_s: 0.1
closed_loop: {kp_mpa_per_deg: 0.002, ki_mpa_per_deg_s: 0.1}
records: [{sine: {frequency_hz: 0.5, amplitude_deg: 25}}]
"""
"""The same in closed loop, by feedback alone."""


_NAMES: Final = ("loop", "recorder", "supervisor", "guardian")
BY_THE_MACHINE: Final = ("MISSED_TICKS", "LONG_STALL", "LOOP_DIED")
"""Faults that a machine which stands still causes by itself."""


class Spoilt(RigError):
    """Something else than the injected fault stopped the rig, such as a machine that stood still: try again."""


class FaultBench:
    """Use as a context manager. `ready` brings the rig into the middle of a sweep, from wherever it is."""

    struck: tuple[str, ...] = ("loop", "recorder", "supervisor", "control")
    """The processes of the rig that are killed and stopped in pairs and triples."""
    at_once: tuple[int, ...] = (2, 3)
    """How many of them, so that somebody is left who can write."""

    def __init__(
        self,
        folder: Path,
        rig: str = RIG,
        arguments: tuple[str, ...] = (),
        terminals: Path | None = None,
        *,
        web: bool = False,
        sweep: str = SWEEP,
    ) -> None:
        """`rig`: text of the rig's YAML; `arguments` go to `pamrig daemon`; `terminals`: where they are, if somebody
        made them; `web`: with the operator's page; `sweep`: what the rig is in the middle of."""
        self.folder, self._arguments, self._web = folder, arguments, web
        self.logs, self.state, self.socket = folder / "logs", folder / "state", folder / "s.sock"
        self._terminals_path = terminals or shared_folder() / f"terminals-{os.getpid()}-{time.monotonic_ns():x}"
        self.terminals = Terminals.at(self._terminals_path)
        model = shipped.configs() / "models" / "simulated.yaml"
        self.rig = folder / "rig.yaml"
        self.rig.write_text(rig.format(model=model, terminals=self._terminals_path), encoding="utf-8")
        self.sweep = folder / "long.yaml"
        self.sweep.write_text(sweep, encoding="utf-8")
        self._daemon: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()
        if self.state.is_dir():
            blackbox.remove(blackbox.Owner.of(self.state, ""))  # of a daemon that was killed last
        self._terminals_path.unlink(missing_ok=True)

    # the daemon's life

    def start(self) -> None:
        """Start the daemon anew and wait until it answers; one that is still there is ended first."""
        self.end()
        web = () if self._web else ("--web", "off")
        folders = "--logs", str(self.logs), "--state", str(self.state), "--socket", str(self.socket)
        self.command("daemon", "--rig", str(self.rig), *folders, *web, *self._arguments)
        self.wait(self._answers, "the daemon to start and answer", START_S)

    def command(self, *arguments: str, stdin: int = subprocess.DEVNULL) -> None:
        """Start `pamrig` with these arguments as the process that commands; what it says goes to the log."""
        with (self.folder / "daemon.log").open("ab") as log:
            command = [sys.executable, "-m", "rig.cli.main", *arguments]
            self._daemon = subprocess.Popen(command, stdout=log, stderr=log, stdin=stdin)

    def end(self) -> int | None:
        """End the daemon by SIGTERM; returns its exit status."""
        daemon, self._daemon = self._daemon, None
        if daemon is None:
            return None
        if daemon.stdin:
            daemon.stdin.close()
        daemon.send_signal(signal.SIGCONT)
        daemon.terminate()
        try:
            return daemon.wait(_PATIENCE_S)
        except subprocess.TimeoutExpired:
            daemon.kill()
            return daemon.wait()

    @property
    def daemon_pid(self) -> int:
        """Pid of the control process."""
        assert self._daemon is not None
        return self._daemon.pid

    @property
    def alive(self) -> bool:
        """The control process has not ended."""
        return self._daemon is not None and self._daemon.poll() is None

    def _answers(self) -> bool:
        if not self.alive:
            raise RigError(f"the daemon ended: {self.log_text()[-400:]}")
        with contextlib.suppress(RigError):
            status = self.status()
            return bool(status["loop"] or status["fault"])  # one that could not open its device waits for a reset
        return False

    def log_text(self) -> str:
        """What the daemon has written to its log so far."""
        return (self.folder / "daemon.log").read_text(encoding="utf-8", errors="replace")

    # talking to it

    def client(self) -> Client:
        """A new connection."""
        return Client(self.socket)

    def status(self) -> dict[str, Any]:
        """The daemon's status."""
        with self.client() as client:
            return client.status()

    def fault(self) -> str:
        """Name of the fault that stands, empty without one."""
        shown = self.status()["fault"]
        return str(shown["name"]) if shown else ""

    def pid(self, process: str) -> int:
        """Pid of one of its processes."""
        return int(self.status()["processes"][process]["pid"])

    def pids(self) -> dict[str, int]:
        """Pids of its processes by name, as the kernel has them."""
        return {"control": self.daemon_pid, **named_children(self.daemon_pid)}

    def revive(self) -> None:
        """Let a stopped control process go on; nothing where it is gone."""
        if self._daemon is not None and self.alive:
            self._daemon.send_signal(signal.SIGCONT)

    def said_of_safe(self, patience_s: float) -> str:
        """The status' words on a safe state that it calls safe, which is checked against the valves; RigError when it
        never does."""

        def confirmed() -> dict[str, Any] | None:
            shown = self.status()["safe_state"]
            if shown and shown["safe"] and not self.is_safe:
                raise RigError(
                    f"the status says {shown['words']!r}, but at the valves stands {self.terminals.setpoints}"
                )
            return dict(shown) if shown and shown["safe"] else None

        shown = self.wait(confirmed, "the status to say that the rig is safe", patience_s)
        return str(shown["words"]) if shown else ""

    def ready(self) -> None:
        """Into the middle of a sweep: start, reset, arm, start the sweep, as far as needed."""
        self.terminals.inject(Injection.NONE)
        self._there()
        for _ in range(_TRIES):
            try:
                self._into_the_sweep()
                return
            except Spoilt:
                continue  # the machine stood still on the way
        raise RigError(f"the rig does not come into its sweep: {self.log_text()[-400:]}")

    def at_rest(self) -> None:
        """Disarmed, with nothing in the queue and no fault, whatever stood before; with all its processes."""
        self._there()
        with self.client() as client:
            self.wait(lambda: self._is_disarmed(client) and self._finished(client), "the rig to be at rest")
            client.clear()

    def _there(self) -> None:
        """A control process that runs, whatever was done to the one before."""
        self.revive()
        if not self.alive:
            self.start()

    def _is_disarmed(self, client: Client) -> bool:
        """Or a step on the way there."""
        state = client.status()["state"]
        with contextlib.suppress(RigError):
            if state == "fault":
                client.reset()
            elif state != "disarmed":
                client.stop()
        return bool(state == "disarmed")

    def _into_the_sweep(self) -> None:
        with self.client() as client:
            status = client.status()
            if status["state"] == "fault":
                self._reset(client)
                status = client.status()
            if status["state"] == "disarmed":
                with contextlib.suppress(StateError):
                    client.arm()
            client.clear()
            if client.status()["state"] != "running":
                self.wait(lambda: self._finished(client), "the record before to be finished")
                try:
                    client.start(self.sweep)
                except RigError as error:
                    raise Spoilt(str(error)) from None
            self.wait(lambda: self._sweeping(client), "the sweep")

    def _finished(self, client: Client) -> bool:
        """Nothing of what was stopped is still being written: until then a start is refused, for it is not over."""
        return all(job["state"] != "running" for job in client.status()["queue"])

    def _reset(self, client: Client) -> None:
        deadline = time.monotonic() + _PATIENCE_S
        while True:
            try:
                client.reset()
                return
            except RigError:
                if time.monotonic() > deadline:
                    raise
                time.sleep(_RESET_S)

    def _sweeping(self, client: Client) -> bool:
        status = client.status()
        if status["fault"]:
            raise Spoilt(str(status["fault"]))
        return status["loop"]["phase"] == "sweep" and not self.is_safe

    @property
    def is_safe(self) -> bool:
        """The safe set-points stand at the valves, as exactly as a converter can put them there."""
        there = self.terminals.setpoints
        return all(abs(p - safe) < _COUNT_MPA for p, safe in zip(there, SAFE_MPA, strict=True))

    # measuring

    def wait(self, condition: Callable[[], T], what: str, patience_s: float = _PATIENCE_S) -> T:
        """Until `condition` is true; RigError when it does not become so."""
        deadline = time.monotonic() + patience_s
        while True:
            if value := condition():
                return value
            if time.monotonic() > deadline:
                raise RigError(f"waited {patience_s:g} s in vain for {what}")
            time.sleep(_LOOK_S if patience_s < 1 else 0.01)

    def ms_to_safe(self, since_ns: int, patience_s: float = 5.0) -> float:
        """Milliseconds from `since_ns` until the safe set-points stood at the terminals, where they must stay."""
        deadline = time.monotonic() + patience_s
        while not self.is_safe:
            if time.monotonic() > deadline:
                raise RigError(
                    f"the safe set-points did not reach the valves within {patience_s:g} s; there: "
                    f"{self.terminals.setpoints}"
                )
            time.sleep(_LOOK_S)
        reached_ns = self.terminals.changed_ns
        settled = time.monotonic() + _STAYS_S
        while time.monotonic() < settled:
            if not self.is_safe:
                return self.ms_to_safe(since_ns, patience_s)  # somebody wrote after it: that does not count
            time.sleep(_LOOK_S)
        if reached_ns < since_ns:
            raise Spoilt("the rig was in its safe state already")
        return (reached_ns - since_ns) / 1e6

    def inject(self, fault: Injection) -> int:
        """Switch a fault of the device on; returns when."""
        self.terminals.inject(fault)
        return self.terminals.fault_since_ns

    def send(self, process: str, number: int) -> int:
        """Send a signal to one of the processes (or `control`); returns when."""
        pid = self.daemon_pid if process == "control" else self.pid(process)
        now_ns = time.monotonic_ns()
        os.kill(pid, number)
        return now_ns


def named_children(pid: int) -> dict[str, int]:
    """Pids of the processes of a rig that a process has started, by name, as the kernel has them."""
    found: dict[str, int] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            name, _, rest = stat.read_text(encoding="utf-8", errors="replace").partition("(")[2].rpartition(")")
            if rest.split()[1] == str(pid):
                found |= {known: int(stat.parent.name) for known in _NAMES if name == f"pamrig-{known}"[:15]}
    return found

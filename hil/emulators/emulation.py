"""The owner's side of an emulated rig: start it in a process of its own, find its devices, break it, ask it, end it."""

import contextlib
import json
import os
import subprocess
import sys
from types import TracebackType
from typing import Any, Self

from hil.emulators.spec import RigSpec
from rig.config import unstructure
from rig.errors import DeviceError


class Emulation:
    """A running emulated rig; a context manager. `places` says where each valve and bus is found (a device file, or a
    TCP port)."""

    def __init__(self, spec: RigSpec) -> None:
        self.spec = spec
        self.places: dict[str, Any] = {}
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Self:
        path = os.pathsep.join(filter(None, sys.path))
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "hil.emulators.serving"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": path},
            start_new_session=True,
        )  # fmt: skip
        try:
            self.places = self._ask(unstructure(self.spec))
        except BaseException:
            self.end()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.end()

    @property
    def alive(self) -> bool:
        """Its process has not ended."""
        return self._process is not None and self._process.poll() is None

    def end(self) -> None:
        """Pull every plug and end the process. Idempotent."""
        process, self._process = self._process, None
        if process is None:
            return
        assert process.stdin
        assert process.stdout
        with contextlib.suppress(OSError):  # it is gone, and what it was asked last still waits to be written
            process.stdin.close()
        try:
            process.wait(5.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()

    def trouble(self, name: str, **values: Any) -> None:
        """Faults of a line or a bus, by the fields of its Trouble."""
        self._ask({"do": "trouble", "name": name, "values": values})

    def damage(self, name: str, unit: int = 1, **values: Any) -> None:
        """Faults of a module's wires, by the fields of its Damage."""
        self._ask({"do": "damage", "name": name, "unit": unit, "values": values})

    def power(self, name: str, on: bool) -> None:
        """Switch a serial regulator."""
        self._ask({"do": "power", "name": name, "on": on})

    def unplug(self, name: str) -> None:
        """Pull the plug of a valve's port or of a bus."""
        self._ask({"do": "unplug", "name": name})

    def plug(self, name: str) -> None:
        """Plug it in again, at the same place."""
        self._ask({"do": "plug", "name": name})

    def leave_at(self, p1_mpa: float, p2_mpa: float) -> None:
        """The set-points that somebody left behind, in every regulator and register."""
        self._ask({"do": "leave", "at_mpa": [p1_mpa, p2_mpa]})

    def state(self) -> dict[str, Any]:
        """Set-points that arrived, when they changed, what stands in the output registers, what the plant does."""
        state: dict[str, Any] = self._ask({"do": "state"})
        return state

    def _ask(self, question: Any) -> Any:
        process = self._process
        if process is None or process.stdin is None or process.stdout is None:
            raise DeviceError("the emulated rig is not running")
        process.stdin.write(json.dumps(question).encode() + b"\n")
        process.stdin.flush()
        line = process.stdout.readline()
        if not line:
            raise DeviceError(f"the emulated rig ended with status {process.wait()}")
        answer = json.loads(line)
        if isinstance(answer, dict) and "error" in answer:
            raise DeviceError(f"emulated rig: {answer['error']}")
        return answer

"""Fault benches whose rigs hang on wires: the real drivers, their hardware emulated in a process of its own, and
terminals where its outputs end.

`python -m rig.qualify.faults.wired TERMINALS DEVICES` is that process: DEVICES is JSON, name -> kind, settings and
roles; it prints, as JSON, what must stand in each device's settings to be found, and serves until its input ends.
"""

import contextlib
import json
import os
import select
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from hil.terminals import Terminals
from rig.app import shipped
from rig.config import read_yaml
from rig.errors import RigError
from rig.qualify.faults.bench import SAFE_MPA, FaultBench

_SERIAL_BAUD: Final = 9600
_RTU_BAUD: Final = 115_200
_PLACES: Final = ("host", "port", "serial", "valve_1", "valve_2", "bitfile")
"""Of what an emulator says: where it is found. The driver is to work as it would in the lab."""
_POLL_S: Final = 0.0005
"""How often an emulated FPGA looks at what others have written to its registers."""
_HEAD: Final[dict[str, Any]] = {
    "name": "faulty, wired",
    "period_ms": 5,
    "safe": {"p1_mpa": SAFE_MPA[0], "p2_mpa": SAFE_MPA[1], "return_mpa_s": 1.0},
}


class WiredFaultBench(FaultBench):
    """A fault bench whose rig's devices are those of a lab's YAML, on emulated hardware."""

    def __init__(
        self, folder: Path, lab: Mapping[str, Any], settings: Mapping[str, Mapping[str, Any]], limits: Mapping[str, Any]
    ) -> None:
        """`lab`: a rig's YAML; `settings`: device -> settings that replace the lab's."""
        devices = {name: _found(device) | dict(settings.get(name, {})) for name, device in lab["devices"].items()}
        terminals = folder / "terminals"
        Terminals.at(terminals)
        self._hardware = _serve(terminals, devices, lab["roles"])
        found = self._found_at()
        rig = _HEAD | {
            "limits": dict(limits),
            "devices": {name: device | found[name] for name, device in devices.items()},
            "roles": lab["roles"],
        }
        (folder / "daemon.yaml").write_text("force: true\n", encoding="utf-8")
        text = json.dumps(rig).replace("{", "{{").replace("}", "}}")  # which is YAML, for a format string
        super().__init__(folder, text, ("--config", str(folder / "daemon.yaml")), terminals)

    def _found_at(self) -> dict[str, dict[str, Any]]:
        assert self._hardware.stdout
        line = self._hardware.stdout.readline()
        if not line:
            raise RigError("the emulated hardware did not start")
        found: dict[str, dict[str, Any]] = json.loads(line)
        return found

    def __exit__(self, *_: object) -> None:
        super().__exit__()
        for pipe in (self._hardware.stdin, self._hardware.stdout):
            if pipe:
                pipe.close()
        self._hardware.wait(10)

    def pids(self) -> dict[str, int]:
        """The processes of the rig, and those that hold its slow wires: io process 1, io process 2."""
        pids = super().pids()
        return pids | {f"io process {n}": pid for n, pid in enumerate(io_processes_of(pids.get("loop", 0)), 1)}


class ModbusFaultBench(WiredFaultBench):
    """Over Modbus TCP: both valves, both monitors and the angle on one module."""

    def __init__(self, folder: Path, watchdog_s: float = 0.5) -> None:
        """With a `watchdog_s` beyond the bound the daemon is forced: then it is software alone that makes safe."""
        super().__init__(folder, _lab("all_modbus"), {"wago": {"watchdog_s": watchdog_s}}, {"misses_per_s": 1000})


class RtuFaultBench(WiredFaultBench):
    """The same module on a serial line, which an I/O process holds. Its own watchdog is of no help."""

    struck = (*FaultBench.struck, "io process 1")

    def __init__(self, folder: Path) -> None:
        line = {"device": "rtu", "baud": _RTU_BAUD, "parity": "N"}
        settings = {"serial": line, "host": "", "watchdog_s": 60.0, "patience_s": 0.1}
        super().__init__(folder, _lab("all_modbus"), {"wago": settings}, {"misses_per_s": 1000, "max_age_s": 0.5})


class SerialFaultBench(WiredFaultBench):
    """A regulator on each of two serial lines, each held by an I/O process; the angle over Modbus TCP."""

    struck = (*FaultBench.struck, "io process 1", "io process 2")

    def __init__(self, folder: Path) -> None:
        ports = {f"valve_{n}": {"device": f"valve_{n}", "baud": _SERIAL_BAUD} for n in (1, 2)}
        angle = {"mode": "separate"}  # by itself it would give a slow machine's module an I/O process as well
        super().__init__(
            folder,
            _lab("serial_modbus"),
            {"valves": ports, "potentiometer": angle},
            {"misses_per_s": 1000, "max_age_s": 0.5, "follow_s": 2.0},
        )


class MixedFaultBench(WiredFaultBench):
    """Valve 1 on a serial line, which an I/O process holds, the rest on a Modbus TCP module whose own watchdog is of no
    help."""

    struck = (*FaultBench.struck, "io process 1")

    def __init__(self, folder: Path) -> None:
        lab = _lab("all_modbus")
        valve = {"kind": "itv_serial", "valve_1": {"device": "valve_1", "baud": _SERIAL_BAUD}}
        lab["devices"]["valve"] = valve
        lab["roles"] |= {"valve_1": "valve", "monitor_1": "valve"}
        module = {"watchdog_s": 60.0, "valve_1": None, "monitor_1": None, "mode": "separate"}
        limits = {"misses_per_s": 1000, "max_age_s": 0.5, "follow_s": 2.0}
        super().__init__(folder, lab, {"wago": module}, limits)


class MyRioFaultBench(WiredFaultBench):
    """The paper's rig on a myRIO whose FPGA has no watchdog: it is software alone that makes safe."""

    def __init__(self, folder: Path) -> None:
        resource = f"RIO{os.getpid()}"  # one process of the machine drives a RIO: benches beside this have their own
        super().__init__(folder, _lab("paper_myrio"), {"myrio": {"resource": resource}}, {"misses_per_s": 1000})

    def _found_at(self) -> dict[str, dict[str, Any]]:
        from hil.emulators.nifpga.library import load

        found = super()._found_at()
        load().serve(Path(found["myrio"]["bitfile"]).parent)
        return found


def _lab(name: str) -> dict[str, Any]:
    """One of pamrig's own rigs, as its YAML has it."""
    raw: dict[str, Any] = read_yaml(shipped.configs() / "rigs" / f"{name}.yaml")  # type: ignore[assignment]
    return raw


def _found(device: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of a lab's device, its register map as this process finds it."""
    maps = {"map": str((shipped.configs() / "rigs" / device["map"]).resolve())} if "map" in device else {}
    return dict(device) | maps


def _serve(terminals: Path, devices: Mapping[str, Any], roles: Mapping[str, str]) -> "subprocess.Popen[str]":
    hardware = {
        name: {"settings": settings, "roles": [role for role, at in roles.items() if at == name]}
        for name, settings in devices.items()
    }
    command = [sys.executable, "-m", "rig.qualify.faults.wired", str(terminals), json.dumps(hardware)]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def io_processes_of(pid: int) -> list[int]:
    """The children of a loop that hold its wires, in the order in which they were started."""
    with contextlib.suppress(OSError):
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()
        return [int(child) for child in children if _is_io_process(child)]
    return []


def _is_io_process(pid: str) -> bool:
    with contextlib.suppress(OSError):
        return b"drivers.io_process" in Path(f"/proc/{pid}/cmdline").read_bytes()
    return False


def _place(settings: Mapping[str, Any]) -> dict[str, Any]:
    return {key: settings[key] for key in _PLACES if key in settings}


def serve(terminals_path: Path, devices: Mapping[str, Any]) -> None:
    """The emulated hardware with the simulated plant behind it; every change of its outputs is put on the terminals."""
    from hil.emulators.catalog import emulate
    from hil.emulators.world import World
    from rig.interfaces import Role
    from rig.model.chain import Chain
    from rig.model.parameters import load_model
    from rig.realtime.clock import MonotonicClock

    terminals = Terminals.at(terminals_path)

    class Wired(World):
        """A world whose set-points can be seen from outside."""

        def command(self, valve: int, pressure_mpa: float) -> None:
            super().command(valve, pressure_mpa)
            terminals.write(*self.commands)

    chain = Chain(load_model(shipped.configs() / "models" / "simulated.yaml"))
    chain.reset(*SAFE_MPA)
    world = Wired(chain, MonotonicClock(), commands=SAFE_MPA)
    terminals.write(*SAFE_MPA)
    with tempfile.TemporaryDirectory() as folder:
        running = {
            name: emulate(
                device["settings"]["kind"],
                device["settings"],
                frozenset(map(Role, device["roles"])),
                world,
                Path(folder),
            )
            for name, device in devices.items()
        }
        print(json.dumps({name: _place(emulator.settings) for name, emulator in running.items()}), flush=True)
        polls = [board.poll for emulator in running.values() if (board := getattr(emulator, "board", None))]
        while not select.select([sys.stdin], [], [], _POLL_S if polls else None)[0]:
            for poll in polls:
                poll()
        for emulator in running.values():
            emulator.close()


if __name__ == "__main__":
    serve(Path(sys.argv[1]), json.loads(sys.argv[2]))

"""The fault bench over Modbus TCP: the real driver, a module emulated in a process of its own, and terminals where its
outputs end.

`python -m rig.qualify.faults.modbus TERMINALS` is that process: it prints its port and serves until its input ends.
"""

import subprocess
import sys
from pathlib import Path
from typing import Final

from hil.terminals import Terminals
from rig.app import compose
from rig.errors import RigError
from rig.qualify.faults.bench import FaultBench

_RIG: Final = """\
name: faulty Modbus
period_ms: 5
safe: {{p1_mpa: 0.15, p2_mpa: 0.15, return_mpa_s: 1.0}}
limits: {{misses_per_s: 1000}}
devices:
  module:
    kind: modbus_io
    map: MAP
    watchdog_s: WATCHDOG
    host: 127.0.0.1
    port: PORT
    valve_1: {{channel: 0, signal: 0-10 V, low_mpa: 0.0, high_mpa: 0.5}}
    valve_2: {{channel: 1, signal: 0-10 V, low_mpa: 0.0, high_mpa: 0.5}}
    monitor_1: {{channel: 0, signal: 1-5 V, low_mpa: 0.0, high_mpa: 0.5}}
    monitor_2: {{channel: 1, signal: 1-5 V, low_mpa: 0.0, high_mpa: 0.5}}
    angle: {{wiper: 2, excitation: 3}}
roles: {{valve_1: module, valve_2: module, monitor_1: module, monitor_2: module, angle: module}}
"""


class ModbusFaultBench(FaultBench):
    """A fault bench whose rig hangs on an emulated Modbus module."""

    def __init__(self, folder: Path, watchdog_s: float = 0.5) -> None:
        """With a `watchdog_s` beyond the bound the daemon is forced: then it is software alone that makes safe."""
        terminals = folder / "terminals"
        Terminals.at(terminals)
        command = [sys.executable, "-m", "rig.qualify.faults.modbus", str(terminals)]
        self._module = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert self._module.stdout
        port = self._module.stdout.readline().strip()
        if not port.isdigit():
            raise RigError("the emulated Modbus module did not start")
        settings = folder / "daemon.yaml"
        settings.write_text("force: true\n", encoding="utf-8")
        rig = _RIG.replace("PORT", port).replace("MAP", str(_map())).replace("WATCHDOG", f"{watchdog_s:g}")
        super().__init__(folder, rig, ("--config", str(settings)), terminals)

    def __exit__(self, *_: object) -> None:
        super().__exit__()
        for pipe in (self._module.stdin, self._module.stdout):
            if pipe:
                pipe.close()
        self._module.wait(10)


def _map() -> Path:
    return compose.configs() / "modbus" / "wago_750.yaml"


def serve(terminals_path: Path) -> None:
    """The emulated module with the simulated plant behind it; every change of its outputs is put on the terminals."""
    import tempfile

    from hil.emulators.modbus.stand_in import emulate
    from hil.emulators.world import World
    from rig.config import read_yaml
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

    rig = read_yaml(compose.configs() / "rigs" / "all_modbus.yaml")
    assert isinstance(rig, dict)
    settings = dict(rig["devices"]["wago"]) | {"map": str(_map())}
    chain = Chain(load_model(compose.configs() / "models" / "simulated.yaml"))
    chain.reset(0.15, 0.15)
    with tempfile.TemporaryDirectory() as folder:
        module = emulate(settings, frozenset(Role), Wired(chain, MonotonicClock(), commands=(0.15, 0.15)), Path(folder))
        print(module.settings["port"], flush=True)
        sys.stdin.read()
        module.close()


if __name__ == "__main__":
    serve(Path(sys.argv[1]))

"""A whole emulated myRIO for a device's settings: library, bitfile, registers and wiring in one."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hil.emulators.nifpga.bitfile import Register, guarded_personality, personality, write_bitfile
from hil.emulators.nifpga.board import Board, BoardWiring, Line
from hil.emulators.nifpga.library import load
from hil.emulators.nifpga.shared import RegisterFile
from hil.emulators.world import World
from rig.interfaces import Role

_VOLTS = {
    "0-5 V": (0.0, 5.0),
    "0-10 V": (0.0, 10.0),
    "1-5 V": (1.0, 5.0),
    "4-20 mA": (4.0, 20.0),
    "0-20 mA": (0.0, 20.0),
}


class StandIn:
    """One emulated myRIO; see hil.emulators.catalog.Emulator."""

    virtual = True

    def __init__(
        self, world: World, folder: Path, resource: str, wiring: BoardWiring, registers: Sequence[Register]
    ) -> None:
        self.registers = RegisterFile(folder, resource, registers)
        self.board = Board(self.registers, world, wiring)
        self.board.leave_outputs_at(*world.commands)
        bitfile = write_bitfile(folder / f"{self.registers.key}.lvbitx", registers)
        self.settings: Mapping[str, Any] = {"bitfile": str(bitfile)}
        self._library = load()
        self._library.serve(folder)
        self._library.set_hook(self.registers.key, self.board.hook)

    def close(self) -> None:
        """The library stays loaded, the plant is let go."""
        self._library.set_hook(self.registers.key, None)


def emulate(settings: Mapping[str, Any], roles: frozenset[Role], world: World, folder: Path) -> StandIn:
    """Registers by the names in the settings; a bitfile with watchdog and limits when the settings name them."""
    lines = {name: _line(settings.get(name), default) for name, default in _defaults().items()}
    angle = settings.get("angle", {})
    wiring = BoardWiring(
        valves=(lines["valve_1"], lines["valve_2"]),
        monitors=(lines["monitor_1"], lines["monitor_2"]),
        wiper=angle.get("wiper", BoardWiring.wiper),
        excitation=angle.get("excitation") or ("" if angle else BoardWiring.excitation),
        excitation_v=angle.get("reference_v", BoardWiring.excitation_v),
    )
    guarded = any("limit_min" in (settings.get(role.value) or {}) for role in roles) or settings.get("heartbeat")
    registers = guarded_personality() if guarded else personality()
    return StandIn(world, folder, settings.get("resource", "RIO0"), wiring, registers)


def _defaults() -> dict[str, Line]:
    paper = BoardWiring()
    names = ("valve_1", "valve_2", "monitor_1", "monitor_2")
    return dict(zip(names, (*paper.valves, *paper.monitors), strict=True))


def _line(setting: Mapping[str, Any] | None, default: Line) -> Line:
    if not setting:
        return default
    low, high = _VOLTS[setting["signal"]]
    per_volt = setting.get("units_per_volt", 1.0)
    span = setting.get("low_mpa", 0.0), setting.get("high_mpa", 0.5)
    return Line(setting["register"], low / per_volt, high / per_volt, *span)

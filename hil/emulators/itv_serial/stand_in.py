"""Regulators on ptys in place of the serial valves of a rig's YAML: same baud rate, same dialect, one shared plant
behind."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hil.emulators.itv_serial.line import EmulatedSerialLine
from hil.emulators.itv_serial.regulator import Regulator, RegulatorDialect
from hil.emulators.world import World
from rig.errors import ConfigError
from rig.interfaces import Role

_VALVES = {1: ("valve_1", {Role.VALVE_1, Role.MONITOR_1}), 2: ("valve_2", {Role.VALVE_2, Role.MONITOR_2})}


class SerialValves:
    """The running regulators of one device."""

    virtual = False
    """A pty, and the I/O process at its other end, live in real time."""

    def __init__(self, settings: Mapping[str, Any], roles: frozenset[Role], world: World, folder: Path) -> None:
        dialect = dialect_of(settings.get("dialect") or {})
        self.lines: dict[str, EmulatedSerialLine] = {}
        self.settings: dict[str, Any] = {}
        for number, (name, served) in _VALVES.items():
            port = settings.get(name)
            if port and served & roles:
                self.lines[name] = line = _line(number, port, dialect, world, folder)
                line.plug()
                self.settings[name] = {**port, "device": str(line.device), "parity": "N"}  # a pty has no parity bit

    def close(self) -> None:
        """Take the ports away."""
        for line in self.lines.values():
            line.unplug()


def _line(
    number: int, port: Mapping[str, Any], dialect: RegulatorDialect, world: World, folder: Path
) -> EmulatedSerialLine:
    regulator = Regulator(
        dialect, lambda pressure_mpa: world.command(number, pressure_mpa), lambda: world.outputs()[number - 1]
    )
    regulator.start_from(world.commands[number - 1])
    bits = 1 + int(port.get("data_bits", 8)) + int(port.get("stop_bits", 1))
    return EmulatedSerialLine(regulator, folder / f"valve_{number}", int(port.get("baud", 9600)), bits, seed=number)


def dialect_of(settings: Mapping[str, Any]) -> RegulatorDialect:
    """What a regulator must speak to be understood in this dialect; ConfigError for replies that cannot be told from
    their pattern."""
    known = RegulatorDialect()
    word, separator = known.set_word, known.separator
    if "set_command" in settings:
        head = str(settings["set_command"]).split("{count}")[0]
        word = head.rstrip(" =:,")
        separator = head[len(word) :]
    scale = {
        key: settings[key] for key in ("full_scale_counts", "full_scale_mpa", "echo", "terminator") if key in settings
    }
    return RegulatorDialect(
        set_word=word,
        separator=separator,
        monitor_word=str(settings.get("monitor_command", known.monitor_word)),
        set_answer=_answer(settings.get("set_reply"), known.set_answer),
        monitor_answer=_answer(settings.get("monitor_reply"), known.monitor_answer),
        **scale,
    )


def _answer(pattern: str | None, known: str) -> str:
    if pattern is None:
        return known
    text = re.sub(r"\(\?P<count>[^)]*\)", "{count}", pattern).replace("\\", "")
    if re.search(r"[*+?()\[\]|]", text):
        raise ConfigError(
            f"dialect: no emulator can be derived from the reply {pattern!r}; use plain text around (?P<count>...)"
        )
    return text


def emulate(settings: Mapping[str, Any], roles: frozenset[Role], world: World, folder: Path) -> SerialValves:
    """For hil.emulators.catalog."""
    return SerialValves(settings, roles, world, folder)

"""What is left when every process of pamrig, or the computer, is lost at once: the device's own watchdog, and how long
it takes."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from rig.interfaces import Role
from rig.rig_config import RigConfig

FACT: Final = "watchdog_s"
"""What a device that has a watchdog says of it when it is opened: seconds, or `unknown`."""
_VALVES: Final = frozenset({Role.VALVE_1, Role.VALVE_2})


@dataclass(frozen=True)
class LastResort:
    """Of one rig, as its devices were opened."""

    problems: tuple[str, ...]
    """Watchdogs that take longer than the rig's config allows: nothing goes without the operator's word."""
    lines: tuple[str, ...]
    """What the operator must know."""


def last_resort(rig: RigConfig, facts: Mapping[str, str]) -> LastResort:
    """By what the devices said of themselves; one with a valve that says nothing has no watchdog."""
    problems, lines = [], []
    for number, entry in enumerate(rig.devices, 1):
        if not entry.roles & _VALVES:
            continue
        value = facts.get(FACT if len(rig.devices) == 1 else f"{number}.{FACT}", "")
        try:
            takes_s = float(value)
        except ValueError:
            lines.append(_without(entry.name, value, rig))
            continue
        if takes_s > rig.safe.watchdog_s:
            problems.append(
                f"{entry.name}: its watchdog takes {takes_s:g} s, longer than the rig's safe.watchdog_s, "
                f"{rig.safe.watchdog_s:g} s: "
                "for so long old set-points may stand when every process is lost at once"
            )
    return LastResort(tuple(problems), tuple(lines))


def _without(name: str, value: str, rig: RigConfig) -> str:
    watchdog = "a watchdog whose time is not known (watchdog_s of the device)" if value else "no watchdog of its own"
    return (
        f"{name}: {watchdog}: when every process of pamrig, or this computer, is lost at once, the valves keep their "
        "last "
        f"set-points, up to {rig.limits.pressure_mpa[1]:g} MPa each; keep the dump valve within reach"
    )

"""What a rig consists of, read from its config alone, and the question before anything moves."""

import datetime
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import click
from rich.table import Table

from drivers.calibration import Calibration, Potentiometer, Taken, complaint, parse_all
from drivers.catalog import kinds, summary_of
from drivers.fitting import summary
from rig.app import compose
from rig.app.terminal import listing
from rig.errors import RigError
from rig.interfaces import Role
from rig.rig_config import RigConfig


def calibrations(rig: RigConfig) -> dict[Role, Calibration | Potentiometer]:
    """The rig's calibrations by role; ConfigError when one cannot be read."""
    return parse_all(rig.calibration, f"{rig.path}: calibration") if rig.calibration else {}


def warnings(rig: RigConfig, today: datetime.date | None = None) -> list[str]:
    """A line for every role of real hardware whose calibration is old; one for all that were never calibrated."""
    found = calibrations(rig)
    today = today or datetime.datetime.now().astimezone().date()
    real = [role for entry in rig.devices if entry.kind not in compose.STAND_INS for role in sorted(entry.roles)]
    taken = {role.value: found[role].taken if role in found else Taken() for role in real}
    never = [role for role, one in taken.items() if one.age_days(today) is None]
    lines = [complaint(", ".join(never), Taken(), today)] if never else []
    lines += [complaint(role, one, today) for role, one in taken.items() if role not in never]
    return [line for line in lines if line]


def inventory(rig: RigConfig) -> dict[str, Any]:
    """Devices, roles and calibrations, for JSON and for `table`; ConfigError where they are wired to what is not
    there."""
    compose.check_wiring(rig)
    rows = [
        {
            "name": entry.name,
            "kind": entry.kind,
            "what": summary_of(compose.device_class(entry.kind, str(rig.path))),
            "roles": [role.value for role in Role if role in entry.roles],
            "settings": dict(_flat(entry.settings)),
        }
        for entry in rig.devices
    ]
    return {
        "rig": rig.name,
        "file": str(rig.path),
        "period_ms": rig.period_ns / 1e6,
        "devices": rows,
        "calibration": summary(calibrations(rig)),
        "kinds": sorted([*kinds(), *compose.STAND_INS]),
        "warnings": [*warnings(rig), *_absent(rig)],
    }


def _absent(rig: RigConfig) -> Iterator[str]:
    """A line for every file that a device looks for when it is opened, and that is not on this machine: the rig may
    live on another."""
    for entry in rig.devices:
        _, settings = compose.device_settings(entry, rig, {})
        for name, place in vars(settings).items():
            if isinstance(place, Path) and name in entry.settings and not os.path.exists(place):
                written = entry.settings[name]
                yield f"devices.{entry.name}.{name}: {written}: no such file yet; looked for at {place.resolve()}"


def _flat(settings: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Settings inside settings by dotted names: `valve_1.device`."""
    for key, value in settings.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", value


def table(found: dict[str, Any]) -> Table:
    """For a person."""
    shown = listing("device", "kind", "roles", "settings", title=f"{found['rig']}, {found['period_ms']:g} ms")
    for row in found["devices"]:
        settings = "\n".join(f"{key} {value}" for key, value in row["settings"].items())
        shown.add_row(row["name"], row["kind"], "\n".join(row["roles"]), settings)
    for role, one in found["calibration"].items():
        spread = "" if one["uncertainty"] is None else f", uncertainty {one['uncertainty']:.3g} {one['unit']}"
        shown.add_row(
            "", "calibration", role, f"{one['date'] or 'no date'}, {one['form']}, {one['points']} points{spread}"
        )
    return shown


def ask_to_move(rig: RigConfig, what: str) -> None:
    """The question before a command moves something; no answer, or no terminal, is a no."""
    moved = "The simulated rig" if compose.is_simulated(rig) else "THE RIG MOVES: it"
    try:
        sure = click.confirm(f"{moved} {what}. Is everybody clear, and the dump valve within reach?", default=False)
    except click.Abort:
        sure = False
    if not sure:
        raise RigError("nothing was moved; answer y, or give --yes")

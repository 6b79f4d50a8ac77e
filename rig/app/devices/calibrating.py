"""Calibrating a rig: points from a file or asked for on the terminal, fitted, and written to a calibration file."""

import contextlib
import dataclasses
import datetime
import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
from rich.table import Table

from drivers.calibration import Calibration, Potentiometer, parse_all
from drivers.fitting import Form, Measured, calibrate, summary
from rig.app import compose, wire_locks
from rig.app.devices.bringup import DeviceTicker, mean
from rig.app.supervised_command import SupervisedCommand, check_last_resort, supervised
from rig.app.terminal import answer_to, listing
from rig.config import read_yaml, structure, unstructure
from rig.errors import ConfigError, RigError, beside
from rig.interfaces import Device, Role
from rig.outputs import OutputKind, write_text
from rig.realtime.clock import MonotonicClock
from rig.rig_config import RigConfig

COLLECT_S = 0.5
"""Samples over this time make one point, s: their mean stands beside what the person reads off. More: a longer wait,
less noise."""
Typed = dict[Role, list[tuple[float, float]]]
"""Points that somebody has typed in so far: raw reading and reference of each."""


@dataclass(frozen=True)
class CalibrationOptions:
    """What the command was asked for, beside the points."""

    form: str
    reference_uncertainty: float
    serial_numbers: dict[str, str]
    settle_s: float
    reference_v: float | None = None
    force: bool = False
    """Go although the watchdog of a device takes too long."""


def parse_serials(pairs: Sequence[str]) -> dict[str, str]:
    """PART=NUMBER pairs of the command line."""
    numbers = {}
    for pair in pairs:
        part, _, number = pair.partition("=")
        if not part or not number:
            raise RigError(f"--serial {pair}: expected PART=NUMBER, for example gauge=A1234")
        numbers[part] = number
    return numbers


def parse_levels(text: str, rig: RigConfig) -> list[float]:
    """The pressures to visit, inside the rig's envelope."""
    low, high = rig.limits.pressure_mpa
    try:
        levels = [float(item) for item in text.split(",")]
    except ValueError:
        raise RigError(f"--levels {text}: expected pressures in MPa, with commas between them") from None
    for level in levels:
        if not low <= level <= high:
            raise RigError(
                f"--levels: {level:g} MPa is outside {low:g} .. {high:g} MPa, limits.pressure_mpa of {rig.path}"
            )
    if len(set(levels)) < 2:
        raise RigError("--levels: at least 2 different pressures are needed")
    return levels


def read_points(path: Path) -> dict[Role, Measured]:
    """A file of points: role -> points, form, reference, serial numbers."""
    raw = read_yaml(path)
    if not isinstance(raw, Mapping) or not raw:
        raise ConfigError(f"{path}: expected a mapping with some of the keys {', '.join(Role)}")
    for key in raw:
        if key not in list(Role):
            raise ConfigError(f"{path}: unknown role {key!r}; allowed: {', '.join(Role)}")
    return {Role(key): structure(item, Measured, f"{path}: {key}") for key, item in raw.items()}


def guided_angle(rig: RigConfig, options: CalibrationOptions, typed: Typed) -> None:
    """Ask for joint angles set by hand and measure the potentiometer at each, into `typed`. Nothing is written to the
    rig."""
    points = typed.setdefault(Role.ANGLE, [])
    click.echo(
        "Air off and vented. Turn the joint to an angle of the protractor, type the angle in degrees; an empty line "
        "ends."
    )
    device = compose.make_device(rig, MonotonicClock())
    with wire_locks.held(compose.held_wires(rig)), _ticker(device, rig) as ticker:
        while (angle_deg := _ask(f"angle {len(points) + 1} [deg]")) is not None:
            found = ticker.collect(COLLECT_S)
            wiper, noise = mean(found, "angle_raw")
            excitation = mean(found, "excitation_raw")[0]
            reference = options.reference_v if math.isnan(excitation) else excitation
            if reference is None:
                raise RigError("this rig does not read the excitation of its potentiometer: give --reference-v")
            if reference <= 0.0 or Potentiometer().is_dead(wiper / reference):
                click.echo(
                    f"  not taken: wiper {wiper:.3f}, excitation {reference:.3f}: open, without excitation, or in "
                    "the dead zone"
                )
                continue
            points.append((wiper / reference, angle_deg))
            click.echo(f"  ratio {wiper / reference:.5f}, noise {noise / reference:.5f}")


def guided_pressures(rig: RigConfig, levels: Sequence[float], options: CalibrationOptions, typed: Typed) -> None:
    """Visit `levels` with both muscles, ask for the gauges, and so calibrate regulators and monitors together; the
    points go into `typed`."""
    nominal = dataclasses.replace(rig, calibration={})
    device = compose.make_device(nominal, MonotonicClock())
    with wire_locks.held(compose.held_wires(rig)), _ticker(device, rig, supervised(nominal)) as ticker:
        check_last_resort(rig, ticker.facts, options.force)
        for level in levels:
            ticker.go_to(level, level, settle_s=options.settle_s)
            found = ticker.collect(COLLECT_S)
            for valve, monitor, raw in (
                (Role.VALVE_1, Role.MONITOR_1, "p1_raw"),
                (Role.VALVE_2, Role.MONITOR_2, "p2_raw"),
            ):
                gauge_mpa = _ask(f"set {level:g} MPa; gauge of {valve.value} [MPa]")
                if gauge_mpa is None:
                    continue
                typed.setdefault(valve, []).append((level, gauge_mpa))
                reading = mean(found, raw)[0]
                if math.isfinite(reading):
                    typed.setdefault(monitor, []).append((reading, gauge_mpa))


def measured(typed: Typed, options: CalibrationOptions) -> dict[Role, Measured]:
    """What was typed in, with what the command was asked for."""
    form, uncertainty, serials = Form(options.form), options.reference_uncertainty, options.serial_numbers
    return {role: Measured(points, form, "", uncertainty, serials) for role, points in typed.items()}


@contextlib.contextmanager
def not_lost(out: Path, typed: Typed, options: CalibrationOptions) -> Iterator[None]:
    """Points that somebody has typed in outlive whatever ends the calibration of `out`: a fit that is refused, a device
    that is lost at the last level, a full disk, Ctrl-C. They lie in a file for `--points` or, where the disk takes
    none, stand on the terminal."""
    try:
        yield
    except RigError as error:
        kept = _kept_points(out, typed, options)
        raise beside(error, kept) if kept else error from None
    except (click.Abort, KeyboardInterrupt):
        kept = _kept_points(out, typed, options) or "nothing was written"
        click.echo(f"\ncalibration given up: {kept}", err=True)
        raise


def _kept_points(out: Path, typed: Typed, options: CalibrationOptions) -> str:
    """Where they are now; empty without any."""
    found = {role: points for role, points in typed.items() if points}
    if not found:
        return ""
    try:
        return f"the points are kept in {keep_points(out, measured(found, options))}"
    except RigError as error:
        click.echo(_as_yaml(measured(found, options)), err=True)
        return f"the points stand above, for a file for --points: {error}"


def kept_in(out: Path) -> dict[Role, Calibration | Potentiometer]:
    """What the calibration file holds already; looked at before anybody spends an hour on new points."""
    if not out.parent.is_dir():
        raise RigError(f"{out}: there is no folder {out.parent}")
    return parse_all(read_yaml(out), str(out)) if out.exists() else {}


def keep_points(out: Path, measured: Mapping[Role, Measured]) -> Path:
    """Points that were typed in and made no calibration, as a file for `--points`."""
    path = next(place for n in itertools.count(1) if not (place := _points_place(out, n)).exists())
    write_text(path, _as_yaml(measured), OutputKind.CALIBRATION)
    return path


def _as_yaml(measured: Mapping[Role, Measured]) -> str:
    import yaml

    return yaml.safe_dump({role.value: unstructure(m) for role, m in measured.items()}, sort_keys=False)


def _points_place(out: Path, number: int) -> Path:
    """Points of an earlier day stay."""
    return out.with_name(f"{out.stem}.points{'' if number == 1 else f'_{number}'}.yaml")


def write(out: Path, measured: Mapping[Role, Measured], where: str, rig: RigConfig | None = None) -> dict[str, Any]:
    """Fit, merge into the calibration file `out`, and say what came of it. Nothing is written when a fit fails, or when
    the devices of the `rig` it is for, where that is known, refuse it."""
    import yaml

    today = datetime.datetime.now().astimezone().date().isoformat()
    fresh = {role: calibrate(role, points, today, where) for role, points in measured.items()}
    if rig is not None:
        asked = {role.value: one for role, one in fresh.items()}
        compose.make_device(dataclasses.replace(rig, calibration=asked), MonotonicClock())
    kept = kept_in(out)
    merged = {role: (kept | fresh)[role] for role in Role if role in kept | fresh}
    text = yaml.safe_dump(
        {role.value: unstructure(c) for role, c in merged.items()}, sort_keys=False, default_flow_style=None, width=120
    )
    head = "# By `pamrig devices calibrate`; name it under `calibration:` in the rig's YAML.\n"
    write_text(out, head + text, OutputKind.CALIBRATION)
    return {"file": str(out), "calibrated": summary(fresh), "kept": [role.value for role in kept if role not in fresh]}


def table(result: Mapping[str, Any]) -> Table:
    """For a person."""
    title = f"written to {result['file']}"
    shown = listing("channel", "form", "points", "residual", "uncertainty (k = 1)", "furthest point", title=title)
    for role, one in result["calibrated"].items():
        numbers = (
            "too few points" if v is None else f"{v:.3g} {one['unit']}" for v in (one["residual"], one["uncertainty"])
        )
        furthest = f"{one['furthest_point']}: {one['furthest_distance']:.3g} {one['unit']}"
        shown.add_row(role, one["form"], str(one["points"]), *numbers, furthest)
    return shown


def _ticker(device: Device, rig: RigConfig, above: SupervisedCommand | None = None) -> DeviceTicker:
    return DeviceTicker(device, rig.period_ns, (rig.safe.p1_mpa, rig.safe.p2_mpa), above)


def _ask(question: str) -> float | None:
    """A number, asked for until it is one; None for an empty line."""
    while True:
        text = answer_to(question).strip()
        if not text:
            return None
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if math.isfinite(value):
            return value
        click.echo(f"  {text!r} is not a number")

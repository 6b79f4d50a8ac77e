"""Calibrations: what a raw reading means and what a set-point must be written as. Pure Python, used by every driver.

A curve is a list of knots (raw, value); two knots are a straight line, more are straight pieces, and both go on beyond
their ends. The potentiometer has two steps: its ratio becomes a wiper position, then a curve makes the angle of it. How
the knots are found from measured points stands in drivers.fitting; this file only applies them.
"""

import datetime
import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Final, TypeVar

from drivers.signals import Span
from rig.config import structure
from rig.errors import ConfigError
from rig.fields import bounded
from rig.interfaces import DeviceContext, Role

Knots = Sequence[tuple[float, float]]

SLOPES: Final = (0.8, 1.25)
"""Pressure by command of a regulator that works, and by nominal reading of a monitor. SMC's ITV: linearity 1 %,
hysteresis and repeatability 0.5 % of full scale, zero and span within a few per cent, a monitor up to 6 %. One beyond
these had no supply, is of another range, or was measured in another order."""
VALVE_OFF_MPA: Final = 0.05
"""10 % of the ITV's 0.5 MPa: so far may a regulator's pressure be from its command."""
MONITOR_OFF: Final = 0.1
"""Of the monitor's span: the ITV's 6 % of full scale, and what gauge and regulator add."""
LEAST_BROKEN: Final = 0.2
"""Of a live zero: a limit below this lets a broken wire pass for a pressure. An open input reads zero within the
converter's offset; 50 mV at the myRIO's (NI's specification), a twentieth of 1 V, and leakage comes on top."""
MAX_AGE_DAYS: Final = 365
"""A calibration older than this is warned about."""


@dataclass(frozen=True)
class Taken:
    """Where a calibration comes from. No date: nominal values of a datasheet, never measured."""

    date: str = ""
    """ISO date, 2026-11-21."""
    form: str = "nominal"
    """nominal, linear or pieces."""
    points: list[tuple[float, float]] = field(default_factory=list)
    """Raw reading and reference value of each measured point."""
    residual: float | None = None
    """RMS distance of the points from the curve, in the unit of the value; None when the points leave none."""
    uncertainty: float | None = None
    """Standard uncertainty (k = 1) of one value, residual and reference together."""
    serial_numbers: dict[str, str] = field(default_factory=dict)
    """What was calibrated and what with: part -> serial number."""

    def __post_init__(self) -> None:
        if self.date:
            _iso_date(self.date)

    def age_days(self, today: datetime.date) -> int | None:
        """Days since it was taken; None when nominal."""
        return (today - _iso_date(self.date)).days if self.date else None


@dataclass(frozen=True)
class Calibration:
    """A pressure channel: a monitor's signal (V, mA or counts) -> pressure, or a regulator's command (MPa) ->
    pressure."""

    knots: list[tuple[float, float]]
    """(raw, MPa), rising in raw and monotonic in MPa."""
    raw_unit: str = ""
    """V, mA, counts; empty: as the device gives it. MPa for a regulator: the command that was given, on the nominal
    scale."""
    broken_below: float | None = None
    """A raw value below this is a broken wire (live zero of 1-5 V and 4-20 mA), not a pressure; None: half of the live
    zero. Less than `LEAST_BROKEN` of it is refused."""
    suspect_above: float | None = None
    """A raw value above this cannot come from a healthy monitor."""
    taken: Taken = field(default_factory=Taken)

    def __post_init__(self) -> None:
        check_knots(self.knots)

    def is_broken(self, raw: float) -> bool:
        """Whether `raw` lies below the live zero; NaN counts as broken."""
        return raw != raw or (self.broken_below is not None and raw < self.broken_below)

    def is_suspect(self, raw: float) -> bool:
        """Whether `raw` lies above anything a healthy monitor gives."""
        return self.suspect_above is not None and raw > self.suspect_above


@dataclass(frozen=True)
class Potentiometer:
    """The angle sensor: ratio of wiper to excitation voltage -> wiper position 0..1 -> degrees."""

    knots: list[tuple[float, float]] = field(default_factory=lambda: [(0.0, -172.5), (1.0, 172.5)])
    """(position, deg). The default is the WDD35D8's 345 degrees of electrical travel with its zero in the middle."""
    pot_ohm: float = bounded(1.0, 1e6, "Ohm", default=5000.0)
    load_ohm: float = bounded(1.0, 1e12, "Ohm", default=500_000.0)
    """Input resistance of the converter at the wiper; bends the reading by up to 4/27 of pot_ohm / load_ohm of full
    scale."""
    dead_below: float = bounded(0.002, 0.5, default=0.01)
    dead_above: float = bounded(0.5, 0.998, default=0.99)
    """Positions outside these are the gap between the track's ends, or an open wire: there is no angle. At 0 and 1 an
    open wire would be an angle; the bounds are 10 mV of 5 V from there, eight counts of the myRIO's 12 bits."""
    min_excitation_v: float = bounded(0.1, 30.0, "V", default=1.0)
    """Less excitation than this means that the supply of the potentiometer is off or its wire open."""
    taken: Taken = field(default_factory=Taken)

    def __post_init__(self) -> None:
        check_knots(self.knots)

    def position(self, ratio: float) -> float:
        """Wiper position 0..1 from the loaded ratio; the exact inverse of `loaded_ratio`."""
        return wiper_position(ratio, self.pot_ohm / self.load_ohm)

    def is_dead(self, ratio: float) -> bool:
        """Whether the ratio lies in the dead zone or comes from an open wire; NaN counts as open."""
        return not self.dead_below <= self.position(ratio) <= self.dead_above

    def to_angle(self) -> Callable[[float], float]:
        """ratio -> deg, NaN in the dead zone; made once, called each tick."""
        load, low, high, angle = self.pot_ohm / self.load_ohm, self.dead_below, self.dead_above, curve(self.knots)

        def convert(ratio: float) -> float:
            position = wiper_position(ratio, load)
            return angle(position) if low <= position <= high else math.nan

        return convert


def wiper_position(ratio: float, load_ratio: float) -> float:
    """Position x of the wiper from ratio r = x / (1 + a x (1 - x)), a = R_pot / R_load (voltage divider under load)."""
    bend = 1.0 - load_ratio * ratio
    return 2.0 * ratio / (bend + math.sqrt(bend * bend + 4.0 * load_ratio * ratio * ratio))


def loaded_ratio(position: float, load_ratio: float) -> float:
    """What the converter sees of wiper position 0..1: at most (4/27) a below it, for small a, at x = 2/3."""
    return position / (1.0 + load_ratio * position * (1.0 - position))


def curve(knots: Knots) -> Callable[[float], float]:
    """raw -> value along the knots, straight on beyond both ends; NaN stays NaN. Made once, called each tick."""
    check_knots(knots)
    slopes = [(v1 - v0) / (r1 - r0) for (r0, v0), (r1, v1) in pairwise(knots)]
    offsets = [v0 - slope * r0 for slope, (r0, v0) in zip(slopes, knots, strict=False)]
    if len(slopes) == 1:
        slope, offset = slopes[0], offsets[0]
        return lambda raw: slope * raw + offset
    inner = [raw for raw, _ in knots[1:-1]]

    def pieces(raw: float) -> float:
        index = bisect_right(inner, raw)
        return slopes[index] * raw + offsets[index]

    return pieces


def inverse(knots: Knots) -> Callable[[float], float]:
    """value -> raw along the same knots."""
    check_knots(knots)
    return curve(sorted((value, raw) for raw, value in knots))


def check_knots(knots: Knots) -> None:
    """ValueError unless the knots rise in raw and run one way in value, so that the curve has an inverse."""
    if len(knots) < 2:
        raise ValueError(f"a curve needs at least 2 knots, got {len(knots)}")
    if not all(math.isfinite(number) for knot in knots for number in knot):
        raise ValueError("a knot holds a value that is not finite")
    for (raw_0, _), (raw_1, _) in pairwise(knots):
        if not raw_0 < raw_1:
            raise ValueError(f"knots must rise in their first number: {raw_1:g} follows {raw_0:g}")
    steps = [value_1 - value_0 for (_, value_0), (_, value_1) in pairwise(knots)]
    if not (all(step > 0 for step in steps) or all(step < 0 for step in steps)):
        raise ValueError("knots must rise or fall throughout in their second number")


def check_valve(knots: Knots) -> None:
    """ValueError for a regulator's (command, pressure), in MPa, that no working regulator has: by its inverse a safe
    set-point would be written as anything."""
    if far := _too_far(knots, VALVE_OFF_MPA):
        raise ValueError(
            f"a command of {far[0]:g} MPa gave {far[1]:g} MPa; a regulator is at most {VALVE_OFF_MPA:g} MPa "
            "off: is the supply on and high enough, and are the gauges in the order of the commands?"
        )
    if steep := _too_steep(knots):
        raise ValueError(
            f"from {steep[0]:g} to {steep[1]:g} MPa the pressure changes by {steep[2]:.2f} of the command; allowed: "
            f"{SLOPES[0]:g} .. {SLOPES[1]:g}. Is the supply high enough, or do the points lie too close to each other?"
        )


def check_monitor(knots: Knots, nominally: Calibration) -> None:
    """ValueError for a monitor's (reading, MPa) that no monitor has whose signal and span are those of `nominally`: the
    guard would take a muscle under full pressure for one that is empty."""
    to_nominal, to_reading, unit = curve(nominally.knots), inverse(nominally.knots), nominally.raw_unit
    pairs = [(to_nominal(reading), pressure) for reading, pressure in knots]
    off_mpa = MONITOR_OFF * abs(nominally.knots[-1][1] - nominally.knots[0][1])
    asked = "are signal, low_mpa and high_mpa of the rig's YAML those of what is wired"
    if far := _too_far(pairs, off_mpa):
        raise ValueError(
            f"a reading of {to_reading(far[0]):.4g} {unit}, nominally {far[0]:.4g} MPa, is calibrated as {far[1]:.4g} "
            f"MPa; a monitor is at most {off_mpa:g} MPa off: {asked}, and the gauges in the order of the readings?"
        )
    if steep := _too_steep(pairs):
        raise ValueError(
            f"from {to_reading(steep[0]):.4g} to {to_reading(steep[1]):.4g} {unit} the pressure changes by "
            f"{steep[2]:.2f} of what is nominal; allowed: {SLOPES[0]:g} .. {SLOPES[1]:g}: {asked}, or do the points "
            "lie too close to each other?"
        )


def _too_far(pairs: Knots, off_mpa: float) -> tuple[float, float] | None:
    """The first (nominal, measured) pressure that is more than `off_mpa` off."""
    return next((pair for pair in pairs if abs(pair[1] - pair[0]) > off_mpa), None)


def _too_steep(pairs: Knots) -> tuple[float, float, float] | None:
    """The first two nominal pressures between which the measured one changes too much or too little, and by how much of
    the nominal one."""
    slopes = ((n0, n1, (p1 - p0) / (n1 - n0)) for (n0, p0), (n1, p1) in pairwise(pairs))
    return next((found for found in slopes if not SLOPES[0] <= found[2] <= SLOPES[1]), None)


def nominal(span: Span) -> Calibration:
    """The datasheet's line for a signal and its span, with the signal's limits."""
    signal = span.signal
    top = signal.high + 0.1 * (signal.high - signal.low)
    return Calibration(span.knots(), signal.unit, signal.broken_below, top)


C = TypeVar("C", Calibration, Potentiometer)


def for_role(context: DeviceContext, role: Role, default: C) -> C:
    """The rig's calibration of a channel in the units of `default`, or the default; ConfigError when it does not fit,
    or is one that no working regulator or monitor has.

    A valve is calibrated from command to pressure (raw_unit MPa), whatever its device; here it becomes signal to
    pressure. A monitor is calibrated in what its device gives, and keeps the default's limits where it names none.
    """
    raw = context.calibration.get(role.value)
    if raw is None:
        return default
    where = f"calibration: {role.value}"
    found = raw if isinstance(raw, type(default)) else structure(raw, type(default), where)
    if isinstance(found, Calibration) and isinstance(default, Calibration):
        return _fitted(found, default, role in (Role.VALVE_1, Role.VALVE_2), where)  # type: ignore[return-value]  # C is Calibration
    return found


def _fitted(found: Calibration, default: Calibration, is_valve: bool, where: str) -> Calibration:
    allowed = [default.raw_unit, *(["MPa"] if is_valve else [])]
    if found.raw_unit not in ("", *allowed):
        raise ConfigError(
            f"{where}: raw_unit: calibrated in {found.raw_unit!r}; allowed for this device: {' or '.join(allowed)}"
        )
    _check(found, default, is_valve, where)
    if found.raw_unit in ("", default.raw_unit):
        broken = default.broken_below if found.broken_below is None else found.broken_below
        suspect = default.suspect_above if found.suspect_above is None else found.suspect_above
        return replace(found, raw_unit=default.raw_unit, broken_below=broken, suspect_above=suspect)
    signal = inverse(default.knots)
    return replace(
        found, knots=[(signal(command), pressure) for command, pressure in found.knots], raw_unit=default.raw_unit
    )


def _check(found: Calibration, default: Calibration, is_valve: bool, where: str) -> None:
    """A valve on the scale of commands, whatever it was calibrated in."""
    command = (lambda raw: raw) if found.raw_unit == "MPa" else curve(default.knots)
    try:
        if is_valve:
            check_valve([(command(raw), pressure) for raw, pressure in found.knots])
        else:
            check_monitor(found.knots, default)
            _check_broken(found, default)
    except ValueError as error:
        raise ConfigError(f"{where}: {error}") from None


def _check_broken(found: Calibration, default: Calibration) -> None:
    """ValueError for a limit that no broken wire of a signal with a live zero would fall below."""
    if found.broken_below is None or default.broken_below is None:
        return
    zero = default.knots[0][0]
    if found.broken_below < LEAST_BROKEN * zero:
        raise ValueError(
            f"broken_below: {found.broken_below:g} {default.raw_unit} would let a broken wire pass for a pressure; at "
            f"least {LEAST_BROKEN * zero:g} {default.raw_unit}, or leave it out ({default.broken_below:g})"
        )


def complaint(role: str, taken: Taken, today: datetime.date) -> str | None:
    """One line about a calibration that is missing, old, or dated in the future; None when it is fine."""
    age = taken.age_days(today)
    if age is None:
        return f"{role}: nominal values, never calibrated; run `pamrig devices calibrate`"
    if age < 0:
        return f"{role}: calibrated on {taken.date}, which lies in the future: is the clock right?"
    if age > MAX_AGE_DAYS:
        return f"{role}: calibrated on {taken.date}, {age} days ago; more than {MAX_AGE_DAYS} days is old"
    return None


def parse(raw: object, role: Role, where: str) -> Calibration | Potentiometer:
    """One entry of a calibration file; ConfigError names what is wrong."""
    place = f"{where}: {role.value}"
    return structure(raw, Potentiometer, place) if role is Role.ANGLE else structure(raw, Calibration, place)


def parse_all(raw: object, where: str) -> dict[Role, Calibration | Potentiometer]:
    """A whole calibration file: role -> calibration."""
    if not isinstance(raw, dict):
        raise ConfigError(f"{where}: expected a mapping with the keys {', '.join(Role)}")
    unknown = sorted(set(map(str, raw)) - set(Role))
    if unknown:
        raise ConfigError(f"{where}: unknown role {unknown[0]!r}; allowed: {', '.join(Role)}")
    return {Role(key): parse(item, Role(key), where) for key, item in raw.items()}


def _iso_date(text: str) -> datetime.date:
    try:
        return datetime.date.fromisoformat(text)
    except ValueError:
        raise ValueError(f"expected a date like 2026-11-21, got {text!r}") from None

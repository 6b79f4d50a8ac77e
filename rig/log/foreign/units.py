"""Units that records come in, and the way from them to ours (MPa, deg, s), or to a channel map's own.

Names are case-sensitive: mPa is not MPa.
"""

import math
from typing import Final, NamedTuple

from rig.errors import RecordError
from rig.log.mcap.columns import Array


class UnitConversion(NamedTuple):
    """value in our unit = value * times / by; two numbers, so that decimal factors stay exact."""

    quantity: str
    times: float
    by: float


UNITS: Final = {
    "MPa": UnitConversion("pressure", 1, 1),
    "kPa": UnitConversion("pressure", 1, 1000),
    "Pa": UnitConversion("pressure", 1, 1_000_000),
    "bar": UnitConversion("pressure", 1, 10),
    "mbar": UnitConversion("pressure", 1, 10_000),
    "psi": UnitConversion("pressure", 6894.757293168361, 1_000_000),
    "deg": UnitConversion("angle", 1, 1),
    "\N{DEGREE SIGN}": UnitConversion("angle", 1, 1),
    "rad": UnitConversion("angle", 180, math.pi),
    "mrad": UnitConversion("angle", 0.18, math.pi),
    "s": UnitConversion("time", 1, 1),
    "ms": UnitConversion("time", 1, 1000),
    "us": UnitConversion("time", 1, 1_000_000),
    "\N{MICRO SIGN}s": UnitConversion("time", 1, 1_000_000),
    "ns": UnitConversion("time", 1, 1_000_000_000),
    "m": UnitConversion("length", 1, 1),
    "cm": UnitConversion("length", 1, 100),
    "mm": UnitConversion("length", 1, 1000),
    "um": UnitConversion("length", 1, 1_000_000),
    "\N{MICRO SIGN}m": UnitConversion("length", 1, 1_000_000),
    "in": UnitConversion("length", 0.0254, 1),
    "kN": UnitConversion("force", 1000, 1),
    "N": UnitConversion("force", 1, 1),
    "mN": UnitConversion("force", 1, 1000),
    "lbf": UnitConversion("force", 4.4482216152605, 1),
    "kip": UnitConversion("force", 4448.2216152605, 1),
    "kV": UnitConversion("voltage", 1000, 1),
    "V": UnitConversion("voltage", 1, 1),
    "mV": UnitConversion("voltage", 1, 1000),
    "A": UnitConversion("current", 1, 1),
    "mA": UnitConversion("current", 1, 1000),
}

PRESSURE_SIZES: Final = ((1.2, "MPa"), (15.0, "bar"), (2000.0, "kPa"), (math.inf, "Pa"))
"""Largest value of a pressure of such a rig, and the unit that it is then in: the regulators end at 0.5 to 0.9 MPa,
which is 5 to 9 bar and 500 to 900 kPa, and each bound lies between two of these. A bound that moves moves which unit a
table that names none is taken for; psi (73 to 130) lie among the kPa and are told by their name only."""
STEP_SIZES: Final = ((0.5, "s"), (500.0, "ms"), (5e5, "us"), (math.inf, "ns"))
"""Largest usual distance of two rows, and the unit of time that it is then in: no rig whose muscles answer within 0.1 s
is sampled more slowly than every 0.5 s, and none faster than every 0.5 ms."""

_SPELT: Final = {
    "bar": "bar", "bars": "bar", "psi": "psi",
    "deg": "deg", "degs": "deg", "degree": "deg", "degrees": "deg", "rad": "rad", "radian": "rad", "radians": "rad",
    "sec": "s", "second": "s", "seconds": "s", "msec": "ms",
    "volt": "V", "volts": "V", "ampere": "A", "amperes": "A", "amps": "A", "newton": "N", "newtons": "N",
}  # fmt: skip
"""How LabVIEW and DIAdem spell units, whatever their case: words that no other unit is written with."""
_SUFFIXES = {"_mpa": "MPa", "_deg": "deg", "_s": "s"}


def unit_by_size(value: float, sizes: tuple[tuple[float, str], ...]) -> str:
    """The unit in which a largest value is this large: the first of the `sizes` that holds it."""
    return next(unit for most, unit in sizes if value <= most)


def unit_in_name(column: str) -> str | None:
    """The unit that one of our column names ends in: p1_mpa -> MPa; None when it ends in none."""
    return next((unit for suffix, unit in _SUFFIXES.items() if column.endswith(suffix)), None)


def spelt(unit: str) -> str:
    """The unit by our spelling where it is known by another (Bar, Volts); as it stands where it is not."""
    return unit if unit in UNITS else _SPELT.get(unit.casefold(), unit)


def conversion(column: str, unit: str, where: str) -> UnitConversion:
    """How values in `unit` become values of our `column`; RecordError when the unit is unknown or of another
    quantity."""
    ours = unit_in_name(column)
    quantity = UNITS[ours].quantity if ours else None
    if unit not in UNITS or UNITS[unit].quantity != quantity:
        allowed = [name for name, item in UNITS.items() if item.quantity == quantity]
        raise RecordError(f"{where}: the unit {unit!r} does not fit {column}; allowed: {', '.join(allowed) or 'none'}")
    return UNITS[unit]


def converted(values: Array, unit: str, wanted: str, where: str) -> Array:
    """Values in `unit` as values in `wanted`; RecordError when they are different and no way between them is known."""
    if unit == wanted:
        return values
    one, other = UNITS.get(unit), UNITS.get(wanted)
    if one is None or other is None or one.quantity != other.quantity:
        raise RecordError(f"{where}: the unit {unit!r} does not fit {wanted!r} of the channel map; `scale` converts")
    return values * (one.times * other.by) / (one.by * other.times)

"""Units that records come in, and the way from them to ours (MPa, deg, s), or to a channel map's own.

Names are case-sensitive: mPa is not MPa.
"""

import math
from typing import Final, NamedTuple

from rig.errors import RecordError
from rig.log.mcap.columns import Array


class Unit(NamedTuple):
    """value in our unit = value * times / by; two numbers, so that decimal factors stay exact."""

    quantity: str
    times: float
    by: float


UNITS: Final = {
    "MPa": Unit("pressure", 1, 1),
    "kPa": Unit("pressure", 1, 1000),
    "Pa": Unit("pressure", 1, 1_000_000),
    "bar": Unit("pressure", 1, 10),
    "mbar": Unit("pressure", 1, 10_000),
    "psi": Unit("pressure", 6894.757293168361, 1_000_000),
    "deg": Unit("angle", 1, 1),
    "\N{DEGREE SIGN}": Unit("angle", 1, 1),
    "rad": Unit("angle", 180, math.pi),
    "mrad": Unit("angle", 0.18, math.pi),
    "s": Unit("time", 1, 1),
    "ms": Unit("time", 1, 1000),
    "us": Unit("time", 1, 1_000_000),
    "\N{MICRO SIGN}s": Unit("time", 1, 1_000_000),
    "ns": Unit("time", 1, 1_000_000_000),
    "m": Unit("length", 1, 1),
    "cm": Unit("length", 1, 100),
    "mm": Unit("length", 1, 1000),
    "um": Unit("length", 1, 1_000_000),
    "\N{MICRO SIGN}m": Unit("length", 1, 1_000_000),
    "in": Unit("length", 0.0254, 1),
    "kN": Unit("force", 1000, 1),
    "N": Unit("force", 1, 1),
    "mN": Unit("force", 1, 1000),
    "lbf": Unit("force", 4.4482216152605, 1),
    "kip": Unit("force", 4448.2216152605, 1),
    "kV": Unit("voltage", 1000, 1),
    "V": Unit("voltage", 1, 1),
    "mV": Unit("voltage", 1, 1000),
    "A": Unit("current", 1, 1),
    "mA": Unit("current", 1, 1000),
}

_SPELT: Final = {
    "bar": "bar", "bars": "bar", "psi": "psi",
    "deg": "deg", "degs": "deg", "degree": "deg", "degrees": "deg", "rad": "rad", "radian": "rad", "radians": "rad",
    "sec": "s", "second": "s", "seconds": "s", "msec": "ms",
    "volt": "V", "volts": "V", "ampere": "A", "amperes": "A", "amps": "A", "newton": "N", "newtons": "N",
}  # fmt: skip
"""How LabVIEW and DIAdem spell units, whatever their case: words that no other unit is written with."""
_SUFFIXES = {"_mpa": "MPa", "_deg": "deg", "_s": "s"}


def unit_in_name(column: str) -> str | None:
    """The unit that one of our column names ends in: p1_mpa -> MPa; None when it ends in none."""
    return next((unit for suffix, unit in _SUFFIXES.items() if column.endswith(suffix)), None)


def spelt(unit: str) -> str:
    """The unit by our spelling where it is known by another (Bar, Volts); as it stands where it is not."""
    return unit if unit in UNITS else _SPELT.get(unit.casefold(), unit)


def conversion(column: str, unit: str, where: str) -> Unit:
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

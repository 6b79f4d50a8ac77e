"""An effect of a plant family as an entry of its table, and what is the same of it in every family.

A law turns one signed size into a disturbance; details that are no size (which valve, which phase, how uneven) are
drawn.
"""

import math
from collections.abc import Callable
from typing import Any, Final, NamedTuple

from numpy.random import Generator

from hil.reference.disturbance import Disturbance

Law = Callable[[float, Generator], Disturbance]
"""(signed size, details by chance) -> what is wrong."""
Setter = Callable[..., Disturbance]
Detail = tuple[float, float] | list[float]
"""Bounds of a uniform detail, or its choices."""


class EffectLaw(NamedTuple):
    """One effect of a plant. Sizes lie between `low` and `high`, both positive; `signed` ones may be negative too."""

    stage: str
    unit: str
    low: float
    high: float
    signed: bool
    law: Law
    library_parameter: str = ""
    """The library's parameter that means the same as the size; empty where the two laws have no number in common."""
    falling: bool = False
    """A smaller size is the stronger effect (a limit, a ceiling)."""


class _Known(NamedTuple):
    """What a library's effect is, whatever its law."""

    stage: str
    unit: str
    signed: bool = False
    library_parameter: str = ""
    falling: bool = False


KNOWN: Final = {
    "delay": _Known("timing", "s", False, "delay_s"),
    "clock_drift": _Known("timing", "relative", True, "drift"),
    "lost_samples": _Known("timing", "probability"),
    "valve_gain": _Known("valve", "relative", True, "gain"),
    "valve_offset": _Known("valve", "MPa", True, "offset_mpa"),
    "valve_lag": _Known("valve", "s", False, "tau_s"),
    "valve_slew": _Known("valve", "MPa/s", falling=True),
    "fill_exhaust_asymmetry": _Known("valve", "ratio - 1", True),
    "valve_dead_band": _Known("valve", "MPa", False, "width_mpa"),
    "pressure_ceiling": _Known("valve", "MPa", False, "ceiling_mpa", True),
    "supply_droop": _Known("valve", "MPa"),
    "co_contraction": _Known("muscle", "MPa", True, "shift_mpa"),
    "muscle_mismatch": _Known("muscle", "relative", True),
    "leak": _Known("muscle", "relative"),
    "creep": _Known("muscle", "relative"),
    "thermal_drift": _Known("muscle", "relative", True),
    "coulomb_friction": _Known("joint", "N m"),
    "viscous_friction": _Known("joint", "N m s/rad"),
    "inertia": _Known("joint", "kg m2"),
    "gravity_load": _Known("joint", "N m", True),
    "stiffness": _Known("joint", "relative", True, "stiffness"),
    "backlash": _Known("joint", "deg", False, "width_deg"),
    "end_stop": _Known("joint", "deg", falling=True),
    "sensor_gain": _Known("sensor", "relative", True, "gain"),
    "sensor_offset": _Known("sensor", "deg", True, "offset_deg"),
    "sensor_drift": _Known("sensor", "deg/min", True, "rate_deg_min"),
    "sensor_nonlinearity": _Known("sensor", "deg", True),
    "sensor_lag": _Known("sensor", "s", False, "tau_s"),
    "quantisation": _Known("sensor", "deg", False, "step_deg"),
    "mains_hum": _Known("sensor", "deg"),
    "sensor_noise": _Known("sensor", "deg", False, "std_deg"),
    "sensor_dropout": _Known("sensor", "probability", False, "probability"),
}  # fmt: skip
"""Effects that a library may hold."""


def known(effect: str, low: float, high: float, law: Law, unit: str = "") -> tuple[str, EffectLaw]:
    """An entry of a family's table for an effect of the library; `unit` where this law's size is another number."""
    what = KNOWN[effect]
    parameter = "" if unit else what.library_parameter
    return effect, EffectLaw(what.stage, unit or what.unit, low, high, what.signed, law, parameter, what.falling)


def sized(set_law: Setter, name: str, scale: float = 1.0, **details: Detail) -> Law:
    """The law whose parameter `name` is the size times `scale`, and whose other parameters are chance details: uniform
    between two bounds, or one of a list."""

    def law(size: float, random: Generator) -> Disturbance:
        return set_law(**{name: scale * size}, **{key: _drawn(random, detail) for key, detail in details.items()})

    return law


def _drawn(random: Generator, detail: Detail) -> float:
    return between(random, *detail) if isinstance(detail, tuple) else float(one_of(random, *detail))


def between(random: Generator, low: float, high: float) -> float:
    """A detail by chance."""
    return float(random.uniform(low, high))


def one_of(random: Generator, *choices: Any) -> Any:
    """One of several, by chance."""
    return choices[int(random.integers(len(choices)))]


def by_sign(set_law: Setter, positive: str, negative: str) -> Law:
    """The size is one parameter when positive, and another one when negative."""
    return lambda size, _: set_law(**{positive: size} if size > 0.0 else {negative: -size})


def one_leak(set_rig: Setter, names: tuple[str, str], scale: float) -> Law:
    """One of both muscles leaks, by the size times `scale`."""
    return lambda size, random: set_rig(**{one_of(random, *names): scale * size})


def uneven_gains(set_rig: Setter) -> Law:
    """Both regulators' gains off, not quite alike, and bent over the pressure."""

    def law(size: float, random: Generator) -> Disturbance:
        second, bend = size * between(random, 0.8, 1.2), between(random, -0.15, 0.15)
        return set_rig(gain_1=size, gain_2=second, gain_bend=bend)

    return law


def one_offset(set_rig: Setter) -> Law:
    """The set-point of one regulator off by a constant."""
    return lambda size, random: set_rig(**{one_of(random, "offset_2_mpa", "offset_1_mpa"): size})


def both_offsets(set_rig: Setter) -> Law:
    """Both set-points off by nearly the same."""

    def law(size: float, random: Generator) -> Disturbance:
        uneven = between(random, -0.03, 0.03)
        return set_rig(offset_1_mpa=size * (1.0 + uneven), offset_2_mpa=size * (1.0 - uneven))

    return law


def stops(set_rig: Setter) -> Law:
    """A stop at an angle (deg), on one side or on both."""

    def law(size: float, random: Generator) -> Disturbance:
        high, low = {"stop_high_rad": math.radians(size)}, {"stop_low_rad": -math.radians(size)}
        return set_rig(**one_of(random, high, low, {**high, **low}))

    return law

"""From measured points to a calibration: least squares lines, straight pieces, residual and uncertainty. Pure Python.

Uncertainties follow the Guide to the Expression of Uncertainty in Measurement (JCGM 100:2008, k = 1): the scatter of
the points about the curve, the curve's own uncertainty, and that of the reference instrument.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from statistics import fmean
from typing import Final

from drivers.calibration import Calibration, Potentiometer, Taken, check_knots, check_valve, curve, wiper_position
from rig.errors import ConfigError
from rig.fields import bounded
from rig.interfaces import Role

Points = Sequence[tuple[float, float]]


class Form(StrEnum):
    """The shape of the curve."""

    LINEAR = "linear"
    PIECES = "pieces"


@dataclass(frozen=True)
class Measured:
    """The points of one channel, as a file of points or a guided calibration gives them."""

    points: list[tuple[float, float]]
    """Raw reading and reference value. Valves: command in MPa and gauge in MPa. Angle: ratio of wiper to excitation,
    and deg."""
    form: Form = Form.LINEAR
    raw_unit: str = ""
    """Monitors: V, mA or counts; empty: as the device gives it."""
    reference_uncertainty: float = bounded(0.0, 1000.0, default=0.0)
    """Standard uncertainty (k = 1) of the reference instrument, in the unit of the reference value."""
    serial_numbers: dict[str, str] = field(default_factory=dict)
    pot_ohm: float = bounded(1.0, 1e6, "Ohm", default=5000.0)
    load_ohm: float = bounded(1.0, 1e12, "Ohm", default=500_000.0)


@dataclass(frozen=True)
class CurveFit:
    """A fitted curve; residual and uncertainty in the unit of the value, None when the points leave nothing to judge
    by."""

    knots: list[tuple[float, float]]
    residual: float | None
    uncertainty: float | None


LEAST_POINTS: Final = 2
"""Of a straight line."""


def calibrate(role: Role, measured: Measured, date: str, where: str) -> Calibration | Potentiometer:
    """The calibration of a channel from its points; ConfigError names the point that cannot be right."""
    try:
        if role is Role.ANGLE:
            return _potentiometer(measured, date)
        fit = fit_points(measured.points, measured.form, measured.reference_uncertainty)
        is_valve = role in (Role.VALVE_1, Role.VALVE_2)
        if is_valve:
            check_valve(fit.knots)
        unit = "MPa" if is_valve else measured.raw_unit
        return Calibration(fit.knots, unit, taken=_taken(measured, fit, date))
    except ValueError as error:
        raise ConfigError(f"{where}: {role.value}: {error}") from None


def fit_points(points: Points, form: Form, reference_uncertainty: float = 0.0) -> CurveFit:
    """The curve through `points`; ValueError when they are too few, not finite, or do not run one way."""
    if len(points) < LEAST_POINTS:
        raise ValueError(f"too few points, {len(points)}; at least {LEAST_POINTS} are needed")
    for number, point in enumerate(points, 1):
        if not all(map(math.isfinite, point)):
            raise ValueError(f"point {number}: {point[0]}, {point[1]} is not finite")
    fit = fit_line(points, reference_uncertainty) if form is Form.LINEAR else fit_pieces(points, reference_uncertainty)
    check_knots(fit.knots)
    return fit


def fit_line(points: Points, reference_uncertainty: float) -> CurveFit:
    """Least squares; the knots are its ends. The uncertainty is that of a new reading at the worse end."""
    n = len(points)
    mean_raw, mean_value = fmean(raw for raw, _ in points), fmean(value for _, value in points)
    spread = sum((raw - mean_raw) ** 2 for raw, _ in points)
    if spread == 0.0:
        raise ValueError("all points have the same raw reading; nothing moved between them")
    slope = sum((raw - mean_raw) * (value - mean_value) for raw, value in points) / spread
    low, high = min(raw for raw, _ in points), max(raw for raw, _ in points)
    knots = [(raw, mean_value + slope * (raw - mean_raw)) for raw in (low, high)]
    line = curve(knots) if slope else lambda raw: mean_value
    squares = sum((value - line(raw)) ** 2 for raw, value in points)
    if n == 2:
        return CurveFit(knots, None, reference_uncertainty or None)
    leverage = 1.0 / n + max(mean_raw - low, high - mean_raw) ** 2 / spread
    scatter = squares / (n - 2)
    return CurveFit(knots, math.sqrt(squares / n), math.sqrt(scatter * (1.0 + leverage) + reference_uncertainty**2))


def fit_pieces(points: Points, reference_uncertainty: float) -> CurveFit:
    """Knots at the mean of each group of equal raw readings.

    The scatter comes from the repeats; without repeats, from how far each inner knot lies from the line of its
    neighbours, which overstates it where the curve bends.
    """
    groups: dict[float, list[float]] = {}
    for raw, value in points:
        groups.setdefault(raw, []).append(value)
    knots = sorted((raw, fmean(values)) for raw, values in groups.items())
    squares = sum((value - fmean(values)) ** 2 for values in groups.values() for value in values)
    repeats = len(points) - len(groups)
    if repeats:
        scatter = squares / repeats
    elif len(knots) > 2:
        bends = [
            knot[1] - curve([before, after])(knot[0])
            for before, knot, after in zip(knots, knots[1:], knots[2:], strict=False)
        ]
        scatter = fmean(bend**2 for bend in bends)
    else:
        return CurveFit(knots, None, reference_uncertainty or None)
    return CurveFit(knots, math.sqrt(squares / len(points)), math.sqrt(scatter + reference_uncertainty**2))


def _potentiometer(measured: Measured, date: str) -> Potentiometer:
    load = measured.pot_ohm / measured.load_ohm
    for number, (ratio, _) in enumerate(measured.points, 1):
        if not 0.0 < ratio < 1.0:
            raise ValueError(
                f"point {number}: a ratio of {ratio:g} is not between 0 and 1; is the wire open, or is this a voltage?"
            )
    positions = [(wiper_position(ratio, load), angle_deg) for ratio, angle_deg in measured.points]
    fit = fit_points(positions, measured.form, measured.reference_uncertainty)
    return Potentiometer(fit.knots, measured.pot_ohm, measured.load_ohm, taken=_taken(measured, fit, date))


def _taken(measured: Measured, fit: CurveFit, date: str) -> Taken:
    return Taken(
        date, measured.form.value, list(measured.points), fit.residual, fit.uncertainty, dict(measured.serial_numbers)
    )


def furthest_point(found: Calibration | Potentiometer) -> tuple[int, float] | None:
    """Number (from 1) and distance of the point furthest from its curve: the one to look at again; None for nominal
    values."""
    convert = found.to_angle() if isinstance(found, Potentiometer) else curve(found.knots)
    distances = [abs(value - convert(raw)) for raw, value in found.taken.points]
    if not distances:
        return None
    worst = max(range(len(distances)), key=distances.__getitem__)
    return worst + 1, distances[worst]


def summary(calibrations: Mapping[Role, Calibration | Potentiometer]) -> dict[str, dict[str, object]]:
    """For the screen and for JSON."""
    return {role.value: _summary(role, found) for role, found in calibrations.items()}


def _summary(role: Role, found: Calibration | Potentiometer) -> dict[str, object]:
    taken, worst = found.taken, furthest_point(found)
    return {
        "date": taken.date or None,
        "form": taken.form,
        "points": len(taken.points),
        "residual": taken.residual,
        "uncertainty": taken.uncertainty,
        "unit": "deg" if role is Role.ANGLE else "MPa",
        "furthest_point": worst[0] if worst else None,
        "furthest_distance": worst[1] if worst else None,
        "serial_numbers": dict(taken.serial_numbers),
    }

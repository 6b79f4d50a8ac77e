"""From the module's numbers to a Measurement: signal, pressure or angle, and the flags of what cannot be believed."""

import math
from collections.abc import Callable, Mapping

from drivers.calibration import Calibration, Potentiometer, curve, for_role, inverse, nominal
from drivers.modbus_io.codec import to_signal
from drivers.modbus_io.plan import EXCITATION, FIRST_FURTHER, MONITORS, VALVES, WIPER, ExchangePlan
from drivers.modbus_io.settings import FurtherChannel, ModbusSettings
from rig.interfaces import NAN, DeviceContext, Measurement, Role
from rig.sample import ANGLE_ABSENT, BROKEN_WIRE, P1_ABSENT, P2_ABSENT, SUSPECT

_ABSENT = (P1_ABSENT, P2_ABSENT)
_DEAD = ANGLE_ABSENT | SUSPECT


class Inputs:
    """Numbers by place -> Measurement, for the roles that this device fills."""

    def __init__(self, settings: ModbusSettings, context: DeviceContext, plan: ExchangePlan) -> None:
        self._plan = plan
        self._monitors: list[tuple[Calibration, Callable[[float], float]] | None] = [None, None]
        for place, role in enumerate(MONITORS):
            if role in context.roles:
                calibration = for_role(context, role, nominal(getattr(settings, role.value).span))
                self._monitors[place] = (calibration, curve(calibration.knots))
        self._potentiometer = for_role(context, Role.ANGLE, Potentiometer()) if Role.ANGLE in context.roles else None
        self._angle = self._potentiometer.to_angle() if self._potentiometer else None
        order = list(settings.further)
        self._further = [
            (FIRST_FURTHER + order.index(name), settings.further[name]) if name in order else None
            for name in context.places
        ]
        self._reference_v = (settings.angle.reference_v or NAN) if settings.angle else NAN

    def measurement(self, numbers: Mapping[int, float], age_ns: int, flags: int) -> Measurement:
        """Raw values are V or mA. A broken wire, and a potentiometer in its dead zone, have no value: NaN."""
        values, raws = [NAN, NAN], [NAN, NAN]
        for place in (0, 1):
            raws[place], values[place], flag = self._monitor(place, numbers)
            flags |= flag
        wiper, excitation, angle_deg, flag = self._turned(numbers)
        flags |= flag
        ages = [0 if flags & absent else age_ns for absent in (*_ABSENT, ANGLE_ABSENT)]
        return Measurement(
            values[0], values[1], angle_deg, raws[0], raws[1], wiper, excitation, ages[0], ages[1], ages[2], flags,
            *(self._other(wired, numbers) for wired in self._further),
        )  # fmt: skip

    def _other(self, wired: tuple[int, FurtherChannel] | None, numbers: Mapping[int, float]) -> float:
        """A further channel's value in its own unit; NaN where it is not read here."""
        if wired is None or wired[0] not in numbers:
            return NAN
        return to_signal(self._plan.inputs, numbers[wired[0]]) * wired[1].scale + wired[1].offset

    def _monitor(self, place: int, numbers: Mapping[int, float]) -> tuple[float, float, int]:
        wired = self._monitors[place]
        if wired is None or place not in numbers:
            return NAN, NAN, _ABSENT[place]
        calibration, to_mpa = wired
        raw = to_signal(self._plan.inputs, numbers[place])
        if calibration.is_broken(raw):
            return raw, NAN, _ABSENT[place] | BROKEN_WIRE
        return raw, to_mpa(raw), SUSPECT if calibration.is_suspect(raw) else 0

    def _turned(self, numbers: Mapping[int, float]) -> tuple[float, float, float, int]:
        if self._angle is None or self._potentiometer is None or WIPER not in numbers:
            return NAN, NAN, NAN, ANGLE_ABSENT
        wiper = to_signal(self._plan.inputs, numbers[WIPER])
        excitation = to_signal(self._plan.inputs, numbers[EXCITATION]) if EXCITATION in numbers else NAN
        reference = self._reference_v if math.isnan(excitation) else excitation
        if math.isnan(wiper) or not reference >= self._potentiometer.min_excitation_v:
            return wiper, excitation, NAN, _DEAD
        angle_deg = self._angle(wiper / reference)
        return wiper, excitation, angle_deg, 0 if math.isfinite(angle_deg) else _DEAD


def set_point_signals(settings: ModbusSettings, context: DeviceContext) -> dict[int, Callable[[float], float]]:
    """Place -> MPa to signal of each driven valve, clamped to its pressure range and to its signal."""
    return {place: _to_signal(settings, context, role) for place, role in enumerate(VALVES) if role in context.roles}


def _to_signal(settings: ModbusSettings, context: DeviceContext, role: Role) -> Callable[[float], float]:
    span = getattr(settings, role.value).span
    signal = inverse(for_role(context, role, nominal(span)).knots)
    return lambda pressure_mpa: span.clamp_signal(signal(span.clamp_mpa(pressure_mpa)))

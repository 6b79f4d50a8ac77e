"""The myRIO's terminals in the units of the rig: each channel joins a register's call, the counts' meaning and a
calibration."""

import math
from collections.abc import Callable
from typing import Final, TypeVar

from drivers.calibration import Calibration, Potentiometer, curve, inverse
from drivers.myrio.codec import Converter, converter, decoder, encoder
from drivers.myrio.session import FpgaSession
from drivers.myrio.settings import AngleInput, FurtherInput, PressureLine
from rig.errors import ConfigError
from rig.interfaces import NAN
from rig.sample import Flag

_SUSPECT: Final = int(Flag.SUSPECT)
T = TypeVar("T")


def _input(
    session: FpgaSession, register: str, units_per_volt: float = 1.0
) -> tuple[Callable[[], int], Callable[[int], float]]:
    """The register's call, and what makes a signal of its value."""
    return session.reader(register), _checked(
        register, decoder, converter(register, output=False), session, units_per_volt
    )


def _checked(register: str, make: Callable[..., T], terminal: Converter, session: FpgaSession, *rest: float) -> T:
    try:
        return make(terminal, session.datatype(register), *rest)
    except ValueError as error:
        raise ConfigError(f"register {register!r} has {error}") from None


class PressureInput:
    """A regulator's monitor."""

    def __init__(self, session: FpgaSession, line: PressureLine, calibration: Calibration, absent: int) -> None:
        self._read, self._signal = _input(session, line.register, line.units_per_volt)
        self._curve = curve(calibration.knots)
        self._broken = -math.inf if calibration.broken_below is None else calibration.broken_below
        self._suspect = math.inf if calibration.suspect_above is None else calibration.suspect_above
        self._broken_flags = absent | int(Flag.BROKEN_WIRE)

    def take(self) -> tuple[float, float, int]:
        """Raw signal (V or mA), pressure (MPa), flags; a broken wire has no pressure."""
        raw = self._signal(self._read())
        if raw < self._broken:
            return raw, NAN, self._broken_flags
        return raw, self._curve(raw), _SUSPECT if raw > self._suspect else 0


class AngleChannel:
    """The potentiometer: ratio of wiper to excitation, or to a fixed reference."""

    DEAD: Final = int(Flag.ANGLE_ABSENT | Flag.SUSPECT)

    def __init__(self, session: FpgaSession, wiring: AngleInput, potentiometer: Potentiometer) -> None:
        self._read, self._volts = _input(session, wiring.wiper)
        self._angle = potentiometer.to_angle()
        self._reference_v = wiring.reference_v or NAN
        self._least_v = potentiometer.min_excitation_v
        self._excitation = _input(session, wiring.excitation) if wiring.excitation else None

    def take(self) -> tuple[float, float, float, int]:
        """Wiper (V), excitation (V, NaN when it is not read), angle (deg, NaN in the dead zone or without excitation),
        flags."""
        wiper_v = self._volts(self._read())
        if self._excitation is None:
            angle_deg = self._angle(wiper_v / self._reference_v)
            return wiper_v, NAN, angle_deg, 0 if angle_deg == angle_deg else self.DEAD
        read, volts = self._excitation
        excitation_v = volts(read())
        if excitation_v < self._least_v:
            return wiper_v, excitation_v, NAN, self.DEAD
        angle_deg = self._angle(wiper_v / excitation_v)
        return wiper_v, excitation_v, angle_deg, 0 if angle_deg == angle_deg else self.DEAD


class FurtherInputChannel:
    """A further sensor."""

    def __init__(self, session: FpgaSession, wiring: FurtherInput) -> None:
        self._read, self._volts = _input(session, wiring.register)
        self._scale, self._offset = wiring.scale, wiring.offset

    def take(self) -> float:
        """Its value in its own unit."""
        return self._volts(self._read()) * self._scale + self._offset


class PressureOutput:
    """A regulator's set-point: clamped in MPa, in signal and in counts, and rounded, before anything is written."""

    def __init__(self, session: FpgaSession, line: PressureLine, calibration: Calibration) -> None:
        self.stage = session.writer(line.register)
        """Writes the register; the strobe brings the value to the terminal."""
        self.standing = session.reader(line.register)
        """Reads the register back."""
        self._signal = inverse(calibration.knots)
        self._low_mpa, self._high_mpa = line.low_mpa, line.high_mpa
        ends = line.signal.low, line.signal.high
        self._encode = _checked(
            line.register, encoder, converter(line.register, output=True), session, *ends, line.units_per_volt
        )

    @property
    def count_range(self) -> tuple[int, int]:
        """The counts that the signal allows."""
        return self._encode.low, self._encode.high

    def bits(self, pressure_mpa: float) -> int:
        """What the register is to hold; ValueError for a set-point that is not finite."""
        if not self._low_mpa <= pressure_mpa <= self._high_mpa:
            if not math.isfinite(pressure_mpa):
                raise ValueError(f"a set-point of {pressure_mpa} MPa is not finite")
            pressure_mpa = min(max(pressure_mpa, self._low_mpa), self._high_mpa)
        return self._encode(self._signal(pressure_mpa))

"""How a coarse converter makes a code of an angle: the nearest one, the next lower one, or the next one towards zero.

The samples alone tell the last of these, for there the code zero is twice as wide as any other. The next lower code
reads like the nearest one with a zero half a step too low: it is that where the zero is so far off, and nothing else.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from rig.columns import rms
from rig.gap.raw_tests.settings import CODES_APART, HALF_STEP_LOW
from rig.record import Column, Record


class ConverterCode(IntEnum):
    """Which code an angle between two gets; the numbers are those of the stage `quantisation`."""

    NEAREST = 0
    LOWER = 1
    TOWARDS_ZERO = 2


CUT_OFF = {
    ConverterCode.NEAREST: "",
    ConverterCode.LOWER: ", the part beyond a whole step cut off downwards",
    ConverterCode.TOWARDS_ZERO: ", the part beyond a whole step cut off towards zero",
}
"""What is said of a step's code, behind the step."""


@dataclass(frozen=True)
class _Followed:
    """How readings follow from a healthy day's angle when they are coded in one way."""

    left_deg: float
    """Rms that the readings are off the coded angle."""
    zero_deg: float
    """How far their zero is off the healthy day's."""


def code_of(cases: Sequence[Record], sessions: Sequence[Sequence[Record]], step_deg: float) -> ConverterCode:
    """The way in which readings with this step are coded, by what healthy sessions read instead; the nearest code
    without any, and where another one is not plain."""
    pairs = [each for k, case in enumerate(cases) for each in _beside(case, [session[k] for session in sessions])]
    if not pairs:
        return ConverterCode.NEAREST
    nearest, zero = (_followed(pairs, step_deg, code) for code in (ConverterCode.NEAREST, ConverterCode.TOWARDS_ZERO))
    if zero.left_deg < CODES_APART * nearest.left_deg:
        return ConverterCode.TOWARDS_ZERO
    low = abs(nearest.zero_deg + 0.5 * step_deg) < HALF_STEP_LOW * step_deg
    return ConverterCode.LOWER if low else ConverterCode.NEAREST


def centred(record: Record, step_deg: float, code: ConverterCode) -> Record:
    """The record with each reading in the middle of the angles that get its code."""
    return record if record.angle_deg is None else replace(record, angle_deg=_middle(record.angle_deg, step_deg, code))


def cut_off_deg2(step_deg: float, code: ConverterCode) -> float:
    """Mean square (deg2) by which readings are off the middle of the angles that get their code."""
    return 0.0 if code is ConverterCode.NEAREST else 0.25 * step_deg**2


def _middle(reading: Column, step_deg: float, code: ConverterCode) -> Column:
    off = {
        ConverterCode.NEAREST: np.zeros_like(reading),
        ConverterCode.LOWER: np.ones_like(reading),
        ConverterCode.TOWARDS_ZERO: np.sign(reading),
    }
    out: Column = reading + 0.5 * step_deg * off[code]
    return out


def _coded(angle: Column, step_deg: float, code: ConverterCode) -> Column:
    steps = angle / step_deg
    whole = {
        ConverterCode.NEAREST: np.round(steps),
        ConverterCode.LOWER: np.floor(steps),
        ConverterCode.TOWARDS_ZERO: np.trunc(steps),
    }
    out: Column = step_deg * whole[code]
    return out


def _beside(case: Record, days: Sequence[Record]) -> list[tuple[Column, Column]]:
    """(reading, mean of the healthy days) at the same times, where both are known; none without days."""
    angles = [np.interp(case.t_s, day.t_s, day.angle_deg) for day in days if day.angle_deg is not None]
    if not angles or case.angle_deg is None:
        return []
    healthy = np.mean(angles, axis=0)
    both = np.isfinite(case.angle_deg) & np.isfinite(healthy)
    return [(case.angle_deg[both], healthy[both])]


def _followed(pairs: Sequence[tuple[Column, Column]], step_deg: float, code: ConverterCode) -> _Followed:
    """With whatever gain and zero the healthy angle fits the middle of the readings best."""
    reading, healthy = (np.concatenate(columns) for columns in zip(*pairs, strict=True))
    gain, zero = np.polyfit(healthy, _middle(reading, step_deg, code), 1)
    return _Followed(rms(reading - _coded(gain * healthy + zero, step_deg, code)), float(zero))

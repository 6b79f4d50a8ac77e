"""What can be put into anybody's records exactly: what happens to an angle sensor, or to the time base, changes the
columns and nothing else.

Everything ahead of the sensor would need a model of the rig and is not here. Two effects that no library knows are.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.random import Generator

from rig.errors import RecordError
from rig.record import MEASURED_COLUMNS, Column, Record

Put = Callable[[Record, float, Generator], Record]
RAIL_BELOW: Final = 0.5
"""A fallen sample reads so many spans below the lowest angle."""
WAVES: Final = 3.0
"""Turns of the error of a magnet that does not sit in the middle, over the span of the angle."""
BURSTS: Final = 8
"""Times a buffer is late in one record."""
LAG_STEPS: Final = 50
"""Steps between two rows in which a lag is computed, along straight lines."""


@dataclass(frozen=True)
class PutIn:
    """One effect with the sizes that it may have."""

    stage: str
    unit: str
    low: float
    high: float
    put: Put
    number: str = ""
    """The library's number that is this size; empty where the law has another."""
    signed: bool = False
    of_span: bool = False
    """`low` and `high` are shares of the angle's span, the size itself is in deg."""
    in_library: bool = True
    """The library has it."""

    def bounds(self, span_deg: float) -> tuple[float, float]:
        """Least and largest size, for an angle of this span."""
        scale = span_deg if self.of_span else 1.0
        return self.low * scale, self.high * scale


def reread(record: Record, law: Callable[[Column], Column]) -> Record:
    """The record with the angle that `law` makes of its own, both (n,) in deg; RecordError when it has none."""
    if record.angle_deg is None:
        raise RecordError(f"{record.name}: has no angle to put an effect into")
    return replace(record, angle_deg=np.asarray(law(record.angle_deg)))


def late(record: Record, delay_s: "float | Column") -> Record:
    """All that was measured, as it was `delay_s` before: one number (s), or (n,) a delay for each row."""
    t = record.t_s - delay_s
    shifted = {
        name: np.interp(t, record.t_s, column)
        for name in MEASURED_COLUMNS
        if (column := getattr(record, name)) is not None
    }
    return replace(record, **shifted)


def lagging(angle: Column, tau_s: float, period_s: float) -> Column:
    """The angle (n,) behind a first-order low pass of `tau_s` above 0, exact between straight
    samples."""
    from scipy.signal import lfilter

    steps, keep = len(angle), float(np.exp(-period_s / LAG_STEPS / tau_s))
    straight = np.interp(np.arange(steps * LAG_STEPS) / LAG_STEPS, np.arange(steps), angle)
    behind = np.asarray(lfilter([1.0 - keep], [1.0, -keep], straight - angle[0]))
    lagged: Column = behind[::LAG_STEPS] + angle[0]
    return lagged


def lost(angle: Column, share: float, random: Generator) -> Column:
    """The angle (n,), of which each row repeats the one before with the probability `share`."""
    gone = random.random(len(angle)) < share
    gone[0] = False
    return angle[np.maximum.accumulate(np.where(gone, 0, np.arange(len(angle))))]


def dropped(angle: Column, probability: float, random: Generator, rail_deg: float | None = None) -> Column:
    """The angle (n,), of which each row reads the rail with this probability; without `rail_deg` one below all that was
    read, by RAIL_BELOW of its range."""
    rail = float(angle.min()) - RAIL_BELOW * float(np.ptp(angle)) if rail_deg is None else rail_deg
    return np.where(random.random(len(angle)) < probability, rail, angle)


def _behind_buffer(record: Record, burst_s: float, random: Generator) -> Record:
    """A buffer holds the angle back for a while and lets it catch up at double speed; the pressures are on time."""
    t, held = record.t_s, np.zeros(len(record))
    for start in random.uniform(t[0], t[-1], BURSTS):
        held = np.maximum(held, np.minimum(np.clip(t - start, 0.0, burst_s), np.clip(start + 2 * burst_s - t, 0, None)))
    return reread(record, lambda angle: np.interp(t - held, t, angle))


def _bent(angle: Column, size: float) -> Column:
    half = 0.5 * float(np.ptp(angle)) or 1.0
    return angle + size * angle * np.abs(angle) / half


def _uneven(angle: Column, size_deg: float, random: Generator) -> Column:
    """The once-round error of a magnet that does not sit in the middle of its sensor."""
    waves = 2.0 * np.pi * WAVES / (float(np.ptp(angle)) or 1.0)
    return angle + size_deg * np.sin(waves * angle + random.uniform(0.0, 2.0 * np.pi))


def _on_angle(law: Callable[[Column, float, Generator], Column]) -> Put:
    return lambda record, size, random: reread(record, lambda angle: law(angle, size, random))


def _drifting(record: Record, rate_deg_min: float, _: Generator) -> Record:
    return reread(record, lambda angle: angle + rate_deg_min / 60.0 * (record.t_s - record.t_s[0]))


def _lagged(record: Record, tau_s: float, _: Generator) -> Record:
    return reread(record, lambda angle: lagging(angle, tau_s, record.period_s))


PUT_IN: Final[Mapping[str, PutIn]] = {
    "delay": PutIn("timing", "s", 0.001, 0.3, lambda record, size, _: late(record, size), "delay_s"),
    "clock_drift": PutIn(
        "timing", "1", 1e-4, 0.05, lambda record, size, _: late(record, -size * (record.t_s - record.t_s[0])), "drift",
        signed=True,
    ),
    "sensor_gain": PutIn("sensor", "1", 1e-3, 0.5, _on_angle(lambda y, k, _: (1.0 + k) * y), "gain", signed=True),
    "sensor_offset": PutIn(
        "sensor", "deg", 1e-3, 0.5, _on_angle(lambda y, k, _: y + k), "offset_deg", signed=True, of_span=True
    ),
    "sensor_drift": PutIn("sensor", "deg/min", 1e-3, 3.0, _drifting, "rate_deg_min", signed=True, of_span=True),
    "sensor_nonlinearity": PutIn("sensor", "1", 1e-3, 0.4, _on_angle(lambda y, k, _: _bent(y, k)), signed=True),
    "sensor_lag": PutIn("sensor", "s", 0.001, 0.4, _lagged, "tau_s"),
    "quantisation": PutIn(
        "sensor", "deg", 1e-3, 0.3, _on_angle(lambda y, k, _: np.round(y / k) * k), "step_deg", of_span=True
    ),
    "sensor_noise": PutIn(
        "sensor", "deg", 5e-4, 0.3, _on_angle(lambda y, k, r: y + k * r.standard_normal(len(y))), "std_deg",
        of_span=True,
    ),
    "lost_samples": PutIn("sensor", "1", 0.005, 0.6, _on_angle(lost), "probability"),
    "sensor_dropout": PutIn("sensor", "1", 0.002, 0.2, _on_angle(dropped), "probability"),
    "sensor_eccentricity": PutIn("sensor", "deg", 1e-3, 0.2, _on_angle(_uneven), of_span=True, in_library=False),
    "sensor_backlog": PutIn("sensor", "s", 0.01, 2.0, _behind_buffer, in_library=False),
}  # fmt: skip
"""Effect -> how it is put in."""

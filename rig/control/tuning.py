"""Gains of the feedback from a model, with stated margins.

Of all PI controllers whose maximum sensitivity stays below a bound for every response of the plant at hand, the one
with the most integral action: it takes away disturbances fastest (Åström, Panagopoulos and Hägglund, Automatica 34,
1998). The sensitivity's bound is the margin: 1 / Ms is how near the loop comes to the critical point. The responses are
those of the model at several amplitudes, each with its gain and its lag off by what the model may be wrong.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from rig.control.frequency_response import FrequencyResponse, Response, best_linear_approximation
from rig.control.plant import Plant
from rig.errors import ModelError
from rig.gains import ClosedLoop
from rig.number_text import to_digits
from rig.record import Column

AMPLITUDES_MPA: Final = (0.03, 0.1, 0.2)
"""Sizes at which the plant is looked at; a muscle with hysteresis is stiffer in small movements."""
SENSITIVITY: Final = 1.6
"""Bound of the maximum sensitivity Ms. 1.2 to 2.0 are usual; it implies a gain margin of Ms / (Ms - 1) and a phase
margin of 2 asin(1 / (2 Ms)): 2.7 and 36 degrees."""
OFF: Final = 0.2
"""By how much gain and dead time of the plant may differ from the model's, relative; the bound holds for these too."""
LATER_S: Final = 0.04
"""Further dead time that the bound holds for as well: a rig whose regulators have become slow is to stay stable under
the gains of its good days. Without this, physics rigs with 30 ms more lag swung at their limits."""
INTEGRAL_TIMES_S: Final = (0.0, 0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 0.8)
"""Kp over Ki, s, of which the best is taken; 0: an integral alone. More: a finer choice, and slower."""
_LOWEST, _HIGHEST, _HALVINGS = 1e-5, 1.0, 40
_DIGITS = 3
"""Of a gain: more say nothing about a rig."""


@dataclass(frozen=True)
class Margins:
    """How far a loop is from instability, the worst over the responses that it was judged on."""

    gain: float
    """Factor on the plant's gain."""
    phase_deg: float
    delay_s: float
    """Further dead time."""
    sensitivity: float
    """Ms."""
    crossover_hz: float
    """Highest frequency at which the loop's gain is 1."""

    def __str__(self) -> str:
        return (
            f"gain margin {self.gain:.1f}, phase margin {self.phase_deg:.0f} deg, delay margin "
            f"{1e3 * self.delay_s:.0f} ms, maximum sensitivity {self.sensitivity:.2f}, crossover "
            f"{self.crossover_hz:.2g} Hz"
        )


@dataclass(frozen=True)
class Tuned:
    """Gains and what they leave."""

    gains: ClosedLoop
    nominal: Margins
    """On the model as it is."""
    worst: Margins
    """On the model with gain and lag off, and later."""


def responses(plant: Plant) -> list[FrequencyResponse]:
    """The plant at each of AMPLITUDES_MPA."""
    return [best_linear_approximation(plant, amplitude) for amplitude in AMPLITUDES_MPA]


def tune(
    plants: Sequence[FrequencyResponse], sensitivity: float = SENSITIVITY, off: float = OFF, later_s: float = LATER_S
) -> Tuned:
    """The PI gains for these responses of one plant; ModelError when none keeps the bound."""
    varied = _varied(plants, off, later_s)
    sign = math.copysign(1.0, plants[0].response[0].real)
    best = max((_most_integral(varied, time_s, sensitivity, sign), time_s) for time_s in INTEGRAL_TIMES_S)
    ki, time_s = best
    if ki <= _LOWEST:
        raise ModelError(f"no PI controller keeps the maximum sensitivity below {sensitivity:g} on this model")
    gains = ClosedLoop(
        kp_mpa_per_deg=to_digits(sign * ki * time_s, _DIGITS), ki_mpa_per_deg_s=to_digits(sign * ki, _DIGITS)
    )
    return Tuned(gains, margins(plants, gains), margins(varied, gains))


def margins(plants: Sequence[FrequencyResponse], gains: ClosedLoop) -> Margins:
    """The worst margins of these gains over the responses; gain and delay margin are 0 for an unstable loop."""
    found = [_margins(plant, gains) for plant in plants]
    return Margins(
        min(one.gain for one in found),
        min(one.phase_deg for one in found),
        min(one.delay_s for one in found),
        max(one.sensitivity for one in found),
        max(one.crossover_hz for one in found),
    )


def controller(gains: ClosedLoop, frequency_hz: Column, period_s: float) -> Response:
    """C(f) of the feedback as `rig.realtime.closed_loop` carries it out: integral by the newest error, filtered
    derivative."""
    back = np.exp(-2j * np.pi * frequency_hz * period_s)
    share = period_s / (gains.filter_s + period_s)
    slope = share * (1.0 - back) / period_s / (1.0 - (1.0 - share) * back)
    integral = gains.ki_mpa_per_deg_s * period_s / (1.0 - back)
    return np.asarray(gains.kp_mpa_per_deg + integral + gains.kd_mpa_s_per_deg * slope)


def open_loop(plant: FrequencyResponse, gains: ClosedLoop) -> Response:
    """Controller times plant, at the plant's frequencies."""
    return plant.response * controller(gains, plant.frequency_hz, plant.period_s)


def is_stable(loop: Response) -> bool:
    """The Nyquist criterion for a stable plant and an integrator: 1 + L does not go around 0 from low to high."""
    turned = np.unwrap(np.angle(1.0 + loop))
    return bool(turned[-1] - turned[0] > -0.5 * np.pi)


def _margins(plant: FrequencyResponse, gains: ClosedLoop) -> Margins:
    loop, frequency = open_loop(plant, gains), plant.frequency_hz
    if not is_stable(loop):
        return Margins(0.0, 0.0, 0.0, math.inf, math.nan)
    real_axis = np.flatnonzero((loop.imag[:-1] * loop.imag[1:] < 0.0) & (loop.real[:-1] < 0.0))
    gain = 1.0 / max((abs(loop[k]) for k in real_axis), default=1e-3)
    size = np.abs(loop)
    crossings = np.flatnonzero((size[:-1] - 1.0) * (size[1:] - 1.0) <= 0.0)
    phases = [np.angle(-loop[k]) % (2.0 * np.pi) for k in crossings]
    delays = [phase / (2.0 * np.pi * frequency[k]) for phase, k in zip(phases, crossings, strict=True)]
    return Margins(
        float(gain),
        float(np.degrees(min(phases, default=np.pi))),
        float(min(delays, default=math.inf)),
        float(np.max(1.0 / np.abs(1.0 + loop))),
        float(frequency[crossings[-1]]) if len(crossings) else 0.0,
    )


def _varied(plants: Sequence[FrequencyResponse], off: float, later_s: float) -> list[FrequencyResponse]:
    """Each response as it is, with its gain larger by `off`, and also later by `off` of its lag and `later_s`: what
    makes a loop less stable."""
    out = []
    for plant in plants:
        later = _lag_s(plant) * off + later_s
        shift = np.exp(-2j * np.pi * plant.frequency_hz * later)
        changed = (plant.response, (1.0 + off) * plant.response, (1.0 + off) * plant.response * shift)
        out += [FrequencyResponse(plant.frequency_hz, response, plant.period_s) for response in changed]
    return out


def _lag_s(plant: FrequencyResponse) -> float:
    """How late the plant answers where its loop would cross over: its phase at 3 Hz as a delay, counted on from the
    lowest frequency, because half a turn is behind a plant that is later than 167 ms."""
    at = int(np.argmin(np.abs(plant.frequency_hz - 3.0)))
    turned = np.unwrap(np.angle(plant.response[: at + 1] * np.sign(plant.response[0].real)))
    return float(-turned[-1] / (2.0 * np.pi * plant.frequency_hz[at]))


def _most_integral(plants: Sequence[FrequencyResponse], time_s: float, sensitivity: float, sign: float) -> float:
    """The largest ki with kp = ki time_s that keeps the bound everywhere, by bisection of its logarithm."""

    def keeps(ki: float) -> bool:
        gains = ClosedLoop(sign * ki * time_s, sign * ki)
        loops = [open_loop(plant, gains) for plant in plants]
        return all(np.min(np.abs(1.0 + loop)) >= 1.0 / sensitivity and is_stable(loop) for loop in loops)

    low, high = math.log(_LOWEST), math.log(_HIGHEST)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if keeps(math.exp(middle)) else (low, middle)
    return math.exp(low)

"""The feed-forward: the differential pressure under which a model follows a reference that is known beforehand.

    u <- u + a L (r - F(u)),   L = conj(G) / (|G|^2 + mu^2),   cut off above the frequencies that matter

F is the model with all its hysteresis, G its best linear approximation, L a Wiener inverse of that. L looks ahead, so
dead times and lags of the regulators are met by preview. A step a is only taken when it makes the error smaller, and
halved otherwise, so the error falls at each step and the iteration ends; what is left of it is reported. Set-points
outside the envelope are never proposed: u is brought back into it before it is judged. (Iterative learning control on
the model in place of the rig: Bristow, Tharayil and Alleyne, IEEE Control Systems Magazine 26(3), 2006.)
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from rig.columns import rms
from rig.control.frequency_response import FrequencyResponse
from rig.control.plant import Plant
from rig.record import Column

MOST_ITERATIONS: Final = 60
"""Iterations at most, where LAST_ITERATIONS did not end them before."""
LEAST_IMPROVEMENT: Final = 0.02
"""An iteration that makes the rms error smaller by less than this share is one of the last."""
LAST_ITERATIONS: Final = 4
"""So many of these in a row are the end."""
REGULARISED: Final = 0.05
"""mu over the gain at low frequency: where the plant answers with less than this, it is not inverted."""
CUT_OFF_HZ: Final = 10.0
"""L falls to half here: beyond it no reference of a joint has anything, and a model says little."""
_PADDING_S: Final = 4.0


@dataclass(frozen=True)
class DpBounds:
    """What the envelope leaves to a differential pressure about P0."""

    low_mpa: float
    high_mpa: float
    step_mpa: float
    """Largest change from one tick to the next."""

    def holds(self, dp_mpa: Column, slack_mpa: float = 1e-9) -> bool:
        """No value of these (n,) and no step between them is outside."""
        steps = np.abs(np.diff(dp_mpa, prepend=0.0))
        inside = (dp_mpa >= self.low_mpa - slack_mpa) & (dp_mpa <= self.high_mpa + slack_mpa)
        return bool(np.all(inside) and np.all(steps <= self.step_mpa + slack_mpa))

    def clipped(self, dp_mpa: Column) -> Column:
        """(n,) the nearest that is inside: values cut, then steps, from rest on."""
        out = np.clip(dp_mpa, self.low_mpa, self.high_mpa)
        if np.all(np.abs(np.diff(out, prepend=0.0)) <= self.step_mpa):
            return out
        before = 0.0
        for k, value in enumerate(out):
            before += min(max(value - before, -self.step_mpa), self.step_mpa)
            out[k] = before
        return out


ANYTHING: Final = DpBounds(-np.inf, np.inf, np.inf)


@dataclass(frozen=True)
class Inverse:
    """A feed-forward and how well the model follows with it."""

    dp_mpa: Column
    """One entry a tick of the reference (n,)."""
    residual_deg: Column
    """Reference less the model's angle (n,)."""
    iterations: int

    @property
    def rms_deg(self) -> float:
        """Of the residual."""
        return rms(self.residual_deg)

    @property
    def max_deg(self) -> float:
        """Of the residual, in size."""
        return float(np.max(np.abs(self.residual_deg)))


def invert(
    plant: Plant, response: FrequencyResponse, reference_deg: Column, beyond_deg: Column, box: DpBounds
) -> Inverse:
    """The feed-forward for a reference (n,) that begins at rest at 0 and goes on for `beyond_deg`.

    Nothing is commanded before the reference begins, so the first entry is 0. ModelError when the model diverges.
    """
    whole = np.concatenate([reference_deg, beyond_deg])
    n = len(reference_deg)
    filtered = _Filter(response, len(whole))
    u = np.zeros(len(whole))
    error = whole - plant.angle_deg(u)
    step, idle, done = 1.0, 0, 0
    for _ in range(MOST_ITERATIONS):
        done += 1
        tried = box.clipped(u + step * filtered(error))
        left = whole - plant.angle_deg(tried)
        gained = 1.0 - rms(left) / max(rms(error), 1e-12)
        idle = 0 if gained > LEAST_IMPROVEMENT else idle + 1
        if gained > 0.0:
            u, error = tried, left
            step = min(1.0, 1.5 * step)
        else:
            step *= 0.5
        if idle >= LAST_ITERATIONS:
            break
    return Inverse(u[:n], error[:n], done)


class _Filter:
    """L as a filter over columns of one length, looking both ways, with room on both sides so that nothing goes
    around."""

    def __init__(self, response: FrequencyResponse, length: int) -> None:
        self._before = round(_PADDING_S / response.period_s)
        self._length = length
        self._size = 1 << (length + 2 * self._before - 1).bit_length()
        frequency = np.fft.rfftfreq(self._size, response.period_s).astype(np.float64)
        g = response.at(frequency)
        level = REGULARISED * abs(response.response[0])
        self._transfer = g.conj() / (np.abs(g) ** 2 + level**2) / (1.0 + (frequency / CUT_OFF_HZ) ** 4)

    def __call__(self, error: Column) -> Column:
        padded = np.zeros(self._size)
        padded[self._before : self._before + self._length] = error
        padded[self._before + self._length :] = error[-1]  # it goes on as it ended, so that the end is no step
        padded[: self._before] = error[0]
        padded[self._before + self._length + self._before :] = np.linspace(
            error[-1], error[0], self._size - self._length - 2 * self._before
        )
        out = np.fft.irfft(self._transfer * np.fft.rfft(padded), self._size)
        return np.asarray(out[self._before : self._before + self._length])

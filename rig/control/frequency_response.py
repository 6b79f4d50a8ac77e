"""The best linear approximation of a plant: its frequency response under an excitation of a given size.

A muscle with hysteresis has no one transfer function. What comes nearest to it in the least-squares sense, for random
phases of the input, depends on the amplitude (Pintelon and Schoukens, System Identification, 2nd ed., 2012, chapter 3);
so it is asked for at several.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rig.control.plant import Plant
from rig.record import Column

Response = NDArray[np.complex128]
PERIOD_TICKS: Final = 4096
"""Of one period of the multisine: 20 s at 5 ms, so that its lowest line is 0.05 Hz. More: lower and finer lines, and a
longer simulation."""
PHASES: Final = 4
"""Draws of the phases that are averaged."""
CORNER_HZ: Final = 1.0
"""The amplitudes of the lines fall with the frequency from here on, as a rig's excitation does."""
SMOOTHED: Final = 0.06
"""Lines within this share of a frequency are averaged: between them nothing changes but the distortion."""
POINTS: Final = 1000
"""Frequencies, even in their logarithm, on which margins are looked for. More: slower."""
PHASES_SEED: Final = 5
"""Fixed, so that one model gives one response."""


@dataclass(frozen=True)
class FrequencyResponse:
    """Frequencies (n,), Hz, rising evenly in their logarithm to half the loop's, and the response at each, deg/MPa."""

    frequency_hz: Column
    response: Response
    period_s: float

    def at(self, frequency_hz: Column) -> Response:
        """(m,) deg/MPa at these frequencies (m,): between the lines; below the first and above the last as there."""
        parts = (np.interp(frequency_hz, self.frequency_hz, part) for part in (self.response.real, self.response.imag))
        real, imaginary = parts
        return real + 1j * imaginary


def best_linear_approximation(plant: Plant, amplitude_mpa: float) -> FrequencyResponse:
    """The response under multisines whose sum has the peak `amplitude_mpa`; ModelError when the model diverges."""
    lines = np.arange(1, PERIOD_TICKS // 2, 2)
    frequency = lines / (PERIOD_TICKS * plant.period_s)
    random = np.random.default_rng(PHASES_SEED)
    cross, power = np.zeros(len(lines), dtype=np.complex128), np.zeros(len(lines))
    for _ in range(PHASES):
        u = _multisine(lines, frequency, random)
        u *= amplitude_mpa / np.max(np.abs(u))
        y = plant.angle_deg(np.concatenate([u, u]))[PERIOD_TICKS:]
        of_u, of_y = np.fft.rfft(u)[lines], np.fft.rfft(y)[lines]
        cross += of_y * of_u.conj()
        power += np.abs(of_u) ** 2
    return on_logarithmic_grid(frequency, _smoothed(cross / power), plant.period_s)


def on_logarithmic_grid(frequency_hz: Column, response: Response, period_s: float) -> FrequencyResponse:
    """The response at POINTS frequencies between its first and last line, from (l,) both: a margin does not depend on
    where a line lies."""
    grid = np.geomspace(frequency_hz[0], frequency_hz[-1], POINTS)
    return FrequencyResponse(grid, FrequencyResponse(frequency_hz, response, period_s).at(grid), period_s)


def _multisine(lines: NDArray[np.int64], frequency_hz: Column, random: np.random.Generator) -> Column:
    """One period (PERIOD_TICKS,) with random phases."""
    spectrum = np.zeros(PERIOD_TICKS // 2 + 1, dtype=np.complex128)
    size = 1.0 / np.maximum(1.0, frequency_hz / CORNER_HZ)
    spectrum[lines] = size * np.exp(1j * random.uniform(0.0, 2.0 * np.pi, len(lines)))
    return np.fft.irfft(spectrum, PERIOD_TICKS)


def _smoothed(response: Response) -> Response:
    """The mean over a share of each frequency to both sides; the lines are evenly spaced from the first odd one."""
    total = np.concatenate([[0.0], np.cumsum(response)])
    line = np.arange(len(response))
    half = np.minimum((SMOOTHED * line).astype(int), len(response) - 1 - line)
    return np.asarray((total[line + half + 1] - total[line - half]) / (2 * half + 1))

"""Differential pressure commands for the plant: the paper's signals and others that nothing was trained on.

Written apart from rig.excite on purpose: the plant must not inherit a mistake from the rig.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.random import Generator

from hil.reference.compiling import Array

FADE_S: Final = 0.5
"""In which an excitation comes and goes, s: a joint is not pushed at once."""


class Excitation(NamedTuple):
    """One record's command: dp around P0, p1 = P0 + dp/2, p2 = P0 - dp/2."""

    kind: str
    """sine, triangle, mixed (equation 12), chirp (to frequency_hz and back), steps (smoothed) or multisine."""
    frequency_hz: float
    amplitude_mpa: float
    p0_mpa: float = 0.2
    seconds: float = 20.0
    period_s: float = 0.005
    shape_seed: int = 0
    """Phases of a multisine, levels of steps."""

    @property
    def name(self) -> str:
        """File name of its record: what pairs it with its baseline."""
        return f"{self.kind}_{self.frequency_hz:.2f}hz_{self.amplitude_mpa:.3f}mpa"

    def dp_mpa(self) -> Array:
        """The command over time, shape (n,): faded in and out within half a second, from zero to zero."""
        t = np.arange(round(self.seconds / self.period_s), dtype=float) * self.period_s
        fade = np.clip(np.minimum(t, self.seconds - t) / FADE_S, 0.0, 1.0)
        return np.asarray(self.amplitude_mpa * _SHAPES[self.kind](t, self) * fade, float)


def _sine(t: Array, e: Excitation) -> Array:
    return np.asarray(np.sin(2.0 * math.pi * e.frequency_hz * t))


def _triangle(t: Array, e: Excitation) -> Array:
    return np.asarray(2.0 / math.pi * np.arcsin(np.clip(np.sin(2.0 * math.pi * e.frequency_hz * t), -1.0, 1.0)))


def _mixed(t: Array, e: Excitation) -> Array:
    w = 2.0 * math.pi * e.frequency_hz * t
    return np.asarray(np.sin(w) + 0.6 * np.sin(0.3 * w) + 0.7 * np.sin(1.5 * w) + 0.1 * np.sin(4.0 * w))


def _chirp(t: Array, e: Excitation) -> Array:
    low, half = 0.1, e.seconds / 2.0
    up = np.minimum(t, e.seconds - t)
    turn = low * up + (e.frequency_hz - low) / (2.0 * half) * up * up
    return np.asarray(np.sin(2.0 * math.pi * turn) * np.where(t < half, 1.0, -1.0))


def _steps(t: Array, e: Excitation) -> Array:
    random = np.random.default_rng(e.shape_seed)
    levels = random.uniform(-1.0, 1.0, math.ceil(e.seconds * e.frequency_hz) + 2)
    position = t * e.frequency_hz
    k = position.astype(int)
    blend = np.clip((position - k) / (0.25 * e.frequency_hz), 0.0, 1.0)
    return np.asarray(levels[k] + (levels[k + 1] - levels[k]) * 0.5 * (1.0 - np.cos(math.pi * blend)))


def _multisine(t: Array, e: Excitation) -> Array:
    random = np.random.default_rng(e.shape_seed)
    lines = e.frequency_hz * np.array([0.25, 0.45, 0.75, 1.0, 1.35, 1.8, 2.4])
    phases = random.uniform(0.0, 2.0 * math.pi, len(lines))
    wave = np.sum(np.sin(2.0 * math.pi * lines[:, None] * t + phases[:, None]) / np.sqrt(lines[:, None]), axis=0)
    return np.asarray(wave / np.abs(wave).max())


_SHAPES = {
    "sine": _sine,
    "triangle": _triangle,
    "mixed": _mixed,
    "chirp": _chirp,
    "steps": _steps,
    "multisine": _multisine,
}


def draw_set(random: Generator, n: int, p0_mpa: float) -> list[Excitation]:
    """n excitations of different kind, frequency and amplitude: three of the paper's at drawn sizes, the rest of any
    kind."""
    kinds = [
        "sine",
        "triangle",
        "mixed",
        *random.permutation(["sine", "sine", "triangle", "multisine", "chirp", "mixed"]),
    ]
    return [_draw(str(kind), random, p0_mpa) for kind in kinds[:n]]


def draw_untouched(random: Generator, p0_mpa: float) -> list[Excitation]:
    """Three excitations of kinds and sizes that the diagnosis is never given."""
    return [_draw(kind, random, p0_mpa) for kind in ("steps", "multisine", "sine")]


def _draw(kind: str, random: Generator, p0_mpa: float) -> Excitation:
    frequency = float(np.exp(random.uniform(math.log(0.2), math.log(0.8)))) * (2.0 if kind == "chirp" else 1.0)
    amplitude = float(random.uniform(0.08, 0.20)) * (0.5 if kind == "mixed" else 1.0)
    return Excitation(kind, round(frequency, 2), round(amplitude, 3), p0_mpa, shape_seed=int(random.integers(2**31)))

"""The sweep range as excitations, and whether a model's muscles stay bounded over it.

A model fitted to one sine may diverge at another frequency or amplitude (docs/explanation/paper_findings.md); the
excitations here go into the score of the search, and a denser set judges the result.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rig.errors import ModelError
from rig.excite.signals import Mixed, Signal, Sine, Triangle, sampled
from rig.model.external import KIND as EXTERNAL
from rig.model.kernels import simulate
from rig.model.parameters import Input, Model
from rig.model.swarm_kernel import Inputs, lay_inputs, swarm_peaks
from rig.record import Column, Record

Table = NDArray[np.float64]


@dataclass(frozen=True)
class SweepRange:
    """Over what a model has to stay bounded."""

    low_hz: float = 0.2
    high_hz: float = 0.8
    amplitude_mpa: float = 0.2


@dataclass(frozen=True)
class Verdict:
    """What the dense check says."""

    bounded: bool
    worst: str
    """Label of the excitation with the largest output."""
    peak_deg: float
    limit_deg: float
    failing: list[Signal]


_FASTER, _LARGER = 1.25, 1.1
"""The search keeps a model bounded beyond the range, so that within it there is a margin: it is near instability that
it predicts badly."""


def search_signals(sweep: SweepRange) -> list[Signal]:
    """A few excitations that find most of what diverges: the ends and the middle of the range, sharp corners, the mixed
    sine."""
    middle, fast, size = 0.5 * (sweep.low_hz + sweep.high_hz), _FASTER * sweep.high_hz, _LARGER * sweep.amplitude_mpa
    full: list[Signal] = [Sine(frequency, size) for frequency in (sweep.low_hz, middle, sweep.high_hz, fast)]
    return [*full, Triangle(fast, size), Mixed(middle, size / 2)]


def dense_signals(sweep: SweepRange) -> list[Signal]:
    """Sines and triangles at 13 frequencies and 4 amplitudes, mixed sines at 3: what the verdict is taken on."""
    found: list[Signal] = []
    for frequency in np.linspace(sweep.low_hz, sweep.high_hz, 13):
        for share in (0.25, 0.5, 0.75, 1.0):
            size = float(share * sweep.amplitude_mpa)
            found += [Sine(float(frequency), size), Triangle(float(frequency), size)]
    return found + [Mixed(float(f), sweep.amplitude_mpa / 2) for f in np.linspace(sweep.low_hz, sweep.high_hz, 3)]


@lru_cache(maxsize=256)
def excitation(signal: Signal, dt_s: float, periods: float = 3.0) -> Column:
    """dp (MPa) of some periods of a signal, and at least 4 s of one that has parts slower than its name says."""
    seconds = max(periods / signal.highest_hz, 4.0 if isinstance(signal, Mixed) else 0.0)
    column = np.array(sampled(signal, round(seconds / dt_s) + 1, round(dt_s * 1e9)), dtype=np.float64)
    column.setflags(write=False)  # every verdict asks for the same
    return column


class StabilityTerm:
    """What a parameter set pays for leaving the range of sensible angles under the search's excitations."""

    def __init__(self, signals: Iterable[Signal], model: Model, limit_deg: float, periods: float = 1.5) -> None:
        muscle = model.muscle
        self._y_unit = muscle.value("y_unit_deg")
        self.limit_deg = limit_deg
        u = [excitation(signal, model.sample_time_s, periods) / muscle.value("u_unit_mpa") for signal in signals]
        self._inputs: Inputs = lay_inputs(
            u, [np.zeros(len(column)) for column in u], muscle.value("theta_divisor_s"), [1] * len(u)
        )

    def excess(self, particles: Table, workers: int = 1) -> Table:
        """By how much each particle (columns of a kernel's table) exceeds the limit on each excitation, (signals,
        particles).

        0 within, else the logarithm of peak over limit: smooth enough to be followed back, and finite.
        """
        peaks = swarm_peaks(particles, self._inputs, workers) * self._y_unit
        return np.asarray(np.log(np.maximum(peaks / self.limit_deg, 1.0)))


def check_bounded(model: Model, sweep: SweepRange, limit_deg: float) -> Verdict:
    """Run the whole chain from the command over the dense set; bounded means |angle| within `limit_deg` throughout."""
    worst, peak, failing = "", 0.0, []
    chain = replace(model, effects=[])
    for signal in search_signals(sweep) if model.muscle.kind == EXTERNAL else dense_signals(sweep):
        dp = excitation(signal, model.sample_time_s)
        record = Record(signal.label, np.arange(len(dp), dtype=np.float64) * model.sample_time_s, dp)
        try:
            angle = simulate(chain, record, drive=Input.COMMAND, start_deg=0.0).angle_deg
            reached = float(np.max(np.abs(angle))) if angle is not None else 0.0
        except ModelError:
            reached = float("inf")
        if reached > peak:
            worst, peak = signal.label, reached
        if not reached <= limit_deg:
            failing.append(signal)
    return Verdict(not failing, worst, peak, limit_deg, failing)

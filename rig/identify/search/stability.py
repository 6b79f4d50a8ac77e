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
from rig.excite.signals import MIXED_PARTS, Mixed, Signal, Sine, Triangle, sampled
from rig.model.compiled.swarm import SwarmInputs, lay_inputs, swarm_peaks
from rig.model.external.simulator import KIND as EXTERNAL
from rig.model.parameters import Input, Model
from rig.model.simulation import simulate
from rig.record import Column, Record

Table = NDArray[np.float64]


@dataclass(frozen=True)
class SweepRange:
    """Over what a model has to stay bounded."""

    low_hz: float = 0.2
    high_hz: float = 0.8
    amplitude_mpa: float = 0.2


@dataclass(frozen=True)
class StabilityVerdict:
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
_SEARCH_PERIODS = 1.5
"""Periods of an excitation in the score of the search."""
_PERIODS = 9.0
"""Of one in the verdict: three times what four sines take until they come round again (10/f, three periods of their
slowest, 0.3 f). Of 20000 parameter sets, 4 s of the mixed sine called 418 bounded that it drives beyond the limit
later."""
_LONG_PERIODS = 90.0
"""Where the last third of those reaches further than the one before, by more than a corner between two ticks does."""
_GROWS = 1.02
_SHAPED_MPA = 0.1
"""Amplitude with which a form is computed; the others are multiples of it."""


_FREQUENCIES, _MIXED_FREQUENCIES = 13, 3
"""Of the verdict, evenly over the range: at 0.2 to 0.8 Hz a sine every 0.05 Hz. A resonance narrower than that may lie
between two; the mixed sines last three times as long and are fewer."""
_AMPLITUDES = (0.25, 0.5, 0.75, 1.0)
"""Of the verdict, as shares of the range's: what is bounded at full amplitude may diverge at a smaller one, where less
slips."""


def search_signals(sweep: SweepRange) -> list[Signal]:
    """A few excitations that find most of what diverges: the ends and the middle of the range, sharp corners, the mixed
    sine."""
    middle, fast, size = 0.5 * (sweep.low_hz + sweep.high_hz), _FASTER * sweep.high_hz, _LARGER * sweep.amplitude_mpa
    full: list[Signal] = [Sine(frequency, size) for frequency in (sweep.low_hz, middle, sweep.high_hz, fast)]
    return [*full, Triangle(fast, size), Mixed(middle, size / 2)]


def dense_signals(sweep: SweepRange) -> list[Signal]:
    """Sines and triangles over frequencies and amplitudes, and mixed sines: what the verdict is taken on."""
    found: list[Signal] = []
    for frequency in np.linspace(sweep.low_hz, sweep.high_hz, _FREQUENCIES):
        for share in _AMPLITUDES:
            size = float(share * sweep.amplitude_mpa)
            found += [Sine(float(frequency), size), Triangle(float(frequency), size)]
    middles = np.linspace(sweep.low_hz, sweep.high_hz, _MIXED_FREQUENCIES)
    return found + [Mixed(float(frequency), sweep.amplitude_mpa / 2) for frequency in middles]


def excitation(signal: Signal, dt_s: float, periods: float) -> Column:
    """dp (n,) in MPa of so many periods of a signal, of its slowest part where it has several. ModelError for a signal
    that is none of a check's."""
    if not isinstance(signal, (Sine, Triangle, Mixed)):
        raise ModelError(f"{signal.label}: no excitation of a check; allowed: sine, triangle, mixed")
    shape = _shape(replace(signal, amplitude_mpa=_SHAPED_MPA), dt_s, periods)
    return shape * (signal.amplitude_mpa / _SHAPED_MPA)


@lru_cache(maxsize=256)
def _shape(signal: Sine | Triangle | Mixed, dt_s: float, periods: float) -> Column:
    slowest = min(factor for _, factor in MIXED_PARTS) if isinstance(signal, Mixed) else 1.0
    seconds = periods / (slowest * signal.frequency_hz)
    column = np.array(sampled(signal, round(seconds / dt_s) + 1, round(dt_s * 1e9)), dtype=np.float64)
    column.setflags(write=False)  # every verdict asks for the same
    return column


class StabilityTerm:
    """What a parameter set pays for leaving the range of sensible angles under the search's excitations."""

    def __init__(self, sweep: SweepRange, model: Model, limit_deg: float, failing: Iterable[Signal] = ()) -> None:
        """`limit_deg` is meant at the sweep's amplitude; an excitation that goes beyond that may reach as much farther.
        `failing` are excitations of a verdict, as long as it has them."""
        muscle = model.muscle
        self._y_unit = muscle.value("y_unit_deg")
        self.limit_deg = limit_deg
        asked = [(signal, _SEARCH_PERIODS) for signal in search_signals(sweep)]
        asked += [(signal, _PERIODS) for signal in failing]
        dp = [excitation(each, model.sample_time_s, periods) for each, periods in asked]
        beyond = [max(float(np.max(np.abs(column))) / sweep.amplitude_mpa, 1.0) for column in dp]
        self._limits_deg = limit_deg * np.array(beyond)[:, None]
        u = [column / muscle.value("u_unit_mpa") for column in dp]
        self._inputs: SwarmInputs = lay_inputs(
            u, [np.zeros(len(column)) for column in u], muscle.value("theta_divisor_s"), [1] * len(u)
        )

    def excess(self, particles: Table) -> Table:
        """By how much each particle (columns of a kernel's table) exceeds the limit on each excitation, (signals,
        particles).

        0 within, else the logarithm of peak over limit: smooth enough to be followed back, and finite.
        """
        peaks = swarm_peaks(particles, self._inputs) * self._y_unit
        return np.asarray(np.log(np.maximum(peaks / self._limits_deg, 1.0)))


def check_bounded(model: Model, sweep: SweepRange, limit_deg: float) -> StabilityVerdict:
    """Run the whole chain from the command over the dense set; bounded means |angle| within `limit_deg` throughout."""
    worst, peak, failing = "", 0.0, []
    chain = replace(model, effects=[])
    for signal in search_signals(sweep) if model.muscle.kind == EXTERNAL else dense_signals(sweep):
        reached = _peak_deg(chain, signal, limit_deg)
        if reached > peak:
            worst, peak = signal.label, reached
        if not reached <= limit_deg:
            failing.append(signal)
    return StabilityVerdict(not failing, worst, peak, limit_deg, failing)


def _peak_deg(chain: Model, signal: Signal, limit_deg: float) -> float:
    """Largest |angle| under an excitation, for longer where it still grows; infinite where the model diverges."""
    largest = 0.0
    for periods in (_PERIODS, _LONG_PERIODS):
        dp = excitation(signal, chain.sample_time_s, periods)
        record = Record(signal.label, np.arange(len(dp), dtype=np.float64) * chain.sample_time_s, dp)
        try:
            angle = simulate(chain, record, drive=Input.COMMAND).angle_deg
        except ModelError:
            return float("inf")
        size = np.abs(np.zeros(len(dp)) if angle is None else angle)
        _, before, last = (float(np.max(part)) for part in np.array_split(size, 3))
        largest = float(np.max(size))
        if last <= _GROWS * before or largest > limit_deg:
            break
    return largest

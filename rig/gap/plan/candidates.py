"""Records that could be made: signals over frequencies, amplitudes and rest pressures, inside what the rig allows."""

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, cast

import numpy as np
import yaml

from rig.errors import EnvelopeError
from rig.excite.envelope import check
from rig.excite.run_plan import RunPlan, Waves, expand
from rig.excite.signals import Chirp, Mixed, Multisine, Signal, Sine, Triangle
from rig.excite.steps import Staircase
from rig.excite.sweep import Entry, Sweep, Timing
from rig.gap.plan.settings import MOST_SWING_MPA, PEAK_OF_MIXED, SETTLE_S
from rig.gap.response.propagate import RecordContext

SINES_HZ = (0.1, 0.2, 0.35, 0.5, 0.8, 1.5, 2.5, 4.0)
"""Frequencies of the sines to choose from: close where joints turn from stiffness to inertia, up to FASTEST_HZ."""
TRIANGLES_HZ = (0.1, 0.3, 0.5)
"""Those of the triangles, which show a play or a friction at constant speed: slow ones."""
AMPLITUDE_SHARES = (1.0, 0.4)
"""Amplitudes, as shares of the largest."""
FASTEST_HZ = 4.0
"""Fastest part of any record: there a delay parts from a lag and from an inertia, and above `rig.gap.settings.TOP_HZ`
nothing is compared."""


@dataclass(frozen=True)
class SweepEnvelope:
    """What planned records may ask of a rig; an `rig.excite.envelope.WholeEnvelope`."""

    pressure_mpa: tuple[float, float] = (0.02, 0.45)
    slew_mpa_s: float = 2.0
    swing_mpa: float = 0.2
    """Largest amplitude of dp."""
    rests_mpa: tuple[float, ...] = (0.15, 0.2, 0.25, 0.3)
    """Rest pressures that are tried."""
    angle_deg: tuple[float, float] = (-np.inf, np.inf)
    """Where the joint may be."""


def envelope_within(contexts: Sequence[RecordContext], allowed: SweepEnvelope) -> SweepEnvelope:
    """The part of what is `allowed` that the existing records used: their rest pressures, and at most their
    amplitude."""
    rests = sorted({round(0.5 * float(np.median(t.pair.u1_mpa + t.pair.u2_mpa)), 3) for t in contexts})
    swing = max(float(np.ptp(context.pair.u1_mpa)) for context in contexts)
    return replace(allowed, swing_mpa=min(swing, MOST_SWING_MPA), rests_mpa=tuple(rests))


def candidates(
    envelope: SweepEnvelope, lengths_s: Sequence[float], grid_ns: int, made: "Waves | None" = None
) -> list[Entry]:
    """Every record of the pool that stays inside the envelope on that grid, and in a loop of any shorter period: there
    a sine may be steeper from row to row, which the slew limit allows for. `made`: see `expand`."""
    found: list[Entry] = []
    envelope = replace(envelope, slew_mpa_s=envelope.slew_mpa_s * float(np.sinc(2.0 * FASTEST_HZ * grid_ns * 1e-9)))
    for p0, length in itertools.product(envelope.rests_mpa, lengths_s):
        timing = Timing(settle_s=SETTLE_S, duration_s=length)
        entries = [Entry(signal, timing, (p0,)) for signal in _signals(_largest(envelope, p0), length)]
        found.extend(entry for entry in entries if _fits(entry, envelope, grid_ns, made))
    return found


def planned(entries: Sequence[Entry], grid_ns: int, made: "Waves | None" = None) -> list[RunPlan]:
    """The records on the grid on which they are compared, one for each entry. `made`: see `expand`."""
    return expand(Sweep("planned", tuple(entries)), grid_ns, made)


def lasts_s(entry: Entry) -> float:
    """How long a record takes on the rig, settling and ramps included."""
    return float(sum(asdict(entry.timing).values()))


def lasting_s(entries: Iterable[Entry]) -> float:
    """How long a session takes on the rig."""
    return sum(map(lasts_s, entries))


def sweep_text(name: str, entries: Sequence[Entry], comment: str = "") -> str:
    """The sweep as the YAML that `pamrig run` takes."""
    rests = list(dict.fromkeys(entry.p0_mpa[0] for entry in entries))
    alone = len(rests) == 1
    head: dict[str, Any] = {"name": name, "p0_mpa": rests[:1], "settle_s": SETTLE_S}
    records = [_record(entry, alone) for entry in entries]
    comment_lines = "".join(f"# {line}\n" for line in comment.splitlines())
    return comment_lines + yaml.safe_dump(head | {"records": records}, sort_keys=False, default_flow_style=None)


def _record(entry: Entry, alone: bool) -> dict[str, Any]:
    signal: dict[str, Any] = asdict(cast(Any, entry.signal))
    own = {} if alone else {"p0_mpa": entry.p0_mpa[0]}
    return {type(entry.signal).__name__.lower(): signal, "duration_s": entry.timing.duration_s} | own


def _largest(envelope: SweepEnvelope, p0_mpa: float) -> float:
    low, high = envelope.pressure_mpa
    return _downward(min(envelope.swing_mpa, 2.0 * min(p0_mpa - low, high - p0_mpa)))


def _downward(amplitude_mpa: float) -> float:
    """To whole kPa, never beyond what is allowed."""
    return float(np.floor(amplitude_mpa * 1e3 + 1e-6)) / 1e3


def _signals(largest: float, length_s: float) -> Iterator[Signal]:
    for share in AMPLITUDE_SHARES:
        amplitude = round(share * largest, 3)
        yield from (Sine(hz, amplitude) for hz in SINES_HZ)
        yield from (Triangle(hz, amplitude) for hz in TRIANGLES_HZ)
    yield Mixed(0.5, _downward(largest / PEAK_OF_MIXED))
    yield Multisine(largest, 0.1, FASTEST_HZ, 10.0)
    yield Chirp(largest, 0.1, FASTEST_HZ, length_s)
    yield Staircase(largest, 2, length_s / 10.0, 0.2)


def _fits(entry: Entry, envelope: SweepEnvelope, grid_ns: int, made: "Waves | None") -> bool:
    if min(entry.p0_mpa[0] - envelope.pressure_mpa[0], envelope.pressure_mpa[1] - entry.p0_mpa[0]) <= 0.0:
        return False
    try:
        check(planned([entry], grid_ns, made)[0], envelope, grid_ns)
    except EnvelopeError:
        return False
    return True

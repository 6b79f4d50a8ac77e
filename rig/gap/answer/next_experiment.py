"""What to record next: the sweep under which the causes that are still possible differ most, inside what the rig
already did.

Each candidate sweep is carried through the frozen nominal rig once for each possible cause; the sweep with the largest
smallest difference, counted in floors, is recommended.
"""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
import yaml

from rig.gap.hypotheses.propagate import Applied, Track, lay_tracks, ready, response_with
from rig.gap.records.pairs import Pair, Session
from rig.gap.reference.nominal import Nominal, Reference
from rig.record import Column, Record

PERIOD_S = 0.005
DURATION_S = 10.0
LOW_MPA, HIGH_MPA = 0.02, 0.45
REST_MPA = (0.15, 0.2, 0.3)
_NO_RECORD = Record("planned", np.zeros(2), np.zeros(2))
WORTH = 3.0
"""Expected differences below this many floors are not worth an experiment: a gap of three is what the diagnosis is held
to."""


def recommend(
    possible: Sequence[Applied],
    nominal: Nominal,
    tracks: Sequence[Track],
    floor_deg: float,
    valve_floor_mpa: float | None,
) -> dict[str, Any] | None:
    """The sweep that separates most of the possible causes (likeliest first), as inline YAML, with the expected ratio;
    None when none separates the likeliest from any other.

    `valve_floor_mpa` is the floor of the monitors where they were measured: then the pressures count too.
    """
    if len(possible) < 2:
        return None
    swing = min(max(float(np.ptp(track.pair.u1_mpa)) for track in tracks), 0.4)
    best: tuple[tuple[int, float], dict[str, Any], list[int]] | None = None
    for sweep in _sweeps(swing, nominal.p0_mpa):
        floors = _differences(sweep, possible, nominal, floor_deg, valve_floor_mpa)
        apart = _apart(floors, len(possible))
        weakest = min((floors[pair] for pair in combinations(apart, 2)), default=0.0)
        if len(apart) > 1 and (best is None or (len(apart), weakest) > best[0]):
            best = ((len(apart), weakest), sweep, apart)
    if best is None:
        return None
    (_, weakest), sweep, apart = best
    return {
        "config": yaml.safe_dump({key: value for key, value in sweep.items() if key != "why"}, sort_keys=False),
        "separates": [possible[k].effect for k in apart],
        "expected_ratio": weakest,
        "why": sweep["why"],
        "measure_baseline_too": True,
    }


def _apart(floors: Mapping[tuple[int, int], float], count: int) -> list[int]:
    """Causes that all differ from each other by enough to be worth it: the likeliest, and each next one that joins."""
    kept = [0]
    for k in range(1, count):
        if all(floors[j, k] >= WORTH for j in kept):
            kept.append(k)
    return kept


def _sweeps(swing_mpa: float, p0_mpa: float) -> list[dict[str, Any]]:
    """Candidate sweeps; amplitudes are of dp = p1 - p2 and stay within what was done at each rest pressure."""

    def amplitude(share: float, rest: float) -> float:
        room = 2.0 * min(rest - LOW_MPA, HIGH_MPA - rest)
        return float(round(min(share * swing_mpa * rest / max(p0_mpa, 0.05), share * swing_mpa, room), 3))

    def sweep(name: str, why: str, rests: Sequence[float], *records: dict[str, Any]) -> dict[str, Any]:
        return {
            "name": name,
            "why": why,
            "p0_mpa": list(rests),
            "settle_s": 3.0,
            "duration_s": DURATION_S,
            "records": list(records),
        }

    def sine(hz: float, share: float, rest: float) -> dict[str, Any]:
        return {"sine": {"frequency_hz": hz, "amplitude_mpa": amplitude(share, rest)}}

    lowest = min(REST_MPA)
    return [
        sweep("fast_sine", "delay, lag and inertia part at 4 Hz", [p0_mpa], sine(4.0, 0.3, p0_mpa), sine(2.0, 0.4,
        p0_mpa)),
        sweep("slow_triangle", "play, creep and drift part when the joint moves slowly", [p0_mpa],
              {"triangle": {"frequency_hz": 0.1, "amplitude_mpa": amplitude(1.0, p0_mpa)}}, {"triangle": {"frequency_hz": 0.1, "amplitude_mpa": amplitude(0.3, p0_mpa)}}),  # noqa: E501
        sweep("amplitudes", "gain, bend, ceiling and load part when the amplitude changes", [p0_mpa],
              sine(0.2, 1.0, p0_mpa), sine(0.2, 0.5, p0_mpa), sine(0.2, 0.2, p0_mpa)),
        sweep("cocontraction", "friction, load and mismatch change with the rest pressure; sensor and backlash do not", [float(rest) for rest in REST_MPA],  # noqa: E501
              sine(0.5, 0.8, lowest), {"triangle": {"frequency_hz": 0.2, "amplitude_mpa": amplitude(0.5, lowest)}}),
        sweep("fast_and_slow", "one record where the effect is small, one where it is large", [p0_mpa], sine(0.2, 0.8, p0_mpa), sine(1.5, 0.5, p0_mpa)),  # noqa: E501
    ]  # fmt: skip


def _differences(
    sweep: dict[str, Any],
    possible: Sequence[Applied],
    nominal: Nominal,
    floor_deg: float,
    valve_floor_mpa: float | None,
) -> dict[tuple[int, int], float]:
    """For each pair of causes: how many floors they differ by in the record of the sweep where they differ most."""
    tracks = _virtual(sweep, nominal)
    answers = [[response_with(ready([cause], nominal), track, nominal) for track in tracks] for cause in possible]
    floors = {}
    for one, other in combinations(range(len(possible)), 2):
        strongest = 0.0
        for mine, theirs in zip(answers[one], answers[other], strict=True):
            angle = mine[2] - theirs[2]
            strongest = max(strongest, float(np.std(angle)) / floor_deg, 0.3 * abs(float(np.mean(angle))) / floor_deg)
            if valve_floor_mpa is not None:
                strongest = max(strongest, *(float(np.std(mine[k] - theirs[k])) / valve_floor_mpa for k in (0, 1)))
        floors[one, other] = strongest
    return floors


def _virtual(sweep: dict[str, Any], nominal: Nominal) -> list[Track]:
    """The sweep's records on the nominal rig."""
    t = np.arange(0.0, DURATION_S, PERIOD_S)
    pairs = []
    for rest in sweep["p0_mpa"]:
        for record in sweep["records"]:
            ((kind, numbers),) = record.items()
            phase = 2 * np.pi * numbers["frequency_hz"] * t
            wave = np.sin(phase) if kind == "sine" else 2 / np.pi * np.arcsin(np.sin(phase))
            half = 0.5 * numbers["amplitude_mpa"] * wave
            pairs.append(
                Pair(
                    f"{kind}_{rest}",
                    PERIOD_S,
                    t,
                    rest + half,
                    rest - half,
                    _nothing(t),
                    (),
                    np.ones_like(t),
                    _NO_RECORD,
                    (),
                )
            )
    references = []
    for pair in pairs:
        p1, p2 = nominal.pressures(pair.u1_mpa, pair.u2_mpa, PERIOD_S)
        references.append(Reference(p1, p2, nominal.angle(p1, p2, PERIOD_S)))
    return lay_tracks(pairs, references, nominal)


def _nothing(t: Column) -> Session:
    return Session(None, None, np.zeros_like(t))

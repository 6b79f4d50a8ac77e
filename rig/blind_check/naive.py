"""The baselines that a diagnosis has to beat: always "none", a guess, the largest error after the best lag, a re-tuned
nominal.

They see the same records as the diagnosis and answer with one name, "none" included. They are written to be what people
do.
"""

from collections.abc import Sequence
from hashlib import sha256
from typing import Final

import numpy as np

from rig.columns import rms
from rig.gap.hypotheses.library import LIBRARY
from rig.record import Column, Record

NOTICED: Final = 0.02
"""A change below this share of the signal's own spread goes unnoticed."""
MAX_LAG_S: Final = 0.2
"""Lags are tried up to here, s."""


def naive_answers(
    records: Sequence[Record], baselines: Sequence[Sequence[Record]], token: str, pressures: bool
) -> dict[str, str]:
    """Name of the baseline -> its answer."""
    names = ["none", *LIBRARY]
    pairs = _pairs(records, baselines)
    return {
        "always_none": "none",
        "random": names[int.from_bytes(sha256(token.encode()).digest()) % len(names)],
        "largest_rmse": _largest_rmse(pairs, pressures),
        "retuned": _retuned(pairs),
    }


def _pairs(records: Sequence[Record], baselines: Sequence[Sequence[Record]]) -> list[tuple[Record, Record]]:
    """Each record beside the first baseline of its name and length."""
    baseline_of = {record.name: record for day in reversed(baselines) for record in day}
    return [
        (record, baseline_of[record.name])
        for record in records
        if record.name in baseline_of and len(baseline_of[record.name]) == len(record)
    ]


def _largest_rmse(pairs: Sequence[tuple[Record, Record]], pressures: bool) -> str:
    """The signal with the largest relative error; its lag when that explains half of it, else its gain or offset."""
    columns = ["p1_mpa", "p2_mpa", "angle_deg"] if pressures else ["angle_deg"]
    best_name, worst = "none", NOTICED
    for column in columns:
        for record, healthy in pairs:
            y, y0 = getattr(record, column), getattr(healthy, column)
            if y is None or y0 is None:
                continue
            error, spread = rms(y - y0), float(np.std(y0))
            if error / spread <= worst:
                continue
            worst = error / spread
            lag, left = _best_lag(y, y0, round(MAX_LAG_S / record.period_s))
            best_name = _blamed(column, lag, left < 0.5 * error, abs(float(np.mean(y - y0))) > 0.5 * error)
    return best_name


def _blamed(column: str, lag: int, lagging: bool, shifted: bool) -> str:
    valve = column != "angle_deg"
    if lagging and lag > 0:
        return "valve_lag" if valve else "delay"
    if shifted:
        return "valve_offset" if valve else "sensor_offset"
    return "valve_gain" if valve else "sensor_gain"


def _best_lag(y: Column, y0: Column, most: int) -> tuple[int, float]:
    """(samples by which y is late, rms that is left)."""
    inner = slice(most, len(y) - most)
    left = [rms(y[inner] - y0[most - lag : len(y) - most - lag]) for lag in range(most)]
    lag = int(np.argmin(left))
    return lag, left[lag]


def _retuned(pairs: Sequence[tuple[Record, Record]]) -> str:
    """The common practice: fit gain, offset and lag of the healthy response to the new records and blame what moved
    most."""
    rows, targets, spreads = [], [], []
    for record, healthy in pairs:
        if record.angle_deg is None or healthy.angle_deg is None:
            continue
        y0 = healthy.angle_deg
        rows.append(np.column_stack([y0, np.ones(len(y0)), -np.gradient(y0, record.period_s)]))
        targets.append(record.angle_deg - y0)
        spreads.append(float(np.std(y0)))
    if not rows:
        return "none"
    terms, change = np.concatenate(rows), np.concatenate(targets)
    moved = np.linalg.lstsq(terms, change, rcond=None)[0]
    shares = np.abs(moved) * np.sqrt(np.mean(terms**2, axis=0)) / float(np.mean(spreads))
    worst = int(np.argmax(shares))
    return ("sensor_gain", "sensor_offset", "delay")[worst] if shares[worst] > NOTICED else "none"

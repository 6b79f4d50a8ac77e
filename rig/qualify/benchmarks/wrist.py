"""`pamrig bench wrist`: a real joint as a third kind beside the plant families. What happens to its angle and to its
time base is put into its own records, exactly; the diagnosis has to find it again.

The record is one sweep of 20 s, so there is no second day: the healthy day beside it is the same sweep with the
encoder's noise drawn once more. What is measured is whether effects of sensor and timing are named on a joint that
nobody modelled, and how large they are said to be; not what days differ by. Asked with the pressures and from the angle
alone.
"""

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rig.blind_check.put_in import dropped, lagging, late, lost, reread
from rig.errors import RecordError
from rig.gap.answer.facts import Verdict
from rig.qualify.benchmarks import figure, share

if TYPE_CHECKING:
    from rig.gap.answer.result import Diagnosis
    from rig.record import Column, Record

WRIST_PLACES: Final = ("../shared/real/porcaro_wrist",)
"""Where the wrist's records may lie, from the working folder; or the environment variable PAMRIG_WRIST."""
SWEEP: Final = "exp3_sweep_20260211.csv"
STARTED_S: Final = 0.5
"""The start-up transient before that is left out."""
PERIOD_S: Final = 0.02
COUNT_DEG: Final = 0.18
MIDDLE_DEG: Final = 36.0
RANGE_DEG: Final = 90.0
"""Of the published wrist: the period to which its rows are brought, the step of its encoder, and middle and range of
its angle."""
REPEATS: Final = 5
"""Healthy sets, each with noise of its own."""


def bench_wrist() -> dict[str, Any]:
    """Exact names, classes, sets, sizes of effects put into the record, and false alarms, with the pressures and
    without."""
    healthy = wrist()
    rows: dict[str, Any] = {}
    for mode, pressures in (("pressures", True), ("angle", False)):
        found = [(name, size, asked(put(healthy), healthy, pressures)) for name, size, put in CASES]
        rows |= {f"{name}, {mode}": row for name, row in scored(found, pressures).items()}
        quiet = [asked(again(healthy, seed), healthy, pressures) for seed in range(2, 2 + REPEATS)]
        rows[f"false alarms, {mode}"] = share([one.verdict is not Verdict.NONE for one in quiet], better="lower")
    return rows


def wrist() -> "Record":
    """The sweep on an even time base, without repeated packets, its angle counted from the middle; RecordError when it
    is not there."""
    from rig.record import Record

    for place in (os.environ.get("PAMRIG_WRIST", ""), *WRIST_PLACES):
        if place and (Path(place) / SWEEP).is_file():
            break
    else:
        raise RecordError(f"bench wrist: no {SWEEP}; run beside {WRIST_PLACES[0]} or set PAMRIG_WRIST to its folder")
    table: Any = np.genfromtxt(Path(place) / SWEEP, delimiter=",", names=True)
    rows = table[(table["is_repeat_of_previous_packet"] == 0) & (table["t_s"] > STARTED_S)]
    t = np.arange(rows["t_s"][0], rows["t_s"][-1], PERIOD_S)
    columns = ("u_cmd_DF_MPa", "u_cmd_F_MPa", "y_meas_DF_MPa", "y_meas_F_MPa", "y_wrist_angle_deg")
    first, second, p1, p2, angle = (np.interp(t, rows["t_s"], rows[name]) for name in columns)
    return Record("sweep", t - t[0], first - second, angle - MIDDLE_DEG, p1, p2, first, second)


def asked(case: "Record", healthy: "Record", pressures: bool) -> "Diagnosis":
    """The diagnosis of the case beside the same sweep with other noise."""
    from rig.gap.diagnosis import diagnose

    return diagnose(None, [case], [[again(healthy, 1)]], pressures=pressures)


def again(record: "Record", seed: int) -> "Record":
    """The same with the noise of another reading: half a count."""
    return _read(record, lambda angle, random: angle + 0.5 * COUNT_DEG * random.uniform(-1.0, 1.0, len(angle)), seed)


def _read(record: "Record", law: Callable[["Column", np.random.Generator], "Column"], seed: int = 7) -> "Record":
    return reread(record, lambda angle: law(angle, np.random.default_rng(seed)))


Put = Callable[["Record"], "Record"]


def _sensor(law: Callable[["Column", float, np.random.Generator], "Column"]) -> Callable[[float], Put]:
    """What happens to the angle, by its size."""
    return lambda size: lambda record: _read(record, lambda angle, random: law(angle, size, random))


def _cases() -> list[tuple[str, float, Put]]:
    sizes: dict[str, tuple[Sequence[float], Callable[[float], Put]]] = {
        "delay": ((0.01, 0.03, 0.06), lambda size: lambda record: late(record, size)),
        "clock_drift": ((-0.004, 0.008), lambda size: lambda record: late(record, -size * record.t_s)),
        "sensor_gain": ((-0.1, -0.05, 0.05, 0.1), _sensor(lambda y, size, _: (1.0 + size) * y)),
        "sensor_offset": ((-4.0, -2.0, 2.0, 4.0), _sensor(lambda y, size, _: y + size)),
        "sensor_drift": (
            (-15.0, 15.0, 30.0),
            _sensor(lambda y, size, _: y + size / 60.0 * PERIOD_S * np.arange(len(y))),
        ),
        "sensor_nonlinearity": ((-0.15, 0.15), _sensor(lambda y, size, _: y + size * y * np.abs(y) / 40.0)),
        "sensor_lag": ((0.02, 0.04, 0.08), _sensor(lambda y, size, _: lagging(y, size, PERIOD_S))),
        "quantisation": ((2.0, 4.0), _sensor(lambda y, size, _: np.round(y / size) * size)),
        "sensor_noise": ((1.0, 2.0), _sensor(lambda y, size, random: y + size * random.standard_normal(len(y)))),
        "lost_samples": ((0.05, 0.2), _sensor(lost)),
        "sensor_dropout": ((0.01, 0.05), _sensor(lambda y, size, random: dropped(y, size, random, -RANGE_DEG))),
    }
    return [(name, size, made(size)) for name, (some, made) in sizes.items() for size in some]


CASES: Final = _cases()
NUMBERS: Final = {
    "delay": "delay_s", "clock_drift": "drift", "sensor_gain": "gain", "sensor_offset": "offset_deg",
    "sensor_drift": "rate_deg_min", "sensor_lag": "tau_s", "quantisation": "step_deg", "sensor_noise": "std_deg",
    "lost_samples": "probability", "sensor_dropout": "probability",
}  # fmt: skip
"""The library's number that is the size put in."""


def scored(found: "Sequence[tuple[str, float, Diagnosis]]", pressures: bool) -> dict[str, Any]:
    """Shares with their intervals, and the median error of sizes."""
    from rig.gap.hypotheses.library import LIBRARY, effect_class

    exact, alike, held, errors = [], [], [], []
    for name, size, said in found:
        first = next((cause for cause in said.causes if cause.effect in LIBRARY), None)
        exact.append(first is not None and first.effect == name)
        word = effect_class(name, pressures)
        alike.append(first is not None and effect_class(first.effect, pressures) == word)
        held.append(first is not None and name in (first.effect, *first.ambiguous_with))
        if first is not None and first.effect == name and NUMBERS.get(name) in first.parameters:
            errors.append(abs(first.parameters[NUMBERS[name]].value / size - 1.0))
    rows = {
        "detected": share([said.verdict is not Verdict.NONE for _, _, said in found]),
        "exact name first": share(exact), "class first": share(alike), "truth in the set": share(held),
    }  # fmt: skip
    return (
        rows | {"size, median error": figure(100.0 * float(np.median(errors)), "%", why="a size is right or it is not")}
        if errors
        else rows
    )

"""`pamrig bench tracking`: what closing the gap is worth, and what closing the loop costs.

On the simulated rig and on two physics rigs that share no law with the simulator: the tracking error with PI alone,
with the inverse of the identified model before it, and, when the rig has changed, with the inverse of the simulator
that the diagnosis augmented. Every step is a command as a user would type it, in virtual time. Beside it the loop's own
work a tick, open and closed.
"""

import json
import math
from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import yaml

from rig.app import compose, shipped
from rig.config import read_yaml
from rig.gains import ClosedLoop
from rig.qualify import lateness
from rig.qualify.benchmarks import figure
from rig.qualify.benchmarks.commands import pamrig
from rig.realtime.closed_loop import TrackingProgram
from rig.realtime.program import Program
from rig.rig_config import RigConfig
from rig.sample import Phase
from rig.service.records.lateness import quantiles

TURN_S = 15.0
"""Of each turn of the loop's work."""
TURNS = 3
HEALTHY_DAYS = 3
"""Turns of the loop's work, of which the middle one counts; and healthy days before the one that is followed."""
SWEEP: str | Path = "gap"
"""Of a day."""
REFERENCE: str | Path = "tracking"
"""What is followed."""
_VIRTUAL = ("--clock", "virtual")
Errors = dict[tuple[str, str], float]
"""(reference, feed-forward) -> RMSE in degrees."""


@dataclass(frozen=True)
class TrackingCase:
    """One rig, and what happens to it."""

    name: str
    rig: str
    """Of those that come with pamrig."""
    changed: Mapping[str, Any] = field(default_factory=dict)
    """Settings of its device when it has changed."""


def _effect(name: str, **parameters: float) -> dict[str, Any]:
    return {"effects": [{"effect": name, "parameters": parameters}]}


CASES = (
    TrackingCase("simulated, slow valves", "simulated", _effect("valve_lag", tau_s=0.03, tau0_s=0.0425)),
    TrackingCase("simulated, weak muscle", "simulated", _effect("muscle_mismatch", mismatch=-0.15)),
    TrackingCase("mckibben, slow valves", "physics_mckibben", {"effects": {"valve_lag": 0.03}}),
    TrackingCase("mckibben, late set-points", "physics_mckibben", {"effects": {"delay": 0.03}}),
    TrackingCase("fluidic, slow valves", "physics_fluidic", {"effects": {"valve_lag": 0.03}}),
    TrackingCase("fluidic, viscous joint", "physics_fluidic", {"effects": {"viscous_friction": 1.0}}),
)


def bench_tracking() -> dict[str, Any]:
    """RMSE of each case and reference beside PI alone, and beside the healthy rig; the tick's work."""
    rows: dict[str, Any] = {}
    with TemporaryDirectory(prefix="pamrig-tracking-") as folder:
        healthy: dict[str, tuple[Path, Errors]] = {}
        for case in CASES:
            if case.rig not in healthy:
                healthy[case.rig] = _healthy(Path(folder) / case.rig, case.rig)
            place, before = healthy[case.rig]
            rows |= _compared(case.name, before, _changed(place, case))
    return rows | _work()


def _compared(name: str, healthy: Errors, changed: Errors) -> dict[str, Any]:
    """A row a reference, and the mean over all by squares."""
    references = list(dict.fromkeys(reference for reference, _ in healthy))
    rows: dict[str, Any] = {}
    for reference in (*references, "all"):
        was, now = (_of(errors, reference) for errors in (healthy, changed))
        rows |= {
            f"{name}: {reference}, healthy, inverse": figure(was["model"], "deg", "PI alone", was["none"], seeded=True),
            f"{name}: {reference}, changed, inverse": figure(now["model"], "deg", "PI alone", now["none"], seeded=True),
            f"{name}: {reference}, changed, augmented": figure(
                now["augmented"], "deg", "changed, inverse", now["model"], seeded=True
            ),
            f"{name}: {reference}, augmented over healthy": figure(
                now["augmented"], "deg", "healthy, inverse", was["model"], seeded=True, goal=1.1 * was["model"]
            ),
        }
    return rows


def _of(errors: Errors, reference: str) -> dict[str, float]:
    """Feed-forward -> RMSE of that reference, or of all."""
    kinds = dict.fromkeys(kind for _, kind in errors)
    found = {
        kind: [e for (name, own), e in errors.items() if own == kind and reference in (name, "all")] for kind in kinds
    }
    return {kind: math.sqrt(math.fsum(e * e for e in each) / len(each)) for kind, each in found.items()}


def _healthy(place: Path, rig: str) -> tuple[Path, Errors]:
    """Days on the healthy rig, the model from the first, gains from that, and how well it then follows."""
    place.mkdir()
    for day in range(1, HEALTHY_DAYS + 1):
        pamrig("run", SWEEP, "--rig", _rig(place, rig, day, {}), *_VIRTUAL, "-o", place / f"day_{day}")
    pamrig("identify", place / "day_1", "--early-stop", "100", "-o", place / "model.yaml")
    pamrig("tune", "--model", place / "model.yaml", "--tracking", REFERENCE, "-o", place / "reference.yaml")
    followed = _track(place, _rig(place, rig, HEALTHY_DAYS + 1, {}), "healthy", ("none", "model"))
    return place, followed


def _changed(place: Path, case: TrackingCase) -> Errors:
    """The same rig on a later day, changed: diagnosed, and followed with what was found."""
    name = case.name.replace(", ", "_").replace(" ", "_")
    rig, log, augmented = (
        _rig(place, case.rig, HEALTHY_DAYS + 1, case.changed),
        place / f"{name}_log",
        place / f"{name}_augmented.yaml",
    )
    pamrig("run", SWEEP, "--rig", rig, *_VIRTUAL, "-o", log)
    days = [word for day in range(1, HEALTHY_DAYS + 1) for word in ("--baseline", place / f"day_{day}")]
    pamrig("gap", "diagnose", "--model", place / "model.yaml", "--log", log, *days, "--augmented-model", augmented)
    more = ("--augmented", augmented)
    return _track(place, rig, name, ("none", "model", "augmented"), more)


def _track(place: Path, rig: Path, name: str, kinds: Sequence[str], more: Sequence[object] = ()) -> Errors:
    wanted = [word for kind in kinds for word in ("--feedforward", kind)]
    output = pamrig(
        "track", place / "reference.yaml", "--rig", rig, "--model", place / "model.yaml", *more, *wanted, *_VIRTUAL,
        "-o", place / f"{name}_followed", "--json", "-",
    )  # fmt: skip
    return {(run["reference"], run["feedforward"]): run["rmse_deg"] for run in json.loads(output)["runs"]}


def _rig(place: Path, rig: str, day: int, changed: Mapping[str, Any]) -> Path:
    """The rig's YAML for that day, which is its seed where days are drawn by that."""
    raw: Any = read_yaml(shipped.configs() / "rigs" / f"{rig}.yaml")
    device = raw["devices"]["main"]
    device |= {"seed" if "model" in device else "day": day, **changed}
    if "model" in device:
        device["model"] = str(shipped.configs() / "rigs" / device["model"])
    path = place / f"rig_{day}{'_changed' if changed else ''}.yaml"
    path.write_text(yaml.safe_dump(raw), encoding="utf-8")
    return path


def _work() -> dict[str, Any]:
    """Read to write of a tick in its sweep, open and closed in turns: for each the middle turn."""
    rig = compose.load(None)
    found: dict[str, list[dict[str, float]]] = {"open": [], "closed": []}
    for _ in range(TURNS):
        for name, program in (("open", lateness.at_rest), ("closed", closed_at_rest)):
            samples, _ = lateness.loop_samples(rig, TURN_S, program)
            swept = [s for s in samples if s.phase == Phase.SWEEP]
            found[name].append(quantiles([(s.written_ns - s.woken_ns) / 1e3 for s in swept]))
    middle = {
        name: {key: sorted(turn[key] for turn in turns)[TURNS // 2] for key in ("p50", "p99")}
        for name, turns in found.items()
    }
    return {
        f"tick's own work, closed loop, {key}": figure(middle["closed"][key], "us", "open loop", middle["open"][key])
        for key in ("p50", "p99")
    }


def closed_at_rest(rig: RigConfig, ticks: int) -> Program:
    """A closed loop that holds the angle of the safe pressures."""
    p1_mpa, p2_mpa, none = rig.safe.p1_mpa, rig.safe.p2_mpa, array("d")
    p1, p2, zero = (array("d", [value]) * ticks for value in (p1_mpa, p2_mpa, 0.0))
    gains = ClosedLoop(0.0025, 0.12, kd_mpa_s_per_deg=1e-5, error_deg=180.0)
    return TrackingProgram(1, p1_mpa, p2_mpa, p1, p2, 0, 10, 0, 0, none, none, zero, gains, rig.period_ns * 1e-9)

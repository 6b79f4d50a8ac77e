"""`pamrig bench loop`: lateness of the full loop beside cyclictest, idle and loaded, and what a tick's own work
consists of."""

import os
import time
from dataclasses import replace
from typing import Any

from rig.app import compose
from rig.qualify import lateness
from rig.qualify.benchmarks import figure
from rig.realtime.ring import Ring, RingWriter
from rig.rig_config import RigConfig
from rig.sample import Sample
from rig.service.records.lateness import quantiles

LOOP_ROUNDS = 1
"""Within a round of `pamrig bench`, which makes several."""
SECONDS = 10.0
"""Of each loop and of each run of cyclictest beside it, s."""
_COUNTED = "missed ticks are counted"
_PARTS = "the parts of a tick show where its time goes"


def bench_loop() -> dict[str, Any]:
    """Loop and cyclictest in turns, so that a drift of the machine meets both."""
    rig = compose.load(None)
    idle, idle_peer, samples = _in_turns(rig)
    with lateness.load() as what:
        loaded, loaded_peer, loaded_samples = _in_turns(rig)
    figures: dict[str, Any] = {}
    for name, ours, peer in (("idle", idle, idle_peer), (f"loaded by {what}", loaded, loaded_peer)):
        for key in ("p50", "p99", "max"):
            figures[f"lateness {key}, {name}"] = figure(ours[key], "us", "cyclictest", peer.get(key))
    figures["missed ticks, idle"] = figure(sum(s.missed for s in samples), "ticks", of=len(samples), why=_COUNTED)
    figures["missed ticks, loaded"] = figure(
        sum(s.missed for s in loaded_samples), "ticks", of=len(loaded_samples), why=_COUNTED
    )
    return figures | _work(samples) | _unrehearsed(rig, samples)


def _in_turns(rig: RigConfig) -> tuple[dict[str, float], dict[str, float], list[Sample]]:
    """Quantiles of the loop and of cyclictest, for each the middle one of the rounds: a stall of the machine meets one
    round."""
    samples: list[Sample] = []
    ours: list[dict[str, float]] = []
    peers: list[dict[str, float]] = []
    for _ in range(LOOP_ROUNDS):
        found = lateness.loop_samples(rig, SECONDS)[0]
        ours.append(lateness.lateness_us(found))
        peers.append(lateness.cyclictest_us(SECONDS, rig.realtime.fifo_priority, rig.period_ns) or {})
        samples += found
    return _middle(ours), _middle(peers), samples


def _middle(rounds: list[dict[str, float]]) -> dict[str, float]:
    """Key by key; without the keys that some round lacks."""
    common = [key for key in ("p50", "p99", "max") if all(key in found for found in rounds)]
    return {key: sorted(found[key] for found in rounds)[len(rounds) // 2] for key in common}


def _work(samples: list[Sample]) -> dict[str, Any]:
    """From waking to the hand-off, and its parts."""
    handoff = _handoff_us(samples[-1])
    parts = {
        "read the device": [(s.read_ns - s.woken_ns) / 1e3 for s in samples],
        "check, command, guard, write": [(s.written_ns - s.read_ns) / 1e3 for s in samples],
        "hand-off to the ring": handoff,
    }
    figures = {}
    whole = quantiles([(s.written_ns - s.woken_ns) / 1e3 for s in samples])
    for key in ("p50", "p99"):
        figures[f"tick's own work {key}"] = figure(whole[key] + quantiles(handoff)[key], "us", why=_PARTS)
        for part, values in parts.items():
            figures[f"of it: {part}, {key}"] = figure(quantiles(values)[key], "us", why=_PARTS)
    return figures


def _unrehearsed(rig: RigConfig, rehearsed: list[Sample]) -> dict[str, Any]:
    """The same loop, idle, when it sleeps until each tick: what waking early and rehearsing buys."""
    samples, _ = lateness.loop_samples(replace(rig, realtime=replace(rig.realtime, early_us=0)), SECONDS)
    return {
        f"without rehearsal: {what} {key}": figure(found[key], "us", "rehearsed", before[key])
        for what, found, before in (
            ("lateness", lateness.lateness_us(samples), lateness.lateness_us(rehearsed)),
            ("read to write", _read_to_write_us(samples), _read_to_write_us(rehearsed)),
        )
        for key in ("p50", "p99")
    }


def _read_to_write_us(samples: list[Sample]) -> dict[str, float]:
    return quantiles([(s.written_ns - s.woken_ns) / 1e3 for s in samples])


def _handoff_us(sample: Sample) -> list[float]:
    """Time of single hand-offs of `sample` to a ring of its own."""
    ring = Ring.create(f"bench-{os.getpid()}", 1)
    writer = RingWriter(ring)
    times = []
    for _ in range(20_000):
        start = time.perf_counter_ns()
        writer.put(sample)
        times.append((time.perf_counter_ns() - start) / 1e3)
    ring.block.unlink()
    return times

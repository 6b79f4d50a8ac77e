"""Which benchmarks there are, and how one is run by its name.

A benchmark is a module of this folder with a function `bench_NAME() -> {figure: {value, unit, peer, peer_value,
ratio}}`.
"""

import importlib
from collections.abc import Callable
from typing import Any, NamedTuple


class Benchmark(NamedTuple):
    """Where a benchmark lives, imported when it is run, and how many rounds of it say how far it varies."""

    place: str
    rounds: int = 5


BENCHMARKS = {
    "loop": Benchmark("rig.qualify.benchmarks.loop:bench_loop", 3),
    "record": Benchmark("rig.qualify.benchmarks.record:bench_record"),
    "identify": Benchmark("rig.qualify.benchmarks.identify:bench_identify"),
    "log": Benchmark("rig.qualify.benchmarks.log:bench_log", 3),
    "devices": Benchmark("rig.qualify.benchmarks.devices.all_devices:bench_devices", 3),
    "safety": Benchmark("rig.qualify.benchmarks.safety:bench_safety", 1),
    "gap": Benchmark("rig.qualify.benchmarks.gap:bench_gap", 1),
    "tracking": Benchmark("rig.qualify.benchmarks.tracking:bench_tracking", 1),
    "page": Benchmark("rig.qualify.benchmarks.page:bench_page", 1),
    "history": Benchmark("rig.qualify.benchmarks.history:bench_history", 1),
    "waits": Benchmark("rig.qualify.benchmarks.waits:bench_waits", 3),
    "check": Benchmark("rig.qualify.benchmarks.waits:bench_check", 1),
    "wrist": Benchmark("rig.qualify.benchmarks.wrist:bench_wrist", 1),
}
"""What a seed fixes, or what takes minutes, is measured once."""


def run_benchmark(name: str, rounds: int | None) -> dict[str, Any]:
    """Its figures by name, from so many rounds or its own number of them."""
    from rig.qualify.figures.rounds import measured

    module, function = BENCHMARKS[name].place.split(":")
    run: Callable[[], dict[str, Any]] = getattr(importlib.import_module(module), function)
    return measured(run, rounds or BENCHMARKS[name].rounds)

"""`pamrig bench`: the project's own benchmarks, each beside its peer in the same run.

A benchmark is a module of rig.qualify.benchmarks with a function `bench_NAME() -> {figure: {value, unit, peer,
peer_value, ratio}}`.
"""

import importlib
from typing import Any

import click

from rig.app.terminal import console, listing, progress
from rig.cli.common import emit, json_option
from rig.cli.outputs import Command
from rig.errors import CheckFailed

BENCHMARKS = {
    "loop": "rig.qualify.benchmarks.loop:bench_loop",
    "record": "rig.qualify.benchmarks.record:bench_record",
    "identify": "rig.qualify.benchmarks.identify:bench_identify",
    "log": "rig.qualify.benchmarks.log:bench_log",
    "devices": "rig.qualify.benchmarks.devices:bench_devices",
    "safety": "rig.qualify.benchmarks.safety:bench_safety",
    "gap": "rig.qualify.benchmarks.gap:bench_gap",
    "tracking": "rig.qualify.benchmarks.tracking:bench_tracking",
    "page": "rig.qualify.benchmarks.page:bench_page",
    "wrist": "rig.qualify.benchmarks.wrist:bench_wrist",
}
"""Name -> where it lives; imported when it is run."""


@click.command(cls=Command)
@click.argument("names", nargs=-1, type=click.Choice(list(BENCHMARKS)))
@json_option
def bench(names: tuple[str, ...], json_to: str | None) -> None:
    """Run the benchmarks NAMES, or all. Quote the ratios: absolute times are this machine's."""
    chosen = names or tuple(BENCHMARKS)
    results: dict[str, Any] = {"machine": _machine()}
    lacking: list[str] = []
    with progress("benchmarks", len(chosen)) as update:
        for done, name in enumerate(chosen):
            update(done, name)
            try:
                results[name] = _run(name)
            except ModuleNotFoundError as error:
                lacking.append(f"{name} needs the package {error.name}, which is not installed")
            if json_to != "-":
                emit(results, json_to)  # what was measured is kept, whatever comes after it
    if json_to == "-":
        emit(results, json_to)
    for name in [name for name in chosen if name in results]:
        show(name, results[name], json_to)
    if lacking:
        raise CheckFailed("; ".join(lacking))


def _run(name: str) -> dict[str, Any]:
    module, function = BENCHMARKS[name].split(":")
    figures: dict[str, Any] = getattr(importlib.import_module(module), function)()
    return figures


def _machine() -> dict[str, Any]:
    import os
    import platform

    model = ""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            model = next((line.split(":", 1)[1].strip() for line in file if line.startswith("model name")), "")
    except OSError:
        pass  # not Linux
    return {
        "cpu": model or platform.processor(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
    }


def show(name: str, figures: dict[str, Any], json_to: str | None) -> None:
    """The table of one benchmark."""
    from rig.qualify.benchmarks import cells

    table = listing(name, "value", "unit", "peer", "peer's value", "ratio")
    for figure, row in figures.items():
        table.add_row(figure, *cells(row))
    console(json_to).print(table)

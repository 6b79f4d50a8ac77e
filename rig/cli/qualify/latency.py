"""`pamrig latency`: can this machine hold the period? The full loop beside cyclictest."""

from pathlib import Path

import click

from rig.app.terminal import console, listing
from rig.cli.common import Number, emit, json_option, rig_option
from rig.cli.outputs import Command


@click.command(cls=Command)
@click.option(
    "--seconds",
    type=Number(1, 86400),
    default=10.0,
    show_default=True,
    help="How long to measure each of the two.",
)
@rig_option("Rig whose period and priority to use; default: the simulated rig.")
@json_option
def latency(seconds: float, rig_path: Path | None, json_to: str | None) -> None:
    """Run the loop with the simulated rig and recording, then cyclictest at the same priority, and compare how late
    they wake.

    Nothing real is moved. Exit status 1 when a period was missed.
    """
    from rig.app import compose
    from rig.errors import CheckFailed, RigError
    from rig.qualify import lateness

    rig = compose.load(rig_path)
    if not compose.is_simulated(rig):
        raise RigError(
            f"{rig.path}: latency holds the rig at rest and needs a simulated one; use `pamrig devices probe` for a "
            "real device"
        )
    samples, granted = lateness.loop_samples(rig, seconds)
    reference = lateness.cyclictest_us(seconds, rig.realtime.fifo_priority, rig.period_ns)
    late = lateness.lateness_us(samples)
    missed = sum(s.missed for s in samples)
    _show(late, reference, granted, missed, len(samples), rig.period_ns, json_to)
    result = {
        "loop_us": late,
        "cyclictest_us": reference or {},
        "ratio_p99": late["p99"] / reference["p99"] if reference else None,
        "granted": {name: answer == "granted" for name, answer in granted.items()},
        "realtime": granted,
        "ticks": len(samples),
        "missed": missed,
        "period_ns": rig.period_ns,
    }
    emit(result, json_to)
    if missed:
        raise CheckFailed(f"{missed} of {len(samples) + missed} periods of {rig.period_ns / 1e6:g} ms were missed")


def _show(
    late: dict[str, float],
    reference: dict[str, float] | None,
    granted: dict[str, str],
    missed: int,
    ticks: int,
    period_ns: int,
    json_to: str | None,
) -> None:
    terminal = console(json_to)
    table = listing("woke late by (us)", "p50", "p99", "max")
    table.add_row("pamrig's loop", *(f"{late[key]:.0f}" for key in ("p50", "p99", "max")))
    if reference:
        table.add_row("cyclictest", *(f"{reference[key]:.0f}" for key in ("p50", "p99", "max")))
        table.add_row("ratio", *(f"{late[key] / max(reference[key], 1):.2f}" for key in ("p50", "p99", "max")))
    terminal.print(table)
    if not reference:
        terminal.print("cyclictest is not here or not permitted; Debian has it in the package rt-tests")
    terminal.print(f"{ticks} ticks of {period_ns / 1e6:g} ms, {missed} missed")
    terminal.print("real-time measures: " + ", ".join(f"{name} {answer}" for name, answer in granted.items()))

"""`pamrig bench`: the project's own benchmarks, each beside its peer in the same run, and beside an earlier run."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from rig.app.terminal import console, listing, progress
from rig.cli.common import emit, json_option
from rig.cli.outputs import Command
from rig.errors import CheckFailed
from rig.qualify.benchmarks.catalog import BENCHMARKS, run_benchmark


@click.command(cls=Command)
@click.argument("names", nargs=-1, type=click.Choice(list(BENCHMARKS)))
@click.option(
    "--against",
    metavar="FILE",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Compare with the figures of an earlier `--json FILE`; status 1 when a ratio is worse beyond its spread.",
)
@click.option(
    "--add", is_flag=True, help="Keep what the `--json FILE` holds of other benchmarks, measured on the same machine."
)
@click.option("--rounds", type=click.IntRange(1, 100), help="Measure each benchmark so many times.  [default: 1 to 5]")
@json_option
def bench(names: tuple[str, ...], against: Path | None, add: bool, rounds: int | None, json_to: str | None) -> None:
    """Run the benchmarks NAMES, or all. Quote the ratios: absolute times are this machine's."""
    from rig.qualify.figures.comparison import compared, earlier

    chosen = names or tuple(BENCHMARKS)
    before = earlier(against) if against else None
    results, failed = _measured(chosen, rounds, json_to, _kept(add, chosen, json_to))
    comparison = compared(before, results, str(against)) if before else None
    if comparison:
        results["against"] = {"file": str(against), **comparison.to_json()}
    if comparison or json_to == "-":
        emit(results, json_to)
    for name in [name for name in chosen if name in results]:
        show(name, results[name], json_to)
    if comparison:
        show_moves(results["against"], json_to)
    if comparison and comparison.worse:
        failed.append(f"{len(comparison.worse)} of {len(comparison.moves)} ratios are worse than in {against}")
    if failed:
        raise CheckFailed("; ".join(failed))


def _kept(add: bool, chosen: Sequence[str], json_to: str | None) -> dict[str, Any]:
    """What an earlier run of the same machine has measured of other benchmarks, where that is to be kept."""
    from rig.qualify.figures.comparison import joined
    from rig.qualify.figures.machine import machine

    if not add:
        return {"machine": machine()}
    if json_to in (None, "-"):
        raise click.UsageError("--add: to which file? --json FILE is missing")
    return joined(Path(str(json_to)), machine(), chosen)


def _measured(
    chosen: Sequence[str], rounds: int | None, json_to: str | None, results: dict[str, Any]
) -> tuple[dict[str, Any], list[str]]:
    """The figures, beside those in `results`, and why some could not be had."""
    lacking: list[str] = []
    with progress("benchmarks", len(chosen)) as update:
        for done, name in enumerate(chosen):
            update(done, name)
            try:
                results[name] = run_benchmark(name, rounds)
            except ModuleNotFoundError as error:
                lacking.append(f"{name} needs the package {error.name}, which is not installed")
            if json_to != "-":
                emit(results, json_to)  # what was measured is kept, whatever comes after it
    return results, lacking


def show(name: str, figures: dict[str, Any], json_to: str | None) -> None:
    """The table of one benchmark."""
    from rig.qualify.benchmarks import cells

    table = listing(name, "value", "unit", "peer", "peer's value", "ratio", "limit", "of it", "goal")
    for figure, row in figures.items():
        table.add_row(figure, *cells(row))
    console(json_to).print(table)


def show_moves(against: dict[str, Any], json_to: str | None) -> None:
    """What has moved since the earlier run beyond its spread."""
    table = listing("figure", "was", "is", "moved by", "spread", "")
    for verdict in ("worse", "better"):
        for move in against[verdict]:
            shown = [f"{move['was']:.3g}", f"{move['now']:.3g}", f"{move['by']:+.0%}", f"{move['spread']:.0%}", verdict]
            table.add_row(f"{move['benchmark']}: {move['figure']}", *shown)
    terminal = console(json_to)
    terminal.print(table)
    terminal.print(
        f"{against['judged']} ratios judged against {against['file']}: {len(against['worse'])} worse, "
        f"{len(against['better'])} better; {len(against['unjudged'])} have no ratio or no spread"
    )
    for name in against["gone"]:
        terminal.print(f"no longer measured: {name}")

"""`pamrig identify` and `pamrig validate`: a model from logs, and how well a model predicts logs."""

import os
from collections.abc import Callable, Collection, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import click

from rig.app.terminal import console
from rig.cli import memory_room
from rig.cli.common import Number, emit, json_option, with_options
from rig.cli.outputs import Command, Output, output_option, refuse_options, write_errors_last
from rig.outputs import OutputKind

if TYPE_CHECKING:
    from rig.identify.fit import Identified, Report
    from rig.identify.records.data import RecordOptions
    from rig.identify.search.stability import SweepRange
    from rig.record import Record

P = TypeVar("P")
_SEARCH_MB = 800
"""Of address space for a search whose machine code is made anew, as measured; where LLVM finds less, it ends the
process."""
_OF_A_TEMPLATE = ("kind", "drive", "joint", "free_offset", "mean_exponent", "p0_mpa", "u_unit_mpa", "sample_time_s")
"""What a model is made by where none is given by --start."""
_LOGS = click.argument("logs", nargs=-1, required=True, metavar="LOG...", type=click.Path(path_type=Path))


def _shared(command: Any) -> Any:
    """Options that both commands have."""
    options = (
        click.option(
            "--sweep-range",
            default="0.2-0.8",
            show_default=True,
            metavar="LOW-HIGH",
            help="Hz over which the model has to stay bounded.",
        ),
        click.option(
            "--amplitude",
            type=Number(0.001, 1.0),
            help="Largest pressure difference, MPa, that it has to bear bounded; default: the records' own.",
        ),
        click.option("--resample", is_flag=True, help="Put records of another sampling period onto the model's."),
        click.option("--trust-units", is_flag=True, help="Take numbers that look like another unit as they stand."),
        click.option(
            "--skip",
            "skip_s",
            type=Number(0.0),
            default=0.0,
            show_default=True,
            help="Seconds at the start of each record that are simulated but not scored.",
        ),
        click.option(
            "--until",
            "until_s",
            type=Number(0.1),
            help="Ignore each record after so many seconds.",
        ),
        click.option("--figures", type=Output(OutputKind.FOLDER), metavar="DIR", help="Folder for figures and tables."),
        json_option,
    )
    return with_options(command, options)


@click.command(cls=Command)
@_LOGS
@output_option(OutputKind.MODEL, "Where the model goes.", required=True, metavar="MODEL.yaml")
@click.option(
    "--kind",
    type=click.Choice(["mbw", "bw", "bw_continuous"]),
    default="mbw",
    show_default=True,
    help="Modified Bouc-Wen (the paper's eq. 11), Bouc-Wen (eq. 8), or its continuous form (eq. 1).",
)
@click.option(
    "--input",
    "drive",
    type=click.Choice(["auto", "command", "pressure"]),
    default="auto",
    show_default=True,
    help="What drives the muscles; auto: the measured pressures where all records have them.",
)
@click.option(
    "--optimizer",
    type=click.Choice(["pso", "cma-es", "de"]),
    default="pso",
    show_default=True,
    help="Particle swarm, CMA-ES, or differential evolution.",
)
@click.option("--seed", default=1, show_default=True, type=click.IntRange(0), help="Seed of the first search.")
@click.option(
    "--seeds",
    default=3,
    show_default=True,
    type=click.IntRange(1, 100),
    help="Searches from so many seeds, the best is kept.",
)
@click.option(
    "--particles",
    default=60,
    show_default=True,
    type=click.IntRange(2, 100_000),
    help="Particles of the swarm, or members of the population.",
)
@click.option(
    "--iterations", default=1000, show_default=True, type=click.IntRange(1, 1_000_000), help="Rounds of each search."
)
@click.option(
    "--early-stop", type=click.IntRange(1), metavar="ROUNDS", help="End a search after so many rounds without gain."
)
@click.option(
    "--polish/--no-polish", default=True, show_default=True, help="Least squares from where each search ended."
)
@click.option(
    "--bounded/--unbounded", default=True, show_default=True, help="Keep the model bounded over the sweep range."
)
@click.option(
    "--start",
    type=click.Path(path_type=Path),
    metavar="MODEL.yaml",
    help="Start from this model: its parameters marked `free` are searched within their bounds, and the rest stays.",
)
@click.option(
    "--joint",
    type=click.Choice(["rigid", "second_order"]),
    default="rigid",
    show_default=True,
    help="With second_order the joint has an inertia, which the muscles' stiffness moves.",
)
@click.option(
    "--free-offset/--no-free-offset",
    default=None,
    help="Identify an offset of the angle's zero as well; default: where the records show one.",
)
@click.option(
    "--mean-exponent",
    type=Number(0.0, 2.0),
    help="Exponent n of (2 P0 / (p1 + p2))^n, by which the mean pressure scales the drive; default: identified where "
    "it varies.",
)
@click.option("--p0", "p0_mpa", type=Number(0.0, 0.5), help="Pressure at rest in MPa; default: what the records say.")
@click.option(
    "--u-unit",
    "u_unit_mpa",
    default=0.2,
    show_default=True,
    type=Number(0.001, 1.0),
    help="Unit of u in MPa.",
)
@click.option(
    "--sample-time",
    "sample_time_s",
    type=Number(1e-4, 1.0),
    help="Sample time of the model in s; default: the records' own, or 0.005 with --resample.",
)
@_shared
def identify(logs: tuple[Path, ...], output: Path, json_to: str | None, **asked: Any) -> None:
    """Fit the model to LOGs (.mcap, .csv, .csv.gz or folders) by particle swarm, and write it to MODEL.yaml.

    The defaults are the paper's (Table II): 60 particles, 1000 iterations, inertia 0.9 to 0.2; a least-squares polish
    follows.
    """
    if asked["start"] is not None:
        refuse_options(_OF_A_TEMPLATE, "--start says what the model is; set it in that file")
    _one_blas_thread()
    memory_room.ask(_SEARCH_MB)
    from rig.app.model.identifying import SearchOptions, StartOptions, identify_model
    from rig.cli.model.shown import identified_json, show_identified, show_worst
    from rig.model.parameters import save_model
    from rig.report.fit_files import write_fit_figures

    records, options = _read(logs), _options(asked)
    sweep = _sweep(asked["sweep_range"], asked["amplitude"], records)
    start, search = _part(StartOptions, asked), _part(SearchOptions, asked)
    found = _with_progress(lambda report: identify_model(records, start, search, sweep, options, report))
    terminal = console(json_to)
    show_identified(found, terminal)  # before its file: what was found is said where that cannot be written
    show_worst(found.model, records, found.scores, options, terminal)
    replaces = output.is_file() and output.stat().st_size > 0
    with write_errors_last():
        save_model(found.model, output)
        terminal.print(f"model: {output}{', in place of the one that was there' if replaces else ''}")
    if asked["figures"] is not None:
        with write_errors_last():
            write_fit_figures(found, records, options, asked["figures"])
            terminal.print(f"figures and tables: {asked['figures']}")
    emit(identified_json(found, output), json_to)


@click.command(cls=Command)
@click.argument("model", type=click.Path(path_type=Path), metavar="MODEL.yaml")
@_LOGS
@click.option(
    "--beside",
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="MODEL.yaml",
    help="Another model to show beside it.",
)
@_shared
def validate(model: Path, logs: tuple[Path, ...], beside: tuple[Path, ...], json_to: str | None, **asked: Any) -> None:
    """How well MODEL predicts LOGs it was not fitted to: RMSE, NRMSE, fit and maximum of each record (Table IV).

    Exit status 1 when the model is not bounded over the sweep range.
    """
    _one_blas_thread()
    from rig.app.shipped import find_config
    from rig.cli.model.shown import show_validation, show_worst, validation_json
    from rig.errors import CheckFailed
    from rig.identify.validate import validate as judge
    from rig.log.log_files import is_named_like_one
    from rig.model.parameters import load_model
    from rig.own_units import own_text
    from rig.report.fit_files import write_validation

    if model.is_dir() or is_named_like_one(model):
        raise click.UsageError(f"{model} is no model: MODEL.yaml comes first, the logs behind it")
    models = {path: load_model(find_config(path, "models")) for path in (model, *beside)}
    records, options = _read(logs), _options(asked)
    sweep = _sweep(asked["sweep_range"], asked["amplitude"], records)
    results = {path: judge(each, records, sweep, options) for path, each in models.items()}
    result = results[model]
    terminal = console(json_to)
    names = _short_names(models)
    others = {names[path]: each for path, each in results.items() if path != model}
    show_validation(result, models[model], others, terminal)
    show_worst(models[model], records, result.scores, options, terminal)
    if asked["figures"] is not None:
        drawn = {names[path]: each for path, each in models.items()}
        with write_errors_last():
            write_validation(drawn, records, result, options, asked["figures"])
            terminal.print(f"figures and tables: {asked['figures']}")
    aside = {str(path): validation_json(each, models[path]) for path, each in results.items() if path != model}
    emit(validation_json(result, models[model]) | ({"beside": aside} if beside else {}), json_to)
    if not result.verdict.bounded:
        verdict = result.verdict
        reached = f"{verdict.worst} reaches {verdict.peak_deg:.3g} deg, allowed {verdict.limit_deg:.3g} deg"
        why = own_text(reached, models[model].own_channels)
        raise CheckFailed(f"{model}: not bounded over the sweep range: {why}")


def _short_names(paths: Collection[Path]) -> dict[Path, str]:
    """What each model is called beside the others: its file's name, or its path where two have that name."""
    stems = [path.stem for path in paths]
    return {path: path.stem if stems.count(path.stem) == 1 else str(path) for path in paths}


def _one_blas_thread() -> None:
    """Before numpy is loaded: the searches already run one on each core, and threads of BLAS beside them cost a factor
    of ten."""
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")


def _read(logs: Sequence[Path]) -> "list[Record]":
    from rig.channels import common
    from rig.log.reader import read_all

    records = read_all(logs)
    common([(str(record.source or record.name), record.channels) for record in records])
    return records


def _options(asked: dict[str, Any]) -> "RecordOptions":
    from rig.identify.records.data import RecordOptions

    return _part(RecordOptions, asked)


def _part(kind: type[P], asked: dict[str, Any]) -> P:
    """The options of the command that belong to one dataclass, by name."""
    return kind(**{field.name: asked[field.name] for field in fields(cast(Any, kind))})


def _sweep(text: str, amplitude_mpa: float | None, records: "Sequence[Record]") -> "SweepRange":
    """LOW-HIGH in Hz and the amplitude; by default the largest command of the records."""
    from rig.app.model.identifying import sweep_range

    try:
        low, high = (float(part) for part in text.split("-"))
    except ValueError:
        raise click.BadParameter(
            f"{text!r}: expected LOW-HIGH in Hz, for example 0.2-0.8", param_hint="--sweep-range"
        ) from None
    return sweep_range(low, high, amplitude_mpa, records)


def _with_progress(work: "Callable[[Report | None], Identified]") -> "Identified":
    """Run the identification with a bar for each of its steps; nothing in a pipe."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    terminal = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[said]}"))
    with Progress(*columns, console=terminal, transient=True, disable=not terminal.is_terminal) as bars:
        first = bars.add_task(
            "records, regulators", total=None, said=""
        )  # of unknown length: until the first search reports
        tasks: dict[str, Any] = {}

        def report(title: str, share: float, best: float) -> None:
            bars.update(first, visible=False)
            if title not in tasks:
                tasks[title] = bars.add_task(title, total=1.0, said="")
            bars.update(tasks[title], completed=min(share, 1.0), said=f"{share:4.0%}  best {best:.4g} deg")

        return work(report if terminal.is_terminal else None)

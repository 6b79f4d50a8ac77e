"""`pamrig log`: look into logs, check them, rescue them, and carry them to and from other tools."""

import contextlib
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from rig.app.terminal import console, listing, styled
from rig.cli.common import Number, emit, json_option
from rig.cli.outputs import FORMERLY_OUTPUT, Group, Renamed, figure_option, output_option
from rig.number_text import counted
from rig.outputs import OutputKind, targets_in, write_text
from rig.report.shown_text import in_lines, in_one_line

_FILES = click.argument("logs", nargs=-1, required=True, metavar="LOG...", type=click.Path(path_type=Path))
_FILE = click.argument("log_file", metavar="LOG", type=click.Path(path_type=Path))


@click.group(name="log", cls=Group)
def log() -> None:
    """Look into logs: .mcap, .csv, .csv.gz or .tdms files, or folders of them."""


@log.command(short_help="What logs hold.")
@_FILES
@json_option
def info(logs: tuple[Path, ...], json_to: str | None) -> None:
    """What LOGs hold: of one file its duration, rate, columns, run facts and log lines, of several a line each."""
    from rig.app.records.logs import OVERVIEW, describe, found_files, overview, plain_lines

    descriptions = [describe(file) for file in found_files(logs)]
    terminal = console(json_to)
    if len(descriptions) > 1:
        table = listing(*OVERVIEW)
        for item in descriptions:
            for row in overview(item):
                table.add_row(*row)
        terminal.print(table)
    else:
        (item,) = descriptions
        terminal.print(item["file"], style="bold")
        for line in plain_lines({key: value for key, value in item.items() if key not in ("file", "log")}):
            terminal.print(f"  {line}")
        for time_s, level, message in item.get("log", []):
            terminal.print(f"  {time_s:9.3f} s  {level}: {in_one_line(message)}")
    emit({"files": descriptions}, json_to)


@log.command(short_help="Are logs complete and consistent?")
@_FILES
@json_option
def check(logs: tuple[Path, ...], json_to: str | None) -> None:
    """Are LOGs complete and consistent: CRCs, schema, ticks, time, values, `valid`? One line a finding; exit status 1
    if there is any."""
    from rig.app.records.logs import UNFINISHED, found_or_unfinished
    from rig.errors import CheckFailed

    finished, unfinished = found_or_unfinished(logs)
    findings = {str(file): _findings(file, file in logs) for file in finished}
    findings |= {str(file): [UNFINISHED] for file in unfinished}
    for file, lines in findings.items():
        for line in lines or ["ok"]:
            console(json_to).print(in_one_line(f"{file}: {line}"))
    emit({"files": [{"file": file, "ok": not lines, "findings": lines} for file, lines in findings.items()]}, json_to)
    bad = sum(bool(lines) for lines in findings.values())
    if bad:
        raise CheckFailed(f"{bad} of {counted(len(findings), 'log')} not in order")


def _findings(file: Path, named: bool) -> list[str]:
    """What is found about a file. That it cannot be read is a finding where it was found in a folder, of which the
    others are checked all the same; RecordError where it was named."""
    from rig.errors import RecordError
    from rig.log.check import check as check_file

    try:
        return check_file(file)
    except RecordError as error:
        if named:
            raise
        return [str(error).removeprefix(f"{file}: ")]


@log.command(short_help="Rescue a cut or damaged log.")
@_FILE
@output_option(OutputKind.RECORDING, "Default: NAME.recovered.mcap beside LOG.", metavar="FILE")
@json_option
def recover(log_file: Path, output: Path | None, json_to: str | None) -> None:
    """Save every part of a cut or damaged LOG that passes its CRC into a new file, and say what was lost. LOG stays as
    it is."""
    from rig.log.recover import recover as rescue

    result = rescue(log_file, output)
    terminal = console(json_to)
    if not result.damages and result.file == log_file:
        terminal.print(f"{log_file}: whole, with {counted(result.records, 'sample')}; nothing was written")
    else:
        terminal.print(f"{result.file}: {counted(result.records, 'sample')} saved, every one verified by its CRC")
        for damage in result.damages:
            terminal.print(f"  bytes {damage.start} to {damage.end}: {damage.what}")
        for gap in result.gaps:
            terminal.print(f"  lost: {counted(gap.records, 'sample')} between {gap.from_s:.3f} s and {gap.to_s:.3f} s")
        if result.lost_at_the_ends:
            terminal.print(f"  lost: {counted(result.lost_at_the_ends, 'sample')} before the first or after the last")
        if result.unsaved_bytes:
            terminal.print(
                f"  {counted(result.unsaved_bytes, 'byte')} after the last saved sample prove nothing; "
                "what was held there is not known"
            )
    emit(_recovery_json(result), json_to)


def _recovery_json(result: Any) -> dict[str, Any]:
    return {
        "file": str(result.file),
        "records": result.records,
        "lost_records": result.lost_records,
        "lost_seconds": result.lost_seconds,
        "lost_spans_s": [[gap.from_s, gap.to_s] for gap in result.gaps],
        "unsaved_bytes": result.unsaved_bytes,
        "damages": [damage._asdict() for damage in result.damages],
        "verified": True,
    }


@log.command("import", short_help="Make logs of another tool's files.")
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=click.Path(path_type=Path))
@click.option(
    "--mapping",
    "mapping_path",
    type=click.Path(path_type=Path),
    metavar="MAPPING.yaml",
    help="YAML: which column is which, in which unit.",
)
@click.option(
    "--guess", "guessing", is_flag=True, help="Import nothing: propose a mapping for FILE and say what it would mean."
)
@click.option("--tag", "tags", multiple=True, metavar="NAME=VALUE", help="Goes into the record: muscle, load, who.")
@click.option("--note", metavar="TEXT", help="Why it was taken: goes into the record.")
@output_option(
    OutputKind.RECORDING,
    "A file, or a folder for several; default: NAME.mcap in the current folder.",
    or_folder=True,
    metavar="OUT",
)
@json_option
def import_(
    files: tuple[Path, ...],
    mapping_path: Path | None,
    guessing: bool,
    tags: tuple[str, ...],
    note: str | None,
    output: Path | None,
    json_to: str | None,
) -> None:
    """Make an MCAP log of each FILE: CSV, LVM and TDMS from LabVIEW, another program's MCAP, or what `export` wrote.

    Columns with our names and units need no mapping; anything ambiguous is refused. With --guess, -o is where the
    proposed mapping goes; --mapping, --tag and --note belong to an import.
    """
    if guessing:
        if given := [name for name, one in (("--mapping", mapping_path), ("--tag", tags), ("--note", note)) if one]:
            raise click.UsageError(f"--guess imports nothing and takes no {' and no '.join(given)}")
        if len(files) > 1:
            raise click.UsageError(f"--guess looks at one FILE; {len(files)} are given, and one mapping may do for all")
        _guess(files[0], output, json_to)
        return
    from rig.app.records.logs import imports
    from rig.log.convert import write_content
    from rig.tags import check_note, parse_tags, tagged

    own_tags, own_note, terminal = parse_tags(tags, "--tag"), check_note(note, "--note"), console(json_to)
    made: list[dict[str, Any]] = []
    with contextlib.ExitStack() as undone:  # a disk that fills, or Ctrl-C, leaves no half of a day
        for one in imports(files, mapping_path, output):
            content = replace(one.content, run_facts=tagged(one.content.run_facts, own_tags, own_note))
            target = write_content(content, one.target)
            undone.callback(target.unlink, missing_ok=True)
            terminal.print(f"{target}: {counted(len(content.samples), 'row')}")
            if one.not_kept and one.not_kept != (made[-1]["not_kept"] if made else []):
                terminal.print(f"  not kept, by the mapping or for want of a field: {', '.join(one.not_kept)}")
            made.append({"file": str(target), "records": len(content.samples), "not_kept": one.not_kept})
        undone.pop_all()
    emit((made[0] if len(made) == 1 else {}) | {"files": made}, json_to)


def _guess(file: Path, output: Path | None, json_to: str | None) -> None:
    """The proposal: its YAML to be edited, then what it would mean and what is doubtful."""
    from rig.app.records.logs import proposed_mapping

    found, text = proposed_mapping(file)
    terminal = console(json_to)
    terminal.print(in_lines(text), markup=False)
    for line in found.meaning:
        terminal.print(in_lines(f"# {line}"), markup=False)
    for line in found.doubts:
        terminal.print(styled(("# look at:", "yellow"), f" {in_lines(line)}"))
    if output is not None:
        write_text(output, text, OutputKind.MAPPING)
        terminal.print(in_lines(f"# next: pamrig log import {file} --mapping {output}"), markup=False)
    emit({"file": str(file), "mapping": found.mapping, "meaning": found.meaning, "doubts": found.doubts}, json_to)


@log.command(short_help="Write logs for other tools.")
@_FILES
@click.option(
    "--to",
    "kind",
    type=click.Choice(["csv", "csv.gz", "parquet", "mat"]),
    default="csv",
    show_default=True,
    help="Kind of the files.",
)
@output_option(
    OutputKind.RECORDING,
    "A file, or a folder for several logs; default: beside each log.",
    or_folder=True,
    metavar="OUT",
)
@click.option(
    "--period",
    "period_s",
    cls=Renamed,
    former=("--resample",),
    type=Number(1e-4),
    metavar="SECONDS",
    help="Put the sweep onto a regular grid of that period (commands held, measurements interpolated).",
)
@json_option
def export(logs: tuple[Path, ...], kind: str, output: Path | None, period_s: float | None, json_to: str | None) -> None:
    """Write LOGs for other tools, with units and run facts; every tick and field, unless --period is given."""
    from rig.app.records.logs import exports, found_files
    from rig.log.exchange import export as write

    note = f", resampled to {period_s:g} s" if period_s else ""
    written = []
    for target, content in exports(found_files(logs), kind, output, period_s):
        written.append(write(content, target, kind))
        console(json_to).print(f"{target}: {counted(len(content.samples), 'row')}{note}")
    emit({"files": [str(file) for files in written for file in files]}, json_to)


@log.command(short_help="Draw a log.")
@_FILE
@output_option(
    OutputKind.FIGURE, "PNG, SVG or PDF by its suffix; without it, a small picture here.", or_folder=True, metavar="OUT"
)
@click.option("--all", "whole", is_flag=True, help="All phases of the run, not the sweep alone.")
@click.option("--from", "from_s", type=Number(0.0), default=0.0, help="Begin so many seconds after the first row.")
@click.option(
    "--until", "to_s", type=Number(0.0), help="End so many seconds after the first row; default: with the last."
)
def plot(log_file: Path, output: Path | None, whole: bool, from_s: float, to_s: float | None) -> None:
    """Draw LOG: command, pressures and angle over time with missed ticks marked, and the hysteresis loop."""
    import shutil

    from rig.errors import RecordError
    from rig.log.reader import SWEEP_ONLY, read
    from rig.report import log_figures

    into = output is not None and (output.is_dir() or not output.suffix)
    if output is not None and log_file.is_dir() and not into:
        raise RecordError(
            f"-o {output}: {log_file} may hold many records; give a folder, each gets a figure of its name"
        )
    records = read(log_file, None if whole else SWEEP_ONLY)
    names = (record.name for record in records)
    targets = targets_in(output, names, ".svg") if output and into else [output] * len(records)
    for record, target in zip(records, targets, strict=True):
        part = record.rows((record.t_s >= from_s) & (record.t_s <= (record.t_s[-1] if to_s is None else to_s)))
        if len(part) < 2:
            asked = f"from {from_s:g} s on" if to_s is None else f"between {from_s:g} s and {to_s:g} s"
            raise RecordError(
                f"{log_file}: {record.name} has {counted(len(part), 'row')} {asked}; it lasts {record.t_s[-1]:g} s"
            )
        if target is None:
            size = shutil.get_terminal_size((100, 30))
            click.echo(in_lines(log_figures.terminal_picture(part, min(size.columns, 120), min(size.lines - 2, 25))))
            continue
        log_figures.save(log_figures.run_figure(part), target)
        console().print(f"{target}")
    sys.stdout.flush()


@log.command(short_help="Compare two records, or folders of them.")
@click.argument("a", type=click.Path(path_type=Path))
@click.argument("b", type=click.Path(path_type=Path))
@click.option(
    "--within",
    type=Number(0.0),
    metavar="DEG",
    help="Exit status 1 when an angle (the output of a rig with a channel map, in its unit) differs by more than this "
    "anywhere, or a record has no counterpart.",
)
@figure_option("PNG, SVG or PDF of the pair; a folder for several.", or_folder=True, former=FORMERLY_OUTPUT)
@json_option
def compare(a: Path, b: Path, within: float | None, figure: Path | None, json_to: str | None) -> None:
    """Records, or folders of them, beside each other: B minus A.

    Records go together by name and repeat (one beside one whatever it is called), B is brought to the times of A by
    their commands, and every column that both have is compared.
    """
    from rig.app.records.comparing import compare_logs, draw_pairs
    from rig.app.terminal import listing
    from rig.channels import unit_word
    from rig.errors import CheckFailed
    from rig.own_units import speaker

    found = compare_logs(a, b)
    own, say = found.channels, speaker(found.channels)
    pressures = ["RMS p1, p2 MPa"] if own.has_valves else []
    table = listing("record", "shift s", *map(say, ("RMS deg", "max deg", "mean deg", "RMS command MPa")), *pressures)
    for pair in found.pairs:
        table.add_row(pair.name, *pair.cells())
    terminal = console(json_to)
    terminal.print(table)
    for side, names in (("A", found.only_a), ("B", found.only_b)):
        if names:
            terminal.print(f"only in {side}: {', '.join(names)}")
    for drawn in draw_pairs(found, figure) if figure else ():
        terminal.print(f"{drawn}")
    departures = [] if within is None else found.departures(within)
    allowed = {f"within_{unit_word(own.output.unit)}": within}
    emit(found.to_json() | allowed | {"differ": bool(departures)}, json_to)
    if departures:
        more = f" (and {len(departures) - 1} more)" if len(departures) > 1 else ""
        raise CheckFailed(f"{departures[0]}{more}")

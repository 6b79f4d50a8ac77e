"""`pamrig faults`: the whole fault table on a simulated rig of this machine, printed."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rig.app.terminal import console, listing, progress, styled
from rig.cli.common import Number, emit, json_option
from rig.cli.outputs import Command, output_option
from rig.number_text import counted
from rig.outputs import OutputKind

if TYPE_CHECKING:
    from rig.qualify.faults.trial import Finding


_WIDTH = 150
BENCH_NAMES = (
    "simulated", "modbus", "modbus-long-watchdog", "rtu", "serial", "mixed", "myrio", "run", "run-modbus",
    "run-serial", "replay", "calibrate", "calibrate-modbus", "calibrate-serial", "probe", "probe-modbus",
)  # fmt: skip
"""As rig.qualify.faults.losses has them, which is not imported for a help text."""


@click.command(cls=Command)
@click.argument("names", nargs=-1)
@click.option("--dry-run", is_flag=True, help="Only say what would be done.")
@click.option("--closed-loop", is_flag=True, help="While the rig follows an angle in closed loop.")
@click.option("--soak", "soak_hours", type=Number(0.01, 1000), help="Instead: so many hours of sweeps in virtual time.")
@click.option("--real", is_flag=True, help="With --soak: in real time, with a witness for stalls of the machine.")
@output_option(OutputKind.FOLDER, "With --soak: new folder for the records; default: temporary.", metavar="DIR")
@click.option(
    "--together", type=click.IntRange(1, 100_000), help="Instead: so many random losses of 2 or 3 processes at once."
)
@click.option(
    "--on", "benches", multiple=True, type=click.Choice(BENCH_NAMES), help="With --together: where; repeatable."
)
@click.option(
    "--attacks",
    type=click.IntRange(1, 100_000),
    help="Instead: so many emergency stops under each attack on the daemon.",
)
@click.option(
    "--seed", type=click.IntRange(0), default=1, show_default=True, help="With --together, --attacks: what is drawn."
)
@json_option
def faults(
    names: tuple[str, ...], dry_run: bool, closed_loop: bool, soak_hours: float | None, real: bool,
    output: Path | None, together: int | None, benches: tuple[str, ...], attacks: int | None, seed: int,
    json_to: str | None,
) -> None:  # fmt: skip
    """Inject every fault of the table (or those NAMES) into a simulated rig, and say what followed and how fast.

    Starts a daemon of its own in a temporary folder; nothing of yours is touched. Takes about two minutes.
    With --together, loop, recorder, supervisor and the commanding process are killed or stopped in pairs and triples,
    in any order, 0 to 500 ms apart; each takes about three seconds.
    With --attacks, clients keep the daemon busy in every way of a list (or in those NAMES) while the emergency stop is
    timed; each stop takes about half a second.
    """
    from rig.cli.qualify import fault_attacks

    if soak_hours is not None:
        _soak(soak_hours, real, output, json_to)
    elif together is not None:
        _together(together, benches or BENCH_NAMES[:1], seed, json_to)
    elif attacks is not None:
        fault_attacks.attacks(names, attacks, seed, json_to)
    else:
        _one_by_one(names, closed_loop, dry_run, json_to)


def _one_by_one(names: tuple[str, ...], closed_loop: bool, dry_run: bool, json_to: str | None) -> None:
    """The rows of the table; CheckFailed when one did not end as it must."""
    import tempfile

    from rig.config import suggest
    from rig.errors import CheckFailed, RigError
    from rig.qualify.faults.bench import CLOSED_LOOP_SWEEP, SWEEP, FaultBench
    from rig.qualify.faults.table import CLOSED_LOOP_TABLE, TABLE
    from rig.qualify.faults.trial import try_row

    table, sweep = (CLOSED_LOOP_TABLE, CLOSED_LOOP_SWEEP) if closed_loop else (TABLE, SWEEP)
    known = [row.name for row in table]
    if unknown := next((name for name in names if name not in known), None):
        raise RigError(f"no fault {unknown!r}; {suggest(unknown, known)}")
    rows = [row for row in table if not names or row.name in names]
    findings: list[Finding] = []
    if not dry_run:
        with (
            tempfile.TemporaryDirectory(prefix="pamrig-") as folder,
            FaultBench(Path(folder), sweep=sweep) as bench,
            progress("faults", len(rows)) as update,
        ):
            for row in rows:
                update(len(findings), row.name)
                findings.append(try_row(bench, row))
    _show([(row.name, row.done, row.causes, row.bound_ms) for row in rows], findings, json_to)
    emit({"faults": [_plain(finding) for finding in findings]}, json_to)
    wrong = [finding for finding in findings if finding.problem]
    if wrong:
        raise CheckFailed(
            f"{len(wrong)} of {counted(len(findings), 'fault')} did not end as they must; first: {wrong[0].row.name}: "
            f"{wrong[0].problem}"
        )


def _soak(hours: float, real: bool, output: Path | None, json_to: str | None) -> None:
    """Sweeps for hours; CheckFailed when the rig did not get through, or a record is not valid and no stall of the
    machine the reason."""
    import tempfile

    from rig.errors import CheckFailed
    from rig.qualify.soak import soak

    with tempfile.TemporaryDirectory(prefix="pamrig-") as temporary, progress("soak", None) as update:
        result = soak(_own_folder(output or Path(temporary)), hours, not real, update)
    _tell_soak(result, json_to)
    emit({"soak": result}, json_to)
    blamed = result["machine"].get("not_valid_otherwise", result["not_valid"])
    if result["done"] != result["records"] or blamed:
        raise CheckFailed(
            f"{result['done']} of {counted(result['records'], 'record')}, {blamed} not valid; {result['error']}"
        )


def _together(count: int, benches: tuple[str, ...], seed: int, json_to: str | None) -> None:
    """Random losses of several processes; CheckFailed when the rig was not safe after one of them, or somebody said
    what was not so."""
    import tempfile

    from rig.errors import CheckFailed
    from rig.qualify.faults import losses

    results = {}
    for name in benches:
        with (
            tempfile.TemporaryDirectory(prefix="pamrig-") as folder,
            losses.BENCHES[name](Path(folder)) as bench,
            progress(name, count) as update,
        ):
            found = []
            for trial in losses.trials(bench, count, seed):
                found.append(trial)
                update(len(found), str(trial))
        results[name] = losses.summary(found)
    _show_together(results, json_to)
    emit({"together": results, "seed": seed}, json_to)
    if problems := [f"{name}: {problem}" for name, one in results.items() for problem in one["problems"]]:
        raise CheckFailed(f"{len(problems)} of {count * len(benches)} losses did not end safe; first: {problems[0]}")


def _show_together(results: dict[str, dict[str, Any]], json_to: str | None) -> None:
    table = listing("rig", "trials", "safe", "p50 ms", "p99 ms", "longest ms")
    for name, one in results.items():
        times = ("-" if one[key] is None else f"{one[key]:.1f}" for key in ("p50_ms", "p99_ms", "max_ms"))
        table.add_row(name, str(one["trials"]), str(one["safe"]), *times)
    console(json_to).print(table)


def _own_folder(folder: Path) -> Path:
    """An empty one: what an earlier soak left would be counted with this one."""
    from rig.errors import RigError

    folder.mkdir(parents=True, exist_ok=True)
    if any(folder.iterdir()):
        raise RigError(f"{folder}: is not empty; give a new one with -o")
    return folder


def _tell_soak(result: dict[str, Any], json_to: str | None) -> None:
    from rig.qualify.stalls import summary

    terminal = console(json_to)
    for key, value in result.items():
        if key != "machine":
            terminal.print(f"{key}: {value}")
    for line in summary(result["machine"]) if result["machine"] else ():
        terminal.print(line)


def _show(rows: list[tuple[str, str, tuple[str, ...], float]], findings: "list[Finding]", json_to: str | None) -> None:
    table = listing("fault", "what is done", "cause reported", "ms to safe", "bound", "evidence")
    for index, (name, done, causes, bound_ms) in enumerate(rows):
        bound = f"{bound_ms:g}" if causes else "-"
        if not findings:
            table.add_row(name, done, " or ".join(causes) or "none, the rig goes on", "", bound, "")
            continue
        finding = findings[index]
        ms = "-" if finding.ms is None else f"{finding.ms:.1f}"
        table.add_row(
            name,
            done,
            finding.cause or "none, the rig goes on",
            ms,
            bound,
            styled((finding.problem, "red")) if finding.problem else finding.evidence,
        )
    terminal = console(json_to)
    terminal.width = max(terminal.width, _WIDTH)
    terminal.print(table)


def _plain(finding: "Finding") -> dict[str, Any]:
    row = finding.row
    return {
        "name": row.name,
        "done": row.done,
        "causes": list(row.causes),
        "bound_ms": row.bound_ms,
        "cause": finding.cause,
        "ms": finding.ms,
        "evidence": finding.evidence,
        "problem": finding.problem,
    }

"""What the commands that run a rig show at the end: a line a record."""

import math

from rig.app.runs.outcome import RunOutcome
from rig.app.terminal import console, listing, styled
from rig.number_text import counted


def summary(outcome: RunOutcome, json_to: str | None) -> None:
    """The table at the end: one row a run."""
    table = listing("record", "ticks", "missed", "dropped", "late p50/p99/max us", "valid")
    for run in outcome.runs:
        late = "/".join(f"{run.lateness_us.get(k, math.nan):.0f}" for k in ("p50", "p99", "max"))
        valid = "yes" if run.valid else styled(("stopped", "yellow") if run.ended == "stopped" else ("no", "red"))
        table.add_row(run.file.stem, str(run.ticks), str(run.missed), str(run.dropped), late, valid)
    terminal = console(json_to)
    if outcome.runs:
        terminal.print(table)
        written = sum(not run.error for run in outcome.runs)
        terminal.print(f"{written} of {counted(outcome.planned, 'record')} in {outcome.runs[0].file.parent}")

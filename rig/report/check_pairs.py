"""Two blind checks of the same cases as a table for the terminal, and as a page."""

from collections.abc import Iterator
from datetime import date
from typing import TYPE_CHECKING

from rig.blind_check.goals import figure_text
from rig.blind_check.modes import MODES

if TYPE_CHECKING:
    from rich.table import Table

    from rig.blind_check.paired import Compared

HEAD = ("mode", "figure", "first", "other", "only first", "only other", "p")


def pairs_table(found: "Compared") -> "Table":
    """For the terminal."""
    from rich.table import Table

    table = Table(*HEAD, title=f"{found.cases} cases: {found.first} (first) and {found.other} (other)")
    for row in _rows(found):
        table.add_row(*row)
    return table


def pairs_page(found: "Compared") -> str:
    """As Markdown, dated."""
    head = f"| {' | '.join(HEAD)} |\n{'|---' * len(HEAD)}|"
    rows = "\n".join(f"| {' | '.join(row)} |" for row in _rows(found))
    return (
        "# Two checks of the same cases\n\n"
        f"Written by `pamrig gap check compare` on {date.today().isoformat()}: {found.cases} cases, "
        f"{found.first} (first) beside {found.other} (other), the same units, effects and sizes. Rates carry "
        f"Wilson 95 % intervals; p: exact sign test on the cases that one alone has right.\n\n{head}\n{rows}\n"
    )


def _rows(found: "Compared") -> Iterator[tuple[str, ...]]:
    for mode, figures in found.modes.items():
        for words, one in figures.items():
            if one.first.n:
                rates = (figure_text(rate.to_json(), "%") for rate in (one.first, one.other))
                alone = (str(one.only_first), str(one.only_other))
                yield (MODES[mode].words, words, *rates, *alone, f"{one.p_value:.2g}")

"""The terminal for a person: where text goes, plain tables, and progress."""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, Final

from rig.report.shown_text import in_lines, in_one_line

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderResult
    from rich.table import Table
    from rich.text import Text

_PIPE_COLUMNS: Final = 1 << 16
"""A pipe has no width: whatever reads it gets each row on a line of its own."""
_CELL_COLUMNS: Final = 12
"""No cell is folded to less: its longest word, up to so many columns, stays whole."""
_GAP_COLUMNS: Final = 2
"""Between two columns of a table, at most."""


def console(json_to: str | None = None) -> "Console":
    """The terminal for a person: stdout, or stderr when stdout carries JSON.

    Text is shown as it is: brackets in a name are no markup (who wants styles gives `styled` or `style=`), control
    codes no commands.
    """
    from rich.console import Console
    from rich.table import Table

    class Terminal(Console):
        def render_str(self, text: str, **how: Any) -> "Text":
            return super().render_str(in_lines(text), **how)

        def print(self, *what: Any, **how: Any) -> None:
            # a table that is wider than the terminal is wrapped by it; rich would cut what does not fit
            cut = {} if not any(isinstance(one, Table) for one in what) else {"crop": False}
            super().print(*what, **(cut | how))

    to_stderr = json_to == "-"
    piped = not (sys.stderr if to_stderr else sys.stdout).isatty()
    width = _PIPE_COLUMNS if piped and "COLUMNS" not in os.environ else None
    return Terminal(stderr=to_stderr, markup=False, highlight=False, soft_wrap=piped, width=width)


def answer_to(question: str) -> str:
    """The line that somebody types, without its end; click.Abort where there is none any more.

    Where it is no terminal that is asked, not by `input()`: that takes whatever is raised while the question is written
    for a fault of the stream, and goes on (CPython, builtin_input_impl). A signal that struck there was lost."""
    import click

    if sys.stdin.isatty() and sys.stdout.isatty():  # its line can be edited, and what a signal raises is not lost
        return str(click.prompt(question, default="", show_default=False))
    click.echo(f"{question}: ", nl=False)
    if not (line := sys.stdin.readline()):
        raise click.Abort
    return line.rstrip("\n")


def say(line: str, style: str) -> None:
    """A line for a person, on stderr, from one who goes on whether or not anybody reads it: a terminal may be gone."""
    with suppress(OSError):
        console("-").print(line, style=style)


def styled(*parts: str | tuple[str, str]) -> "Text":
    """A line whose parts are plain text, or text with a style, each fit for a terminal."""
    from rich.text import Text

    return Text.assemble(*(in_lines(part) if isinstance(part, str) else (in_lines(part[0]), part[1]) for part in parts))


def listing(names: str, *titles: str, title: str | None = None) -> "Table":
    """A plain table of names and what belongs to them. Names stay whole however narrow it is, and so do words of
    titles; other cells are folded, never cut."""
    from rich.cells import cell_len
    from rich.table import Column, Table
    from rich.text import Text

    class Listing(Table):
        def add_row(self, *cells: Any, **how: Any) -> None:
            name, *others = cells  # a name is one line, or the rest of it would pass for another row
            shown = [Text(in_one_line(name)) if isinstance(name, str) else name]
            shown += [Text(in_lines(cell)) if isinstance(cell, str) else cell for cell in others]
            for number, (column, cell) in enumerate(zip(self.columns, shown, strict=False)):
                pieces = str(cell).split() if number else [str(cell)]
                longest = max(map(cell_len, [str(column.header) if number else "", *pieces]), default=0)
                titled = max(map(cell_len, str(column.header).split()), default=0)
                needed = max(min(longest, _CELL_COLUMNS), titled) if number else longest
                column.min_width = max(column.min_width or 0, needed)
            super().add_row(*shown, **how)

        def __rich_console__(self, console: "Console", options: "ConsoleOptions") -> "RenderResult":
            needed = sum((column.min_width or 0) + _GAP_COLUMNS for column in self.columns)
            return super().__rich_console__(console, options.update(max_width=max(options.max_width, needed)))

    columns = [Column(names, no_wrap=True, overflow="ignore"), *(Column(title, overflow="fold") for title in titles)]
    return Listing(*columns, box=None, pad_edge=False, title=title, title_justify="left")


@contextmanager
def progress(what: str, total: float | None = None) -> Iterator[Callable[[float, str], None]]:
    """A progress bar on a terminal (one that only moves, without `total`), silence in a pipe; yields `update(done,
    note)`. Note and description are shown as they are, like all text on a `console`."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    terminal = Console(stderr=True)
    how_far = () if total is None else (TextColumn("{task.percentage:>3.0f} %"), TimeRemainingColumn())
    title, note = (TextColumn(text, markup=False) for text in ("{task.description}", "{task.fields[note]}"))
    columns = (title, BarColumn(), *how_far, note)
    with Progress(*columns, console=terminal, transient=True, disable=not terminal.is_terminal) as bar:
        task = bar.add_task(in_one_line(what), total=total, note="")

        def update(done: float, note: str = "") -> None:
            bar.update(task, completed=done, note=in_one_line(note))

        yield update

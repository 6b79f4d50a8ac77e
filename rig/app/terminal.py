"""The terminal for a person: where text goes, plain tables, and progress."""

import errno
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


def console(json_to: str | None = None) -> "Console":
    """The terminal for a person: stdout, or stderr when stdout carries JSON."""
    from rich.console import Console

    class Terminal(Console):
        def on_broken_pipe(self) -> None:
            # rich would end with status 1, as if the thing asked about were not so
            raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))

    return Terminal(stderr=json_to == "-", highlight=False, soft_wrap=not sys.stdout.isatty())


def listing(names: str, *titles: str) -> "Table":
    """A plain table of names and what belongs to them; where it is too wide, cells are folded and never cut."""
    from rich.table import Column, Table

    return Table(*(Column(title, overflow="fold") for title in (names, *titles)), box=None, pad_edge=False)


@contextmanager
def progress(what: str, total: float | None = None) -> Iterator[Callable[[float, str], None]]:
    """A progress bar on a terminal (one that only moves, without `total`), silence in a pipe; yields `update(done, note)`."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    terminal = Console(stderr=True)
    how_far = () if total is None else (TextColumn("{task.percentage:>3.0f} %"), TimeRemainingColumn())
    columns = (TextColumn("{task.description}"), BarColumn(), *how_far, TextColumn("{task.fields[note]}"))
    with Progress(*columns, console=terminal, transient=True, disable=not terminal.is_terminal) as bar:
        task = bar.add_task(what, total=total, note="")

        def update(done: float, note: str = "") -> None:
            bar.update(task, completed=done, note=note)

        yield update

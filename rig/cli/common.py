"""What the commands share: the JSON option, the terminal, progress, and one way to end on an error."""

import errno
import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from rig.errors import RigError

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

F = TypeVar("F", bound=Callable[..., Any])
Place = TypeVar("Place", str | None, Path | None)


def json_option(command: F) -> F:
    """Adds `--json FILE`, passed to the command as `json_to`."""
    return click.option(
        "--json",
        "json_to",
        metavar="FILE",
        callback=writable,
        help="Write the result as JSON to FILE, or to stdout with '-'.",
    )(command)


def writable(_context: click.Context, _option: click.Parameter, place: Place) -> Place:
    """A callback of an option: refuse a place that cannot be written before the work is done, not after it."""
    if place is not None and place != "-":
        file = Path(place)
        if not os.access(file.parent, os.W_OK) or file.is_dir():
            why = "no such folder" if not file.parent.is_dir() else "it is a folder" if file.is_dir() else "not allowed there"
            raise RigError(f"{place}: cannot be written: {why}")
    return place


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


def emit(result: dict[str, Any], json_to: str | None) -> None:
    """Write `result` where `--json` asked for; nothing without it. Not-a-number becomes null."""
    if json_to is None:
        return
    text = json.dumps(_plain(result), indent=1, allow_nan=False)
    if json_to == "-":
        click.echo(text)
        return
    try:
        Path(json_to).write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise RigError(f"{json_to}: cannot be written: {error.strerror}") from None


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


def _plain(value: Any) -> Any:
    """JSON has no NaN, no paths and no numpy scalars."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, float) and (value != value or value in (float("inf"), float("-inf"))):
        return None
    return str(value) if isinstance(value, Path) else value

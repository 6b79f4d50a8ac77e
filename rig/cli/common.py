"""What the commands share: the JSON option, and places that can be written."""

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from rig.errors import RigError

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


def emit(result: dict[str, Any], json_to: str | None) -> None:
    """Write `result` where `--json` asked for; nothing without it. Not-a-number becomes null."""
    if json_to is None:
        return
    text = json.dumps(plain(result), indent=1, allow_nan=False)
    if json_to == "-":
        click.echo(text)
        return
    try:
        Path(json_to).write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise RigError(f"{json_to}: cannot be written: {error.strerror}") from None


def plain(value: Any) -> Any:
    """JSON has no NaN, no paths and no numpy scalars."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, float) and (value != value or value in (float("inf"), float("-inf"))):
        return None
    return str(value) if isinstance(value, Path) else value

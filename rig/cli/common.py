"""What the commands share: numbers in options, the JSON option, how a call is told and how a result is written."""

import functools
import json
import math
import shlex
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import click

from hil.reference.names import NAMES as FAMILIES
from rig.cli.outputs import FormerArgument, Output, write_errors_last
from rig.outputs import OutputKind, write_text

F = TypeVar("F", bound=Callable[..., Any])


class Number(click.FloatRange):
    """A finite number within bounds: click's own range lets nan through, which is neither above nor below them, and
    where it is open above, inf."""

    def __init__(self, low: float, high: float | None = None) -> None:
        super().__init__(low, high)
        self._allowed = f"{low:g} to {high:g}" if high is not None else f"{low:g} or more"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The number; click.BadParameter for anything else."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is no finite number; allowed: {self._allowed}", param, ctx)
        return number


def with_options(command: F, options: Sequence[Callable[[F], F]]) -> F:
    """The command with these options and arguments, listed by its help in this order."""
    for option in reversed(options):  # the last one applied stands first in the help
        command = option(command)
    return command


def json_option(command: F) -> F:
    """Adds `--json FILE`, passed to the command as `json_to`."""
    return click.option(
        "--json",
        "json_to",
        metavar="FILE",
        type=Output(OutputKind.JSON, stdout=True),
        help="Write the result as JSON to FILE, or to stdout with '-'.",
    )(command)


def family_option(
    words: str, *, several: bool = True, none: bool = False, default: str | None = None
) -> Callable[[F], F]:
    """`--family NAME`, a plant family; passed as `families` where `several` may be named. With `none` that is a name,
    too."""
    names = ("--family", "families") if several else ("--family", "family")
    return click.option(
        *names,
        multiple=several,
        type=click.Choice((*FAMILIES, "none") if none else FAMILIES),
        default=default,
        show_default=default is not None,
        help=words,
    )


def rig_option(words: str) -> Callable[[F], F]:
    """`--rig RIG.yaml`, passed on as `rig_path`."""
    path = click.Path(path_type=Path)
    return click.option("--rig", "rig_path", type=path, metavar="RIG.yaml", help=words)


def clock_option(command: F) -> F:
    """`--clock real|virtual`, of a command that runs a rig."""
    kinds = click.Choice(["real", "virtual"])
    help_text = "Virtual: as fast as it can."
    return click.option("--clock", type=kinds, default="real", show_default=True, help=help_text)(command)


def force_option(verb: str) -> Callable[[F], F]:
    """`--force`, of a command that moves a real rig."""
    help_text = "on real hardware although real-time measures were denied, or the watchdog of a device takes too long."
    return click.option("--force", is_flag=True, help=f"{verb} {help_text}")


def model_option(command: Callable[..., None]) -> Callable[..., None]:
    """`--model MODEL.yaml`, passed on as `model`: what the command is about, and must be named. MODEL as the first
    argument stays understood."""

    @functools.wraps(command)
    def named(*arguments: Any, model: Path | None, former_model: Path | None, **options: Any) -> None:
        if (model is None) == (former_model is None):
            raise click.UsageError("name the simulator: --model MODEL.yaml")
        command(*arguments, model=model or former_model, **options)

    path = click.Path(path_type=Path)
    argument = click.argument("former_model", cls=FormerArgument, required=False, type=path, metavar="MODEL.yaml")
    return argument(click.option("--model", type=path, metavar="MODEL.yaml", help="The simulator.")(named))


def left_out_option(words: str) -> Callable[[F], F]:
    """`--leave-out NAME`, plant families, passed as `left_out`."""
    return click.option("--leave-out", "left_out", multiple=True, type=click.Choice(FAMILIES), help=words)


def as_called() -> str:
    """This call as somebody types it, for a page that says how it came about."""
    return shlex.join(["pamrig", *sys.argv[1:]])


def emit(result: dict[str, Any], json_to: str | None) -> None:
    """Write `result` where `--json` asked for; nothing without it. Not-a-number becomes null. A place that takes
    nothing is told at the end of the command."""
    if json_to is None:
        return
    text = json.dumps(plain(result), indent=1, allow_nan=False)
    if json_to == "-":
        click.echo(text)
        return
    with write_errors_last():
        write_text(Path(json_to), text + "\n", OutputKind.JSON)


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

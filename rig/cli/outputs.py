"""The one rule for outputs at the command line: where an option may point is said before the work begins, and what
could not be written there is told when it is over, beside what was found."""

import contextlib
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import click
from click.decorators import FC

from rig.errors import Interrupted, RigError, beside
from rig.outputs import OutputKind, check_apart, check_place

_UNWRITTEN = "pamrig.unwritten"
"""In what click passes on between contexts: why results were not written."""


class Output(click.ParamType):  # type: ignore[type-arg]  # generic in the stubs only
    """A file that the command writes, or a folder: with `or_folder` a path that is one or has no suffix. `-` is stdout
    with `stdout`, and so is /dev/stdout: as a path it may be a file, which would be replaced."""

    name = "file"

    def __init__(
        self, kind: OutputKind, *, stdout: bool = False, or_folder: bool = False, make_folder: bool = False
    ) -> None:
        self.kind, self._stdout, self.or_folder, self._make_folder = kind, stdout, or_folder, make_folder

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path, once nothing speaks against writing there; RigError otherwise."""
        if self._stdout and str(value) in ("-", "/dev/stdout"):
            return "-"
        path = Path(value)
        folder = self.or_folder and (os.path.isdir(path) or not path.suffix)
        check_place(path, OutputKind.FOLDER if folder else self.kind, make_folder=self._make_folder)
        return str(path) if self._stdout else path


class Renamed(click.Option):
    """An option that is still understood by names of before, `former`, which no help shows."""

    def __init__(self, *arguments: Any, former: Sequence[str], **settings: Any) -> None:
        super().__init__(*arguments, **settings)
        self._former = former

    def add_to_parser(self, parser: Any, ctx: click.Context) -> None:
        """As click does, under all names."""
        shown, self.opts = self.opts, [*self.opts, *self._former]
        super().add_to_parser(parser, ctx)
        self.opts = shown


class FormerArgument(click.Argument):
    """What was an argument before it had an option: still understood, and in no help."""

    def get_usage_pieces(self, ctx: click.Context) -> list[str]:
        """None."""
        return []


class Command(click.Command):
    """A command whose outputs are held apart from its inputs and from each other, before it does anything."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """As click does; who gives several values to an option is told to repeat it, and an empty name of a file or
        folder is refused."""
        given = [*args]
        try:
            if not ctx.resilient_parsing:
                self._refuse_empty_paths(ctx, given)
            return super().parse_args(ctx, args)
        except click.UsageError as error:
            repeated = next((one.opts[0] for one in self.params if one.multiple and {*one.opts} & {*given}), None)
            if repeated is None or "extra argument" not in error.message:
                raise
            example = f"an option takes one value; repeat it for several: {repeated} A {repeated} B"
            raise click.UsageError(f"{error.message}; {example}", ctx) from None

    def _refuse_empty_paths(self, ctx: click.Context, args: list[str]) -> None:
        """UsageError for what a variable without a value leaves of `--log "$DAY"`: as a path it would be the current
        folder, with all that lies there and below."""
        named, _, _ = self.make_parser(ctx).parse_args([*args])
        for param in self.params:
            if isinstance(param.type, Output | click.Path) and "" in _values(named.get(param.name or "")):
                raise click.BadParameter("an empty name; `.` is the current folder", ctx, param)

    def invoke(self, ctx: click.Context) -> Any:
        """As click does, after that check."""
        inputs = [(name, place) for name, path in _places(self, ctx, outputs=False) for place in _meant(path)]
        check_apart(_places(self, ctx, outputs=True), inputs)
        try:
            done = super().invoke(ctx)
        except (RigError, Interrupted) as error:
            if unwritten := ctx.meta.pop(_UNWRITTEN, ""):
                raise beside(error, unwritten) from None
            raise
        if unwritten := ctx.meta.pop(_UNWRITTEN, ""):
            raise RigError(unwritten)
        return done


def _values(given: object) -> tuple[object, ...]:
    """Of an option that may be repeated, or an argument of several, all; of another the one."""
    return tuple(given) if isinstance(given, list | tuple) else (given,)


@contextlib.contextmanager
def write_errors_last() -> Iterator[None]:
    """For writing a result: an error of it waits until the command is over, so that a disk that takes nothing hides no
    fault of the rig. By itself it ends the command with exit status 2, beside another error it is the end of that
    one's line."""
    try:
        yield
    except RigError as error:
        if (ctx := click.get_current_context(silent=True)) is None:
            raise
        ctx.meta[_UNWRITTEN] = "; ".join(filter(None, (ctx.meta.get(_UNWRITTEN, ""), str(error))))


class Group(Command, click.Group):
    """A group of such commands."""

    command_class = Command
    group_class = type

    def list_commands(self, _: click.Context) -> list[str]:
        """In the order in which they were defined: what is needed first comes first."""
        return list(self.commands)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """As click does; of an unknown command it is said what is allowed, as `pamrig` says it of its own."""
        if args[0] not in self.commands and not ctx.resilient_parsing and not args[0].startswith("-"):
            from rig.config import suggest

            raise click.UsageError(f"no such command {args[0]!r}; {suggest(args[0], self.list_commands(ctx))}", ctx)
        return super().resolve_command(ctx, args)


def given_options(ctx: click.Context) -> list[click.Option]:
    """The options that stand in the call; not those that have their defaults."""
    return [
        param
        for param in ctx.command.params
        if isinstance(param, click.Option)
        and ctx.get_parameter_source(param.name or "") is click.core.ParameterSource.COMMANDLINE
    ]


def options_behind_the_step(ctx: click.Context) -> None:
    """UsageError for an option of a group that stands before one of its steps, which have options of their own and
    would pass it over."""
    given = given_options(ctx)
    if ctx.invoked_subcommand is not None and given:
        option = max(given[0].opts, key=len)
        raise click.UsageError(f"{option} stands before {ctx.invoked_subcommand}; options stand behind the step", ctx)


def refuse_options(names: Sequence[str], why: str) -> None:
    """UsageError for the first of these options (as the command is passed them) that stands in the call, and that it
    would pass over: `why` says what is decided otherwise, or what the option goes with."""
    context = click.get_current_context()
    for param in given_options(context):
        if param.name in names:
            raise click.UsageError(f"{max(param.opts, key=len)}: {why}", context)


def output_option(kind: OutputKind, help_text: str, *, or_folder: bool = False, **more: Any) -> Callable[[FC], FC]:
    """`-o`, also `--output` and `--out`: where a command writes its result, passed to it as `output`. Folders on the
    way are made."""
    place = Output(kind, or_folder=or_folder, make_folder=True)
    return click.option("-o", "--output", "--out", "output", type=place, help=help_text, **more)


FORMERLY_OUTPUT: Final = ("-o", "--output", "--out")
"""By which a figure or a page beside an answer was asked for, where the answer itself goes nowhere else."""


def figure_option(help_text: str, *, former: Sequence[str] = (), or_folder: bool = False) -> Callable[[FC], FC]:
    """`--figure`: a picture of the result, passed on as `figure`. Folders on the way are made."""
    place = Output(OutputKind.FIGURE, or_folder=or_folder, make_folder=True)
    metavar = "OUT" if or_folder else "FILE"
    return click.option("--figure", cls=Renamed, former=former, type=place, metavar=metavar, help=help_text)


def _places(command: click.Command, ctx: click.Context, *, outputs: bool) -> Iterator[tuple[str, Path]]:
    """Every file that the call names, with the option or argument that names it."""
    for param in command.params:
        value = ctx.params.get(param.name or "")
        wanted = isinstance(param.type, Output) if outputs else isinstance(param.type, click.Path)
        if not wanted or value is None:
            continue
        for place in value if isinstance(value, tuple) else (value,):
            if str(place) != "-":
                yield (
                    max(param.opts, key=len) if isinstance(param, click.Option) else param.make_metavar(ctx),
                    Path(place),
                )


def _meant(path: Path) -> list[Path]:
    """The file that an input names; where there is none, what comes with pamrig by that name, of whatever kind."""
    if os.path.exists(path):
        return [path]
    from rig.app.shipped import configs

    return [place for place in configs().glob("*/*.yaml") if place.stem == path.name.removesuffix(".yaml")] or [path]

"""The command `pamrig`: a table of commands, each imported when it is called, so that `--help` stays quick."""

import importlib
import os
import sys
from typing import Any

import click

from rig.cli import memory_room
from rig.cli.streams import Streams
from rig.errors import CheckFailed, Interrupted, RigError
from rig.report.blank_figure import leave_own_settings

COMMANDS = {
    "run": ("rig.cli.runs.run:run", "Run a sweep on the rig and record it, one MCAP file a record."),
    "simulate": ("rig.cli.model.simulate:simulate", "What the simulator says under the commands of a sweep or a log."),
    "identify": ("rig.cli.model.identify:identify", "Fit the model to logs by particle swarm."),
    "validate": ("rig.cli.model.identify:validate", "How well a model predicts logs it was not fitted to."),
    "replay": ("rig.cli.runs.replay:replay", "Send recorded commands again and compare."),
    "track": ("rig.cli.runs.track:track", "Follow an angle in closed loop."),
    "tune": ("rig.cli.runs.track:tune", "Tune the gains of `track` from a model, with margins."),
    "gap": ("rig.cli.gap.group:gap", "Diagnose the gap between simulator and rig."),
    "log": ("rig.cli.log:log", "Look into logs: info, check, compare, recover, import, export, plot."),
    "rig": ("rig.cli.rig:rig", "Make a rig's YAML, and check one."),
    "devices": ("rig.cli.devices:devices", "List, probe and calibrate devices."),
    "latency": ("rig.cli.qualify.latency:latency", "Measure whether this machine holds the loop's period."),
    "daemon": ("rig.cli.service.daemon:daemon", "Run the rig as a service."),
    "status": ("rig.cli.service.daemon:status", "What the daemon is doing."),
    "arm": ("rig.cli.service.daemon:arm", "Let the daemon command the rig."),
    "start": ("rig.cli.service.daemon:start", "Start a sweep on the armed daemon."),
    "queue": ("rig.cli.service.daemon:queue", "What the daemon has done and still has to do."),
    "stop": ("rig.cli.service.daemon:stop", "Ramp down and stop."),
    "mark": ("rig.cli.service.daemon:mark", "Put a line into the log of the record that runs."),
    "clear": ("rig.cli.service.daemon:clear", "Take what waits out of the daemon's queue."),
    "estop": ("rig.cli.service.daemon:estop", "Safe state at once."),
    "reset": ("rig.cli.service.daemon:reset", "Clear a fault whose cause is gone."),
    "watch": ("rig.cli.service.watch:watch", "Watch the daemon live in the terminal."),
    "service": ("rig.cli.service.install:service", "Install pamrig as a system service."),
    "faults": ("rig.cli.qualify.faults:faults", "Inject every fault of the table into the simulated rig."),
    "bench": ("rig.cli.qualify.bench:bench", "The project's own benchmarks."),
    "completion": ("rig.cli.completion:completion", "Completion of commands, options and files for your shell."),
}
"""Command -> (where it lives, its line in the help)."""
GROUPS = ("gap", "log", "rig", "devices", "service")
"""Those that have commands of their own."""


def imported(name: str) -> click.Command:
    """One of COMMANDS, from its module."""
    module, attribute = COMMANDS[name][0].split(":")
    command: click.Command = getattr(importlib.import_module(module), attribute)
    return command


def _group_of(name: str) -> str | None:
    """The group that has a command of this name: `diagnose` is meant as `gap diagnose`."""
    for group in GROUPS:
        found = imported(group)
        if isinstance(found, click.Group) and name in found.commands:
            return group
    return None


class _Lazy(click.Group):
    """A group that knows its commands' help lines and imports a command only when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            from rig.config import suggest

            hint = f"did you mean '{within} {name}'?" if (within := _group_of(name)) else suggest(name, list(COMMANDS))
            raise click.UsageError(f"no such command {name!r}; {hint}", ctx)
        command = imported(name)
        if "_PAMRIG_COMPLETE" in os.environ:
            from rig.cli.completion import with_files

            return with_files(command)
        return command

    def invoke(self, ctx: click.Context) -> Any:
        """As click does; Ctrl-C becomes an error of ours, of which `main` says one line (click's own is empty), and so
        does a broken pipe, which is none of our streams: they last."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise Interrupted from None
        except BrokenPipeError:
            raise RigError("a process at the other end of a pipe or a socket is gone") from None

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, line) for name, (_, line) in COMMANDS.items()])


@click.group(cls=_Lazy, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="pamrig")
def cli() -> None:
    """The pneumatic-muscle test rig: run it, simulate it, and find out why the two differ."""


NO_ROOM = ("failed to map segment", "cannot allocate memory", "cannot map zero-fill pages", "can't start new thread")
"""What the loader of glibc says of a library that has no room (elf/dl-load.c, dl-map-segments.h), and CPython of a
thread."""


def main() -> None:
    """Entry point: 0 done, 1 not so, 2 the call or a file is wrong, 130 interrupted."""
    streams = Streams()
    os.environ.setdefault(
        "OPENBLAS_NUM_THREADS", "1"
    )  # our matrices are small and our work is spread already: its threads only wait
    leave_own_settings()
    memory_room.watch()
    status = _status()
    if failure := streams.failure():
        _say(f"pamrig: the system: {failure.strerror}")
        status = 2
    sys.exit(status)


def _status() -> Any:
    """The exit status of the command, of whose error one line is said."""
    try:
        return cli.main(standalone_mode=False) or 0
    except Interrupted as error:
        # a terminal has written ^C into the line
        _say(f"pamrig: {str(error) or 'interrupted'}", apart=sys.stderr.isatty())
        return 130
    except (click.exceptions.Abort, KeyboardInterrupt):
        return 130
    except click.exceptions.NoArgsIsHelpError as error:
        error.show()
        return 2
    except click.ClickException as error:
        _say(f"{_called(error)}: {' '.join(error.format_message().split())}")
        return 2
    except CheckFailed as error:
        _say(f"pamrig: {error}")
        return 1
    except RigError as error:
        _say(f"pamrig: {error}")
        return 2
    except (MemoryError, ImportError, OSError, RuntimeError) as error:
        if _no_memory(error):
            memory_room.say_none()
        elif isinstance(error, OSError):
            _say(f"pamrig: {error.filename or 'the system'}: {error.strerror or error}")
        else:
            raise
        return 2


def _no_memory(error: BaseException | None) -> bool:
    """Whether an error is for want of memory, or came of one that was: a library that finds no room is an ImportError
    by the loader's words."""
    while error is not None:
        if isinstance(error, MemoryError) or any(words in str(error).lower() for words in NO_ROOM):
            return True
        error = error.__cause__ or error.__context__
    return False


def _say(line: str, *, apart: bool = False) -> None:
    """The one line of an error, whatever the names in it hold; `apart` from what stands in the line already."""
    from rig.report.shown_text import in_one_line

    click.echo("\n" * apart + in_one_line(line), err=True)


def _called(error: click.ClickException) -> str:
    """The command that was called wrongly, as it was called."""
    context = error.ctx if isinstance(error, click.UsageError) else None
    return context.command_path if context else "pamrig"

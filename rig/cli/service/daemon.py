"""`pamrig daemon` and its clients: status, arm, start, queue, stop, clear, estop, reset."""

import contextlib
import functools
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rig.app.terminal import console
from rig.cli.common import F, Number, emit, json_option, rig_option
from rig.cli.outputs import Command
from rig.number_text import counted
from rig.report.shown_text import in_one_line

if TYPE_CHECKING:
    from rig.service.settings import DaemonSettings


def socket_option(command: F) -> F:
    """Adds `--socket PATH`, passed on as `socket`."""
    text = "The daemon's socket; default: $PAMRIG_SOCKET, /run/pamrig, or the user's runtime folder."
    return click.option("--socket", "socket", type=click.Path(path_type=Path), help=text)(command)


@click.command(cls=Command)
@rig_option("Rig to serve; default: the simulated rig.")
@click.option(
    "--config",
    type=click.Path(path_type=Path),
    metavar="DAEMON.yaml",
    help="The daemon's own YAML: logs, group, live view, ...",
)
@click.option(
    "--logs", type=click.Path(path_type=Path), metavar="DIR", help="Folder for the records; overrides the config."
)
@click.option(
    "--state",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder for queue and black boxes; overrides the config.",
)
@click.option(
    "--clock",
    type=click.Choice(["real", "virtual"]),
    default="real",
    show_default=True,
    help="Virtual: as fast as can be.",
)
@click.option(
    "--web",
    metavar="HOST:PORT",
    help="Where the page is served (another host than the loopback needs a token), or off.",
)
@click.option(
    "--dry-run", is_flag=True, help="Only say which records retention (keep_gb, keep_days) would remove today."
)
@socket_option
def daemon(
    rig_path: Path | None,
    config: Path | None,
    logs: Path | None,
    state: Path | None,
    clock: str,
    web: str | None,
    dry_run: bool,
    socket: Path | None,
) -> None:
    """Keep a rig as a service: loop, recorder and supervisor, commanded over a socket. Ends safe on SIGTERM and
    Ctrl-C."""
    import asyncio

    from rig.app import compose, shipped
    from rig.app.supervise import parts_of
    from rig.service.connections.socket_access import keep_others_out
    from rig.service.daemon import Daemon
    from rig.service.processes import allow_descriptors
    from rig.service.settings import load_settings
    from rig.service.views import live, metrics

    settings = _overridden(load_settings(config), web, logs=logs, state=state, socket=socket)
    if dry_run:
        _say_what_would_go(settings)
        return
    if settings.live.port:
        live.check_available()
    if settings.metrics is not None:
        metrics.check_usable(settings.metrics)
    rig = compose.load(rig_path and shipped.find_config(rig_path, "rigs").absolute())
    virtual = clock == "virtual"
    if virtual:
        compose.allow_virtual(rig)
    keep_others_out()
    with _logging():
        allow_descriptors()
        asyncio.run(Daemon(parts_of(rig, virtual=virtual), settings).serve())


def _overridden(settings: "DaemonSettings", web: str | None, **given: Path | None) -> "DaemonSettings":
    """The settings with what the command line says instead."""
    import dataclasses

    from rig.service.settings import parse_web

    overrides: dict[str, Any] = {key: value for key, value in given.items() if value is not None}
    if web is not None:
        overrides["web"] = parse_web(web, settings.web)
    return dataclasses.replace(settings, **overrides)


@contextlib.contextmanager
def _logging() -> Iterator[None]:
    """Lines of the log go to standard error from a thread: a log that blocks must not hold up the heartbeat."""
    import logging
    import logging.handlers
    import queue

    class Visible(logging.Formatter):
        def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 - the library's name
            return in_one_line(super().formatMessage(record))

    lines: queue.SimpleQueue[logging.LogRecord] = queue.SimpleQueue()
    writer = logging.StreamHandler()
    writer.setFormatter(Visible("%(asctime)s %(levelname)s %(message)s"))
    handler = logging.handlers.QueueHandler(lines)
    logging.getLogger().addHandler(handler)
    logging.getLogger("pamrig").setLevel(logging.INFO)
    listener = logging.handlers.QueueListener(lines, writer)
    listener.start()
    try:
        yield
    finally:
        logging.getLogger().removeHandler(handler)
        listener.stop()


def _say_what_would_go(settings: "DaemonSettings") -> None:
    from datetime import UTC, datetime

    from rig.service.records.durable_file import DurableFile
    from rig.service.records.ledger import Ledger
    from rig.service.records.operating_time import OperatingTime

    say = console().print
    if settings.retention.off:
        say("retention is off: no record is ever removed (set keep_gb or keep_days in the daemon's settings)")
        return
    entries = Ledger(DurableFile(settings.ledger)).entries
    operating_s = OperatingTime(DurableFile(settings.operating_time)).s()
    due = settings.retention.due(entries, operating_s)
    for entry in due:
        say(
            f"would go: {entry.path}  {entry.size} bytes, of "
            f"{datetime.fromtimestamp(entry.recorded_s, UTC):%Y-%m-%d %H:%M} UTC, "
            f"{(operating_s - entry.operating_s) / 86400:.1f} days of the daemon's running ago",
        )
    say(
        f"{len(due)} of {counted(len(entries), 'record')} of this daemon, "
        f"{sum(entry.size for entry in due) / 1e9:.3f} GB; nothing was removed"
    )


def _client_command(name: str) -> Callable[[Callable[..., None]], click.Command]:
    """A click command that gets a connected client and is named `name`."""

    def decorate(function: Callable[..., None]) -> click.Command:
        @functools.wraps(function)
        def call(socket: Path | None, **options: Any) -> None:
            from rig.service.client import Client

            with Client(socket) as client:
                function(client, **options)

        return click.command(name, cls=Command)(socket_option(call))

    return decorate


@_client_command("status")
@json_option
def status(client: Any, json_to: str | None) -> None:
    """What the daemon is doing."""
    from rig.cli.service.status_lines import status_lines

    now = client.status()
    if json_to is None:
        console().print("\n".join(status_lines(now)), markup=True)
    emit(now, json_to)


@_client_command("arm")
def arm(client: Any) -> None:
    """Let the daemon command the rig; nothing moves yet."""
    import os

    from rig.service.connections.socket_access import user_name

    for line in client.arm(by=f"{user_name(os.getuid())}, by pamrig arm"):
        console("-").print(line, style="yellow")
    console().print("armed: the rig follows `pamrig start`; `pamrig stop` disarms")


@_client_command("start")
@click.argument("sweeps", nargs=-1, type=click.Path(path_type=Path))
@click.option(
    "--pause",
    "pause_s",
    type=Number(0),
    default=0.0,
    show_default=True,
    help="Seconds of rest after each sweep.",
)
@click.option("--first", is_flag=True, help="What an interrupted queue still holds is done before SWEEPS.")
@click.option("--only", is_flag=True, help="Only SWEEPS; what an interrupted queue still holds stays there.")
@click.option(
    "--wait", is_flag=True, help="Return when the work is done; exit status 1 when it was not done whole and valid."
)
def start(client: Any, sweeps: tuple[Path, ...], pause_s: float, first: bool, only: bool, wait: bool) -> None:
    """Queue SWEEPS and work on the queue; without any, go on with what is in it."""
    from rig.app import shipped
    from rig.cli.service import queued

    if (first or only) and (first == only or not sweeps):
        raise click.UsageError("--first or --only says what is done beside SWEEPS: one of them, and with SWEEPS")
    before = "first" if first else "leave" if only else ""
    paths = [shipped.find_config(sweep, "sweeps") for sweep in sweeps]
    waiting = queued.interrupted(client.status())
    if waiting and not sweeps:
        console().print(f"going on with the queue: {queued.described(waiting)}")
    elif waiting and not before and sys.stdin.isatty():
        before = queued.ask(waiting)
    jobs = client.start(*paths, pause_s=pause_s, before=before)
    if not sweeps and not waiting:
        console().print("the queue is worked on already")
    for job in jobs:
        console().print(f"job {job['id']}: {job['sweep']}, {counted(job['records'], 'record')}, {job['seconds']:.0f} s")
    if wait:
        leaving = () if before == "leave" else [job["id"] for job in waiting]
        queued.wait(client, [*leaving, *(job["id"] for job in jobs)])


@_client_command("queue")
@json_option
def queue(client: Any, json_to: str | None) -> None:
    """What was done, what runs, what waits, and how long it takes."""
    from rig.cli.service import queued

    now = client.status()
    console(json_to).print(queued.table(now["queue"]))
    console(json_to).print(queued.total(now))
    emit({key: now[key] for key in ("working", "left_s", "queue")}, json_to)


@_client_command("stop")
@click.option("--after-current", is_flag=True, help="Finish the current record, then stop.")
def stop(client: Any, after_current: bool) -> None:
    """Ramp down and hold the queue; while nothing runs, disarm."""
    console().print(client.call("stop", after_current=after_current)["did"])


@_client_command("mark")
@click.argument("text")
def mark(client: Any, text: str) -> None:
    """Put TEXT, one line, into the log of the record that runs."""
    done = client.call("mark", text=text)
    console().print(f"marked in {done['record']}")


@_client_command("clear")
def clear(client: Any) -> None:
    """Take what waits, was stopped or failed out of the queue; what runs goes on."""
    count = len(client.call("clear")["cleared"])
    console().print(f"{counted(count, 'job')} taken out of the queue")


@_client_command("estop")
def estop(client: Any) -> None:
    """Safe state at once. Exit status 2, and one line that says so, unless the device took it."""
    done = client.estop()
    console().print(f"emergency stop: {done['words']}; `pamrig reset` when the rig may move again")


@_client_command("reset")
def reset(client: Any) -> None:
    """Clear a fault whose cause is gone; does not arm."""
    client.reset()
    console().print("reset: disarmed")

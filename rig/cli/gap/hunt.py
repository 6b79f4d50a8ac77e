"""`pamrig gap hunt`: run, diagnose, run what tells more, until it is known."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rig.app.terminal import console
from rig.cli.common import Number, clock_option, emit, json_option, rig_option
from rig.cli.gap.options import baseline_option, reference_option
from rig.cli.outputs import Command, output_option, refuse_options
from rig.cli.service.daemon import socket_option
from rig.outputs import OutputKind
from rig.report.shown_text import in_one_line

if TYPE_CHECKING:
    from rig.app.gap.hunt.folder import HuntStep
    from rig.app.gap.hunt.hunting import Hunted
    from rig.service.client import Client

_path = click.Path(path_type=Path)


@click.command(cls=Command, short_help="Run and diagnose until the cause is known.")
@rig_option("Rig to run on; default: the simulated rig.")
@click.option("--model", required=True, type=_path, metavar="MODEL.yaml", help="The simulator.")
@baseline_option("Records of one earlier day; repeat for more days. `model`: the logs it was identified from.")
@reference_option()
@click.option(
    "--minutes",
    type=Number(0.5, 600.0),
    default=10.0,
    show_default=True,
    help="How much of the rig's time may be used.",
)
@click.option(
    "--sweep",
    "first",
    type=_path,
    default=Path("gap"),
    show_default=True,
    metavar="SWEEP.yaml",
    help="The session that the hunt begins with.",
)
@click.option(
    "--confirm/--no-confirm",
    default=None,
    help="Ask before every sweep. Default: on a real rig, and not on a simulated one.",
)
@clock_option
@click.option("--seed", type=click.IntRange(0), help="Seed of the simulated rig's noise; each sweep has the next one.")
@click.option("--force", is_flag=True, help="As in `pamrig run`.")
@click.option(
    "--daemon",
    "by_daemon",
    is_flag=True,
    help="Let the daemon run the sweeps, as jobs of its queue; it must be armed. `pamrig watch` shows them.",
)
@socket_option
@output_option(
    OutputKind.FOLDER, "Folder of the hunt; one that is there goes on. Default: a new one under logs/.", metavar="DIR"
)
@json_option
def hunt(
    rig_path: Path | None,
    baselines: tuple[Path, ...],
    every_day: bool,
    confirm: bool | None,
    clock: str,
    by_daemon: bool,
    socket: Path | None,
    output: Path | None,
    json_to: str | None,
    **asked: Any,
) -> None:
    """Run a session on the rig, diagnose it, run the sweep that best tells apart what is still possible, and so on,
    until one cause has 95 %, none is found, no sweep would tell the rest apart, or the time is used up.

    Everything is kept in one folder with a page that shows each step. An interrupted hunt goes on when it is called
    with the same folder.
    """
    from rig.app import compose
    from rig.app.gap.baselines import check_no_own_baseline, earlier_days
    from rig.app.gap.hunt.options import HuntOptions
    from rig.app.gap.hunt.report import hunt_and_tell
    from rig.app.runs import record_folders

    if by_daemon:
        refuse_options(("clock", "seed", "force"), "is the daemon's own; --daemon takes none")
    else:
        refuse_options(("socket",), "goes with --daemon")
    rig, folder = compose.load(rig_path), output or record_folders.new_folder("hunt")
    check_no_own_baseline([folder], baselines)
    days = earlier_days(baselines, asked["model"], every=every_day)
    options = HuntOptions(
        rig=rig,
        folder=folder,
        days=days.records,
        day_names=tuple(str(day.path) for day in days.days),
        every_day=every_day,
        virtual=clock == "virtual",
        daemon=_daemon(socket, rig.name) if by_daemon else None,
        **asked,
    )
    out = console(json_to)
    for line in days.lines():
        out.print(line)
    asks = not compose.is_simulated(rig) if confirm is None else confirm
    dialogue = _Dialogue(rig.name, asks, json_to)
    hunt_and_tell(options, dialogue.allowed, dialogue.report, dialogue.tell)


@dataclass(frozen=True)
class _Dialogue:
    """What a hunt says on the terminal, and asks there."""

    rig: str
    asks: bool
    """Before every sweep."""
    json_to: str | None

    def allowed(self, step: "HuntStep") -> bool:
        """Announce a sweep; whether it may run."""
        console(self.json_to).print(f"next, {step.minutes:.1f} min: {step.why}")
        try:
            return not self.asks or click.confirm(in_one_line(f"Run {step.sweep} on {self.rig}?"), err=True)
        except click.Abort:  # Ctrl-C, or nobody to answer: what was learnt is told as of any other interruption
            raise KeyboardInterrupt from None

    def report(self, step: "HuntStep") -> None:
        """What is still possible after a sweep."""
        from rig.gap.answer.words.sizes import percent

        names = ", ".join(f"{name} {percent(chance)}" for name, chance in step.set)
        console(self.json_to).print(f"still possible: {names}")

    def tell(self, found: "Hunted") -> None:
        """What came of it, for a person and as JSON."""
        _show(found, self.json_to)
        emit(found.to_json(), self.json_to)


def _daemon(socket: Path | None, rig: str) -> "Client":
    """The daemon that keeps this rig; ConfigError when it keeps another."""
    from rig.errors import ConfigError
    from rig.service.client import Client

    client = Client(socket)
    if (kept := client.status()["rig"]) != rig:
        raise ConfigError(f"--daemon: it keeps the rig {kept}, not {rig}; name that rig's YAML by --rig")
    return client


def _show(found: "Hunted", json_to: str | None) -> None:
    """The end of it for a person."""
    from rig.gap.answer.words.sentences import headline
    from rig.own_units import own_text

    out, so_far = console(json_to), found.hunt
    if found.finding is not None:
        diagnosis = found.finding.diagnosis
        for line in headline(diagnosis):
            out.print(own_text(line, diagnosis.channels))
    # why it was cut short is the error that the command ends by, right below
    ended = "cut short" if found.cut_short_by else found.ended
    page = so_far.folder / "hunt.html"
    place = page if not found.cut_short_by or page.is_file() else so_far.folder  # the disk may have taken no page
    out.print(f"ended: {ended}; {so_far.minutes:.1f} min on the rig; {place}")

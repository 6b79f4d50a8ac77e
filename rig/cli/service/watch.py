"""`pamrig watch`: the daemon live in the terminal, with keys for stop and emergency stop."""

import contextlib
import os
import select
import sys
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from rig.cli.common import Number
from rig.cli.outputs import Command
from rig.cli.service.daemon import socket_option

if TYPE_CHECKING:
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    from rig.channels import Channels
    from rig.service.client import Client

WINDOW_S: Final = 20.0
"""Time that the plots of `pamrig watch` show, s."""
KEYS: Final = "s stop (ramps down)   e or space emergency stop   q quit"
_PLOT_POINTS: Final = 800
_PLOT_LINES: Final = (8, 16)
"""Heights between which a plot is worth its place."""
_BLOCKS: Final = " ▁▂▃▄▅▆▇█"


class Window:
    """The last WINDOW_S of what the daemon sent, as working values; `own` is the rig's channel map."""

    def __init__(self, period_s: float, own: "Channels") -> None:
        size = round(WINDOW_S / period_s)
        self.own = own
        self.t_s: deque[float] = deque(maxlen=size)
        self.dp_mpa: deque[float] = deque(maxlen=size)
        self.angle_deg: deque[float] = deque(maxlen=size)
        self._period_s = period_s

    def add(self, samples: dict[str, list[float | None]]) -> None:
        """Take in the columns of one event; samples without an angle are left out."""
        rows = zip(samples["tick"], samples["p1_cmd_mpa"], samples["p2_cmd_mpa"], samples["angle_deg"], strict=True)
        for tick, p1, p2, angle in rows:
            if tick is not None and p1 is not None and p2 is not None and angle is not None:
                if self.t_s and tick * self._period_s < self.t_s[-1]:
                    self.clear()  # another session
                self.t_s.append(tick * self._period_s)
                self.dp_mpa.append(p1 - p2)
                self.angle_deg.append(angle)

    def clear(self) -> None:
        """Forget everything."""
        for column in (self.t_s, self.dp_mpa, self.angle_deg):
            column.clear()


def picture(status: dict[str, Any], window: Window, size: tuple[int, int], note: str = "") -> "Group":
    """The whole picture for a terminal of `size` columns and lines. Keys and note come first: what does not fit is cut
    below."""
    from rich.console import Group
    from rich.text import Text

    from rig.cli.service.status_lines import status_lines

    width, height = size
    lines = [
        Text(KEYS, style="dim"),
        *([Text(note, style="bold yellow")] if note else []),
        *(Text.from_markup(line) for line in status_lines(status)),
        Text(lateness_bars((status["loop"] or {}).get("lateness_us") or {})),
    ]
    left = height - 1 - sum(-(-max(line.cell_len, 1) // width) for line in lines)
    return Group(*lines, *_plots(window, width, left))


def _plots(window: Window, width: int, height: int) -> "list[Table]":
    """Angle over time and over dp, side by side; nothing where there is no room or nothing to show."""
    from rich.table import Table

    from rig.own_units import speaker

    least, most = _PLOT_LINES
    if len(window.t_s) < 2 or height < least:
        return []
    say, wanted = speaker(window.own), [window.own.own_input(dp) for dp in window.dp_mpa]
    answered = [window.own.own_output(angle) for angle in window.angle_deg]
    plots = Table.grid(padding=(0, 1))
    half, now = max(width // 2 - 2, 30), window.t_s[-1]
    size = half, min(height, most)
    plots.add_row(
        _plot([t - now for t in window.t_s], answered, say("angle in degrees over seconds"), size),
        _plot(wanted, answered, say("angle in degrees over p1 - p2 in MPa"), size),
    )
    return [plots]


def lateness_bars(lateness: dict[str, Any]) -> str:
    """The histogram of lateness as one line of bars with the upper edges of its classes."""
    if not lateness:
        return ""
    counts = lateness["histogram"]
    most = max(counts) or 1
    # a rare class must not vanish beside a frequent one
    bars = "".join(_BLOCKS[0 if count == 0 else max(round(count / most * 8), 1)] * 2 for count in counts)
    edges = " ".join(str(edge) for edge in lateness["edges_us"])
    return f"late {bars}  up to {edges} us, more"


def _plot(x: "list[float]", y: "list[float]", title: str, size: tuple[int, int]) -> "Text":
    import plotext
    from rich.text import Text

    step = max(len(y) // _PLOT_POINTS, 1)
    figure = plotext.figure
    figure.clear()
    figure.plot_size(*size)
    figure.theme("colorless")
    signal = figure.signal(x[::step], y[::step], marker="braille")
    signal.lines()
    figure.draw(signal)
    figure.title(title)
    return Text.from_ansi(str(figure.build()))


@contextlib.contextmanager
def keys() -> Iterator[Any]:
    """Single keys from the terminal without waiting: yields a function that returns one, or nothing."""
    import termios
    import tty

    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    tty.setcbreak(descriptor)
    try:
        yield (
            lambda: os.read(descriptor, 1).decode(errors="replace") if select.select([descriptor], [], [], 0)[0] else ""
        )
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


@click.command(cls=Command)
@click.option("--rate", "rate_hz", type=Number(0.5, 20), default=5.0, show_default=True, help="Pictures a second.")
@socket_option
def watch(rate_hz: float, socket: Path | None) -> None:
    """Watch the daemon: state, fault and hint, pressures, angle, lateness. In a pipe: one picture of now."""
    from rig.app.terminal import console
    from rig.cli.service.status_lines import status_lines
    from rig.service.client import Client

    terminal = console()
    with Client(socket) as client:
        if not (terminal.is_terminal and sys.stdin.isatty()):
            terminal.print("\n".join(status_lines(client.status())), markup=True)
            return
        _live(client, Client(socket), rate_hz)


def _live(client: "Client", commands: "Client", rate_hz: float) -> None:
    """Redraw at each event; the keys go over a connection of their own, so that a stop never waits for a picture."""
    from rich.live import Live

    from rig.channels import channels_of

    status = client.status()
    window, note = Window(status["period_s"], channels_of(status, "status")), ""
    with keys() as key, Live(screen=True, auto_refresh=False) as live, commands:
        for status in client.subscribe(rate_hz, samples=True):
            window.add(status.get("samples") or {"tick": [], "p1_cmd_mpa": [], "p2_cmd_mpa": [], "angle_deg": []})
            while pressed := key():
                if pressed == "q":
                    return
                note = act(commands, pressed) or note
            live.update(picture(status, window, live.console.size, note), refresh=True)


def act(client: "Client", key: str) -> str:
    """What a key does; returns the line to show."""
    from rig.errors import RigError

    try:
        if key in ("e", " "):
            return f"emergency stop: {client.estop()['words']}"
        if key == "s":
            return str(client.call("stop", after_current=False)["did"])
    except RigError as error:
        return str(error)
    return ""

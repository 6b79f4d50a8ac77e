"""Figures of identification and validation in the layout of the paper: Fig. 1 (loops of the Bouc-Wen model at several
frequencies), Figs. 4 to 6 (measured and estimated angle over time, their difference, angle against input), and the
convergence of a search.
"""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import TYPE_CHECKING

from rig.channels import PNEUMATIC, Channels
from rig.own_units import own_text, speaker
from rig.record import Column, Record
from rig.report.blank_figure import blank_figure
from rig.report.figure_texts import on_terminal

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_TERMINAL_POINTS = 300
_MEASURED = "0.25"
_MODELS = ("#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Of the first model, the second, ...; as many more begin again."""


def comparison_figure(
    title: str,
    t_s: Column,
    u: Column,
    measured: Column,
    estimated: Mapping[str, Column],
    u_label: str,
    channels: Channels,
) -> "Figure":
    """Figs. 4 to 6: angle over time above its error on the left, the loop over the input on the right.

    `estimated` maps the name of a model (BW, MBW) to its angle; all columns have the shape (n,) and are in the rig's
    own units.
    """
    figure = blank_figure(10.0, 5.0)
    figure.suptitle(title)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.4, 1.0))
    over_time, error, loop = (
        figure.add_subplot(grid[0, 0]),
        figure.add_subplot(grid[1, 0]),
        figure.add_subplot(grid[:, 1]),
    )
    over_time.plot(t_s, measured, color=_MEASURED, label="measured")
    loop.plot(u, measured, color=_MEASURED, label="measured")
    for (name, angle), color in zip(estimated.items(), cycle(_MODELS), strict=False):
        over_time.plot(t_s, angle, color=color, linestyle="--", label=name)
        loop.plot(u, angle, color=color, linestyle="--", linewidth=0.9, label=name)
        error.plot(t_s, angle - measured, color=color, label=name)
    over_time.set_ylabel(own_text("angle [deg]", channels))
    error.set_ylabel(own_text("error [deg]", channels))
    error.set_xlabel("time [s]")
    loop.set_xlabel(u_label)
    loop.set_ylabel(own_text("angle [deg]", channels))
    over_time.legend(loc="upper right", fontsize="small")
    for axes in (over_time, error, loop):
        axes.grid(alpha=0.3)
    return figure


def loops_figure(title: str, records: Sequence[Record]) -> "Figure":
    """Fig. 1: angle over commanded difference of each record's second half, one loop each."""
    figure = blank_figure(5.0, 4.2)
    axes = figure.add_subplot()
    for record in records:
        settled = record.rows(slice(len(record) // 2, None))
        if settled.angle_deg is not None:
            own = record.channels
            axes.plot(
                own.own_input(settled.dp_cmd_mpa), own.own_output(settled.angle_deg), label=record.name, linewidth=1.0
            )
    axes.set_title(title, fontsize="medium")
    say = speaker(records[0].channels if records else PNEUMATIC)
    axes.set_xlabel(say("p1 - p2 commanded [MPa]"))
    axes.set_ylabel(say("angle [deg]"))
    axes.legend(fontsize="small")
    axes.grid(alpha=0.3)
    return figure


def convergence_figure(
    title: str, histories: Mapping[str, Sequence[tuple[int, float]]], channels: Channels
) -> "Figure":
    """Best score over evaluations, one line for each search."""
    figure = blank_figure(6.0, 3.6)
    axes = figure.add_subplot()
    for name, history in histories.items():
        axes.plot([spent for spent, _ in history], [channels.output_per_deg * best for _, best in history], label=name)
    axes.set_yscale("log")
    axes.set_title(title, fontsize="medium")
    axes.set_xlabel("evaluations")
    axes.set_ylabel(own_text("best score [deg]", channels))
    axes.legend(fontsize="small")
    axes.grid(alpha=0.3, which="both")
    return figure


def terminal_comparison(
    title: str,
    t_s: Column,
    measured: Column,
    estimated: Column,
    width: int,
    height: int,
    label: str = "angle [deg]",
) -> str:
    """What was measured as dots and what was estimated as a line over time (all (n,), in the units of the label), as
    text of `width` by `height` characters."""
    import plotext

    figure = plotext.figure
    figure.clear()
    figure.plot_size(width, height)
    figure.theme("colorless")
    rows = slice(None, None, max(1, len(t_s) // _TERMINAL_POINTS))
    figure.draw(figure.signal(t_s[rows].tolist(), measured[rows].tolist(), marker="."))
    line = figure.signal(t_s[rows].tolist(), estimated[rows].tolist(), marker="braille")
    line.lines()
    figure.draw(line)
    figure.title(f"{title}: .. measured, line estimated {label}")
    return on_terminal(figure)

"""Figures of logs: a run over time with its hysteresis loop, and a replay beside its recording.

They show what was recorded and nothing else: no smoothing, no resampling; missed ticks are marked. Figures of models
and of the gap are elsewhere in rig.report.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rig.channels import Channels
from rig.further_channels import furthers_of
from rig.log.compare import ComparedPair
from rig.log.replay import ReplayComparison
from rig.outputs import OutputKind, writing
from rig.own_units import own_text, speaker
from rig.record import Column, Record
from rig.report.blank_figure import blank_figure
from rig.report.figure_texts import as_written, on_terminal

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COMMAND, _FIRST, _SECOND, _ANGLE, _MISSED = "0.45", "#0072b2", "#d55e00", "#009e73", "#cc0000"
_OTHERS = ("#cc79a7", "#e69f00", "#56b4e9", "#000000")
_MANY_ROWS = 20_000
"""Longer lines are drawn as pixels inside an SVG, which would else weigh tens of megabytes."""
_TERMINAL_POINTS = 400
_TERMINAL_BARS = 50


def run_figure(record: Record) -> "Figure":
    """Command, pressures (further channels where none were measured) and angle over time, and the loop of angle over
    differential pressure; a rig with a channel map in its own units."""
    own, say = record.channels, speaker(record.channels)
    figure, (command, middle, angle), loop = _frame(record.name)
    _line(command, record.t_s, own.own_input(record.dp_cmd_mpa), _COMMAND, "commanded")
    if record.has_pressures:
        _line(command, record.t_s, record.dp_mpa, _FIRST, "measured")
    command.set_ylabel(say("p1 - p2 [MPa]"))
    if own.has_valves:
        _pressures(middle, record)
    _further(middle, record)
    angle.set_ylabel(say("angle [deg]"))
    if record.angle_deg is not None:
        output = own.own_output(record.angle_deg)
        _line(angle, record.t_s, output, _ANGLE, say("angle"))
        _line(loop, own.own_input(record.dp_cmd_mpa), output, _COMMAND, "over the command")
        if record.has_pressures:
            _line(loop, record.dp_mpa, output, _FIRST, "over the measured pressures")
    for axes in (command, middle, angle):
        _mark_missed(axes, missed_times(record))
    return _finished(figure, (command, middle, angle), loop, own)


def _pressures(axes: "Axes", record: Record) -> None:
    for color, name, column, wanted in (
        (_FIRST, "p1", record.p1_mpa, record.p1_cmd_mpa),
        (_SECOND, "p2", record.p2_mpa, record.p2_cmd_mpa),
    ):
        if wanted is not None:
            _line(axes, record.t_s, wanted, color, f"{name} set-point", linestyle=":")
        if column is not None:
            _line(axes, record.t_s, column, color, name)
    axes.set_ylabel("pressure [MPa]")


def _further(axes: "Axes", record: Record) -> None:
    """The further channels, each by its name; beside the pressures where there are such."""
    shown = [one for one in furthers_of(record.facts) if one.name in record.extra]
    if not shown:
        if not record.channels.has_valves:
            axes.set_axis_off()
        return
    axes = axes.twinx() if record.channels.has_valves else axes
    for color, one in zip(_OTHERS, shown, strict=False):
        _line(axes, record.t_s, record.extra[one.name], color, f"{one.name} [{one.unit}]")
    axes.set_ylabel(", ".join(f"{one.name} [{one.unit}]" for one in shown))
    axes.legend(loc="lower right", fontsize="small")


def replay_figure(name: str, comparison: ReplayComparison, channels: Channels) -> "Figure":
    """Commands and angles of a recording and of its replay over time, their difference, and both loops."""
    recorded = _Curve("recorded", comparison.recorded_dp_mpa, comparison.recorded_deg)
    replayed = _Curve("replayed", comparison.replayed_dp_mpa, comparison.replayed_deg)
    return _beside(f"{name}: replay and recording", comparison.t_s, recorded, replayed, comparison.missed_s, channels)


def pair_figure(pair: ComparedPair) -> "Figure":
    """Commands and angles of two records over time, their difference, and both loops."""
    curves = [_Curve(label, each.dp_cmd_mpa, _known(each)) for label, each in (("A", pair.a), ("B", pair.b))]
    return _beside(f"{pair.name}: A and B", pair.a.t_s, curves[0], curves[1], (), pair.a.channels)


def _known(record: Record) -> Column:
    return np.full(len(record), np.nan) if record.angle_deg is None else record.angle_deg


class _Curve(NamedTuple):
    """One of two that are shown together; columns (n,)."""

    label: str
    dp_mpa: Column
    angle_deg: Column


def _beside(
    title: str, t_s: Column, first: _Curve, second: _Curve, missed_s: Sequence[float], own: Channels
) -> "Figure":
    figure, (command, angle, residual), loop = _frame(title)
    for color, style, curve in ((_COMMAND, "-", first), (_SECOND, ":", second)):
        wanted, answered = own.own_input(curve.dp_mpa), own.own_output(curve.angle_deg)
        _line(command, t_s, wanted, color, curve.label, linestyle=style)
        _line(angle, t_s, answered, color, curve.label, linestyle=style)
        _line(loop, wanted, answered, color, curve.label, linestyle=style)
    apart = own.output_per_deg * (second.angle_deg - first.angle_deg)
    _line(residual, t_s, apart, _ANGLE, f"{second.label} - {first.label}")
    for axes, label in ((command, "p1 - p2 [MPa]"), (angle, "angle [deg]"), (residual, "residual [deg]")):
        axes.set_ylabel(own_text(label, own))
        _mark_missed(axes, missed_s)
    return _finished(figure, (command, angle, residual), loop, own)


def save(figure: "Figure", path: Path) -> None:
    """Write a figure in the format of the suffix; RigError when that is unknown or the file cannot be written."""
    with writing(path, OutputKind.FIGURE) as part:
        as_written(figure)
        figure.savefig(part, dpi=150, format=path.suffix[1:])


def terminal_picture(record: Record, width: int, height: int) -> str:
    """Angle (pressures where no angle was measured) as a line, the command as dots, missed ticks as bars; text of that
    size."""
    import plotext

    own, say = record.channels, speaker(record.channels)
    left = [(say("angle [deg]"), None if record.angle_deg is None else own.own_output(record.angle_deg))]
    if record.angle_deg is None:
        left = [("p1 [MPa]", record.p1_mpa), ("p2 [MPa]", record.p2_mpa)]
    shown = [(label, column) for label, column in left if column is not None]
    figure = plotext.figure
    figure.clear()
    figure.plot_size(width, height)
    figure.theme("colorless")
    figure.draw(_terminal_curve(figure, record, own.own_input(record.dp_cmd_mpa), "right", "."))
    for _, column in shown:
        figure.draw(_terminal_curve(figure, record, column, "left", "braille"))
    for time_s in missed_times(record)[:_TERMINAL_BARS]:
        figure.line(time_s, "vertical")
    command = say(".. command p1 - p2 [MPa] (right)")
    figure.title(f"{record.name}: {', '.join(label for label, _ in shown)} (left), {command}")
    return on_terminal(figure)


def _terminal_curve(figure: Any, record: Record, column: Column, side: str, marker: str) -> Any:
    rows = np.unique(np.linspace(0, len(record) - 1, min(_TERMINAL_POINTS, len(record))).astype(int))
    rows = rows[np.isfinite(column[rows])]
    signal = figure.signal(record.t_s[rows].tolist(), column[rows].tolist(), marker=marker, yside=side)
    if marker == "braille":
        signal.lines()
    return signal


def missed_times(record: Record) -> list[float]:
    """When ticks were missed, in seconds; the row that came too late stands for those before it."""
    missed = record.extra.get("missed")
    return [] if missed is None else record.t_s[missed > 0].tolist()


def _frame(title: str) -> "tuple[Figure, Sequence[Axes], Axes]":
    """An empty figure: three panels over time on the left, a square one for the loop on the right."""
    figure = blank_figure(12, 7)
    grid = figure.add_gridspec(3, 2, width_ratios=(3, 2))
    first = figure.add_subplot(grid[0, 0])
    panels = [first, *(figure.add_subplot(grid[row, 0], sharex=first) for row in (1, 2))]
    figure.suptitle(title)
    return figure, panels, figure.add_subplot(grid[:, 1])


def _finished(figure: "Figure", panels: "Sequence[Axes]", loop: "Axes", channels: Channels) -> "Figure":
    panels[-1].set_xlabel("time [s]")
    loop.set_xlabel(own_text("p1 - p2 [MPa]", channels))
    loop.set_ylabel(own_text("angle [deg]", channels))
    for axes in (*panels, loop):
        axes.grid(alpha=0.3)
        if axes.get_legend_handles_labels()[0]:
            axes.legend(
                loc="lower right" if axes is loop else "upper right", fontsize="small", ncols=1 if axes is loop else 4
            )
            axes.margins(y=0.05 if axes is loop else 0.25)
    return figure


def _line(axes: "Axes", x: Column, y: Column, color: str, label: str, **style: Any) -> None:
    axes.plot(x, y, color=color, label=label, linewidth=1.0, rasterized=len(x) > _MANY_ROWS, **style)


def _mark_missed(axes: "Axes", times_s: Sequence[float]) -> None:
    """All of them as one drawing: thousands of single lines take minutes."""
    from matplotlib.collections import LineCollection

    if not len(times_s):
        return
    ends = [((time_s, 0.0), (time_s, 1.0)) for time_s in times_s]
    place = axes.get_xaxis_transform()
    marks = LineCollection(ends, transform=place, color=_MISSED, linewidth=0.8, label="missed ticks")
    axes.add_collection(marks, autolim=False)

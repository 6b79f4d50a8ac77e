"""The figure of a rig over many days: gap and floor, and the sizes of what was named."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from rig.channels import Channels
from rig.gap.history.trends import GAP, Change, Day
from rig.own_units import factor
from rig.report.blank_figure import blank_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_GAP, _FLOOR, _SIZE, _CHANGE = "#0072b2", "0.45", "#d55e00", "#cc0000"
MOST_EFFECTS: Final = 6
"""Effects with a line of their own; the most frequent ones."""


def history_figure(days: Sequence[Day], changes: Sequence[Change]) -> "Figure":
    """Gap and floor over time with the changes as vertical lines; below, each effect that was named, most often
    first."""
    names = [effect for day in days for effect in day.sizes]
    effects = sorted(dict.fromkeys(names), key=lambda effect: -names.count(effect))[:MOST_EFFECTS]
    figure = blank_figure(10, 3.2 + 1.8 * len(effects))
    first, *others = figure.subplots(1 + len(effects), 1, sharex=True, squeeze=False)[:, 0]
    times = [day.days for day in days]
    own = days[0].channels
    by = own.output_per_deg
    first.plot(times, [by * day.gap_deg for day in days], "o-", color=_GAP, label="gap")
    first.plot(times, [by * day.floor_deg for day in days], "--", color=_FLOOR, label="floor")
    first.set_ylabel(f"rms [{own.output.unit}]")
    first.set_ylim(bottom=0.0)
    first.legend(loc="upper left")
    _mark(first, days, [change for change in changes if change.quantity == GAP])
    for axes, effect in zip(others, effects, strict=True):
        _sizes(axes, days, effect, own)
        _mark(axes, days, [change for change in changes if change.quantity == effect])
    figure.axes[-1].set_xlabel("days since the first")
    return figure


def _sizes(axes: "Axes", days: Sequence[Day], effect: str, own: Channels) -> None:
    named = [day for day in days if effect in day.sizes]
    sizes = [day.sizes[effect] for day in named]
    by, unit = factor(sizes[0].unit, own)
    middle = [by * size.value for size in sizes]
    reach = [
        [by * max(size.value - size.low, 0.0) for size in sizes],
        [by * max(size.high - size.value, 0.0) for size in sizes],
    ]
    axes.errorbar([day.days for day in named], middle, reach, fmt="o", color=_SIZE, capsize=3)
    axes.set_ylabel(effect.replace("_", " ") + ("" if unit == "1" else f" [{unit}]"))
    axes.axhline(0.0, color=_FLOOR, linewidth=0.5)


def _mark(axes: "Axes", days: Sequence[Day], changes: Sequence[Change]) -> None:
    at = {day.name: day.days for day in days}
    for change in changes:
        axes.axvline(at[change.day], color=_CHANGE, linestyle=":", label=None)
        axes.annotate(change.day, (at[change.day], 1.0), xycoords=("data", "axes fraction"), color=_CHANGE, fontsize=8)

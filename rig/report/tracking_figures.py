"""Figures of closed-loop records: each reference with what followed it, the errors, and what was commanded."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from rig.columns import rms
from rig.record import Column, Record
from rig.report.blank_figure import blank_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLOURS: Final = {"none": "#d55e00", "model": "#0072b2", "augmented": "#009e73"}
_INCHES: Final = (4.6, 6.4)


def error_deg(record: Record) -> Column:
    """Reference less angle (n,)."""
    assert record.angle_deg is not None
    return record.extra["reference_deg"] - record.angle_deg


def tracking_figure(followed: "Sequence[tuple[str, str, Record]]") -> "Figure":
    """A column a reference; (reference, feed-forward, record) with the column reference_deg each."""
    names = list(dict.fromkeys(name for name, _, _ in followed))
    figure = blank_figure(_INCHES[0] * len(names), _INCHES[1])
    axes = figure.subplots(3, len(names), sharex="col", squeeze=False)
    for column, name in enumerate(names):
        angle, error, command = axes[:, column]
        runs = [(kind, record) for other, kind, record in followed if other == name]
        angle.plot(runs[0][1].t_s, runs[0][1].extra["reference_deg"], color="0.3", linestyle=":", label="reference")
        for kind, record in runs:
            colour, missed = _COLOURS.get(kind), error_deg(record)
            angle.plot(record.t_s, record.angle_deg, color=colour, linewidth=0.8, label=f"feed-forward: {kind}")
            error.plot(record.t_s, missed, color=colour, linewidth=0.8, label=f"{kind}: {rms(missed):.2f} deg rms")
            command.plot(record.t_s, record.dp_cmd_mpa, color=colour, linewidth=0.8)
        angle.set_title(name)
        command.set_xlabel("time [s]")
        angle.legend(fontsize="small")
        error.legend(fontsize="small")
    for row, label in zip(axes[:, 0], ("angle [deg]", "reference - angle [deg]", "p1 - p2 [MPa]"), strict=True):
        row.set_ylabel(label)
    return figure

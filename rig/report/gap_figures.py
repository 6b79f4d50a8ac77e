"""Figures of a diagnosis: measured and simulated before and after, loops, residual over frequency, phase and region,
the ranking.

Colours are of the Okabe-Ito set, and lines differ in dash as well, so that no figure needs colour to be read.
"""

from collections.abc import Callable, Sequence
from io import StringIO
from typing import TYPE_CHECKING

import numpy as np

from rig.channels import Channels
from rig.gap.answer.facts import Verdict
from rig.gap.answer.how_far.augment import remaining_gap
from rig.gap.answer.result import Diagnosis
from rig.gap.answer.words.stages import chain_rows
from rig.gap.pipeline import Grounds
from rig.gap.reference.gaps import commanded_gaps
from rig.own_units import own_places
from rig.record import Column
from rig.report.blank_figure import blank_figure
from rig.report.figure_texts import as_written

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MEASURED, BEFORE, AFTER, FLOOR = "0.2", "#d55e00", "#0072b2", "0.55"
FIGURE_POINTS = 700
"""A line gets at most this many points: the page stays small."""
NARROWER = 0.8
"""Of the widths that figures were drawn for: on a phone the letters stay large enough."""
VISIBLE = 0.02
"""Share of the motion below which two curves lie on one another, and a picture of both shows nothing."""


def figures(diagnosis: Diagnosis, grounds: Grounds) -> list[tuple[str, str]]:
    """(caption, SVG) of every figure, in the order of the page."""
    before = commanded_gaps(grounds.expected)
    after = remaining_gap(grounds.simulator, diagnosis.added, grounds.expected) if diagnosis.added else None
    top = _largest(before)
    left = ", and what is left of it" if after else ""
    drawn: list[tuple[str, Callable[[], Figure]]] = []
    if diagnosis.causes:
        drawn.append(
            (
                "The chain from the command to the sensor, with each stage's share of what the causes close",
                lambda: chain_figure(diagnosis),
            )
        )
    drawn += [
        (
            f"Residual and angle over time in the record with the largest gap{left}",
            lambda: _over_time(grounds, before, after, top),
        ),
        ("Gap of each record", lambda: _records(diagnosis, after is not None)),
        ("Residual over frequency, all records together", lambda: _spectrum(grounds, before, after)),
        ("Where in the motion the gap lies: mean residual by phase and by angle", lambda: _regions(diagnosis)),
    ]
    if _visible(grounds, before[top], top):
        caption = "Loops of the record with the largest gap: angle against the commanded difference of pressures"
        drawn.append((caption, lambda: _loops(grounds, before, after, top)))
    if diagnosis.ranking and diagnosis.verdict is not Verdict.NONE:
        drawn.append(("Ranking: what each effect explains, and how probable it is", lambda: _ranking(diagnosis)))
    return [(caption, _svg(draw())) for caption, draw in drawn]


def over_time_figure(diagnosis: Diagnosis, grounds: Grounds) -> "Figure":
    """The record with the largest gap over time: residual and angle, before and with the causes."""
    before = commanded_gaps(grounds.expected)
    after = remaining_gap(grounds.simulator, diagnosis.added, grounds.expected) if diagnosis.added else None
    return _over_time(grounds, before, after, _largest(before))


def _largest(gaps: Sequence[Column]) -> int:
    return int(np.argmax([float(np.mean(gap**2)) for gap in gaps]))


def _figure(width: float, height: float) -> "Figure":
    return blank_figure(NARROWER * width, height)


def _svg(figure: "Figure") -> str:
    import matplotlib

    with matplotlib.rc_context(
        {"svg.fonttype": "none", "font.family": "sans-serif", "font.size": 10, "svg.hashsalt": "pamrig"}
    ):
        text = StringIO()
        as_written(figure)
        figure.savefig(text, format="svg", metadata={"Date": None})
    drawn = text.getvalue()
    return drawn[drawn.index("<svg") :]


def _thin(column: Column, rows: slice) -> Column:
    part = column[rows]
    return part[:: max(1, len(part) // FIGURE_POINTS)]


def _window(grounds: Grounds, index: int) -> slice:
    """The middle of a record: at most eight seconds."""
    pair = grounds.expected.pairs[index]
    rows = int(min(8.0, pair.t_s[-1]) / pair.dt_s)
    start = (len(pair) - rows) // 2
    return slice(start, start + rows)


def _visible(grounds: Grounds, gap: Column, index: int) -> bool:
    """Whether measured and simulated angle lie apart by more than a line's width."""
    angle = grounds.expected.pairs[index].case.angle_deg
    return float(np.std(gap)) > VISIBLE * float(np.ptp(angle))


def chain_figure(diagnosis: Diagnosis) -> "Figure":
    """Boxes from the command to the sensor: the fuller, the larger the share of what the causes close."""
    from matplotlib.patches import Rectangle

    figure = _figure(8.0, 1.7)
    axes = figure.subplots()
    for place, (stage, share, found) in enumerate(chain_rows(diagnosis)):
        part = diagnosis.where.chain[place].share
        axes.add_patch(Rectangle((place, 0.0), 0.8, part, color=BEFORE, alpha=0.45))
        axes.add_patch(Rectangle((place, 0.0), 0.8, 1.0, fill=False, edgecolor=MEASURED, linewidth=1.2))
        axes.text(place + 0.4, 0.68, stage, ha="center", fontsize=11, weight="bold")
        short = share.replace("more than", ">").replace("less than", "<")  # the words are wider than their box
        axes.text(place + 0.4, 0.3, short, ha="center", fontsize=11)
        axes.text(place + 0.4, -0.1, found.replace(", ", "\n"), ha="center", va="top", fontsize=8)
        if place:
            axes.annotate("", (place, 0.5), (place - 0.2, 0.5), arrowprops={"arrowstyle": "->", "color": MEASURED})
    axes.set_xlim(-0.05, 4.85)
    axes.set_ylim(-0.5, 1.05)
    axes.set_axis_off()
    return figure


def _over_time(grounds: Grounds, before: Sequence[Column], after: Sequence[Column] | None, index: int) -> "Figure":
    pair, rows = grounds.expected.pairs[index], _window(grounds, index)
    figure = _figure(8.0, 4.6)
    rest, angle = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    own = pair.raw.channels
    t, measured = _thin(pair.t_s, rows), own.own_output(pair.case.angle_deg)
    before, after = _own(before, own), None if after is None else _own(after, own)
    rest.plot(t, _thin(before[index], rows), color=BEFORE, linestyle="--", label="before")
    angle.plot(t, _thin(measured, rows), color=MEASURED, label="measured")
    angle.plot(t, _thin(measured - before[index], rows), color=BEFORE, linestyle="--", label="simulated before")
    if after is not None:
        rest.plot(t, _thin(after[index], rows), color=AFTER, label="with the causes")
        angle.plot(
            t, _thin(measured - after[index], rows), color=AFTER, linestyle=":", linewidth=2, label="with the causes"
        )
    _zero(rest)
    rest.set_ylabel("residual [deg]")
    rest.set_title(pair.name, fontsize=10, loc="left")
    angle.set_ylabel("angle [deg]")
    angle.set_xlabel("time [s]")
    for axes in (rest, angle):  # above the curves, which fill their axes from end to end
        axes.legend(fontsize=8, ncols=3, loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2, frameon=False)
    return figure


def _loops(grounds: Grounds, before: Sequence[Column], after: Sequence[Column] | None, index: int) -> "Figure":
    pair, rows = grounds.expected.pairs[index], _window(grounds, index)
    own = pair.raw.channels
    before, after = _own(before, own), None if after is None else _own(after, own)
    drawn = [(before[index], BEFORE, "before")] + ([] if after is None else [(after[index], AFTER, "with the causes")])
    figure = _figure(8.0, 3.6)
    command = own.own_input(_thin(pair.u1_mpa - pair.u2_mpa, rows))
    measured = own.own_output(pair.case.angle_deg)
    places = figure.subplots(1, len(drawn), sharey=True, squeeze=False)[0]
    for axes, (gap, color, title) in zip(places, drawn, strict=True):
        axes.plot(command, _thin(measured, rows), color=MEASURED, label="measured")
        axes.plot(command, _thin(measured - gap, rows), color=color, linestyle="--", label="simulated")
        axes.set_title(title, fontsize=10)
        axes.set_xlabel("p1 - p2 commanded [MPa]")
        axes.legend(fontsize=8)
    places[0].set_ylabel("angle [deg]")
    return figure


def _spectrum(grounds: Grounds, before: Sequence[Column], after: Sequence[Column] | None) -> "Figure":
    from scipy.signal import welch

    figure = _figure(8.0, 3.2)
    axes = figure.subplots()
    pairs = grounds.expected.pairs
    before = _own(before, pairs[0].raw.channels)
    after = None if after is None else _own(after, pairs[0].raw.channels)
    curves = [(before, BEFORE, "--", "before")] + ([] if after is None else [(after, AFTER, "-", "with the causes")])
    for gaps, color, style, name in curves:
        parts = [
            welch(gap, 1.0 / pair.dt_s, nperseg=min(len(gap), round(8.0 / pair.dt_s)))
            for pair, gap in zip(pairs, gaps, strict=True)
        ]
        shortest = min(len(part[0]) for part in parts)
        power = np.mean([part[1][:shortest] for part in parts], axis=0)
        rows = parts[0][0][:shortest] < 20.0
        axes.loglog(
            parts[0][0][:shortest][rows][1:], np.sqrt(power[rows][1:]), color=color, linestyle=style, label=name
        )
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel("residual [deg / sqrt Hz]")
    axes.legend(fontsize=8)
    axes.grid(alpha=0.3)
    return figure


def _records(diagnosis: Diagnosis, added: bool) -> "Figure":
    lines = diagnosis.evidence.records[:20]
    figure = _figure(8.0, 1.0 + 0.4 * len(lines))
    axes = figure.subplots()
    rows, by = np.arange(len(lines)), diagnosis.channels.output_per_deg
    axes.barh(rows + 0.2, [by * line.gap_before_deg for line in lines], 0.38, color=BEFORE, label="before")
    if added:
        axes.barh(
            rows - 0.2,
            [by * line.gap_after_deg for line in lines],
            0.38,
            color=AFTER,
            hatch="//",
            label="with the causes",
        )
    axes.axvline(by * diagnosis.gap.floor_deg, color=FLOOR, linestyle=":", label="usual")
    axes.set_yticks(rows, [line.record for line in lines], fontsize=8)
    axes.invert_yaxis()
    axes.set_xlabel("gap [deg rms]")
    axes.legend(fontsize=8)
    return figure


def _regions(diagnosis: Diagnosis) -> "Figure":
    figure = _figure(8.0, 3.0)
    own = diagnosis.channels
    by = own.output_per_deg
    where = {"phase": diagnosis.where.phase, "angle": diagnosis.where.region}
    for axes, (name, lines) in zip(figure.subplots(1, 2, sharey=True), where.items(), strict=True):
        rows = np.arange(len(lines))
        axes.bar(
            rows,
            [by * line.mean_deg for line in lines],
            yerr=[by * line.rms_deg for line in lines],
            color=BEFORE,
            ecolor="0.4",
            capsize=3,
        )
        axes.set_xticks(
            rows,
            [f"{_short(own_places(line.name, own), own.output.unit)}\n{100 * line.share:.0f} %" for line in lines],
            fontsize=7,
        )
        _zero(axes)
        axes.set_title(f"by {name + (' [deg]' if name == 'angle' else '')}: mean, rms, share of the gap", fontsize=8)
        axes.set_ylabel("residual [deg]")
    return figure


def _ranking(diagnosis: Diagnosis) -> "Figure":
    lines = diagnosis.ranking[:10]
    figure = _figure(8.0, 1.0 + 0.32 * len(lines))
    axes = figure.subplots()
    rows = np.arange(len(lines))
    axes.barh(rows, [max(line.explained_fraction, 0.0) for line in lines], 0.7, color=AFTER)
    for row, line in zip(rows, lines, strict=True):
        axes.text(1.04, float(row), f"{line.probability:.2f}", va="center", fontsize=8)
    axes.text(1.04, -0.8, "probability", va="center", fontsize=8)
    axes.set_yticks(rows, [f"{line.effect} ({line.judged_on})" for line in lines], fontsize=8)
    axes.set_xlim(0.0, 1.25)
    axes.set_xticks([0.0, 0.2, 0.4, 0.6, 0.8, 1.0])  # the probabilities stand beyond
    axes.set_ylim(len(lines) - 0.4, -1.4)
    axes.set_xlabel("share that it explains of what it was judged on")
    return figure


def _short(name: str, unit: str) -> str:
    """A band without its unit and spare digits, to fit under its bar."""
    if " to " not in name:
        return name
    low, high = name.removesuffix(f" {unit}").split(" to ")
    return f"{float(low):.0f} to {float(high):.0f}" if unit == "deg" else f"{float(low):.2g} to {float(high):.2g}"


def _own(columns: Sequence[Column], channels: Channels) -> list[Column]:
    """Differences of the output in the rig's own unit."""
    return [channels.output_per_deg * column for column in columns]


def _zero(axes: "Axes") -> None:
    axes.axhline(0.0, color=FLOOR, linewidth=0.8)

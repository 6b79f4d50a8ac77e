"""The result of a blind check for people: a table for the terminal, and one self-contained HTML page.

Everything here is drawn from the check's JSON; no figure is computed anew.
"""

from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.blind_check.goals import GOALS, bound, figure, figure_text, reached
from rig.outputs import OutputKind, write_text
from rig.report.blank_figure import blank_figure
from rig.report.check_results import as_markdown
from rig.report.check_words import FAMILY_FIGURES, MODE_WORDS, MODES_A_TABLE, NAIVE_WORDS
from rig.report.figure_texts import as_written

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.console import Group
    from rich.table import Table

_BLUE, _ORANGE = "#0072b2", "#d55e00"


def check_table(result: Mapping[str, Any]) -> "Group":
    """The goals' figures by mode, for the terminal: tables of few modes each."""
    from rich.console import Group

    modes = [mode for mode in MODE_WORDS if mode in result["modes"]]
    title = f"blind check of {result['cases']} cases: share (95 % interval; count) and its goal"
    parts = [modes[start : start + MODES_A_TABLE] for start in range(0, len(modes), MODES_A_TABLE)]
    return Group(title, *(_table_of(result, part) for part in parts))


def _table_of(result: Mapping[str, Any], modes: Sequence[str]) -> "Table":
    from rich.table import Table

    table = Table("figure", *(MODE_WORDS[mode] for mode in modes))
    for row in rows_of(result):
        cells = [cell for cell in row["cells"] if cell["mode"] in modes]
        texts = [
            f"{cell['text']}  {cell['goal']}{'' if cell['reached'] is not False else '  missed'}" for cell in cells
        ]
        table.add_row(row["words"], *texts)
    return table


def rows_of(result: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Goal by goal: its words, and for each mode the figure, the goal and whether it is reached."""
    rows = []
    for goal in GOALS:
        cells = []
        for name, mode in result["modes"].items():
            text = figure_text(figure(mode, goal), goal.unit)
            cells.append({"mode": name, "text": text, "goal": bound(goal, name), "reached": reached(mode, goal, name)})
        rows.append({"words": goal.words, "cells": cells})
    return rows


def write_page(result: Mapping[str, Any], path: Path) -> None:
    """The page as HTML, or tables in Markdown when the name ends in .md; RigError when it cannot be written."""
    text = as_markdown(result) if path.suffix.lower() == ".md" else as_html(result)
    write_text(path, text, OutputKind.PAGE)


def as_html(result: Mapping[str, Any]) -> str:
    """One self-contained page."""
    from rig.report.templates import rendered, template

    with_goals = {name for goal in GOALS for name in goal.bounds}
    words = {
        "mode_words": MODE_WORDS, "naive_words": NAIVE_WORDS, "with_goals": with_goals,
        "family_figures": FAMILY_FIGURES,
    }  # fmt: skip
    return rendered(
        template("check_page.html.jinja"),
        {"figure": lambda found, unit="%": figure_text(found, unit)},
        result=result, rows=rows_of(result), pictures=_pictures(result), **words,
    )  # fmt: skip


def _pictures(result: Mapping[str, Any]) -> dict[str, str]:
    """Mode -> SVG of names right over strength, beside stated against realised confidence."""
    return {name: _picture(mode) for name, mode in result["modes"].items()}


def _picture(mode: Mapping[str, Any]) -> str:
    drawing = blank_figure(11.0, 3.4)
    strength, trust, shrunk = drawing.subplots(1, 3)
    labels = list(mode["by_ratio"])
    for key, words, color, marker in (
        ("detected", "detected", _BLUE, "o"),
        ("exact_first", "exact name first", _ORANGE, "s"),
    ):
        seen = [
            (place, mode["by_ratio"][label][key])
            for place, label in enumerate(labels)
            if mode["by_ratio"][label][key]["n"]
        ]
        _bars(strength, seen, color, marker, words)
    strength.set_xticks(range(len(labels)), labels)
    strength.set(xlabel="gap over floor", ylabel="share of single effects", ylim=(-0.02, 1.05))
    trust.plot([0, 1], [0, 1], color="0.6", linestyle="--", label="as stated")
    _bars(trust, [(each["stated"], each["right"]) for each in mode["reliability"]], _BLUE, "o", "found")
    trust.set(xlabel="stated confidence of the first name", ylabel="share right", xlim=(0, 1.02), ylim=(-0.02, 1.05))
    shrunk.plot([0, 1], [0, 1], color="0.6", linestyle="--", label="as predicted")
    pairs = [(predicted, max(found, -0.2)) for predicted, found in mode["ef_pairs"]]
    shrunk.plot(
        [pair[0] for pair in pairs], [pair[1] for pair in pairs], "o", color=_BLUE, markersize=4, label="a case"
    )
    shrunk.set(
        xlabel="predicted explained fraction",
        ylabel="realised on untouched records",
        xlim=(-0.02, 1.05),
        ylim=(-0.25, 1.25),
    )
    for axes in (strength, trust, shrunk):
        if axes.get_legend_handles_labels()[0]:
            axes.legend(loc="lower right")
    text = StringIO()
    as_written(drawing)
    drawing.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()[text.getvalue().index("<svg") :]


def _bars(axes: "Axes", seen: Sequence[tuple[float, Mapping[str, Any]]], color: str, marker: str, words: str) -> None:
    """Rates with their intervals, joined."""
    if not seen:
        return
    spans = [[rate["rate"] - rate["low"] for _, rate in seen], [rate["high"] - rate["rate"] for _, rate in seen]]
    places, rates = [place for place, _ in seen], [rate["rate"] for _, rate in seen]
    axes.errorbar(places, rates, spans, color=color, marker=marker, capsize=3, label=words)

"""Figures and tables of identification and validation as files in a folder."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from rig.channels import PNEUMATIC, Channels
from rig.identify.fit import Identified
from rig.identify.records.data import RecordOptions, prepare
from rig.identify.search.objective import predict
from rig.identify.validate import Score, Validation
from rig.model.parameters import Input, Model
from rig.outputs import OutputKind, targets_in, write_text, writing
from rig.own_units import own_plain, own_text
from rig.record import Record
from rig.report.figure_texts import in_markdown
from rig.report.fit_figures import comparison_figure, convergence_figure
from rig.report.log_figures import save
from rig.report.shown_text import in_one_line

_CONVERGENCE: Final = "convergence"
"""A figure of no record; one of that name has a number."""


def write_fit_figures(found: Identified, records: Sequence[Record], options: RecordOptions, folder: Path) -> None:
    """Figs. 4 to 6 of each identification record as it was fitted, the convergence, and the scores as a table."""
    histories = {f"seed {seed}": each.history for seed, each in found.seeds.items()}
    channels = found.model.own_channels
    save(convergence_figure(_CONVERGENCE, histories, channels), folder / f"{_CONVERGENCE}.png")
    _write_comparisons({found.model.muscle.kind.upper(): found.model}, records, options, folder)
    write_scores(found.scores, folder, channels)


def write_validation(
    models: Mapping[str, Model], records: Sequence[Record], result: Validation, options: RecordOptions, folder: Path
) -> None:
    """Figs. 4 to 6 of each record with every model, and Table IV of the first."""
    _write_comparisons(models, records, options, folder)
    write_scores(result.scores, folder, next(iter(models.values())).own_channels)


def write_scores(scores: Sequence[Score], folder: Path, channels: Channels = PNEUMATIC) -> None:
    """Table IV as scores.csv and scores.md."""
    names = ("rmse_deg", "nrmse", "fit_percent", "max_deg", "command_rmse_deg")
    head = ["record", *own_plain(dict.fromkeys(names, 0.0), channels)]
    rows = [[in_one_line(Path(row.log).name), *score_cells(row, channels)] for row in scores]
    lines = [" | ".join(map(in_markdown, cells)) for cells in (head, ["---"] * len(head), *rows)]
    write_text(folder / "scores.md", "".join(f"| {line} |\n" for line in lines), OutputKind.TABLE)
    with (
        writing(folder / "scores.csv", OutputKind.TABLE) as part,
        part.open("w", encoding="utf-8", errors="backslashreplace", newline="") as file,
    ):
        csv.writer(file).writerows([head, *rows])


def _write_comparisons(
    models: Mapping[str, Model], records: Sequence[Record], options: RecordOptions, folder: Path
) -> None:
    _, *targets = targets_in(folder, (_CONVERGENCE, *(record.name for record in records)), ".png")
    for record, target in zip(records, targets, strict=True):
        data = {name: prepare(record, model, options) for name, model in models.items()}
        first_model, first = next(iter(models.values())), next(iter(data.values()))
        source = "commanded" if first_model.muscle.input is Input.COMMAND else "measured"
        angles = {name: predict(model, data[name]) for name, model in models.items()}
        own = record.channels
        u = own.own_input(first.p1_mpa - first.p2_mpa)
        angles = {
            name: own.own_output(np.interp(first.grid.t_s, data[name].grid.t_s, angle))
            for name, angle in angles.items()
        }  # each model is simulated at its own sample time
        measured, label = own.own_output(first.angle_deg), own_text(f"p1 - p2 {source} [MPa]", own)
        figure = comparison_figure(record.name, first.grid.t_s, u, measured, angles, label, own)
        save(figure, target)


def score_cells(row: Score, channels: Channels) -> list[str]:
    """One row of Table IV as text, in the rig's own unit."""
    by, more = channels.output_per_deg, 0 if channels.has_valves else 2
    whole = "" if row.command_rmse_deg is None else f"{by * row.command_rmse_deg:.{3 + more}f}"
    return [
        f"{by * row.rmse_deg:.{3 + more}f}",
        f"{row.nrmse:.4f}",
        f"{row.fit_percent:.1f}",
        f"{by * row.max_deg:.{2 + more}f}",
        whole,
    ]

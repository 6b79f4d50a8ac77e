"""What `pamrig identify` and `pamrig validate` show: tables and JSON."""

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from rig.app.terminal import listing, styled
from rig.config import unstructure
from rig.identify.fit import Identified
from rig.identify.records.data import RecordOptions, prepare
from rig.identify.search.objective import predict
from rig.identify.search.stability import StabilityVerdict
from rig.identify.validate import Score, Validation
from rig.model.fingerprint import Fingerprint, PressureSource
from rig.model.parameters import Model
from rig.number_text import parameter_text
from rig.own_units import own_label, own_plain, own_text, speaker
from rig.record import Record
from rig.report.fit_figures import terminal_comparison
from rig.report.fit_files import score_cells


def identified_json(found: Identified, output: Path) -> dict[str, Any]:
    """The result of `identify` in the shape of the commands' reference, and more."""
    law = found.model.muscle.parameters.get("mean_exponent")
    plain = {
        "model": str(output),
        "rmse_deg": found.rmse_deg,
        "search_rmse_deg": found.search_rmse_deg,
        "unbounded_rmse_deg": found.unbounded_rmse_deg,
        "evaluations": found.evaluations,
        "seconds": found.seconds,
        "bounded": found.verdict.bounded,
        "peak_deg": found.verdict.peak_deg,
        "input": found.model.muscle.input.value,
        "mean_exponent": None if law is None else law.value,
        "fingerprint": unstructure(found.model.fingerprint),
        "correlation": {"names": found.space.names, "matrix": found.uncertainty.correlation.tolist()},
        "records": [score_json(each) for each in found.scores],
        "seeds": {
            str(seed): {
                "score": each.score,
                "evaluations": each.evaluations,
                "seconds": each.seconds,
                "history": each.history,
            }
            for seed, each in found.seeds.items()
        },
        "valves": None
        if found.valves is None
        else {"rmse_mpa": found.valves.rmse_mpa, "dead_time_s": found.valves.dead_time_s, "notes": found.valves.notes},
        "warnings": found.warnings,
    }
    in_own_units: dict[str, Any] = own_plain(plain, found.model.own_channels)
    return in_own_units | {"parameters": _parameters_json(found)} | channels_json(found.model)


def _parameters_json(found: Identified) -> dict[str, Any]:
    """Each parameter that was searched for; in the units of the model's file."""
    spread = found.seed_spread()
    return {
        place.name: {
            "value": (now := found.model.stages()[place.slot].parameters[place.name]).value,
            "unit": now.unit,
            "std": now.std,
            "at_bound": now.at_bound,
            "low": now.low,
            "high": now.high,
            "seed_spread": spread[place.name],
        }
        for place in found.space.places
    }


def channels_json(model: Model) -> dict[str, Any]:
    """The channel map of a model that has one: whose units the figures are in. Its parameters stay as its file has
    them."""
    return {} if model.channels is None else {"channels": model.channels.plain()}


def score_json(row: Score) -> dict[str, Any]:
    """One row of Table IV; an angle that diverged counts as off by a fixed large number."""
    plain = {
        "log": row.log,
        "rmse_deg": row.rmse_deg,
        "nrmse": row.nrmse,
        "fit_percent": row.fit_percent,
        "max_deg": row.max_deg,
    }
    return (
        plain
        | {"diverged": row.diverged}
        | ({} if row.command_rmse_deg is None else {"command_rmse_deg": row.command_rmse_deg})
    )


def validation_json(result: Validation, model: Model) -> dict[str, Any]:
    """The result of `validate`."""
    verdict = result.verdict
    plain = {
        "bounded": verdict.bounded,
        "worst": verdict.worst,
        "peak_deg": verdict.peak_deg,
        "limit_deg": verdict.limit_deg,
        "records": [score_json(row) for row in result.scores],
        "warnings": result.warnings,
    }
    in_own_units: dict[str, Any] = own_plain(plain, model.own_channels)
    return in_own_units | channels_json(model)


def show_identified(found: Identified, terminal: Console) -> None:
    """What was chosen and why, the parameters, the error and what limits them."""
    say = speaker(found.model.own_channels)
    for reason in found.choices:
        terminal.print(say(reason), markup=False)
    table = listing("parameter", "value", "std", "unit", "between seeds", "")
    spread = found.seed_spread()
    for place in found.space.places:
        now = found.model.stages()[place.slot].parameters[place.name]
        std = "-" if now.std is None else f"{now.std:.2g}"
        between = "-" if math.isnan(spread[place.name]) else f"{spread[place.name]:.2g}"  # one search has none
        remark = "at its bound" if now.at_bound else "not determined" if now.std is None else ""
        table.add_row(place.name, parameter_text(now.value, now.std), std, now.unit, between, remark)
    terminal.print(table)
    swarm = f"RMSE {found.rmse_deg:.3f} deg ({found.search_rmse_deg:.3f} deg before the polish)"
    terminal.print(f"{say(swarm)} after {found.evaluations} evaluations in {found.seconds:.1f} s")
    if found.unbounded_rmse_deg is not None:
        cost = f"{found.rmse_deg - found.unbounded_rmse_deg:.3f} deg"
        terminal.print(f"staying bounded over the sweep range costs {say(cost)} of it")
    verdict = found.verdict
    state = "bounded" if verdict.bounded else ("NOT bounded", "red")
    terminal.print(styled(state, f" over the sweep range: {_largest(verdict, found.model)}"))
    if found.valves is not None:
        dead = f", dead time {1e3 * found.valves.dead_time_s:.3g} ms" if found.valves.dead_time_s else ""
        terminal.print(
            "regulators: RMSE " + ", ".join(f"{1e3 * error:.2f} kPa" for error in found.valves.rmse_mpa) + dead
        )
    if (known := found.model.fingerprint) is not None:
        terminal.print(say(_fingerprint_line(known, pneumatic=found.model.own_channels.has_valves)))
    alike = found.uncertainty.alike(found.space.names)
    if alike:
        first = ", ".join(f"{a}~{b} ({r:+.3f})" for a, b, r in alike[:4])
        terminal.print(
            f"hardly told apart by these records: {first}"
            + (f" and {len(alike) - 4} more pairs" if len(alike) > 4 else "")
        )
    _warn(map(say, found.warnings), terminal)


def _largest(verdict: StabilityVerdict, model: Model) -> str:
    """How far the output goes, and under what: an angle from rest, or from the middle of the range of a rig with a
    channel map."""
    own = model.own_channels
    if own.has_valves:
        return f"largest angle {verdict.peak_deg:.1f} deg in {verdict.worst}"
    far = f"{own.output_per_deg * verdict.peak_deg:.1f} {own.output.unit}"
    return f"{own.output.spoken} at most {far} from the middle of its range in {own_label(verdict.worst, own)}"


def _fingerprint_line(known: Fingerprint, *, pneumatic: bool) -> str:
    source = "virtual pressures, the records have no usable ones" if pneumatic else "the command"
    if known.pressures is PressureSource.MEASURED:
        source = "the measured pressures"
    left = "" if known.left_out_deg is None else f", {known.left_out_deg:.2g} deg of a record that it has not seen"
    return f"fingerprint from {source}: it misses {known.misfit_deg:.2g} deg of these records{left}"


def show_validation(result: Validation, model: Model, beside: Mapping[str, Validation], terminal: Console) -> None:
    """Table IV, with a column for the RMSE of each model beside it."""
    channels = model.own_channels
    say = speaker(channels)
    chain = any(row.command_rmse_deg is not None for row in result.scores)
    head = ["record", "RMSE deg", "NRMSE", "fit %", "max deg", *(["RMSE from command"] if chain else [])]
    table = listing(*map(say, head), *(f"RMSE {name}" for name in beside))
    for index, row in enumerate(result.scores):
        cells = score_cells(row, channels)
        others = [score_cells(each.scores[index], channels)[0] for each in beside.values()]
        table.add_row(Path(row.log).name, *(cells if chain else cells[:4]), *others)
    terminal.print(table)
    verdict = result.verdict
    state = "bounded" if verdict.bounded else "NOT bounded"
    limit = say(f"limit {verdict.limit_deg:.1f} deg").removesuffix(f" {channels.output.unit}")
    terminal.print(f"{state} over the sweep range: {_largest(verdict, model)} ({limit})")
    _warn(map(say, result.warnings), terminal)


def show_worst(
    model: Model, records: Sequence[Record], scores: Sequence[Score], options: RecordOptions, terminal: Console
) -> None:
    """The record with the largest error as a picture, on a terminal."""
    if not terminal.is_terminal:
        return
    worst = max(range(len(scores)), key=lambda index: scores[index].rmse_deg)
    data = prepare(records[worst], model, options)
    size = (min(terminal.width, 110), 16)
    own = model.own_channels.own_output
    angle = own(np.clip(predict(model, data), -180.0, 180.0))
    title = own_text("angle [deg]", model.own_channels)
    shown = terminal_comparison(records[worst].name, data.grid.t_s, own(data.angle_deg), angle, *size, title)
    terminal.print(shown)


def _warn(warnings: Iterable[str], terminal: Console) -> None:
    for text in warnings:
        terminal.print(styled(("warning:", "yellow"), f" {text}"))

"""Simulators: read, run, fitted to records, judged on others."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np

from pamrig._picture import Picture, Table, Tabled, shown
from pamrig._places import Logs, place_of, plain, records_of, require_one_of, sweep_file
from pamrig._records import Records
from rig.app.model import simulating
from rig.app.model.identifying import SearchOptions, StartOptions, identify_model, sweep_range
from rig.app.shipped import find_config
from rig.config import structure
from rig.errors import ConfigError, ModelError
from rig.identify import fit
from rig.identify import validate as judging
from rig.identify.records.data import RecordOptions, prepare
from rig.identify.search.objective import predict
from rig.identify.search.stability import SweepRange
from rig.log.session_times import begun_s
from rig.model import parameters
from rig.model.parameters import Input, Model
from rig.number_text import parameter_text
from rig.own_units import own_text
from rig.record import Record
from rig.report.fit_figures import comparison_figure

__all__ = ["Identified", "Model", "Validation", "identify", "load_model", "save_model", "simulate", "validate"]


def load_model(place: str | Path) -> Model:
    """The simulator of a MODEL.yaml, or one that comes with pamrig by its name. ModelError when it is not one.

    >>> pamrig.load_model("simulated").muscle.kind
    'mbw'
    """
    return parameters.load_model(find_config(place_of(place, "model"), "models"))


def save_model(model: "Model | Identified", place: str | Path) -> None:
    """Write a simulator as YAML; a file that is no model is never overwritten.

    >>> pamrig.save_model(pamrig.load_model("simulated"), "mine.yaml")
    """
    if isinstance(model, Identified):
        model = model.model
    if not isinstance(model, Model):
        raise ModelError(f"save_model: expected a Model, got {model!r:.60}; load_model reads one")
    parameters.save_model(model, place_of(place, "save_model"))


def simulate(
    model: "Model | Identified | str | Path",
    commands: Logs | dict[str, Any],
    *,
    drive: Literal["command", "pressure"] = "command",
) -> Records:
    """What a simulator says under commands: records with angle and, where it has regulators, pressures.

    `commands` are records, logs, or a sweep (a file, a name, a mapping). With `drive="pressure"` the measured pressures
    drive the muscles. ModelError where the simulator diverges, RecordError for records of another rig.

    >>> (simulated,) = pamrig.simulate("simulated", "quick")
    >>> f"{simulated.angle_deg.max():.0f} degrees at most"
    '38 degrees at most'
    """
    require_one_of(drive, ("command", "pressure"), "drive")
    simulator = _model(model)
    if isinstance(commands, str | Path | dict):
        with sweep_file(commands) as place:
            records = simulating.commands_of(place, simulator.sample_time_s)
        sweeps = [record.source is None for record in records]
    else:
        records = records_of(commands)
        sweeps = [False] * len(records)
    return Records(
        simulating.answered(simulator, record, Input(drive), "the model", sweep=sweep, begun_s=at_s)
        for record, sweep, at_s in zip(records, sweeps, begun_s(records).tolist(), strict=True)
    )


class Identified(Tabled):
    """A simulator fitted to records, and how well: `model`, `rmse_deg`, `parameters`.

    >>> found = pamrig.identify("first", seeds=1, iterations=50, particles=20, bounded=False)
    >>> found.rmse_deg < 2.0
    True
    """

    def __init__(self, found: fit.Identified, records: list[Record], options: RecordOptions) -> None:
        self._found, self._records, self._options = found, records, options
        self.model = found.model

    @property
    def rmse_deg(self) -> float:
        """Over all records that it was fitted to."""
        return self._found.rmse_deg

    @property
    def bounded(self) -> bool:
        """Its output stays finite and sensible over the sweep range."""
        return self._found.verdict.bounded

    @property
    def parameters(self) -> Mapping[str, parameters.Parameter]:
        """The muscles' parameters by name: value, unit, standard deviation, whether one ended at its bound."""
        return self.model.muscle.parameters

    @property
    def notes(self) -> list[str]:
        """What was chosen, and why; and what is doubtful."""
        return [*self._found.choices, *self._found.warnings]

    def save(self, place: str | Path) -> None:
        """Write the model as YAML."""
        save_model(self.model, place)

    def plot(self) -> Picture:
        """The record that it follows least."""
        return _worst(self.model, self._records, self._found.scores, self._options)

    def _table(self) -> Table:
        free = {name: each for name, each in self.parameters.items() if each.free}
        ends = {True: "at its bound", False: ""}
        rows = [
            (name, parameter_text(each.value, each.std), shown(each.std, 2), each.unit, ends[each.at_bound])
            for name, each in free.items()
        ]
        rmse = own_text(f"RMSE {self.rmse_deg:.3g} deg", self.model.own_channels)
        return Table(("parameter", "value", "std", "unit", ""), rows, rmse)


def identify(
    logs: Logs,
    *,
    start: str | Path | None = None,
    kind: Literal["mbw", "bw", "bw_continuous"] = "mbw",
    drive: Literal["auto", "command", "pressure"] = "auto",
    optimizer: Literal["pso", "cma-es", "de"] = "pso",
    seed: int = 1,
    seeds: int = 3,
    particles: int = 60,
    iterations: int = 1000,
    early_stop: int | None = None,
    polish: bool = True,
    bounded: bool = True,
    joint: Literal["rigid", "second_order"] = "rigid",
    sample_time_s: float | None = None,
    sweep_hz: tuple[float, float] = (0.2, 0.8),
    resample: bool = False,
) -> Identified:
    """Fit a simulator to records by particle swarm and a least-squares polish; the defaults are the paper's (Table II).

    `start` is a model whose `free` parameters are searched, else a template of `kind`. `sample_time_s` is the model's,
    by default the period of the records. `sweep_hz` is where it has to stay bounded.
    RecordError for records that cannot be used, ModelError for a start that cannot be searched.
    """
    require_one_of(drive, ("auto", "command", "pressure"), "drive")
    asked: dict[str, Any] = {
        "optimizer": optimizer,
        "seed": seed,
        "seeds": seeds,
        "particles": particles,
        "iterations": iterations,
    }
    asked |= {"early_stop": early_stop, "polish": polish, "bounded": bounded}
    search = structure(plain(asked), SearchOptions, "identify")
    records, options = records_of(logs), RecordOptions(resample=resample)
    begin = StartOptions(
        None if start is None else place_of(start, "start"), kind, drive, joint, sample_time_s, None, 0.2, None, None
    )
    found = identify_model(records, begin, search, _sweep(sweep_hz, records), options, None)
    return Identified(found, records, options)


class Validation(Tabled):
    """How well a simulator predicts records (Table IV), and whether it stays bounded.

    >>> pamrig.validate("simulated", "first").scores[0].rmse_deg < 3.0
    True
    """

    def __init__(self, model: Model, records: list[Record], judged: judging.Validation, options: RecordOptions) -> None:
        self._model, self._records, self._judged, self._options = model, records, judged, options

    @property
    def bounded(self) -> bool:
        """The output stays finite and sensible over the sweep range."""
        return self._judged.verdict.bounded

    @property
    def scores(self) -> list[judging.Score]:
        """For each record: rmse_deg, nrmse, fit_percent, max_deg."""
        return self._judged.scores

    @property
    def warnings(self) -> list[str]:
        """Records outside what the model is valid for."""
        return self._judged.warnings

    def plot(self) -> Picture:
        """The record with the largest error: measured, simulated, their difference, both loops."""
        return _worst(self._model, self._records, self.scores, self._options)

    def _table(self) -> Table:
        own = self._model.own_channels
        by = own.output_per_deg
        rows = [(Path(row.log).name, *map(shown, _own_score(row, by))) for row in self.scores]
        head = ("record", "RMSE [deg]", "NRMSE", "fit [%]", "max [deg]", "RMSE from the command [deg]")
        return Table(
            [own_text(name, own) for name in head],
            rows,
            "bounded" if self.bounded else "NOT bounded over the sweep range",
        )


def validate(
    model: Model | Identified | str | Path,
    logs: Logs,
    *,
    sweep_hz: tuple[float, float] = (0.2, 0.8),
    resample: bool = False,
) -> Validation:
    """Score a simulator on records that it was not fitted to, driven as it was identified.

    RecordError for records that cannot be used.
    """
    simulator, records, options = _model(model), records_of(logs), RecordOptions(resample=resample)
    judged = judging.validate(simulator, records, _sweep(sweep_hz, records), options)
    return Validation(simulator, records, judged, options)


def _own_score(row: judging.Score, by: float) -> tuple[float | None, ...]:
    """A row of the table; errors times `by`."""
    chain = None if row.command_rmse_deg is None else by * row.command_rmse_deg
    return by * row.rmse_deg, row.nrmse, row.fit_percent, by * row.max_deg, chain


def _sweep(sweep_hz: tuple[float, float], records: list[Record]) -> SweepRange:
    try:
        low_hz, high_hz = map(float, sweep_hz)
    except (TypeError, ValueError):
        raise ConfigError(f"sweep_hz: expected two frequencies in Hz, got {sweep_hz!r:.60}") from None
    return sweep_range(low_hz, high_hz, None, records)


def _model(model: Model | Identified | str | Path) -> Model:
    if isinstance(model, Identified):
        return model.model
    return model if isinstance(model, Model) else load_model(model)


def _worst(model: Model, records: list[Record], scores: list[judging.Score], options: RecordOptions) -> Picture:
    worst = int(np.argmax([row.rmse_deg for row in scores]))
    data = prepare(records[worst], model, options)
    source = "commanded" if model.muscle.input is Input.COMMAND else "measured"
    own = records[worst].channels
    predicted = {model.muscle.kind.upper(): own.own_output(predict(model, data))}
    drive, measured = own.own_input(data.p1_mpa - data.p2_mpa), own.own_output(data.angle_deg)
    label = own_text(f"p1 - p2 {source} [MPa]", own)
    return Picture(comparison_figure(records[worst].name, data.grid.t_s, drive, measured, predicted, label, own))

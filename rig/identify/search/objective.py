"""How good a point of the unit box is: the model's error on the records, and what it pays for leaving the sweep range.

Two objectives with one face: `SwarmObjective` for Bouc-Wen muscles on the compiled kernel, `ChainObjective` for
everything else that can be free in a model (regulators aside, which `rig.identify.response.valves` fits), one
simulation after another.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from rig.identify.records.data import Prepared
from rig.identify.search.space import Space
from rig.identify.search.stability import StabilityTerm
from rig.model.chain import lay_out
from rig.model.compiled.columns import drive
from rig.model.compiled.swarm import HOPELESS, LAW, Table, lay_inputs, swarm_courses, swarm_errors
from rig.model.parameters import Model, StageKind
from rig.model.simulation import DIVERGED_DEG, before_sensor, run_stages
from rig.model.slots import Placed, Slot
from rig.record import Column

_BW_NAMES = {"xi1": "xi", "phi1": "psi", "beta1": "beta"}
"""What the discrete Bouc-Wen model (8) calls the parameters of (11); its second terms are zero."""


_SECOND = ("xi2", "phi2", "beta2")
PRIOR = 0.015
"""What a second parameter of (11) pays at its bound, as a share of the largest angle, where a bounded model is fitted
to one record.

One record hardly tells them from the first ones, along valleys that end near instability; of what fits alike the
smaller is taken. Several records tell them, and nothing is paid. docs/decisions/0103-second-terms-pay-for-their-size.md
has the figures.
"""
_START_DEG = 1e-3
"""Half the step by which a record's start is moved for a derivative."""


class Objective(Protocol):
    """Scores points, counts what it cost."""

    evaluations: int

    def scores(self, points: Table) -> Table:
        """RMSE in degrees plus the stability term, of points (n, d); shape (n,), always finite."""

    def residuals(self, points: Table) -> Table:
        """Simulated less measured angle over all records, then the stability term, of points (n, d); shape (n, m)."""


def muscle_input(model: Model, p1_mpa: Column, p2_mpa: Column) -> Column:
    """u of (11) in the model's unit, as `rig.model.equations.stages.modified_bouc_wen` forms it."""
    muscle = model.muscle
    return drive(p1_mpa, p2_mpa, model.p0_mpa, muscle.value("mean_exponent")) / muscle.value("u_unit_mpa")


def fits_kernel(model: Model, space: Space) -> bool:
    """Only the law of a discrete Bouc-Wen muscle and the sensor's offset are free, and nothing else is in the way."""
    law = set(LAW) | set(_BW_NAMES.values()) | {"offset_deg"}
    plain = model.muscle.kind in (StageKind.BW, StageKind.MBW) and {placed.name for placed in downstream(model)} <= {
        StageKind.BW,
        StageKind.MBW,
        StageKind.AFFINE,
    }
    unit_gain = model.sensor.kind == StageKind.IDEAL or (
        model.sensor.value("gain") == 1.0 and not model.sensor.parameters["gain"].free
    )
    return plain and unit_gain and set(space.names) <= law


class LawTable:
    """Points of the unit box as the kernel's table: the law of (11) and the sensor's offset in units of y."""

    def __init__(self, model: Model, space: Space) -> None:
        muscle, offset = model.muscle, model.sensor.parameters.get("offset_deg")
        names = [_BW_NAMES.get(name, name) for name in LAW] if muscle.kind == StageKind.BW else list(LAW)
        fixed = [muscle.value(name) if name in muscle.parameters else 0.0 for name in names]
        y_unit = muscle.value("y_unit_deg")
        self._fixed = np.array([*fixed, 0.0 if offset is None else offset.value / y_unit])
        rows = {name: row for row, name in enumerate([*names, "offset_deg"])}
        free = [(rows[name], column) for column, name in enumerate(space.names) if name in rows]
        self._rows, self._columns = np.array(free, dtype=np.intp).reshape(-1, 2).T
        unit = np.where(self._rows == len(LAW), y_unit, 1.0)
        self._low = (space.low[self._columns] / unit)[:, np.newaxis]
        self._range = ((space.high - space.low)[self._columns] / unit)[:, np.newaxis]

    def __call__(self, points: Table) -> Table:
        """Points (n, d) to shape (9, n)."""
        table = np.empty((len(self._fixed), len(points)))
        table[:] = self._fixed[:, np.newaxis]
        table[self._rows] = self._low + points.T[self._columns] * self._range
        return table


class ChainObjective:
    """Muscles, joint and sensor of the model run for each point in turn."""

    def __init__(
        self, model: Model, space: Space, data: Sequence[Prepared], stability: StabilityTerm | None, thin: int
    ) -> None:
        """`thin`: residuals of every so many rows only; scores count all rows where the kernel is used."""
        self._space, self._data, self._stability, self._thin = space, data, stability, thin
        self._second = [index for index, name in enumerate(space.names) if name in _SECOND]
        alone = stability is not None and len(data) == 1
        self._prior_deg = PRIOR * float(np.max(np.abs(data[0].angle_deg))) if alone else 0.0
        self._rows = sum(len(record.angle_deg) - record.skip for record in data)
        self._kept = sum(len(range(record.skip, len(record.angle_deg), thin)) for record in data)
        self._laws = LawTable(model, space) if model.muscle.kind in (StageKind.BW, StageKind.MBW) else None
        self.evaluations = 0

    def scores(self, points: Table) -> Table:
        return np.array([float(np.sqrt(np.sum(row**2) / self._kept)) for row in self.residuals(points)])

    def residuals(self, points: Table) -> Table:
        self.evaluations += len(points)
        errors = self._errors(points)
        if self._stability is None or self._laws is None:
            return errors
        excess = self._stability.excess(self._laws(points)).T * excess_weight(self._stability, self._kept)
        return np.concatenate([errors, excess, self._priors(points) * np.sqrt(self._kept)], axis=1)

    def start_slopes(self, point: Table) -> Table:
        """By how much the residuals (m,) at `point` (d,) move per degree that the first measured angle of a record is
        off, of which the record is simulated on; shape (m, records)."""
        model, at = self._space.model(point), 0
        found = np.zeros((self.residuals(point[np.newaxis]).shape[1], len(self._data)))
        for column, record in enumerate(self._data):
            high, low = (predict(model, record, off)[record.skip :: self._thin] for off in (_START_DEG, -_START_DEG))
            found[at : at + len(high), column] = _bounded(high - low) / (2.0 * _START_DEG)
            at += len(high)
        return found

    def _priors(self, points: Table) -> Table:
        """Degrees that the second parameters of (11) pay for their size, (n, of them); their bounds lie evenly about
        zero."""
        return np.asarray((2.0 * points[:, self._second] - 1.0) * self._prior_deg)

    def _errors(self, points: Table) -> Table:
        """Simulated less measured angle after the skipped starts, (n, rows); bounded in size."""
        models = [self._space.model(point) for point in points]
        return np.array(
            [
                np.concatenate([_miss(predict(model, record), record, self._thin) for record in self._data])
                for model in models
            ]
        )


class SwarmObjective(ChainObjective):
    """The same for the law of a discrete Bouc-Wen muscle: all points of an ask at once on the swarm's kernel."""

    def __init__(
        self, model: Model, space: Space, data: Sequence[Prepared], stability: StabilityTerm | None, thin: int = 1
    ) -> None:
        super().__init__(model, space, data, stability, thin)
        muscle = model.muscle
        self.law = LawTable(model, space)
        self._y_unit = muscle.value("y_unit_deg")
        u = [muscle_input(model, record.p1_mpa, record.p2_mpa) for record in data]
        y = [record.angle_deg / self._y_unit for record in data]
        self.inputs = lay_inputs(u, y, muscle.value("theta_divisor_s"), [record.skip for record in data])
        parts = zip(self.inputs.ends[:-1], self.inputs.ends[1:], data, strict=True)
        self._looked_at = np.concatenate([np.arange(first + record.skip, last, thin) for first, last, record in parts])

    def scores(self, points: Table) -> Table:
        self.evaluations += len(points)
        table = self.law(points)
        total = np.add.reduce(swarm_errors(table, self.inputs)) * self._y_unit**2
        if self._stability is not None:
            weight = excess_weight(self._stability, self._rows)
            total = total + np.sum((self._stability.excess(table) * weight) ** 2, axis=0)
            total = total + np.sum(self._priors(points) ** 2, axis=1) * self._rows
        return np.asarray(np.sqrt(np.minimum(total, HOPELESS) / self._rows))

    def _errors(self, points: Table) -> Table:
        table = self.law(points)
        with np.errstate(over="ignore", invalid="ignore"):  # of sets that diverge
            angles = (swarm_courses(table, self.inputs, self._looked_at) + table[8][:, np.newaxis]) * self._y_unit
        return _bounded(angles - self._y_unit * self.inputs.y[self._looked_at])


def _miss(angle_deg: Column, record: Prepared, thin: int) -> Column:
    """Simulated less measured angle after the skipped start, finite and bounded in size."""
    return _bounded(angle_deg - record.angle_deg)[record.skip :: thin]


def _bounded(miss: Table) -> Table:
    return np.asarray(np.clip(np.nan_to_num(miss, nan=DIVERGED_DEG), -DIVERGED_DEG, DIVERGED_DEG))


def excess_weight(stability: StabilityTerm, rows: int) -> float:
    """Residual of an excess of 1 (a peak e times the limit): as if every row missed by the limit."""
    return float(stability.limit_deg * np.sqrt(rows))


def predict(model: Model, record: Prepared, off_deg: float = 0.0, begun_s: float = 0.0) -> Column:
    """(n,) the angle (deg) that muscles, joint and sensor give under what drives the record, from its first measured
    angle or as far off that, begun so long after its session; it may diverge."""
    p1, p2, angle = record.p1_mpa.copy(), record.p2_mpa.copy(), np.zeros(len(record.angle_deg))
    start = before_sensor(model, float(record.angle_deg[0]) + off_deg)
    run_stages(downstream(model), p1, p2, angle, model.sample_time_s, start, begun_s)
    return angle


def downstream(model: Model) -> list[Placed]:
    """The stages behind the monitors."""
    return [placed for placed in lay_out(model) if placed.slot in (Slot.MUSCLE, Slot.JOINT, Slot.SENSOR)]


def make_objective(
    model: Model,
    space: Space,
    data: Sequence[Prepared],
    stability: StabilityTerm | None,
    thin: int = 1,
) -> ChainObjective:
    """The faster of the two that fits what is free."""
    if fits_kernel(model, space):
        return SwarmObjective(model, space, data, stability, thin)
    return ChainObjective(model, space, data, stability, thin)

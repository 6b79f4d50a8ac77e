"""What identification may change: the free parameters of a model as a point in the unit box, and back.

The model given at the start carries everything: which parameters are free, their bounds, and the fixed ones.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.errors import ModelError
from rig.model.parameters import Model, Parameter

Table = NDArray[np.float64]
AT_BOUND = 1e-3
"""Nearer to the edge of its range than this share of it, a parameter counts as at its bound."""
_STEP = 1e-5
"""Half the step of the differences, as a share of the range."""


def slopes(residuals: Callable[[Table], Table], at: Table) -> Table:
    """The Jacobian (n, d) of residuals at a point (d,) of the unit box, by central differences that stay within it;
    `residuals` takes points (2 d, d) at once and gives (2 d, n)."""
    steps = _STEP * np.eye(len(at))
    up, down = np.minimum(at + steps, 1.0), np.maximum(at - steps, 0.0)
    rows = residuals(np.concatenate([up, down]))
    return np.asarray(((rows[: len(at)] - rows[len(at) :]) / np.diag(up - down)[:, np.newaxis]).T)


@dataclass(frozen=True)
class FreeParameter:
    """One free parameter."""

    slot: str
    name: str
    parameter: Parameter


class Space:
    """The free parameters of a model, in a fixed order."""

    def __init__(self, model: Model) -> None:
        self._model = model
        self.places = [
            FreeParameter(slot, name, parameter)
            for slot, stage in model.stages().items()
            for name, parameter in stage.parameters.items()
            if parameter.free
        ]
        if not self.places:
            raise ModelError("no parameter of the model is free; mark at least one `free: true`")
        for place in self.places:
            if not place.parameter.low < place.parameter.high:
                raise ModelError(
                    f"{place.slot}.{place.name}: {place.parameter.low:g} .. {place.parameter.high:g} leaves nothing "
                    "to search"
                )
        self.low = np.array([place.parameter.low for place in self.places])
        self.high = np.array([place.parameter.high for place in self.places])
        self.names = [place.name for place in self.places]

    def __len__(self) -> int:
        return len(self.places)

    def values(self, points: Table) -> Table:
        """Points of the unit box (..., d) in the parameters' own units."""
        return np.asarray(self.low + points * (self.high - self.low))

    def point(self, model: Model) -> Table:
        """Where `model` stands in the unit box, clipped to it."""
        stages = model.stages()
        now = np.array([stages[place.slot].parameters[place.name].value for place in self.places])
        return np.asarray(np.clip((now - self.low) / (self.high - self.low), 0.0, 1.0))

    def model(self, point: Table, std: Table | None = None) -> Model:
        """The model with its free parameters at `point` (d,), and their standard deviations in the unit box if
        known."""
        stages: dict[str, Any] = {slot: dict(stage.parameters) for slot, stage in self._model.stages().items()}
        for index, (place, value) in enumerate(zip(self.places, self.values(point), strict=True)):
            share = float(point[index])
            known = (
                None
                if std is None or not np.isfinite(std[index])
                else float(std[index] * (self.high[index] - self.low[index]))
            )
            at_bound = min(share, 1.0 - share) < AT_BOUND
            stages[place.slot][place.name] = replace(place.parameter, value=float(value), std=known, at_bound=at_bound)
        changed = {slot: replace(stage, parameters=stages[slot]) for slot, stage in self._model.stages().items()}
        return replace(self._model, **changed)  # type: ignore[arg-type]

"""How small an effect of the raw samples may be and still be found: the tests on them, tried on simulated records with
the effect in them."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from rig.gap.hypotheses.library import Effect
from rig.gap.plan.capability import Ability
from rig.gap.plan.directions import unit_of
from rig.gap.priors import UsualNoise
from rig.gap.raw_tests.all_tests import read_signatures
from rig.gap.raw_tests.noise_levels import angles_of
from rig.gap.records.pairs import pair_up
from rig.gap.reference.kinds import ReferenceKind
from rig.gap.reference.known_noise import known_noise
from rig.model.effect_stages import EFFECT_STAGES
from rig.model.parameters import AddedEffect, Model
from rig.model.simulation import simulate
from rig.record import Record

RAW: Final = "raw samples"
"""Where such an effect shows."""
DRAWN_DAYS: Final = 2
"""Days on all of which an effect of the said size is found. More: slower, and a little larger sizes."""
SIZE_FACTOR: Final = 1.15
"""Sizes are known within this factor."""
LEAST_SIZE: Final = 1e-4
MOST_SIZE: Final = 10.0
"""Sizes that are tried, in the effect's unit, within what its stage allows."""


def raw_abilities(
    model: Model,
    commands: Sequence[Record],
    noise_deg: float,
    effects: Sequence[Effect],
    kind: ReferenceKind,
    usual: UsualNoise | None,
) -> list[Ability]:
    """What records of these commands would tell of every effect that is found in the raw samples, on a rig like `model`
    whose sensor has that much noise, beside such a reference: a healthy day, the model's fingerprint, or the simulator
    alone, where so much noise is `usual`."""
    rig = _Samples(model, commands, noise_deg, kind, usual)
    return [_ability(effect, rig) for effect in effects if effect.signature]


class _Samples:
    """Days of one rig as they would be recorded."""

    def __init__(
        self, model: Model, commands: Sequence[Record], noise_deg: float, kind: ReferenceKind, usual: UsualNoise | None
    ) -> None:
        self._model, self._commands, self._noise_deg = model, commands, noise_deg
        self._before = [self._day(100)] if kind.by_days else []
        self._known = known_noise(kind, model, usual, angles_of(self._day(100)))

    def found(self, effect: Effect, size: float) -> bool:
        """Whether the tests find it by its name on every day that is drawn."""
        return all(self._found(effect, size, draw) for draw in range(DRAWN_DAYS))

    def _found(self, effect: Effect, size: float, draw: int) -> bool:
        pairs = pair_up(self._day(draw, effect, size), self._before, self._model.p0_mpa).pairs
        shown = read_signatures(pairs, self._known)
        return any(signature.found and signature.effect == effect.name for signature in shown)

    def _day(self, seed: int, effect: Effect | None = None, size: float = 0.0) -> list[Record]:
        noise = [AddedEffect("sensor_noise", {"std_deg": self._noise_deg, "seed": float(seed)})]
        more = [] if effect is None else [_added(effect, size, seed)]
        rig = replace(self._model, effects=[*self._model.effects, *noise, *more])
        return [simulate(rig, record) for record in self._commands]


def _added(effect: Effect, size: float, seed: int) -> AddedEffect:
    law = effect.laws[0]
    seeds = [number.name for number in EFFECT_STAGES[law.stage].numbers if number.name == "seed"]
    return AddedEffect(law.stage, {law.free[0]: size} | {name: float(seed + 50) for name in seeds})


def _ability(effect: Effect, rig: _Samples) -> Ability:
    law = effect.laws[0]
    number = next(one for one in EFFECT_STAGES[law.stage].numbers if one.name == law.free[0])
    size = smallest(lambda size: rig.found(effect, size), max(LEAST_SIZE, number.low), min(MOST_SIZE, number.high))
    return Ability(effect.name, effect.stage, RAW, size, size, unit_of(law), None)


def smallest(found: Callable[[float], bool], low: float, high: float) -> float | None:
    """The smallest size that is found, within a factor SIZE_FACTOR: upward in doubled steps from `low` to `high`
    itself, then between the last two; None where none is."""
    missed = size = low
    while not found(size):
        if size >= high:
            return None
        missed, size = size, min(2.0 * size, high)
    while size > SIZE_FACTOR * missed:
        middle = float(np.sqrt(missed * size))
        missed, size = (missed, middle) if found(middle) else (middle, size)
    return size

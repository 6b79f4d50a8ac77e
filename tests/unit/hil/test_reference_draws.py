"""What seeds draw of a family: its units and their days."""

from importlib import import_module
from types import ModuleType
from typing import NamedTuple

import numpy as np
import pytest

from hil.reference.excitations import Excitation
from hil.reference.families import run, unit

SHORT = Excitation("sine", 0.5, 0.2, seconds=6.0)


class Drawn(NamedTuple):
    """What is expected of a family's draws."""

    name: str
    day_moves: float
    """Most by which a day moves a number, as the logarithm of a ratio."""
    spreads: dict[str, float]
    """Standard deviation of the logarithms of some numbers over units."""
    moved: str
    by_drift: float
    """A number that days move, and the standard deviation of its logarithm over the drift."""

    @property
    def physics(self) -> ModuleType:
        return import_module(f"hil.reference.{self.name}.physics")


FAMILIES = (
    Drawn("diaphragm", 0.2, {"diameter_m": 0.012, "lobe_n": 0.3, "duty_per_mpa": 0.1}, "rubber", 2.1),
    Drawn("pouch", 0.25, {"film_n_m": 0.06, "crease_nm": 0.3, "gain_per_s": 0.05}, "delayed", 1.97),
)
drawn_families = pytest.mark.parametrize("drawn", FAMILIES, ids=lambda drawn: drawn.name)


@drawn_families
def test_units_and_days_come_from_their_seeds_and_a_day_moves_many_things_a_little(drawn: Drawn) -> None:
    rig, again = unit(drawn.name, 11), unit(drawn.name, 11)
    assert rig.physics == again.physics
    first, second = (run(SHORT, one, one.session(4, 0.01)) for one in (rig, again))
    assert all(np.array_equal(first[name], second[name]) for name in first)
    other = unit(drawn.name, 12).physics
    assert np.mean([a != b for a, b in zip(other, rig.physics, strict=True)]) > 0.9
    moved = drawn.physics.draw_session(rig.physics, 0.01, np.random.default_rng(6)).physics
    ratios = np.array([now / was for name, now, was in zip(moved._fields, moved, rig.physics, strict=True)
                       if not name.startswith("zero")])  # fmt: skip
    assert np.sum(ratios != 1.0) > 15
    assert np.abs(np.log(ratios)).max() < drawn.day_moves


@drawn_families
def test_units_differ_by_their_spread_and_days_by_their_drift(drawn: Drawn) -> None:
    physics = drawn.physics
    units = [physics.draw_unit(np.random.default_rng(k)) for k in range(200)]
    for name, spread in drawn.spreads.items():
        assert np.std([np.log(getattr(one, name)) for one in units]) == pytest.approx(spread, rel=0.25)
    for drift in (0.004, 0.016):
        days = [physics.draw_session(physics.Physics(), drift, np.random.default_rng(k)) for k in range(300)]
        moved = np.std([np.log(getattr(day.physics, drawn.moved)) for day in days])
        assert moved == pytest.approx(drawn.by_drift * drift, rel=0.25)
        zeros = np.std([day.monitor_bias_1_mpa for day in days])
        assert zeros == pytest.approx(0.00054 * (drift / 0.004) ** 0.5, rel=0.2)

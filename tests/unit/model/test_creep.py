"""Creep with one time constant, and with times that spread over decades."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.model.compiled.stages import compiled
from rig.model.effect_stages import EFFECT_STAGES
from rig.record import Column

DT_S = 0.02


def crept(y: Column, share: float, tau_s: float, relaxed: float, decades: float) -> Column:
    """An angle with creep."""
    entry, out = EFFECT_STAGES["creep"], y.copy()
    known = {"share": share, "tau_s": tau_s, "relaxed": relaxed, "decades": decades}
    params = np.array([known[name] for name in entry.parameters])
    compiled(entry.stage)(y.copy(), y.copy(), out, np.zeros(entry.state_size), params, DT_S)
    return out


@given(st.floats(-0.5, 0.8), st.floats(0.1, 60.0), st.floats(0.0, 1.0), st.integers(0, 1000))
def test_creep_of_no_decades_has_one_time_constant(share: float, tau_s: float, relaxed: float, seed: int) -> None:
    y = np.cumsum(np.random.default_rng(seed).standard_normal(200))
    late, keep = np.empty_like(y), math.exp(-DT_S / tau_s)
    late[0] = y[0]
    for i in range(1, len(y)):
        late[i] = y[i] + keep * (late[i - 1] - y[i])
    np.testing.assert_allclose(crept(y, share, tau_s, relaxed, 0.0), y + share * (late - relaxed * y), atol=1e-9)


def width(frequency_hz: float, decades: float) -> float:
    """Of the loop of a sine of this frequency in its last period, over its amplitude: what creep of 3 s loses."""
    t = np.arange(round(6.0 / frequency_hz / DT_S)) * DT_S
    out = crept(np.sin(2.0 * math.pi * frequency_hz * t), 0.2, 3.0, 0.0, decades)
    last = slice(round(5.0 / frequency_hz / DT_S), None)
    return float(-2.0 * np.mean(out[last] * np.cos(2.0 * math.pi * frequency_hz * t[last])))


@pytest.mark.parametrize(("decades", "least", "most"), [(0.0, 2.0, 3.0), (2.0, 1.0, 1.5)])
def test_creep_over_two_decades_loses_as_much_at_every_frequency_between(
    decades: float, least: float, most: float
) -> None:
    """From the slowest of its times to the quickest; with one time constant most is lost at its own frequency."""
    lost = [width(f, decades) for f in (0.013, 0.025, 0.053, 0.11, 0.22)]
    assert least <= max(lost) / min(lost) <= most


@given(st.floats(0.05, 2.0), st.floats(0.4, 20.0))
def test_a_spring_that_relaxes_gives_way_as_maxwells_element_does(more: float, relax_s: float) -> None:
    """Of a step to 10 deg: 10 / (1 + k) at once, and all of it with the time constant (1 + k) T."""
    entry = EFFECT_STAGES["stiffness"]
    known = entry.neutral() | {"stiffness": more, "spring": 1.0, "relax_s": relax_s}
    params = np.array([known[name] for name in entry.parameters])
    y = np.concatenate([np.zeros(5), np.full(2000, 10.0)])
    resting = np.full(len(y), known["p0_mpa"])
    compiled(entry.stage)(resting.copy(), resting.copy(), y, np.zeros(entry.state_size), params, DT_S)
    t = DT_S * np.arange(2000)
    wanted = 10.0 * (1.0 - more / (1.0 + more) * np.exp(-t / ((1.0 + more) * relax_s)))
    np.testing.assert_allclose(y[5:], wanted, atol=10.0 * DT_S / relax_s)

"""Whether a model stays bounded is asked for as long as an excitation needs to show it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.errors import ModelError
from rig.excite.signals import Mixed, Sine
from rig.excite.steps import Prbs
from rig.identify.search.objective import LawTable
from rig.identify.search.space import Space
from rig.identify.search.stability import StabilityTerm, SweepRange, check_bounded, excitation
from rig.identify.templates import Template, template_model
from rig.model.parameters import Input, Model, load_model
from rig.model.simulation import simulate
from rig.record import Column, Record

TRUTH = load_model(Path(__file__).parents[3] / "configs" / "models" / "simulated.yaml")
LAW = ("lambda1", "lambda2", "xi1", "xi2", "phi1", "phi2", "beta1", "beta2")
LATE_IN_THE_MIXED_SINE = (0.993, 0.922, 0.0568, 3.87, -0.00167, 0.0434, 0.0032, 0.0645)
"""Stays within 30 deg for 4 s of every mixed sine, and is gone within a whole one of 0.5 Hz."""
AFTER_MANY_PERIODS = (0.995, 0.979, 0.138, 2.43, -0.000527, -0.0513, 0.00343, 0.0735)
"""Reaches 34 deg in nine periods of 0.8 Hz, and is gone after some tens."""
LIMIT_DEG = 60.0


def model(numbers: tuple[float, ...]) -> Model:
    start = template_model(Template(drive=Input.COMMAND), 40.0)
    known = {
        name: replace(start.muscle.parameters[name], value=value) for name, value in zip(LAW, numbers, strict=True)
    }
    return replace(start, muscle=replace(start.muscle, parameters=start.muscle.parameters | known))


@pytest.mark.parametrize(
    ("numbers", "failing"), [(LATE_IN_THE_MIXED_SINE, Mixed(0.5, 0.1)), (AFTER_MANY_PERIODS, Sine(0.8, 0.2))]
)
def test_what_diverges_late_is_not_bounded(numbers: tuple[float, ...], failing: Mixed | Sine) -> None:
    verdict = check_bounded(model(numbers), SweepRange(), LIMIT_DEG)
    assert not verdict.bounded
    assert [signal.label for signal in verdict.failing] == [failing.label]
    assert verdict.peak_deg > 1e3


def test_what_stays_bounded_is_called_so() -> None:
    assert check_bounded(TRUTH, SweepRange(), LIMIT_DEG).bounded


def test_the_search_pays_for_what_the_verdict_found() -> None:
    start = model(LATE_IN_THE_MIXED_SINE)
    particle, sweep = only(start), SweepRange(0.2, 0.3, 0.1)
    assert np.all(StabilityTerm(sweep, start, LIMIT_DEG).excess(particle) == 0.0)
    assert np.max(StabilityTerm(sweep, start, LIMIT_DEG, [Mixed(0.5, 0.1)]).excess(particle)) > 1.0


def test_an_excitation_beyond_the_sweeps_amplitude_may_reach_as_much_farther() -> None:
    """The excitations of a search go a tenth beyond the sweep and the mixed sine beyond that: a model that follows them
    in proportion pays nothing, one that does not pays."""
    sweep, true = SweepRange(), model(tuple(TRUTH.muscle.value(name) for name in LAW))
    at_the_sweep = max(
        float(np.max(np.abs(angle)))
        for hz in (sweep.low_hz, sweep.high_hz)
        if (angle := simulate(true, driven(Sine(hz, sweep.amplitude_mpa))).angle_deg) is not None
    )
    particle = only(true)
    assert np.all(StabilityTerm(sweep, true, 1.1 * at_the_sweep).excess(particle) == 0.0)
    assert np.max(StabilityTerm(sweep, true, 0.95 * at_the_sweep).excess(particle)) > 0.0


def only(start: Model) -> Column:
    """The kernel's table of a model's own parameters."""
    return LawTable(start, Space(start))(Space(start).point(start)[np.newaxis])


def driven(signal: Sine) -> Record:
    dp = excitation(signal, TRUTH.sample_time_s, 3.0)
    return Record(signal.label, np.arange(len(dp)) * TRUTH.sample_time_s, dp)


@pytest.mark.parametrize("amplitude_mpa", [0.05, 0.2])
def test_an_excitation_is_seen_through_its_slowest_part(amplitude_mpa: float) -> None:
    mixed, sine = (excitation(one, 0.005, 3.0) for one in (Mixed(0.5, amplitude_mpa), Sine(0.5, amplitude_mpa)))
    assert len(mixed) == round(20.0 / 0.005) + 1
    assert len(sine) == round(6.0 / 0.005) + 1
    assert sine == pytest.approx([Sine(0.5, amplitude_mpa).value(0.005 * tick) for tick in range(len(sine))])
    with pytest.raises(ModelError, match="allowed: sine, triangle, mixed"):
        excitation(Prbs(amplitude_mpa), 0.005, 3.0)

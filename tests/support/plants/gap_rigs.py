"""A small rig for the tests of the diagnosis: the simulated model, honest sessions, noise, and an effect to switch
on."""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from rig.blind_check.generate import nominal_model
from rig.gap import diagnose
from rig.gap.answer.result import Diagnosis
from rig.model.parameters import AddedEffect, Model, Parameter, StageKind, StageModel, load_model
from rig.model.simulation import simulate
from rig.record import Record

MODEL = Path(__file__).resolve().parents[3] / "configs" / "models" / "simulated.yaml"
SWEEPS = {"sine_0.3": (0.3, 0.2), "sine_0.8": (0.8, 0.16), "sine_1.3": (1.3, 0.08)}
"""Record name -> frequency (Hz), amplitude of dp (MPa)."""


@lru_cache
def model() -> Model:
    return load_model(MODEL)


def mounted(zero_deg: float) -> Model:
    """The simulator of another rig of the build, with the zero of its own sensor."""
    zero = {"gain": Parameter(1.0), "offset_deg": Parameter(zero_deg, "deg", -40.0, 40.0, free=True)}
    return replace(model(), sensor=StageModel(StageKind.AFFINE, zero))


@lru_cache
def identified() -> Model:
    """The model that the first healthy day was identified to, with its fingerprint."""
    return nominal_model(baselines()[0], model().p0_mpa)


def session(seed: int, *effects: AddedEffect, after: Callable[[Record], Record] | None = None) -> list[Record]:
    """One day's records: gain and offset a little off, white noise, and these effects in the chain."""
    random = np.random.default_rng(seed)
    gain, offset = 1 + 0.002 * random.standard_normal(), 0.03 * random.standard_normal()
    t = np.arange(0.0, 12.0, 0.005)
    records = []
    for name, (hertz, amplitude) in SWEEPS.items():
        asked = Record(name, t, amplitude * np.sin(2 * np.pi * hertz * t))
        said = simulate(replace(model(), effects=list(effects)), asked, start_deg=0.0)
        assert said.angle_deg is not None
        assert said.p1_mpa is not None
        assert said.p2_mpa is not None
        record = replace(
            said,
            angle_deg=gain * said.angle_deg + offset + 0.03 * random.standard_normal(len(t)),
            p1_mpa=said.p1_mpa + 0.0003 * random.standard_normal(len(t)),
            p2_mpa=said.p2_mpa + 0.0003 * random.standard_normal(len(t)),
        )
        records.append(record if after is None else after(record))
    return records


@lru_cache
def baselines() -> tuple[tuple[Record, ...], ...]:
    return tuple(tuple(session(seed)) for seed in (1, 2, 3))


def asked(records: list[Record], *, pressures: bool = True, library: list[str] | None = None) -> Diagnosis:
    return diagnose(model(), records, [list(day) for day in baselines()], pressures=pressures, library=library)


def names(diagnosis: Diagnosis) -> set[str]:
    return {cause.effect for cause in diagnosis.causes}

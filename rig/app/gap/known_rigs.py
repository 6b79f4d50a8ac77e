"""What is known of the rig that a plan is asked for: by its days, by its model's fingerprint, by a simulator."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rig.app.gap.baselines import EarlierDays, earlier_days
from rig.app.model.simulating import by_plant, commands_of
from rig.app.shipped import find_config
from rig.channels import Channels, common
from rig.errors import ConfigError
from rig.gap.hypotheses.library import LIBRARY, Effect
from rig.gap.plan.planned_records import KnownRig, Noise, as_steady_as, known_rig
from rig.gap.possible_effects import channels_of_call, possible
from rig.gap.priors import fitted
from rig.gap.records.grid import rows_apart
from rig.gap.records.pairs import pair_up
from rig.gap.reference.build import expect, from_response, known_how
from rig.gap.reference.kinds import AUTO, ReferenceKind, choose
from rig.identify.response.fingerprint import fingerprint_of
from rig.model.fingerprint import Fingerprint, PressureSource
from rig.model.parameters import Model, load_model
from rig.model.response.kept_day import unpacked
from rig.model.response.model import response_of
from rig.model.simulation import simulate
from rig.record import Record
from rig.rig_config import load_rig

DEFAULT_SWEEP = Path("gap")
"""What a simulator's answer is described on, and what is asked about when no sweep is named."""


@dataclass(frozen=True)
class Asked:
    """What is known of the rig that is asked about."""

    model: Path
    baselines: tuple[Path, ...] = ()
    every_day: bool = False
    """Earlier days that disagree with the others count as well."""
    reference: str = AUTO
    rig: Path | None = None
    """The rig's YAML, for its envelope."""
    pressures: bool = True


@dataclass(frozen=True)
class DescribedRig:
    """The rig that is asked about."""

    rig: KnownRig
    model: Model
    period_s: float
    """Sample time of its records."""
    channels: Channels
    effects: tuple[Effect, ...]
    """That it can have."""


def described_by_call(asked: Asked, earlier: EarlierDays | None = None) -> DescribedRig:
    """The rig as the best reference there is describes it. `earlier`: its days, where the caller has read them already.
    ModelError, ConfigError or RecordError when nothing describes it, or when model, earlier days and YAML are of
    different rigs."""
    model = load_model(find_config(asked.model, "models"))
    days = (earlier or earlier_days(asked.baselines, asked.model, every=asked.every_day)).records
    file = None if asked.rig is None else load_rig(find_config(asked.rig, "rigs"))
    channels = channels_of_call(model, [], days)
    if file is not None:
        channels = common([(str(asked.rig), file.channels), (str(asked.model), channels)])
    period_s = model.sample_time_s if file is None else file.period_ns * 1e-9
    if file is None and days:
        period_s = days[0][0].period_s
    described = known_of(model, days, asked.reference)
    rig = replace(described, pressures=described.pressures and asked.pressures, grid_s=_grid_s(period_s))
    names = possible(channels, [], None if file is None else file.effects, f"{asked.rig}: effects")
    return DescribedRig(rig, model, period_s, channels, tuple(LIBRARY[name] for name in names))


def _grid_s(period_s: float) -> float:
    return period_s * rows_apart(period_s)


def known_of(model: Model, days: Sequence[Sequence[Record]], reference: str = AUTO) -> KnownRig:
    """The rig of a model, and of earlier days of it, on the grid of their records; ModelError or ConfigError when they
    do not describe one."""
    period_s = days[0][0].period_s if days else model.sample_time_s
    return replace(_described(model, days, reference), grid_s=_grid_s(period_s))


def _described(model: Model, days: Sequence[Sequence[Record]], reference: str) -> KnownRig:
    kind = choose(reference, model, len(days))
    if kind in (ReferenceKind.SESSION, ReferenceKind.SESSIONS):
        levels = kind.value if kind.value in fitted().levels else ReferenceKind.SESSION.value
        made = fingerprint_of([record for day in days for record in day], model)
        if made is None:
            raise ConfigError("--baseline: the records are too short to describe the rig by them")
        return replace(_by_fingerprint(made), levels=levels, kind=kind, missed_mpa=0.0, missed_deg=0.0)
    if kind is ReferenceKind.FINGERPRINT and model.fingerprint is not None:
        return _by_fingerprint(model.fingerprint)
    return _by_simulator(model, sister=reference == ReferenceKind.SIMULATOR)


def _by_fingerprint(fingerprint: Fingerprint) -> KnownRig:
    levels, missed_mpa, missed_deg = known_how(fingerprint)
    noise = Noise(
        fingerprint.noise_deg, float(np.mean(fingerprint.noise_mpa)) if fingerprint.noise_mpa else Noise.pressure_mpa
    )
    driven = fingerprint.pressures is PressureSource.MEASURED
    rig = KnownRig(response_of(fingerprint), levels, driven, noise, missed_mpa=missed_mpa, missed_deg=missed_deg)
    kept = unpacked(fingerprint.day)
    if not kept:
        return rig
    itself = from_response(rig.response, pair_up(kept, [], fingerprint.p0_mpa, pressures=driven))
    return as_steady_as(rig, itself.contexts)


def _by_simulator(model: Model, *, sister: bool) -> KnownRig:
    records = [simulate(model, record) for record in commands_of(DEFAULT_SWEEP, model.sample_time_s)]
    described = known_rig(expect(ReferenceKind.SIMULATOR, sister, model, pair_up(records, [], model.p0_mpa)))
    return replace(described, noise=Noise())  # a simulator's own records have none


def family_rig(family: str, unit: int) -> KnownRig:
    """A unit of a plant family, described by a fingerprint of one day of the usual session."""
    simulator = by_plant(family, unit, 0)
    records = [simulator.answer(record, 0.0) for record in commands_of(DEFAULT_SWEEP, simulator.period_s)]
    model = load_model(find_config(Path("simulated"), "models"))
    fingerprint = fingerprint_of(records, model)
    assert fingerprint is not None
    return _by_fingerprint(fingerprint)

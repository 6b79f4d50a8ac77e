"""What `pamrig gap capability` and `pamrig gap design` do: what a rig can tell, and the session that tells most."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from rig.app.compose import find_config
from rig.app.gap.baselines import read_sessions
from rig.app.model.simulating import by_plant, commands_of
from rig.errors import ConfigError, EnvelopeError
from rig.excite.envelope import check
from rig.excite.experiment import Entry, RunPlan, Sweep, expand, load_sweep
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.plan.candidates import Room, candidates, lasting_s, sweep_text
from rig.gap.plan.capability import FALSE_ALARM_RATE, Ability, Capability, capability
from rig.gap.plan.data_sheet import ALLOWED
from rig.gap.plan.design import Design, Told, appraise, design
from rig.gap.plan.raw_ability import raw_abilities
from rig.gap.plan.rehearse import PERIOD_NS, Noise, Rig, known_rig, rehearse
from rig.gap.records.pairs import pair_up
from rig.gap.reference.build import AUTO, Kind, choose, expect, known_how
from rig.gap.settings import fitted
from rig.identify.fingerprint import fingerprint_of
from rig.model.fingerprint import Fingerprint, PressureSource
from rig.model.kernels import simulate
from rig.model.parameters import Model, load_model
from rig.model.response import response_of
from rig.record import Record
from rig.rig_config import load_rig

USUAL_SWEEP = Path("gap")
"""What a simulator's answer is described on, and what is asked about when no sweep is named."""
RECORD_S = (10.0, 20.0)
"""Lengths of the records that a session is designed from."""
FAMILY_UNITS = 2
"""Rigs of each plant family that a session is designed on beside the one at hand."""


@dataclass(frozen=True)
class Asked:
    """What is known of the rig that is asked about."""

    model: Path
    baselines: tuple[Path, ...] = ()
    reference: str = AUTO
    rig: Path | None = None
    """The rig's YAML, for its envelope."""
    pressures: bool = True


def rig_of(asked: Asked) -> Rig:
    """The rig as the best reference there is describes it; ModelError, ConfigError or RecordError when none does."""
    model = load_model(find_config(asked.model, "models"))
    days = [day.records for day in read_sessions(asked.baselines, asked.model)]
    known = known_of(model, days, asked.reference)
    return replace(known, pressures=known.pressures and asked.pressures)


def known_of(model: Model, days: Sequence[Sequence[Record]], reference: str = AUTO) -> Rig:
    """The rig of a model, and of earlier days of it; ModelError or ConfigError when they do not describe one."""
    kind = choose(reference, model, len(days))
    if kind in (Kind.SESSION, Kind.SESSIONS):
        levels = kind.value if kind.value in fitted().levels else Kind.SESSION.value
        made = fingerprint_of([record for day in days for record in day], model)
        if made is None:
            raise ConfigError("--baseline: the records are too short to describe the rig by them")
        return replace(_by_fingerprint(made), levels=levels, kind=kind, missed_mpa=0.0, missed_deg=0.0)
    if kind is Kind.FINGERPRINT and model.fingerprint is not None:
        return _by_fingerprint(model.fingerprint)
    return _by_simulator(model, sister=reference == Kind.SIMULATOR)


def _by_fingerprint(known: Fingerprint) -> Rig:
    levels, missed_mpa, missed_deg = known_how(known)
    noise = Noise(known.noise_deg, float(np.mean(known.noise_mpa)) if known.noise_mpa else Noise.pressure_mpa)
    driven = known.pressures is PressureSource.MEASURED
    return Rig(response_of(known), levels, driven, noise, missed_mpa=missed_mpa, missed_deg=missed_deg)


def _by_simulator(model: Model, *, sister: bool) -> Rig:
    records = [simulate(model, record) for record in commands_of(USUAL_SWEEP, model.sample_time_s)]
    known = known_rig(expect(Kind.SIMULATOR, sister, model, pair_up(records, [], model.p0_mpa)))
    return replace(known, noise=Noise())  # a simulator's own records have none


def capability_of(asked: Asked, sweeps: Sequence[Path]) -> dict[str, Capability]:
    """What each sweep would tell on the rig, by the sweeps' names; EnvelopeError when the rig's YAML forbids one."""
    rig, settings = rig_of(asked), fitted()
    found = {}
    for path in sweeps or [USUAL_SWEEP]:
        sweep = load_sweep(find_config(path, "sweeps"))
        plans = expand(sweep, PERIOD_NS)
        _check_room(plans, asked.rig)
        made = capability(rehearse(rig, plans), list(LIBRARY.values()), settings)
        found[sweep.name] = replace(made, abilities=(*made.abilities, *_raw(asked, rig, path)))
    return found


def _raw(asked: Asked, rig: Rig, sweep: Path) -> list[Ability]:
    """What the raw samples would tell; nothing of a simulator that is not ours."""
    model = load_model(find_config(asked.model, "models"))
    commands = list(commands_of(sweep, model.sample_time_s))
    days = bool(asked.baselines)
    return raw_abilities(model, commands, rig.noise.angle_deg, list(LIBRARY.values()), earlier_day=days)


def _check_room(plans: Sequence[RunPlan], rig: Path | None) -> None:
    if rig is None:
        return
    room = room_of(rig)
    for plan in plans:
        try:
            check(plan, room, PERIOD_NS)
        except EnvelopeError as error:
            raise EnvelopeError(f"{rig}: {error}") from None


def room_of(rig: Path | None) -> Room:
    """What the rig's YAML allows planned records; careful bounds without one."""
    if rig is None:
        return Room()
    limits = load_rig(find_config(rig, "rigs")).limits
    low, high = limits.pressure_mpa
    usual = Room()
    return replace(
        usual,
        pressure_mpa=(max(low, usual.pressure_mpa[0]), min(high, usual.pressure_mpa[1])),
        slew_mpa_s=limits.slew_mpa_s,
    )


@dataclass(frozen=True)
class Designed:
    """A designed session beside the usual one."""

    design: Design
    usual: Told
    usual_s: float
    rigs: int

    def text(self, name: str) -> str:
        """The sweep's YAML."""
        told = self.design.told
        comment = (
            f"A session designed on {self.rigs} rigs: {self.design.seconds / 60:.1f} min, "
            f"{100 * told.seen:.0f} % of the effects seen and\n{100 * told.parted:.0f} % of their pairs told apart at "
            f"their usual sizes, as the likelihood predicts (`pamrig gap design`)."
        )
        return sweep_text(name, self.design.entries, comment)


def design_session(
    asked: Asked, seconds: float, families: Sequence[str], report: Callable[[int, int], None] = lambda done, of: None
) -> Designed:
    """The session that tells most within `seconds` on the rig and on units of these plant families."""
    settings, room = fitted(), room_of(asked.rig)
    rigs = [rig_of(asked), *(_family_rig(name, unit) for name in families for unit in range(FAMILY_UNITS))]
    pool = candidates(room, RECORD_S)
    if not pool:
        raise ConfigError(f"{asked.rig}: its limits leave no room for any record")
    effects = list(LIBRARY.values())
    found = design(rigs, pool, seconds, effects, settings, lambda done: report(done, len(rigs)))
    if not found.entries:
        raise ConfigError(f"--minutes {seconds / 60:g}: no record fits into that; one takes 15 s at least")
    usual = resting(load_sweep(find_config(USUAL_SWEEP, "sweeps")))
    return Designed(found, appraise(rigs, usual, effects, settings), lasting_s(usual), len(rigs))


def resting(sweep: Sweep) -> list[Entry]:
    """The records of a sweep, each at one rest pressure."""
    return [replace(entry, p0_mpa=(p0,)) for entry in sweep.entries for p0 in entry.p0_mpa or sweep.p0_mpa]


def _family_rig(family: str, unit: int) -> Rig:
    """A unit of a plant family, described by a fingerprint of one day of the usual session."""
    simulator = by_plant(family, unit, 0)
    records = [simulator.answer(record) for record in commands_of(USUAL_SWEEP, simulator.period_s)]
    model = load_model(find_config(Path("simulated"), "models"))
    known = fingerprint_of(records, model)
    assert known is not None
    return _by_fingerprint(known)


def report_capability(found: dict[str, Capability]) -> dict[str, Any]:
    """The JSON of the command: the first sweep's abilities, and those of all of them by name."""
    plain = {name: _plain(one) for name, one in found.items()}
    first = next(iter(plain))
    more = {"sweeps": plain} if len(plain) > 1 else {}
    return plain[first] | {"sweep": first, "false_alarm_rate": FALSE_ALARM_RATE} | more


def _plain(one: Capability) -> dict[str, Any]:
    return {
        "effects": {ability.effect: _row(ability) for ability in best_of(one.abilities)},
        "confusable": [list(pair) for pair in one.confusable],
        "matrix": {
            "effects": list(one.names),
            "separation": one.separation.tolist(),
            "needed": one.needed,
        },
    }


def best_of(abilities: Sequence[Ability]) -> list[Ability]:
    """One for each effect: where it may show in both factors, that of its usual law."""
    first: dict[str, Ability] = {}
    for ability in abilities:
        known = first.get(ability.effect)
        if known is None or (known.nameable is None and ability.nameable is not None):
            first[ability.effect] = ability
    return list(first.values())


def _row(ability: Ability) -> dict[str, Any]:
    row: dict[str, Any] = {
        "detectable": ability.detectable,
        "nameable": ability.nameable,
        "unit": ability.unit,
        "stage": ability.stage,
        "shows_in": ability.factor,
        "hardest_rival": ability.rival,
    }
    sheet = ALLOWED.get(ability.effect)
    if sheet is not None:
        share = None if ability.detectable is None else abs(ability.detectable) / sheet.size
        row["data_sheet"] = {"size": sheet.size, "what": sheet.what, "detectable_share": share}
    return row

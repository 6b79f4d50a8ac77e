"""What `pamrig gap capability` and `pamrig gap design` do: what a rig can tell, and the session that tells most."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from hil.reference.names import DESIGNED_FOR
from rig.app.gap.baselines import EarlierDays
from rig.app.gap.calibrating import known_families
from rig.app.gap.effects import sizes_of
from rig.app.gap.known_rigs import DEFAULT_SWEEP, Asked, DescribedRig, described_by_call, family_rig
from rig.app.gap.sweep_envelope import envelope_of
from rig.app.model.simulating import commands_of
from rig.app.shipped import find_config
from rig.channels import FACT, PNEUMATIC, REST_MPA, Channels, map_text
from rig.errors import ConfigError, EnvelopeError, RecordError
from rig.excite.envelope import check_run
from rig.excite.run_plan import RunPlan, Waves, expand
from rig.excite.sweep import Entry, Sweep, load_sweep
from rig.gap.answer.result import Interval
from rig.gap.answer.words.sizes import size
from rig.gap.hypotheses.library import LIBRARY, Allowed
from rig.gap.plan.candidates import SweepEnvelope, candidates, lasting_s, planned, sweep_text
from rig.gap.plan.capability import Ability, Capability, capability
from rig.gap.plan.design import Design, DetectionPower, appraise, design
from rig.gap.plan.planned_records import expect_planned, within
from rig.gap.plan.raw_ability import raw_abilities
from rig.gap.priors import fitted
from rig.gap.records.usable import reasons, usability
from rig.gap.reference.kinds import ReferenceKind
from rig.gap.settings import FALSE_ALARM_RATE
from rig.own_units import factor, own_plain
from rig.record import Record
from rig.rig_config import load_rig

RECORD_S = (10.0, 20.0)
"""Lengths of the records that a session is designed from."""
DESCRIBED, EXPECTED = 0.3, 0.8
"""Shares of a design's time after which its rigs are described, and their records expected."""
FAMILY_UNITS = 2
"""Rigs of each plant family that a session is designed on beside the one at hand."""


@dataclass(frozen=True)
class SweepCapabilities:
    """What sweeps would tell on a rig, by their names, and whose units are told."""

    sweeps: dict[str, Capability]
    channels: Channels
    kind: ReferenceKind
    """What stands for the rig without a gap."""
    notes: tuple[str, ...] = ()
    """Records that a diagnosis would leave out, and why."""


def capability_of(asked: Asked, sweeps: Sequence[Path], earlier: EarlierDays | None = None) -> SweepCapabilities:
    """What each sweep would tell on the rig; EnvelopeError when the rig's YAML forbids one, ConfigError for one that
    closes the loop, RecordError for one of which a diagnosis would use no record."""
    described, settings = described_by_call(asked, earlier), fitted()
    found: dict[str, Capability] = {}
    notes: list[str] = []
    for path in sweeps or [DEFAULT_SWEEP]:
        sweep = load_sweep(find_config(path, "sweeps"))
        _check_limits(sweep, asked.rig)
        commands = commands_of(path, described.period_s)
        plans, left_out = _usable(described, expand(sweep, described.rig.grid_ns))
        notes += left_out
        made = capability(expect_planned(described.rig, plans), described.effects, settings)
        found[sweep.name] = replace(made, abilities=(*made.abilities, *_raw(asked, described, commands)))
    return SweepCapabilities(found, described.channels, described.rig.kind, tuple(notes))


def _usable(described: DescribedRig, plans: Sequence[RunPlan]) -> tuple[list[RunPlan], list[str]]:
    """The plans whose records a diagnosis would use, and why not the others. RecordError where it would use none."""
    judged = [usability(pair.raw) for pair in expect_planned(described.rig, plans).pairs]
    kept = [plan for plan, one in zip(plans, judged, strict=True) if one.usable]
    notes = [one.note for one in judged if one.note]
    if not kept:
        raise RecordError(reasons(notes))
    return kept, notes


def _raw(asked: Asked, described: DescribedRig, commands: Sequence[Record]) -> list[Ability]:
    """What the raw samples would tell."""
    commands = [replace(record, facts=dict(record.facts) | _map_of(described.channels)) for record in commands]
    noise_deg, kind = described.rig.noise.angle_deg, ReferenceKind.SESSION if asked.baselines else described.rig.kind
    return raw_abilities(described.model, commands, noise_deg, described.effects, kind, fitted().noise)


def _map_of(channels: Channels) -> dict[str, Any]:
    return {} if channels.has_valves else {FACT: channels.plain()}


def _check_limits(sweep: Sweep, rig: Path | None) -> None:
    """EnvelopeError when the rig would not run it."""
    if rig is None:
        return
    file = load_rig(find_config(rig, "rigs"))
    for plan in expand(sweep, file.period_ns):
        try:
            check_run(plan, file.limits, file.period_ns)
        except EnvelopeError as error:
            raise EnvelopeError(f"{rig}: {error}") from None


@dataclass(frozen=True)
class Designed:
    """A designed session beside the default one."""

    design: Design
    default: DetectionPower
    """Of the default sweep, which takes `default_s`."""
    default_s: float
    rigs: int
    channels: Channels = PNEUMATIC

    def text(self, name: str) -> str:
        """The sweep's YAML."""
        power = self.design.power
        comment = (
            f"A session designed on {self.rigs} rigs: {self.design.seconds / 60:.1f} min, "
            f"{100 * power.seen:.0f} % of the effects seen and\n{100 * power.parted:.0f} % of their pairs told apart "
            f"at their usual sizes, as the likelihood predicts (`pamrig gap design`)."
        )
        return sweep_text(name, self.design.entries, comment + _working_range(self.channels))


def _working_range(channels: Channels) -> str:
    """What the amplitudes of a sweep are on a rig without valves."""
    own = channels.input
    return "" if channels.has_valves else (
        f"\nAmplitudes stand on the working range: 0.2 MPa are {own.half:g} {own.unit} of the {own.spoken}."
    )  # fmt: skip


def design_session(
    asked: Asked,
    seconds: float,
    families: Sequence[str],
    report: Callable[[float, str], None],
    earlier: EarlierDays | None = None,
) -> Designed:
    """The session that tells most within `seconds` on the rig and on units of these plant families, of all where none
    is named. `report` hears how far it is, from 0 to 1, and what is done."""
    report(0.0, "describing the rig")
    settings, described = fitted(), described_by_call(asked, earlier)
    units = [(name, unit) for name in _families(families, described.channels) for unit in range(FAMILY_UNITS)]
    rigs, count = [described.rig], len(units) + 1
    for name, unit in units:
        report(DESCRIBED * len(rigs) / count, f"describing {len(rigs) + 1} of {count} rigs")
        rigs.append(family_rig(name, unit))
    pool = _pool(described, _envelope_of_described(described, asked.rig))
    if not pool:
        raise ConfigError(f"{asked.rig}: its limits leave no room for any record")
    effects = described.effects

    def known_of_rigs(done: int) -> None:
        what = f"{done} of {count} rigs: expected records computed" if done < count else "choosing the records"
        report(DESCRIBED + (EXPECTED - DESCRIBED) * done / count, what)

    known_of_rigs(0)
    found = design(rigs, pool, seconds, effects, settings, known_of_rigs)
    if not found.entries:
        raise ConfigError(f"--minutes {seconds / 60:g}: no record fits into that; one takes 15 s at least")
    default = resting(load_sweep(find_config(DEFAULT_SWEEP, "sweeps")))
    return Designed(
        found, appraise(rigs, default, effects, settings), lasting_s(default), len(rigs), described.channels
    )


def _pool(described: DescribedRig, envelope: SweepEnvelope) -> list[Entry]:
    """The records to choose from: inside what the rig's YAML allows its set-points, and its joint as it is expected and
    simulated."""
    made: Waves = {}
    pool = candidates(envelope, RECORD_S, described.rig.grid_ns, made)
    expected = expect_planned(described.rig, planned(pool, described.rig.grid_ns, made)) if pool else None
    return [] if expected is None else [pool[k] for k in within(expected, envelope.angle_deg, described.model)]


def _families(names: Sequence[str], channels: Channels) -> Sequence[str]:
    """Those that stand for other rigs of the same build: none for one that is no pneumatic joint, as they are."""
    if tuple(names) == ("none",):
        return ()
    if channels.has_valves:
        return known_families(names or DESIGNED_FOR)
    if names:
        raise ConfigError(f"--family: plant families are pneumatic joints; this rig is driven by {map_text(channels)}")
    return ()


def _envelope_of_described(described: DescribedRig, rig: Path | None) -> SweepEnvelope:
    """What records may ask; a rig without valves has no rest pressures to choose from."""
    envelope = envelope_of(rig)
    return envelope if described.channels.has_valves else replace(envelope, rests_mpa=(REST_MPA,))


def resting(sweep: Sweep) -> list[Entry]:
    """The records of a sweep, each at one rest pressure."""
    return [replace(entry, p0_mpa=(p0,)) for entry in sweep.entries for p0 in entry.p0_mpa or sweep.p0_mpa]


def report_capability(found: SweepCapabilities) -> dict[str, Any]:
    """The JSON of the command: the first sweep's abilities, and those of all of them by name."""
    plain = {name: _plain(one, found.channels) for name, one in found.sweeps.items()}
    first = next(iter(plain))
    more = {"sweeps": plain} if len(plain) > 1 else {}
    head = {"sweep": first, "reference": found.kind.value, "false_alarm_rate": FALSE_ALARM_RATE}
    return plain[first] | head | more | _map_of(found.channels)


def _plain(one: Capability, channels: Channels) -> dict[str, Any]:
    return {
        "effects": {ability.effect: own_plain(_row(ability, channels), channels) for ability in best_of(one.abilities)},
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
        kept = first.get(ability.effect)
        if kept is None or (kept.nameable is None and ability.nameable is not None):
            first[ability.effect] = ability
    return list(first.values())


def rivals_of(pairs: Sequence[tuple[str, str]]) -> dict[str, list[str]]:
    """Each effect that stands in a pair, in the order of the pairs, with all that it stands beside."""
    found: dict[str, list[str]] = {first: [] for first in dict.fromkeys(name for pair in pairs for name in pair)}
    for first, second in pairs:
        found[first].append(second)
        found[second].append(first)
    return found


def none_alike(one: Capability) -> str:
    """What it means that no two effects look alike at a usual size: those that would not even be seen say nothing."""
    seen = sum(far >= one.needed for far in one.separation.diagonal().tolist())
    if seen == len(one.names):
        return "all are told apart at usual sizes"
    if seen < 2:
        return "at usual sizes hardly any would be seen: nothing is said of which are told apart"
    return f"{seen} of {len(one.names)} would be seen at usual sizes, and these are told apart"


def sheet_of(ability: Ability, channels: Channels) -> Allowed | None:
    """What a data sheet of the paper's parts allows; other rigs are made of other parts."""
    return LIBRARY[ability.effect].allowed if channels.has_valves else None


def size_text(ability: Ability, value: float | None, channels: Channels) -> str:
    """A size as a diagnosis tells it, without its sign, in the rig's own units; a ratio as so many times."""
    if value is None:
        return "not within its range"
    first = sizes_of(LIBRARY[ability.effect])[0]
    if ability.unit == first.unit == "1" and first.neutral == 1.0:
        return f"{max(value, 1.0 / value):.2g} times"
    times, unit = factor(ability.unit, channels)
    return size(Interval(times * value, times * value, times * value, unit))


def beside_sheet(ability: Ability, channels: Channels) -> str:
    """What the data sheet allows, and how much of that is what would be seen."""
    sheet = sheet_of(ability, channels)
    if sheet is None:
        return "-"
    allowed = size_text(ability, sheet.size, channels)
    if ability.detectable is None:
        return allowed
    share = abs(ability.detectable) / sheet.size
    return f"{allowed}, seen from {f'{share:.2g} times' if share >= 1.0 else f'{100 * share:.2g} % of'} that"


def _row(ability: Ability, channels: Channels) -> dict[str, Any]:
    row: dict[str, Any] = {
        "detectable": ability.detectable,
        "nameable": ability.nameable,
        "unit": ability.unit,
        "stage": ability.stage,
        "shows_in": ability.factor,
        "hardest_rival": ability.rival,
    }
    sheet = sheet_of(ability, channels)
    if sheet is not None:
        share = None if ability.detectable is None else abs(ability.detectable) / sheet.size
        row["data_sheet"] = {"size": sheet.size, "what": sheet.what, "detectable_share": share}
    return row

"""What `pamrig gap calibrate` does: the levels of every reference, fitted on healthy days of development units of all
plant families.

Each unit is identified on its first day, as a user would; further days then stand beside that day, beside the
fingerprint and the simulator that the identification made, and beside the simulator of the next unit of the same build.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np
import yaml

from hil.reference.cases import CASES_PER_UNIT, Bench, Case, Purpose, bench_of, draw_sheet
from hil.reference.names import JUDGE, NAMES
from rig.blind_check.generate import nominal_model
from rig.blind_check.source import records_of
from rig.columns import rms
from rig.config import suggest, unstructure
from rig.errors import ConfigError, ModelError
from rig.gap.hypotheses.inverse_problems import parts_of_angle, parts_of_pressures
from rig.gap.prior_fitting.levels import fit_builds, fit_levels, fit_monitors, of_another_build
from rig.gap.priors import Fitted, Levels, Prior, fitted
from rig.gap.provenance import FitProvenance, Origin
from rig.gap.records.pairs import pair_up
from rig.gap.reference.build import expect
from rig.gap.reference.expectation import Parts
from rig.gap.reference.expected import SISTER, Expected
from rig.gap.reference.kinds import ReferenceKind
from rig.model.parameters import Model
from rig.model.response.fingerprint_check import fingerprint_checksum
from rig.number_text import to_digits
from rig.outputs import OutputKind, write_text
from rig.parallel import executor
from rig.record import Record

R = TypeVar("R")
STEPS = 2
"""Rounds over the rigs: identified, their days."""
HELD_DAYS = (1, 3, 5)
"""Healthy days that are held beside the first."""
LEVEL_DIGITS = 4
"""Significant digits of a level in priors.yaml."""
FITTED_BY_OTHERS = ("odds", "usual")
"""Of the levels of a reference: by `pamrig gap study odds` and `usual`."""
OF_DAYS = (ReferenceKind.SESSION.value, ReferenceKind.FINGERPRINT.value)
"""References that describe the rig as closely as days repeat; the others miss more than days differ by."""


@dataclass(frozen=True)
class FittingPlan:
    """What to fit on."""

    families: tuple[str, ...]
    units: int
    """Of each family."""
    seed: int
    workers: int | None = None


@dataclass(frozen=True)
class HealthyDay:
    """One healthy day under one reference."""

    family: str
    reference: str
    pressures: Parts
    angle: Parts
    commanded: float
    """Rms of the angle's deviation under the commands, as a share of its span."""


def known_families(names: Sequence[str], left_out: Sequence[str] = ()) -> tuple[str, ...]:
    """The families of these names, without those left out; for none all but the judge. ConfigError for one that
    is not there, and when none is left."""
    for option, given in (("--family", names), ("--leave-out", left_out)):
        for name in given:
            if name not in NAMES:
                raise ConfigError(f"{option}: unknown plant family {name!r}; {suggest(name, list(NAMES))}")
    fitted_on = names or [name for name in NAMES if name != JUDGE]
    kept = tuple(name for name in fitted_on if name not in left_out)
    if not kept:
        raise ConfigError(f"--leave-out: no plant family is left to fit on; there are {', '.join(NAMES)}")
    return kept


def calibrate(plan: FittingPlan, report: Callable[[int], None] = lambda done: None) -> Fitted:
    """The levels of session, fingerprint, simulator and sister; the rest, their odds and what simulators usually lack
    as well, stays as it is. `report` is told how many of STEPS times the rigs are done."""
    shipped = fitted()
    sheets = [first_cases(name, plan) for name in plan.families]
    rigs = [case for sheet in sheets for case in sheet]
    with executor(None, plan.workers) as pool:
        models = list(reported(pool.map(identified, rigs), report, 0))
        sisters = [models[_next_of(k, sheets)] for k in range(len(rigs))]
        found = pool.map(healthy_days, zip(rigs, models, sisters, strict=True))
        days = [day for some in reported(found, report, len(rigs)) for day in some]
        names = list(dict.fromkeys(day.reference for day in days))
        of_each = [[day for day in days if day.reference == name] for name in names]
        made = zip(names, pool.map(partial(_levels, prior=shipped.prior), of_each), strict=True)
        levels = {name: with_what_others_fit(one, shipped.levels[name]) for name, one in made}
    return replace(shipped, provenance=provenance_of(plan, shipped), levels=levels)


def with_what_others_fit(made: Levels, before: Levels) -> Levels:
    """Levels fitted anew, with what other commands fit as it was before."""
    return replace(made, **{name: getattr(before, name) for name in FITTED_BY_OTHERS})


def provenance_of(plan: FittingPlan, before: Fitted) -> FitProvenance:
    """The provenance once levels are fitted anew; of what other commands fit, as it was."""
    rigs = plan.units * len(plan.families)
    made = origin(
        f"pamrig gap calibrate --units {plan.units} --seed {plan.seed}", [plan.seed], plan.families,
        f"{rigs} rigs, {rigs * len(HELD_DAYS)} healthy days",
    )  # fmt: skip
    untouched = [
        f"levels.{name}.{part}"
        for name, levels in before.levels.items()
        for part in FITTED_BY_OTHERS
        if getattr(levels, part) is not None
    ]
    renewed = before.provenance.renewed({"levels": made}, untouched)
    return FitProvenance(list(plan.families), rigs, rigs * len(HELD_DAYS), renewed.parts)


def origin(command: str, seeds: Sequence[int], families: Sequence[str], on: str) -> Origin:
    """Where a part comes from that is fitted today."""
    since = datetime.now().astimezone().date().isoformat()
    return Origin(command, list(seeds), list(families), on, since)


def reported(results: Iterable[R], report: Callable[[int], None], before: int) -> Iterator[R]:
    """The results; `report` is told after each how many there are, with those `before`."""
    for done, result in enumerate(results, before + 1):
        report(done)
        yield result


def write(found: Fitted, path: Path) -> None:
    """The file `priors.yaml`."""
    text = yaml.dump(_rounded(unstructure(found)), Dumper=_ListsOnOneLine, sort_keys=False, width=120)
    write_text(path, text, OutputKind.LEVELS)


class _ListsOnOneLine(yaml.SafeDumper):
    """Plain YAML, but for lists, of which none here holds anything but words and numbers."""


_ListsOnOneLine.add_representer(
    list, lambda dumper, items: dumper.represent_sequence("tag:yaml.org,2002:seq", items, flow_style=True)
)


def identified(case: Case) -> Model:
    """The simulator of the case's unit, from its first day."""
    model: Model = nominal_model(days_of(case)[0], bench_of(case).excitations[0].p0_mpa)
    return model


def healthy_days(rig: tuple[Case, Model, Model]) -> list[HealthyDay]:
    """The unit's further days beside each reference; a simulator that runs away under them tells nothing."""
    case, own, sister = rig
    days, found = days_of(case), []
    for number in HELD_DAYS:
        asked = [
            (ReferenceKind.SESSION, False, own, [days[0]]),
            (ReferenceKind.FINGERPRINT, False, own, []),
            (ReferenceKind.FINGERPRINT, False, uncorrected(own), []),
            (ReferenceKind.SIMULATOR, False, replace(own, fingerprint=None), []),
            (ReferenceKind.SIMULATOR, True, replace(sister, fingerprint=None), []),
        ]
        for kind, is_sister, model, beside in asked:
            try:
                paired = pair_up(days[number], beside, model.p0_mpa)
                found.append(_healthy(case.family, expect(kind, is_sister, model, paired)))
            except ModelError:
                continue
    return found


def uncorrected(model: Model) -> Model:
    """The model with a fingerprint that does not say what its regulators are beside a dead time and a lag."""
    if model.fingerprint is None:
        return model
    bare = replace(model.fingerprint, corrections=())
    return replace(model, fingerprint=replace(bare, checksum=fingerprint_checksum(bare, model)))


def _healthy(family: str, expected: Expected) -> HealthyDay:
    angle, _ = parts_of_angle(expected)
    reference = np.concatenate([context.reference.angle_deg for context in expected.contexts])
    measured = np.concatenate([context.pair.case.angle_deg for context in expected.contexts])
    commanded = rms(measured - reference, angle.lines.used) / angle.span
    return HealthyDay(family, expected.levels, parts_of_pressures(expected)[0], angle, commanded)


def _levels(days: Sequence[HealthyDay], prior: Prior) -> Levels:
    families = [[day for day in days if day.family == name] for name in dict.fromkeys(day.family for day in days)]
    of_days = days[0].reference in OF_DAYS
    pressures, angle = (
        fit_levels([[getattr(day, name) for day in some] for some in families], prior, of_days=of_days)
        for name in ("pressures", "angle")
    )
    monitors = fit_monitors(
        [[(day.pressures, day.angle) for day in some] for some in families], pressures, angle, prior
    )
    if days[0].reference == SISTER:
        pressures = of_another_build(pressures, len(families))
    commanded = [np.sqrt(np.mean([day.commanded**2 for day in some])) for some in families]
    made = Levels(pressures, angle, float(np.exp(np.mean(np.log(commanded)))), monitors)
    if days[0].reference not in (ReferenceKind.SIMULATOR.value, SISTER):
        return made
    return replace(made, builds=fit_builds([[day.pressures for day in some] for some in families], pressures, prior))


def rigs_of(plan: FittingPlan) -> list[Case]:
    """Those of all its families, one family after the other."""
    return [case for name in plan.families for case in first_cases(name, plan)]


def first_cases(family: str, plan: FittingPlan) -> list[Case]:
    """One case of every unit: it stands for the unit."""
    sheet = draw_sheet(Purpose.DEVELOPMENT, plan.seed, plan.units * CASES_PER_UNIT, family)
    return sheet[::CASES_PER_UNIT]


def _next_of(k: int, sheets: Sequence[Sequence[Case]]) -> int:
    """The index, over all families, of another unit of the same build."""
    start = 0
    for sheet in sheets:
        if k < start + len(sheet):
            return start + (k - start + 1) % len(sheet)
        start += len(sheet)
    raise IndexError(k)


def days_of(case: Case) -> list[list[Record]]:
    """The healthy days of the case's unit."""
    bench: Bench = bench_of(case)
    return [records_of(day) for day in bench.baselines]


def _rounded(value: object) -> object:
    """The same with numbers of a few digits: more are not known."""
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    return to_digits(value, LEVEL_DIGITS) if isinstance(value, float) else value

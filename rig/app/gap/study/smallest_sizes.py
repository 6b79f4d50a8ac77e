"""What `pamrig gap study sizes` does: the smallest sizes that a rig is said to show, beside those from which they are
found on plants of the families.

Only effects whose plant's law has its size in common with the library's are tried.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from hil.reference.families import disturbance, family
from hil.reference.families import unit as plant_unit
from rig.app.gap.known_rigs import DEFAULT_SWEEP, known_of
from rig.app.gap.planning import best_of
from rig.app.shipped import find_config
from rig.blind_check.follow_up import commands_of
from rig.blind_check.generate import nominal_model
from rig.blind_check.source import records_of
from rig.errors import RigError
from rig.excite.run_plan import expand
from rig.excite.sweep import load_sweep
from rig.gap.evidence.posterior import judge
from rig.gap.hypotheses.inverse_problems import angle_problem, pressure_problem
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.plan.capability import capability
from rig.gap.plan.planned_records import expect_planned
from rig.gap.plan.settings import CHANCE
from rig.gap.priors import fitted
from rig.gap.records.pairs import pair_up
from rig.gap.reference.build import expect
from rig.gap.reference.kinds import ReferenceKind
from rig.model.parameters import Model
from rig.parallel import each, executor
from rig.record import Record

DRIFT: Final = 0.01
"""Relative standard deviation of what drifts from day to day: the middle of what the blind check draws."""
TRIED_TIMES: Final = 4.0
"""Sizes are tried from this many times below to this many times above what is predicted."""
HALVINGS: Final = 4
"""Of that range on a logarithmic scale: 2.8 octaves to 1.19."""
WITHIN: Final = 1.5
"""Factor within which predicted and found sizes are meant to agree."""
P0_MPA: Final = 0.2
"""Rest pressure of the unit's model, MPa: the reference plants' own."""


@dataclass(frozen=True)
class SizesFound:
    """One effect on one unit: sizes in the unit that the plant's law and the library's share."""

    family: str
    unit: int
    effect: str
    predicted: float
    """Seen in nine of ten cases, as the capability says."""
    found: float | None
    """None where it is not found even at TRIED_TIMES times what is predicted."""


def compare_sizes(
    families: Sequence[str],
    seed: int,
    units: int,
    reference: str,
    workers: int | None,
    report: Callable[[int], None],
) -> list[SizesFound]:
    """Every effect with a common size on `units` units of each family, against the `reference` session (one earlier
    day) or fingerprint."""
    rigs = [(name, seed + number, reference) for name in families for number in range(units)]
    with executor(None, workers) as pool:
        found = [one for some in each(pool, of_unit, rigs, report) for one in some]
    return sorted(found, key=lambda one: (one.effect, one.family, one.unit))


def of_unit(rig: tuple[str, int, str]) -> list[SizesFound]:
    """Every effect on one unit."""
    name, number, reference = rig
    days = _Days(name, number)
    healthy = days.recorded({}, 0)
    model, kind = nominal_model(healthy, P0_MPA), ReferenceKind(reference)
    before = [healthy] if kind is ReferenceKind.SESSION else []
    described = known_of(model, before, reference)
    plans = expand(load_sweep(find_config(DEFAULT_SWEEP, "sweeps")), described.grid_ns)
    made = capability(expect_planned(described, plans), list(LIBRARY.values()), fitted())
    predicted = {one.effect: abs(one.detectable) for one in best_of(made.abilities) if one.detectable is not None}
    shared = [effect for effect, law in family(name).effects.items() if law.library_parameter and not law.falling]

    def found(effect: str) -> float | None:
        def seen(size: float) -> bool:
            return detected(model, days.recorded({effect: size}, 1), before, kind)

        return threshold(seen, predicted[effect])

    return [
        SizesFound(name, number, effect, predicted[effect], found(effect)) for effect in shared if effect in predicted
    ]


class _Days:
    """Days of one unit under the usual session."""

    def __init__(self, name: str, number: int) -> None:
        self._family, self._plant = name, plant_unit(name, number)
        self._commands = commands_of(find_config(DEFAULT_SWEEP, "sweeps"))

    def recorded(self, sizes: Mapping[str, float], day: int) -> list[Record]:
        """A day with these effects in it."""
        session = self._plant.session(day, DRIFT)
        wrong = disturbance(self._family, sizes)
        return records_of(
            {
                name: self._plant.simulate(p1, p2, period_s, session, wrong, number)
                for number, (name, (p1, p2, period_s)) in enumerate(self._commands.items())
            }
        )


def detected(model: Model, records: Sequence[Record], days: Sequence[Sequence[Record]], kind: ReferenceKind) -> bool:
    """Whether something is found on either factor."""
    pairing = pair_up(records, days, model.p0_mpa)
    expected, settings = expect(kind, False, model, pairing), fitted()
    effects = [effect for effect in LIBRARY.values() if not effect.signature]
    problems = [pressure_problem(expected, settings)] if expected.driven else []
    return any(judge(effects, problem).found for problem in (*problems, angle_problem(expected, settings)))


def threshold(seen: Callable[[float], bool], predicted: float) -> float | None:
    """The size from which an effect is seen, between TRIED_TIMES times below and above what is predicted; None
    where it is not seen at all, or the plant cannot bear it."""
    try:
        if not seen(TRIED_TIMES * predicted):
            return None
    except RigError:
        return None
    low, high = predicted / TRIED_TIMES, predicted * TRIED_TIMES
    for _ in range(HALVINGS):
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if seen(middle) else (middle, high)
    return float(np.sqrt(low * high))


@dataclass(frozen=True)
class SizesRow:
    """One effect over all units."""

    effect: str
    predicted: float
    """Median of what was predicted, in `unit`."""
    found: float | None
    """Median of what was found."""
    unit: str
    ratios: tuple[float, ...]
    """Found over predicted on each unit, infinite where it was not found."""

    @property
    def ratio(self) -> float:
        """Found over predicted where nine of ten are found: the prediction is for nine of ten."""
        return float(np.quantile(self.ratios, CHANCE, method="inverted_cdf"))

    @property
    def within(self) -> bool:
        """Whether prediction and finding agree."""
        return 1.0 / WITHIN <= self.ratio <= WITHIN


def rows_of(found: Sequence[SizesFound]) -> list[SizesRow]:
    """Effect by effect."""
    rows = []
    for effect in dict.fromkeys(one.effect for one in found):
        some = [one for one in found if one.effect == effect]
        ratios = tuple(np.inf if one.found is None else one.found / one.predicted for one in some)
        seen = [one.found for one in some if one.found is not None]
        unit = family(some[0].family).effects[effect].unit
        middle = float(np.median(seen)) if seen else None
        rows.append(SizesRow(effect, float(np.median([one.predicted for one in some])), middle, unit, ratios))
    return rows


def sizes_page(rows: Sequence[SizesRow], reference: str, asked: str) -> str:
    """The table as Markdown; `asked`: the command, with its date."""
    body = "\n".join(
        f"| {row.effect} | {row.predicted:.2g} {row.unit} | {_size(row)} | {min(row.ratios):.2f} | "
        f"{np.median(row.ratios):.2f} | {row.ratio:.2f} | {len(row.ratios)} | {'yes' if row.within else 'no'} |"
        for row in rows
    )
    return (
        "# Smallest sizes, said and found\n\n"
        f"{asked} Reference: {reference}. Said: what `pamrig gap capability` says would be seen in nine of ten cases. "
        f"Found: from where on a day with the effect is told from a healthy one, on plants whose laws are not the "
        f"library's. Within a factor {WITHIN:g}, at nine of ten, for {sum(row.within for row in rows)} of {len(rows)} "
        "effects.\n\n"
        "| effect | said, median | found, median | found over said: least | median | nine of ten | trials | within |\n"
        f"|---|---|---|---|---|---|---|---|\n{body}\n"
    )


def _size(row: SizesRow) -> str:
    return "not found" if row.found is None else f"{row.found:.2g} {row.unit}"

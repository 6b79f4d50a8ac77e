"""What `pamrig gap study absorbed` does: how much of each effect a fit of the simulator's own parameters absorbs, on
development units of the families that may be fitted on.

It is how the absorbed effects (`absorbed` in `rig.gap.hypotheses.library`) are declared before any case is scored.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hil.reference.cases import SISTERS, Bench, Case, DrawnKind, Purpose, bench_of, draw_sheet, realise
from hil.reference.families import family
from rig.app.gap.calibrating import known_families
from rig.blind_check.generate import nominal_model, without_fingerprint
from rig.blind_check.source import records_of
from rig.gap.answer.how_far.retuning import retune
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.records.pairs import pair_up
from rig.model.parameters import Model
from rig.parallel import each, executor
from rig.record import Record

STRENGTH = 4.0
"""Gap of each effect, in what sisters differ by."""


@dataclass(frozen=True)
class Absorbed:
    """One effect on one unit."""

    family: str
    effect: str
    share: float | None
    """Of the effect's mean square, on records that the fit has not seen; None where it does not show."""


def absorbed_shares(seed: int, units: int, workers: int | None, report: Callable[[int], None]) -> list[Absorbed]:
    """Every effect of the library on `units` units of each family."""
    rigs = [(name, seed, unit) for name in known_families(()) for unit in range(units)]
    with executor(None, workers) as pool:
        return [one for some in each(pool, of_unit, rigs, report) for one in some]


def of_unit(rig: tuple[str, int, int]) -> list[Absorbed]:
    """Every effect on one unit: identified on its first day, fitted again to a day with the effect."""
    name, seed, unit = rig
    first = draw_sheet(Purpose.DEVELOPMENT, seed, 10 * (unit + 1), name, against=SISTERS)[10 * unit]
    bench = bench_of(first)
    healthy = records_of(bench.baselines[0])
    model = without_fingerprint(nominal_model(healthy, bench.excitations[0].p0_mpa))
    missed = _errors(model, records_of(bench.baselines[1]))
    effects = [effect for effect in LIBRARY if effect in family(name).effects and not LIBRARY[effect].signature]
    return [Absorbed(name, effect, _share(model, first, bench, effect, missed)) for effect in effects]


def _share(model: Model, unit: Case, bench: Bench, effect: str, missed: tuple[float, float] | None) -> float | None:
    case = replace(unit, kind=DrawnKind.SINGLE, effects=(effect,), signs=(1,), wanted_ratios=(STRENGTH,))
    errors = _errors(model, records_of(realise(case, bench).records))
    if errors is None or missed is None:
        return None
    before, after = errors
    shown = before**2 - missed[0] ** 2
    return float(np.clip((before**2 - after**2) / shown, 0.0, 1.0)) if shown > missed[0] ** 2 else None


def _errors(model: Model, records: Sequence[Record]) -> tuple[float, float] | None:
    """Rms (deg) of the simulator's error on records that the fit has not seen, before and after it."""
    pairing = pair_up(list(records), [], model.p0_mpa)
    found = retune(model, pairing.pairs, pairing.pressures)
    return None if found is None else (found.retuning.before_deg, found.retuning.after_deg)


def table(found: Sequence[Absorbed]) -> Iterator[tuple[str, float | None, int]]:
    """Effect, median share and on how many units it showed; the most absorbed first."""
    shares: dict[str, list[float]] = {}
    for one in found:
        shares.setdefault(one.effect, [])
        if one.share is not None:
            shares[one.effect].append(one.share)
    middle = {effect: float(np.median(some)) if some else -1.0 for effect, some in shares.items()}
    for effect, share in sorted(middle.items(), key=lambda item: -item[1]):
        yield effect, share if shares[effect] else None, len(shares[effect])

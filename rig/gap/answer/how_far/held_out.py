"""How far the gap shrinks once the causes are in the simulator, on records that their fit has not seen; of a single
record, on the half of it that the fit has not seen."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.gap.answer.how_far.augment import remaining_gap
from rig.gap.answer.how_far.halves import in_halves
from rig.gap.hypotheses.fit import Fit, refit
from rig.gap.hypotheses.given import forward_given
from rig.gap.hypotheses.inverse_problems import PRESSURES, angle_forward, on_records, pressure_forward
from rig.gap.priors import Fitted
from rig.gap.reference.expected import Expected
from rig.gap.response.causes import Applied
from rig.model.parameters import Model
from rig.record import Column


@dataclass(frozen=True)
class HowFar:
    """Rms of the simulator's error, deg, with the causes in it."""

    after_deg: float
    """Over all measured rows, as the gap is before them."""
    per_record_deg2: tuple[float, ...]
    """Mean square of each record, by fits that have not seen what they are judged on."""


def how_far(causes: Sequence[tuple[str, Fit]], expected: Expected, model: Model | None, settings: Fitted) -> HowFar:
    """Causes with the factor that each was found on; each record, or half of the only one, is judged by a fit to the
    other half."""
    squares = np.zeros(len(expected.contexts))
    for some, judged in _folds(expected):
        applied = [_refitted(k, causes, some, settings, expected) for k in range(len(causes))]
        remaining = remaining_gap(model, applied, expected)
        squares += [float(np.sum(gap**2 * rows)) for gap, rows in zip(remaining, judged, strict=True)]
    rows = np.array([max(float(pair.used.sum()), 1.0) for pair in expected.pairs])
    return HowFar(float(np.sqrt(squares.sum() / rows.sum())), tuple((squares / rows).tolist()))


def _folds(expected: Expected) -> Iterator[tuple[Expected, list[Column]]]:
    """What a fit sees, and the rows (n,) of every record that it is judged on: 1 there, 0 elsewhere. Every measured row
    is judged once."""
    halves = in_halves([context.pair.used for context in expected.contexts])
    for half in (0, 1):
        seen = [context.pair.used * (rows != half) for context, rows in zip(expected.contexts, halves, strict=True)]
        judged = [context.pair.used * (rows == half) for context, rows in zip(expected.contexts, halves, strict=True)]
        shown = [k for k, rows in enumerate(seen) if rows.any()]
        some = on_records(expected, shown)
        contexts = [
            replace(one, pair=replace(one.pair, used=seen[k])) for one, k in zip(some.contexts, shown, strict=True)
        ]
        yield replace(some, contexts=contexts), judged


def _refitted(k: int, causes: Sequence[tuple[str, Fit]], some: Expected, settings: Fitted, whole: Expected) -> Applied:
    """The k-th cause fitted to some of the records, beside the others on its factor."""
    name, fit = causes[k]
    forward = pressure_forward(some, settings, whole) if name == PRESSURES else angle_forward(some, settings, whole)
    for other in (one for j, (where, one) in enumerate(causes) if where == name and j != k):
        forward = forward_given(forward, other)
    return refit(fit, forward)

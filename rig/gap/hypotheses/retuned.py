"""A simulator's regulators as fast as they likeliest are, beside each cause.

Rigs of one build differ by a third in how fast their regulators answer. What such a difference does to the pressures is
a pattern among others for small ones only: a regulator twice as fast as the simulator's was named as an effect, and
late commands beside a slower regulator passed for a lag, for a slower regulator whose commands come late is slower
later. So the pattern is taken anew where the time constants likeliest are beside the cause (Gauss and Newton's step),
and through the cause. Beside days of the rig itself regulators are known to a percent, and it does not matter.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rig.gap.hypotheses.changes import pressure_change
from rig.gap.hypotheses.fit import Relinearised, UncertainParameters
from rig.gap.priors import FactorLevels
from rig.gap.reference.expectation import REGULATOR_STEP, Parts
from rig.gap.reference.patterns import REGULATOR_PATTERNS
from rig.gap.response.causes import Applied, Ready, ready
from rig.gap.response.nominal import Reference
from rig.gap.response.propagate import Course, RecordContext, pressures_with
from rig.gap.settings import FASTEST_REGULATOR
from rig.model.response.model import Regulator, ResponseModel
from rig.record import Column


def unsure_regulators(
    contexts: Sequence[RecordContext], response: ResponseModel, parts: Parts, levels: FactorLevels, times: Column
) -> UncertainParameters:
    """The regulators' time constants in the factor of the pressures, whose lines are known so many `times` (l,) less
    surely: sizes are relative, of both time constants and of exhausting against filling."""
    expected = _monitors([], contexts, response)

    def at(sizes: Column, cause: Applied | None) -> Relinearised:
        here = _retuned(contexts, response, sizes)
        causes = [] if cause is None else ready([cause], here[1])
        monitors = _monitors(causes, *here)
        patterns = np.column_stack([
            (_monitors(causes, *_retuned(contexts, response, sizes + step)) - monitors) / REGULATOR_STEP
            for step in REGULATOR_STEP * np.eye(len(sizes))
        ])  # fmt: skip
        return Relinearised(
            here[1], pressure_change(*here), patterns, _monitors([], *here) - expected - patterns @ sizes
        )

    which = [parts.names.index(name) for name in REGULATOR_PATTERNS]
    spread = np.array([levels.patterns[name] for name in REGULATOR_PATTERNS])
    return UncertainParameters(which, spread, times, at)


def _retuned(
    contexts: Sequence[RecordContext], response: ResponseModel, sizes: Column
) -> tuple[list[RecordContext], ResponseModel]:
    """Contexts and response with other time constants."""
    both, apart = sizes.tolist()
    first, second = (_slower(one, both, apart) for one in response.regulators)
    other = replace(response, regulators=(first, second))
    return [_with_regulators(context, other) for context in contexts], other


def _slower(regulator: Regulator, both: float, apart: float) -> Regulator:
    dead_s, fill_s, exhaust_s = regulator
    return (
        dead_s,
        fill_s * max(1.0 + both - apart, FASTEST_REGULATOR),
        exhaust_s * max(1.0 + both + apart, FASTEST_REGULATOR),
    )


def _with_regulators(context: RecordContext, other: ResponseModel) -> RecordContext:
    pair, reference, was, quiet = context.pair, context.reference, context.regulated, context.quiet
    now = other.pressures(pair.u1_mpa, pair.u2_mpa, pair.dt_s)
    first, second = now[0] - was[0], now[1] - was[1]
    moved = Reference(reference.p1_mpa + first, reference.p2_mpa + second, reference.angle_deg)
    return replace(context, reference=moved, regulated=now, quiet=(quiet[0] + first, quiet[1] + second))


def _monitors(causes: Sequence[Ready], contexts: Sequence[RecordContext], response: ResponseModel) -> Column:
    """(n,) both monitors with these causes, valve 1 of every record and then valve 2."""
    return np.concatenate(pressures_with(causes, Course(tuple(contexts)), response))

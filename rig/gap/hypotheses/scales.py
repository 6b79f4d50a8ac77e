"""What the grids of the laws count in: how far, how high and how fast the expected courses of the records go, and
how quick the regulators are."""

from collections.abc import Sequence

import numpy as np

from rig.gap.response.propagate import RecordContext


def law_scales(contexts: Sequence[RecordContext], regulator_s: float) -> dict[str, float]:
    """What the laws' grids count in, from the expected courses of the records and the regulators' time constant."""
    references = [context.reference for context in contexts]
    high = max(float(reference.angle_deg.max()) for reference in references)
    low = min(float(reference.angle_deg.min()) for reference in references)
    pressures = [column for reference in references for column in (reference.p1_mpa, reference.p2_mpa)]
    top, bottom = max(float(column.max()) for column in pressures), min(float(column.min()) for column in pressures)
    rates = np.concatenate(
        [np.diff(column) / context.pair.dt_s for context in contexts for column in context.regulated]
    )
    return {
        "one": 1.0,
        "span_deg": 0.5 * (high - low),
        "high_deg": high,
        "low_deg": low,
        "top_mpa": top,
        "swing_mpa": top - bottom,
        "rate_mpa_s": float(np.quantile(np.abs(rates), 0.998)) + 1e-9,
        "regulator_s": regulator_s,
        "filling_mpa_s": max(_filling_mpa_s(context) for context in contexts),
    }


def _filling_mpa_s(context: RecordContext) -> float:
    """What both muscles are filled with in a record, over its length."""
    filled = sum(float(np.maximum(np.diff(column), 0.0).sum()) for column in context.regulated)
    return filled / (len(context.regulated[0]) * context.pair.dt_s) + 1e-9

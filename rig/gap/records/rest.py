"""The rest pressure P0 of records: commanded, or measured where nobody says."""

from collections.abc import Sequence

import numpy as np

from rig.conditions import MEASURED_REST, commanded_rest
from rig.gap.records.settings import LEAST_REST_MPA
from rig.identify.records.rest import SHIFTED_MPA, known_rest, measured_rest, rest_note, taken_for, unsaid_rests
from rig.record import Record


def rest_pressure(records: Sequence[Record], p0_mpa: float, *, beside_days: bool) -> float:
    """P0 (MPa) of the records: from their set-points or facts. Where they do not say it, the middle of the measured
    pressures if they are compared with earlier days, else `p0_mpa`, the model's: beside a model a fault that shifts
    both pressures would pass for another P0."""
    commanded = [rest for record in records if (rest := commanded_rest(record)) is not None]
    if commanded:
        return float(np.median(commanded))
    measured = measured_rests(records)
    return max(float(np.round(np.median(measured), 2)), LEAST_REST_MPA) if measured and beside_days else p0_mpa


def at_rests(
    records: Sequence[Record], others: Sequence[Sequence[Record]], p0_mpa: float
) -> tuple[list[Record], list[str]]:
    """The records, each with the P0 around which it is taken to be commanded, and a note where that was read from the
    pressures of some.

    Records that lie around several P0s and do not say so are taken to be around those of their partners (`others`: of
    each record). Without partners the one nearest to the model's P0 is taken to be at it, and the others as far from
    there as measured: so a fault that shifts them all alike is still found.
    """
    rests = unsaid_rests(records)
    if not rests:
        return list(records), []
    nearest = min(rests.values(), key=lambda rest: abs(rest - p0_mpa))
    off = nearest - p0_mpa if abs(nearest - p0_mpa) <= SHIFTED_MPA else 0.0

    def taken(k: int, record: Record) -> Record:
        theirs = [rest for other in others[k] if (rest := known_rest(other)) is not None]
        return taken_for(record, float(np.median(theirs)) if theirs else rests[k] - off)

    found = [taken(k, record) if k in rests else record for k, record in enumerate(records)]
    alone = [found[k] for k in rests if not others[k]]
    return found, [rest_note(alone)] if alone else []


def shifted(records: Sequence[Record], partners: Sequence[Record], p0_mpa: float) -> tuple[str, ...]:
    """The note that the measured P0 lies elsewhere than the earlier days', or without them than the model's, where
    nobody says it; none where it does not."""
    if any(commanded_rest(record) is not None for record in records):
        return ()
    taken = [float(rest) for record in records if (rest := record.facts.get(MEASURED_REST)) is not None]
    mine, theirs = measured_rests(records), measured_rests(partners) if partners else taken or [p0_mpa]
    if not mine or not theirs or abs(np.median(mine) - np.median(theirs)) <= SHIFTED_MPA:
        return ()
    usual = "in the baselines" if partners else "in the model"
    return (
        f"P0 is {np.median(mine):.2f} MPa by the measured pressures, {np.median(theirs):.2f} MPa {usual}: recorded "
        "around another P0, or both pressures are shifted",
    )


def measured_rests(records: Sequence[Record]) -> list[float]:
    """The middle of both measured pressures of each record that has them, MPa."""
    return [rest for record in records if (rest := measured_rest(record)) is not None]

"""Records beside those that a model's fingerprint keeps: what the rig itself answered to the same command."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rig.errors import RecordError
from rig.gap.records.pairs import Pair, Pairing, pair_up
from rig.gap.records.settings import LEAST_COVERED_SAID, LEAST_KEPT
from rig.model.fingerprint import Fingerprint
from rig.model.response.kept_day import unpacked
from rig.record import Record


def pair_with_kept(
    records: Sequence[Record], known: Fingerprint | None, p0_mpa: float, *, pressures: bool = True
) -> Pairing:
    """The records paired with those that the fingerprint keeps, as with one earlier day; with none where they are of
    other sweeps, or where most of them are, or where one lasts longer than what is kept. RecordError as `pair_up`."""
    kept = [] if known is None else unpacked(known.day)
    if kept:
        try:
            beside = pair_up(records, [kept], p0_mpa, pressures=pressures)
        except RecordError:  # that nothing pairs; whatever else it was comes again
            return pair_up(records, [], p0_mpa, pressures=pressures)
        enough = len(beside.pairs) >= LEAST_KEPT * (len(beside.pairs) + len(beside.unpaired))
        if enough and all(map(_lasts, beside.pairs)):
            return replace(beside, pairs=[_without_raw(pair) for pair in beside.pairs])
    return pair_up(records, [], p0_mpa, pressures=pressures)


def _lasts(pair: Pair) -> bool:
    """Whether the earlier day's record is as long as the case's, as far as is not said."""
    own, kept = (float(np.ptp(record.t_s)) for record in (pair.raw, pair.raw_days[0]))
    return kept >= LEAST_COVERED_SAID * own


def _without_raw(pair: Pair) -> Pair:
    """The pair without the raw samples of its earlier day: what was packed shows no noise, no steps and no lost
    samples."""
    return replace(pair, raw_days=(), day_dropouts=())

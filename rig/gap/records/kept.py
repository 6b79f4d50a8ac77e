"""Records beside those that a model's fingerprint keeps: what the rig itself answered to the same command."""

from collections.abc import Sequence
from dataclasses import replace

from rig.errors import RecordError
from rig.gap.records.pairs import Pair, Pairing, pair_up
from rig.gap.records.settings import LEAST_KEPT
from rig.model.fingerprint import Fingerprint
from rig.model.kept_day import unpacked
from rig.record import Record


def pair_with_kept(
    records: Sequence[Record], known: Fingerprint | None, p0_mpa: float, *, pressures: bool = True
) -> Pairing:
    """The records paired with those that the fingerprint keeps, as with one earlier day; with none where they are of
    other sweeps, or where most of them are. RecordError as `pair_up`."""
    kept = [] if known is None else unpacked(known.day)
    if kept:
        try:
            beside = pair_up(records, [kept], p0_mpa, pressures=pressures)
        except RecordError:  # that nothing pairs; whatever else it was comes again
            return pair_up(records, [], p0_mpa, pressures=pressures)
        if len(beside.pairs) >= LEAST_KEPT * (len(beside.pairs) + len(beside.unpaired)):
            return replace(beside, pairs=[_without_raw(pair) for pair in beside.pairs])
    return pair_up(records, [], p0_mpa, pressures=pressures)


def _without_raw(pair: Pair) -> Pair:
    """The pair without the raw samples of its earlier day: what was packed shows no noise, no steps and no lost
    samples."""
    return replace(pair, raw_baselines=(), baseline_dropouts=())

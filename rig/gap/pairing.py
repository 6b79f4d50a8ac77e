"""The records of a question paired with its reference: as they were read, and once more without what the tests on raw
samples found in them, which the reference knows nothing of.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from rig.channels import REST_MPA
from rig.errors import RecordError
from rig.gap.question import Question
from rig.gap.raw_tests.converter_codes import ConverterCode, centred
from rig.gap.raw_tests.lost_samples import lost_samples, without_lost
from rig.gap.raw_tests.quantisation import code_found
from rig.gap.raw_tests.signature import Signature
from rig.gap.records.fingerprint_records import pair_with_kept
from rig.gap.records.pairs import Pair, Pairing, pair_up
from rig.gap.reference.kinds import ReferenceKind
from rig.model.fingerprint import Fingerprint
from rig.record import Record

Repair = Callable[[Record], Record]
"""Takes out of a record what its raw samples show."""


def paired(question: Question, records: Sequence[Record], days: Sequence[Sequence[Record]]) -> Pairing:
    """Records and earlier days as the question has them, or repaired. RecordError where nothing pairs."""
    p0_mpa = question.model.p0_mpa if question.model else REST_MPA
    if not question.kind.by_days:
        return pair_with_kept(records, _fingerprint(question), p0_mpa, pressures=question.pressures)
    pairing = pair_up(records, days, p0_mpa, pressures=question.pressures)
    if not pairing.pairs[0].days:
        raise RecordError(f"--baseline: pairs with no record: {'; '.join(pairing.notes) or 'other sweeps'}")
    return pairing


def _fingerprint(question: Question) -> Fingerprint | None:
    """The model's, where it is the reference."""
    if question.model is None or question.kind is not ReferenceKind.FINGERPRINT:
        return None
    return question.model.fingerprint


def paired_without_artefacts(question: Question, pairing: Pairing, signatures: Sequence[Signature]) -> Pairing:
    """The pairs without what the raw-data tests found in their samples: lost samples are bridged, in the earlier days
    as well, and readings of a converter that cuts off are put into the middle of their codes."""
    step_deg, code = code_found(signatures)
    lost = any(signature.found and signature.effect == "lost_samples" for signature in signatures)
    if not lost and code is ConverterCode.NEAREST:
        return pairing
    bridges = [_bridge(pair) if lost else _same for pair in pairing.pairs]
    centre = _same if code is ConverterCode.NEAREST else partial(centred, step_deg=step_deg, code=code)
    return paired_anew(question, pairing, [_first_then(centre, bridge) for bridge in bridges], bridges)


def _bridge(pair: Pair) -> Repair:
    """Over the case's lost samples, in the days beside it as well."""
    return partial(without_lost, lost=lost_samples(pair.raw))


def paired_anew(question: Question, pairing: Pairing, of_case: Sequence[Repair], of_days: Sequence[Repair]) -> Pairing:
    """Paired anew with repaired records (`of_case` and `of_days`: a repair for each pair). What the first pairing found
    out stands. The first pairing where the repair leaves a record that cannot be used any more: straight lines over
    nearly all rows of a sensor that hardly ever changes show nothing of it."""
    pairs = pairing.pairs
    records = [repair(pair.raw) for pair, repair in zip(pairs, of_case, strict=True)]
    days = [
        [repair(pair.raw_days[k]) for pair, repair in zip(pairs, of_days, strict=True)]
        for k in range(len(pairs[0].raw_days))
    ]
    try:
        anew = paired(question, records, days)
    except RecordError:
        return pairing
    if [pair.name for pair in anew.pairs] != [pair.name for pair in pairs] or anew.day_count != pairing.day_count:
        return pairing
    kept = [
        replace(pair, dropouts=was.dropouts, day_dropouts=was.day_dropouts, day_numbers=was.day_numbers)
        for pair, was in zip(anew.pairs, pairs, strict=True)
    ]
    new_notes = [line for line in anew.notes if line not in pairing.notes]
    return replace(pairing, pairs=kept, pressures=anew.pressures).noting(*new_notes)


def _same(record: Record) -> Record:
    return record


def _first_then(first: Repair, then: Repair) -> Repair:
    return lambda record: then(first(record))

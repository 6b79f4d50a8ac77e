"""A reference brought to the records: of each, its pressures under the commands and its angle under the pressures.

| reference | from |
|---|---|
| sessions | two or more earlier days |
| session | one earlier day |
| fingerprint | what identification keeps in the model file: its records as one day, and a response model |
| simulator | the model alone; with the levels of a sister when it was made for another rig of the build |
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rig.errors import ModelError
from rig.gap.records.pairs import Pair, Pairing
from rig.gap.records.reach import check_direction
from rig.gap.reference.expectation import driving
from rig.gap.reference.expected import SISTER, UNCORRECTED, Expected
from rig.gap.reference.gaps import rms_of
from rig.gap.reference.kinds import ReferenceKind
from rig.gap.reference.simulated import Modelled, at_rest, followed, modelled, started
from rig.gap.response.nominal import Reference, describe, mean_session, references_of
from rig.gap.response.propagate import RecordContext, angle_under, contexts_of
from rig.gap.settings import LAG_SAID, OUTSIDE_SEEN, RUNS_OFF
from rig.model.compiled.columns import drive
from rig.model.fingerprint import Fingerprint, PressureSource
from rig.model.parameters import Input, Model
from rig.model.response.fingerprint_check import fingerprint_trouble
from rig.model.response.model import ResponseModel, response_of
from rig.record import Column

MEAN = "mean pressure"


def expect(kind: ReferenceKind, sister: bool, model: Model | None, pairing: Pairing) -> Expected:
    """What the reference says of the records; ModelError when the model is no simulator of them."""
    if pairing.day_count:
        return _from_days(kind, model, pairing)
    if model is None:
        raise ModelError("neither a fitting baseline nor a model was given: there is nothing to compare with")
    if kind is ReferenceKind.FINGERPRINT:
        return _from_fingerprint(model, pairing)
    if trouble := fingerprint_trouble(model):
        pairing = pairing.noting(trouble)
    return _from_simulator(SISTER if sister else kind.value, model, pairing)


def _from_days(kind: ReferenceKind, model: Model | None, pairing: Pairing) -> Expected:
    sessions = [mean_session(pair, pairing.pressures) for pair in pairing.pairs]
    regulators, references = references_of(model, pairing.pairs, sessions)
    response = describe(pairing.pairs, references, pairing.p0_mpa, regulators)
    contexts = contexts_of(pairing.pairs, references, response)
    base = [
        _under_case(context, response) if pairing.pressures else context.reference.angle_deg for context in contexts
    ]
    return Expected(kind, ReferenceKind.SESSION.value, pairing, contexts, response, tuple(base))


def _from_fingerprint(model: Model, pairing: Pairing) -> Expected:
    known = model.fingerprint
    assert known is not None
    response, driven = response_of(known), pairing.pressures and known.pressures is PressureSource.MEASURED
    if pairing.pressures and not driven:
        pairing = pairing.noting(
            "the model was identified on records without pressures: its file says nothing of them, and the angle "
            "alone is judged"
        )
    made = from_response(response, replace(pairing, pressures=driven))
    expected = [context.reference for context in made.contexts]
    followed(pairing.pairs, [(one.p1_mpa, one.p2_mpa, one.angle_deg) for one in expected])
    check_direction(
        [context.pair.case.angle_deg for context in made.contexts],
        [one.angle_deg for one in expected],
        "what the model's fingerprint expects",
    )
    seen = [driving(context, driven) for context in made.contexts]
    outside = outside_fingerprint(known, [drive(p1, p2, known.p0_mpa, known.exponent) for p1, p2 in seen], seen)
    levels, missed_mpa, missed_deg = known_how(known)
    lag_s, coarse = _unsure_lag_s(model, pairing)
    return replace(
        made,
        pairing=made.pairing.noting(*outside.values(), *coarse),
        levels=levels,
        missed_mpa=missed_mpa,
        missed_deg=missed_deg,
        unsure_lag_s=lag_s,
        mean_unseen=MEAN in outside,
    )


def known_how(known: Fingerprint) -> tuple[str, float, float]:
    """How surely a fingerprint knows its rig: which levels, and by how much it misses pressures (MPa, rms) and angle
    (deg, rms) of the records that it was made from."""
    levels = ReferenceKind.FINGERPRINT.value if any(map(any, known.corrections)) else UNCORRECTED
    return levels, _missed_mpa(known), max(known.misfit_deg, known.left_out_deg or 0.0)


def _missed_mpa(known: Fingerprint | None) -> float:
    """Rms by which regulators of this kind miss the pressures that they were fitted to, as far as it is known."""
    return 0.0 if known is None else max(*known.misfit_mpa, *known.left_out_mpa, 0.0, 0.0)


def _unsure_lag_s(model: Model, pairing: Pairing) -> tuple[float, list[str]]:
    """Half of what the records' sample time is longer than the simulator's step; with a note where it matters."""
    period_s = max(pair.raw.period_s for pair in pairing.pairs)
    lag_s = max(0.5 * (period_s - model.sample_time_s), 0.0)
    if lag_s <= LAG_SAID * model.sample_time_s:
        return lag_s, []
    note = (
        f"sampled every {1e3 * period_s:.3g} ms, the simulator works at {1e3 * model.sample_time_s:.3g} ms: when "
        f"commands were written is not known, and about {1e3 * lag_s:.2g} ms of lag there are no finding"
    )
    return lag_s, [note]


def outside_fingerprint(
    known: Fingerprint, drives: Sequence[Column], pressures: Sequence[tuple[Column, Column]]
) -> dict[str, str]:
    """What goes beyond the fingerprint's records by more than a tenth of the drive's span, the drive or the mean
    pressure, and a line about it; of each record the drive (n,) and both pressures (n,), MPa."""
    room = OUTSIDE_SEEN * (known.drive_mpa[1] - known.drive_mpa[0])
    means = [0.5 * (p1 + p2) for p1, p2 in pressures]
    found = {}
    for name, (low, high), columns in (("drive", known.drive_mpa, drives), (MEAN, known.mean_mpa, means)):
        reached = min(float(c.min()) for c in columns), max(float(c.max()) for c in columns)
        if reached[0] < low - room or reached[1] > high + room:
            now = f"{reached[0]:.3g} to {reached[1]:.3g} MPa"
            found[name] = (
                f"the {name} goes from {now}, the fingerprint knows {low:.3g} to {high:.3g}: beyond it is a guess"
            )
    return found


def from_response(response: ResponseModel, pairing: Pairing) -> Expected:
    """A response model brought to the records, as what a fingerprint would expect of them."""
    references = []
    for pair in pairing.pairs:
        p1, p2 = response.monitored(pair.u1_mpa, pair.u2_mpa, pair.dt_s)
        references.append(Reference(p1, p2, response.angle(p1, p2, pair.dt_s)))
    contexts = contexts_of(pairing.pairs, references, response)
    base = [
        _under_case(context, response) if pairing.pressures else context.reference.angle_deg for context in contexts
    ]
    return Expected(
        ReferenceKind.FINGERPRINT, ReferenceKind.FINGERPRINT.value, pairing, contexts, response, tuple(base)
    )


def _from_simulator(levels: str, model: Model, pairing: Pairing) -> Expected:
    model = at_rest(model, pairing)
    pairing, sessions = _followed(model, pairing)
    regulators, references = references_of(model, pairing.pairs, sessions)
    response = describe(pairing.pairs, references, pairing.p0_mpa, regulators)
    zero = model.sensor.parameters.get("offset_deg")
    response = replace(response, zero_deg=0.0 if zero is None else zero.value)
    contexts = contexts_of(pairing.pairs, references, response)
    driven = pairing.pressures and model.muscle.input is Input.PRESSURE
    base = [_simulated(model, context, response) if driven else context.reference.angle_deg for context in contexts]
    if pairing.pressures and not driven:
        pairing = pairing.noting(
            "the model is driven by the command: it says nothing of the pressures, and the angle alone is judged"
        )
    missed_deg = model.provenance.rmse_deg or 0.0
    check_direction([pair.case.angle_deg for pair in pairing.pairs], [one[2] for one in sessions], "the simulator's")
    lag_s, coarse = _unsure_lag_s(model, pairing)
    judged = replace(pairing, pressures=driven).noting(*coarse)
    made = Expected(ReferenceKind.SIMULATOR, levels, judged, contexts, response, tuple(base))
    other_zero = levels == SISTER and zero is not None
    return replace(
        made,
        missed_mpa=_missed_mpa(model.fingerprint),
        missed_deg=missed_deg,
        unsure_lag_s=lag_s,
        other_zero=other_zero,
    )


def _followed(model: Model, pairing: Pairing) -> tuple[Pairing, list[Modelled]]:
    """The records that the simulator can follow at all, and what it says of them; ModelError when it follows less than
    half of them, or is another rig's."""
    followable: list[tuple[Pair, Modelled]] = []
    refused = []
    for pair in pairing.pairs:
        try:
            followable.append((pair, modelled(model, pair)))
        except ModelError as error:
            refused.append(str(error))
    if followable:
        why = followed([pair for pair, _ in followable], [one for _, one in followable])
        refused += filter(None, why)
        followable = [one for one, reason in zip(followable, why, strict=True) if not reason]
    if len(followable) <= len(refused):
        raise ModelError(refused[0])
    kept = replace(pairing, pairs=[pair for pair, _ in followable])
    return kept.noting(*(f"{reason}; left out" for reason in refused)), [one for _, one in followable]


def _under_case(context: RecordContext, response: ResponseModel) -> Column:
    case = context.pair.case
    assert case.p1_mpa is not None
    assert case.p2_mpa is not None
    return angle_under(case.p1_mpa, case.p2_mpa, context, response)


def _simulated(model: Model, context: RecordContext, response: ResponseModel) -> Column:
    """The simulator's angle under the measured pressures; by its response model where it runs away under them, or off
    by more than the joint moves, and would move under its commands."""
    pair = context.pair
    try:
        _, _, angle = started(model, pair, Input.PRESSURE, float(pair.case.angle_deg[0]))
    except ModelError:
        return _under_case(context, response)
    moves = max(
        rms_of([one - float(np.mean(one))], [pair]) for one in (pair.case.angle_deg, context.reference.angle_deg)
    )
    off = rms_of([pair.case.angle_deg - angle], [pair]) > RUNS_OFF * moves
    return _under_case(context, response) if off else angle

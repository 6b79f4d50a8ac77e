"""The computing of each step: pair and describe the healthy rig, each side's gap and floor, and the judgement of a
side.

Their order is in `rig.gap.days.findings`, the words in `rig.gap.days.diagnosis`.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rig.errors import ModelError, RigError
from rig.gap.days.attribute import Candidate, rank
from rig.gap.days.bench import Bench, case_pressures
from rig.gap.days.compound import makeweight, with_second
from rig.gap.days.floor import (
    ANGLE_PRIORS,
    MODEL_PRIORS,
    MODEL_VALVE_PRIORS,
    VALVE_PRIORS,
    angle_deviations,
    angle_gap,
    angle_modes,
    build_side,
    high_frequency_noise,
    period_noise,
    valve_deviations,
    valve_modes,
)
from rig.gap.days.handover import doubting, echo, monitor_noise, must
from rig.gap.days.prepared import Judged, Prepared, untriggered
from rig.gap.days.side import Side
from rig.gap.days.trigger import trigger
from rig.gap.days.verdict import (
    HALF,
    UNCLEARED,
    clearing_first,
    explained_share,
    leaves_too_much,
    name_set,
    sufficient,
)
from rig.gap.hypotheses.library import Effect, chosen
from rig.gap.hypotheses.propagate import Applied, angle_under, lay_tracks, ready, response_with
from rig.gap.raw_tests.read import read_signatures
from rig.gap.raw_tests.signature import Signature
from rig.gap.records.pairs import Pair, pair_up
from rig.gap.records.strangers import without_strangers
from rig.gap.records.usable import check_reach
from rig.gap.reference.nominal import Reference, describe, fit_regulators, mean_session
from rig.model.kernels import simulate
from rig.model.parameters import Model
from rig.model.response import Regulator, regulators_of
from rig.model.response_kernels import regulated
from rig.record import Column, Record

HANDOVER = 0.05
"""Share of what the valve side explains in the angle that the response model may get wrong."""
STRANGE_HANDOVER = 0.15
"""The same where nothing explains what is left: a gap within it is taken for the response model's."""
MISFIT_SHARE = 0.05
"""What a model misses of a clean rig, as a share of the amplitude, when its file does not say."""


def prepare(
    model: Model | None, records: Sequence[Record], baselines: Sequence[Sequence[Record]], pressures: bool
) -> Prepared:
    """Pair the records and describe the healthy rig; RecordError and ModelError when there is nothing to compare
    with."""
    pairing = without_strangers(pair_up(records, baselines, model.p0_mpa if model else 0.2, pressures=pressures))
    pairs = pairing.pairs
    has_baseline = bool(pairs[0].sessions)
    if has_baseline:
        sessions = [mean_session(pair, pairing.pressures) for pair in pairs]
    else:
        if model is None:
            raise ModelError("neither a fitting baseline nor a model was given: there is nothing to compare with")
        at_rest = replace(model, p0_mpa=pairing.p0_mpa)
        sessions = [modelled(at_rest, pair) for pair in pairs]
    regulators, references = references_of(model, pairs, sessions, pairing.pressures, has_baseline)
    nominal = describe(pairs, references, pairing.p0_mpa, regulators)
    noise = high_frequency_noise([pair.case.angle_deg for pair in pairs])
    return Prepared(pairing, lay_tracks(pairs, references, nominal), nominal, has_baseline, noise)


def model_misfit_deg(model: Model | None, prepared: Prepared) -> float | None:
    """How far (deg rms) the model as it stands is from the healthy sessions; None without sessions or where it cannot
    be simulated.

    No part of the gap: the diagnosis works on differences. The augmented model inherits it.
    """
    if model is None or not prepared.has_baseline:
        return None
    at_rest = replace(model, p0_mpa=prepared.pairing.p0_mpa)
    try:
        said = [modelled(at_rest, pair)[2] for pair in prepared.pairs]
    except RigError:
        return None
    missed = [
        (angle - reference.angle_deg)[pair.used > 0]
        for angle, reference, pair in zip(said, prepared.references, prepared.pairs, strict=True)
    ]
    return float(np.sqrt(np.mean(np.concatenate(missed) ** 2)))


def modelled(model: Model, pair: Pair) -> tuple[Column | None, Column | None, Column]:
    """What the model says under the pair's command, on its grid, from where the healthy rig, or else the record,
    starts."""
    start = [session.angle_deg[0] for session in pair.sessions] or [pair.case.angle_deg[0]]
    said = simulate(model, pair.raw, start_deg=float(np.mean(start)))
    assert said.angle_deg is not None
    check_reach(pair.name, said.angle_deg, pair.case.angle_deg)
    own = said.t_s - said.t_s[0]

    def on_grid(column: Column | None) -> Column | None:
        return None if column is None else np.interp(pair.t_s, own, column)

    return on_grid(said.p1_mpa), on_grid(said.p2_mpa), np.interp(pair.t_s, own, said.angle_deg)


def references_of(
    model: Model | None,
    pairs: Sequence[Pair],
    sessions: Sequence[tuple[Column | None, Column | None, Column]],
    pressures: bool,
    has_baseline: bool,
) -> tuple[tuple[Regulator, Regulator], list[Reference]]:
    """Regulators and references: with measured pressures fitted to them, else the model's or usual ones and virtual
    pressures."""
    measured = [(first, second) for first, second, _ in sessions if first is not None and second is not None]
    if len(measured) == len(pairs) and (pressures or not has_baseline):
        regulators: tuple[Regulator, Regulator] = fit_regulators(pairs, measured)
        return regulators, [
            Reference(first, second, angle) for (first, second), (_, _, angle) in zip(measured, sessions, strict=True)
        ]
    regulators = regulators_of(model)
    virtual = [
        Reference(
            regulated(pair.u1_mpa, *regulators[0], pair.dt_s), regulated(pair.u2_mpa, *regulators[1], pair.dt_s), angle
        )
        for pair, (_, _, angle) in zip(pairs, sessions, strict=True)
    ]
    return regulators, virtual


def valve_side(prepared: Prepared) -> Side:
    """The pressures' gap and floor; what the joint's own gap does to the pressures is taken off."""
    pairs, references = prepared.pairs, prepared.references
    gap = np.concatenate(
        [must(pair.case.p1_mpa) - reference.p1_mpa for pair, reference in zip(pairs, references, strict=True)]
        + [must(pair.case.p2_mpa) - reference.p2_mpa for pair, reference in zip(pairs, references, strict=True)]
    )
    priors = np.array((VALVE_PRIORS if prepared.has_baseline else MODEL_VALVE_PRIORS) * 2)
    noise = high_frequency_noise(
        [column for pair in pairs for column in (must(pair.case.p1_mpa), must(pair.case.p2_mpa))]
    )
    fallback, source = _fallback(prepared, [must(pair.case.p1_mpa) for pair in pairs], noise, 0.002)
    if not prepared.has_baseline:
        fallback = max(fallback, MISFIT_SHARE * max(float(np.ptp(reference.p1_mpa)) for reference in references))
    modes = valve_modes(pairs, references, prepared.pairing.p0_mpa)
    side = build_side("valve", pairs, gap, modes, valve_deviations(pairs), priors, fallback=fallback, source=source)
    return replace(side, gap=side.gap - echo(side, prepared)) if prepared.has_baseline else side


def angle_side(
    prepared: Prepared,
    *,
    driven: bool,
    model: Model | None,
    added_variance: float = 0.0,
    doubted: Sequence[Column] = (),
) -> Side:
    """The angle's gap and floor, under the case's own pressures when `driven`; `doubted` (n,) changes are in nobody's
    hand."""
    pairs, references, nominal = prepared.pairs, prepared.references, prepared.nominal
    healthy = [
        angle_under(*case_pressures(track), track, nominal) if driven else track.reference.angle_deg
        for track in prepared.tracks
    ]
    handed = np.concatenate([now - reference.angle_deg for now, reference in zip(healthy, references, strict=True)])
    share = HANDOVER * float(np.sqrt(np.mean(handed**2)))
    span = max(float(np.ptp(np.concatenate([reference.angle_deg for reference in references]))), 1e-3)
    priors = np.array(ANGLE_PRIORS if prepared.has_baseline else MODEL_PRIORS) * np.array([span, 1.0, 1.0, 1.0])
    fallback, source = _fallback(prepared, [pair.case.angle_deg for pair in pairs], prepared.noise_deg, 0.002 * span)
    if not prepared.has_baseline:
        fallback = max(fallback, _model_misfit(model, span))
    modes = angle_modes(pairs, references)
    as_read = driven and prepared.tracks[0].driven_by is None
    side = build_side(
        "angle", pairs, angle_gap(pairs, healthy), modes, angle_deviations(pairs, nominal, as_read), priors,
        fallback=fallback, source=source, extra=float(np.hypot(share, np.sqrt(added_variance))),
    )  # fmt: skip
    side = replace(side, handed=share / HANDOVER)
    if driven and not as_read:  # the monitors' noise still comes through
        side = replace(side, remainder=max(side.remainder, monitor_noise(prepared, side)))
    if share == 0.0:
        return side
    sizes = np.maximum(np.sqrt(np.mean(modes**2, axis=0)), 1e-12)
    return doubting(replace(side, spread=np.hypot(side.spread, share / sizes)), doubted)


def _model_misfit(model: Model | None, span: float) -> float:
    if model is not None and model.provenance.rmse_deg is not None:
        return max(float(model.provenance.rmse_deg), 0.5 * MISFIT_SHARE * span)
    return MISFIT_SHARE * span


def _fallback(prepared: Prepared, columns: Sequence[Column], noise: float, least: float) -> tuple[float, str]:
    """Floor and its source where sessions cannot give it: the periods' spread, or the sensor's noise."""
    count = len(prepared.pairs[0].sessions)
    if count >= 2:
        return least, "sessions"
    source = "model" if count == 0 else "periods"
    spread = period_noise(prepared.pairs, columns)
    if spread is None:
        return float(np.hypot(np.sqrt(2.0) * noise, least)), "noise" if count else "model"
    return float(np.hypot(np.sqrt(2.0) * spread, least)), source


def judge(
    prepared: Prepared, side: Side, effects: Sequence[Effect], *, driven: bool = False, beside: Side | None = None
) -> Judged:
    """Test a side; where it has a gap, rank the library, and look for a second cause where one does not suffice."""
    bench = Bench(prepared.tracks, prepared.nominal, side, driven, beside)
    sign = bench.sign
    if not sign.found:
        return Judged(side, sign, bench, [], [], [], [], 0.0)
    ranking = rank(effects, bench)
    if not ranking:
        return Judged(side, sign, bench, [], [], [], [], 0.0)
    ranking, chances = clearing_first(ranking, side, prepared.pairing.pressures)
    names = name_set(ranking, chances, prepared.pairing.pressures)
    accepted = with_second(ranking, effects, bench) if prepared.has_baseline else [ranking[0]]
    possible = [[one] for one in ranking if one.effect.name in names] if len(accepted) == 1 else []
    # of what cannot be told apart, the likeliest that explains the side; one that leaves no more than its law usually
    # does goes first
    for causes in sorted([accepted, *possible], key=lambda causes: leaves_too_much(causes, side)):
        fraction, remainder = explained_share(causes, side), leaves_too_much(causes, side)
        if sufficient(fraction, ranking, trigger(side, causes[-1].residual).found, remainder):
            remainder |= _mended(causes, bench, prepared)
            return Judged(side, sign, bench, ranking, chances, names, causes, fraction, remainder)
    fraction = explained_share(accepted, side)
    by_model = fraction < HALF and not trigger(side, None, STRANGE_HANDOVER * side.handed).found
    if side.handed > 0.0 and by_model:
        return untriggered(Judged(side, sign, bench, [], [], [], [], 0.0))
    return Judged(side, sign, bench, ranking, chances, names, [], fraction, True)


def preferring(candidate: Candidate, judged: Judged) -> Judged:
    """A side judged anew: something outside it speaks for one of its names, and against the others."""
    chances = [
        chance * (1.0 if one is candidate else UNCLEARED)
        for one, chance in zip(judged.ranking, judged.chances, strict=True)
    ]
    order = sorted(range(len(chances)), key=lambda k: judged.ranking[k] is not candidate)
    ranking = [judged.ranking[k] for k in order]
    shares = [chances[k] / sum(chances) for k in order]
    fraction = explained_share([candidate], judged.side)
    names = name_set(ranking, shares, True)
    return replace(judged, ranking=ranking, chances=shares, names=names, accepted=[candidate], fraction=fraction)


def _mended(causes: Sequence[Candidate], bench: Bench, prepared: Prepared) -> bool:
    """Whether one of the causes is there for the other's sake; said when so."""
    mending = makeweight(causes, bench)
    if mending is not None:
        prepared.pairing.notes.append(
            f"{mending.effect.name} explains next to nothing by itself, it mends what the other cause leaves; one "
            "effect that the "
            "library does not hold would look the same"
        )
    return mending is not None


def overall_gap(prepared: Prepared, causes: Sequence[Applied]) -> list[Column]:
    """For each pair (n,): case angle less what the healthy rig would have read with these causes, holes 0."""
    left = []
    made = ready(causes, prepared.nominal)
    for track in prepared.tracks:
        angle = response_with(made, track, prepared.nominal)[2]
        left.append((track.pair.case.angle_deg - angle) * track.pair.used)
    return left


def library_of(library: Sequence[str] | None) -> list[Effect]:
    """The effects to try; KeyError names one that is not known."""
    return chosen(library)


def signatures_of(prepared: Prepared) -> list[Signature]:
    """Marks in the raw records."""
    return read_signatures(prepared.pairs)

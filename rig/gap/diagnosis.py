"""`diagnose`: which reference there is, and what is asked of it (`rig.gap.pipeline`)."""

from collections.abc import Sequence
from dataclasses import replace

from rig.gap.answer.result import Diagnosis
from rig.gap.experiments import answer_with
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.pipeline import Grounds
from rig.gap.plan.candidates import SweepEnvelope
from rig.gap.possible_effects import channels_of_call, named_effects, possible
from rig.gap.priors import Fitted, fitted
from rig.gap.question import Question
from rig.gap.reference.kinds import AUTO, ReferenceKind, because, choose
from rig.identify.provenance import identified_on
from rig.model.parameters import Model
from rig.own_units import telling
from rig.record import Record


def diagnose(
    model: Model | None,
    records: Sequence[Record],
    baselines: Sequence[Sequence[Record]] = (),
    *,
    pressures: bool = True,
    library: Sequence[str] | None = None,
    reference: str = AUTO,
) -> Diagnosis:
    """Where the gap between simulator and rig lies, which effect causes it and how far it shrinks with that effect
    added.

    `baselines` holds one list of records a session of an earlier day, all of them healthy (`rig.gap.records.odd_days`
    finds those that do not go with the others). `reference` is auto, sessions, session,
    fingerprint or simulator; simulator says that the model was made for another rig of the build, or from data sheets.
    `library` limits the effects, by their names or stages. Raises RecordError when no record can be used, ModelError
    when there is nothing to compare with, ConfigError for a reference that cannot be had and a word that is no effect.
    """
    found, _ = diagnose_with_grounds(
        model, records, baselines, pressures=pressures, library=library, reference=reference
    )
    return found


def diagnose_with_grounds(
    model: Model | None,
    records: Sequence[Record],
    baselines: Sequence[Sequence[Record]] = (),
    *,
    pressures: bool = True,
    library: Sequence[str] | None = None,
    reference: str = AUTO,
    rig_effects: Sequence[str] | None = None,
    experiments: Sequence[Sequence[Record]] = (),
    settings: Fitted | None = None,
    envelope: SweepEnvelope | None = None,
) -> tuple[Diagnosis, Grounds]:
    """`diagnose`, with what the answer rests on.

    `rig_effects`: effects or stages that the rig can have, by its YAML; None: as the facts of the records say.
    `experiments`: what was recorded afterwards to tell more, sweep by sweep. `settings`: levels and priors in place of
    the shipped ones. `envelope`: within what the next experiment is recommended; None: careful bounds.
    """
    channels = channels_of_call(model, records, baselines)
    able = possible(channels, records, rig_effects)
    named = set(able) if library is None else named_effects(library, "library")
    asked, withheld = [name for name in able if name in named], [name for name in able if name not in named]
    kind = choose(reference, model, len(baselines))
    question = Question(
        model,
        records,
        days=list(baselines),
        kind=kind,
        sister=reference == ReferenceKind.SIMULATOR,
        pressures=pressures,
        library=asked,
        withheld=withheld,
        any_upstream=any(LIBRARY[name].upstream for name in able),
        settings=settings or fitted(),
        envelope=envelope,
    )
    with telling(channels):
        found, grounds = answer_with(question, experiments)
    why, notes = because(reference, kind, model, len(baselines)), _own_records(kind, model, records)
    only = tuple(asked) if withheld else ()
    if withheld:
        notes.append(f"only {len(only)} of the {len(able)} effects that the rig can have were asked about")
    return replace(found, reference_because=why, channels=channels, notes=[*found.notes, *notes], only=only), grounds


def _own_records(kind: ReferenceKind, model: Model | None, records: Sequence[Record]) -> list[str]:
    """A note where a model is asked about the records that it was fitted to."""
    if model is None or kind.by_days or not (same := identified_on(model, records)):
        return []
    what = "these records" if len(same) == len(records) else ", ".join(same)
    return [f"the model was identified on {what}: what it could be fitted to is no gap here; other records judge it"]

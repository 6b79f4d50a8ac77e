"""Diagnosing one case, which is read, diagnosed and written in one piece, in whichever process."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rig.app.gap.baselines import EarlierDay, earlier_days
from rig.app.gap.diagnosis_files import DiagnosedCase, tags_and_notes, write_files
from rig.app.gap.diagnosis_options import DiagnosisOptions, NamedDay
from rig.errors import ConfigError, RigError

if TYPE_CHECKING:
    from rig.gains import ClosedLoop
    from rig.gap.answer.result import Diagnosis
    from rig.gap.pipeline import Grounds
    from rig.model.parameters import Model
    from rig.record import Record


def diagnose_case(
    options: DiagnosisOptions, case: NamedDay, sessions: Sequence[EarlierDay] | None = None
) -> "tuple[Diagnosis, str]":
    """Read (the sessions too, where the caller has not), diagnose, write the files that were asked for; with the
    diagnosis why one of them was not written, empty when all are."""
    from rig.app.gap.sweep_envelope import envelope_of
    from rig.app.shipped import find_config
    from rig.gap.diagnosis import diagnose_with_grounds
    from rig.model.parameters import load_model
    from rig.rig_config import load_rig

    gains = None if options.tracking is None else _gains_of(options.tracking)
    model = load_model(find_config(options.model, "models"))
    records = _read(case.logs)
    if sessions is None:
        sessions = earlier_days(options.baselines, options.model, every=options.every_day).days
    library = list(options.effects) or None
    diagnosis, grounds = diagnose_with_grounds(
        model,
        records,
        [day.records for day in sessions],
        pressures=not options.no_pressures,
        library=library,
        reference=options.reference,
        rig_effects=None if options.rig is None else load_rig(find_config(options.rig, "rigs")).effects,
        envelope=None if options.rig is None else envelope_of(options.rig),
    )
    if gains is not None:
        diagnosis = _with_worth(gains, model, diagnosis, grounds, records)
    if tags := {name: text for name, text in tags_and_notes(records).items() if text}:
        diagnosis = replace(diagnosis, evidence=replace(diagnosis.evidence, said=tags))
    try:
        write_files(options, DiagnosedCase(case, model, records, sessions, diagnosis, grounds))
    except RigError as error:
        return diagnosis, str(error)
    return diagnosis, ""


def first_time() -> str:
    """Why the first diagnosis on a machine takes a minute more; empty ever after."""
    from rig.model.compiled.stages import is_machine_code_kept

    return "" if is_machine_code_kept() else "the first time: compiling"


def _gains_of(reference: Path) -> "ClosedLoop":
    """Those of a reference's YAML; ConfigError when it has none."""
    from rig.app.shipped import find_config
    from rig.excite.experiment import load_sweep

    place = find_config(reference, "references")
    gains = load_sweep(place).closed_loop
    if gains is None:
        raise ConfigError(f"--tracking {place}: closed_loop: gains are missing; `pamrig tune` finds some")
    return gains


def _with_worth(
    gains: "ClosedLoop",
    model: "Model",
    diagnosis: "Diagnosis",
    grounds: "Grounds",
    records: "Sequence[Record]",
) -> "Diagnosis":
    """The diagnosis with what its causes are worth to a feed-forward, in the evidence and in a note."""
    from rig.control.worth import worth
    from rig.gap.answer.facts import FeedForwardResidual
    from rig.gap.answer.how_far.augment import augmented

    if not any(cause.applied for cause in diagnosis.causes):
        nothing = "no cause with a course of its own was found: the feed-forward stays as it is"
        return replace(diagnosis, notes=[*diagnosis.notes, nothing])
    found = worth(model, augmented(model, diagnosis, grounds.expected), records, gains)
    way = "closer" if found.closer >= 0.0 else "less closely"
    evidence = replace(diagnosis.evidence, tracking=FeedForwardResidual(found.before_deg, found.after_deg))
    note = (
        f"with the causes in it the feed-forward follows {100 * abs(found.closer):.0f} % {way}: of these movements the "
        f"loop would leave {found.after_deg:.2f} deg rms, {found.before_deg:.2f} with the simulator as it was"
    )
    return replace(diagnosis, evidence=evidence, notes=[*diagnosis.notes, note])


def _read(paths: Sequence[Path]) -> "list[Record]":
    from rig.log.reader import read_all

    return read_all(paths)

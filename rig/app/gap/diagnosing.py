"""Diagnosing one case, which is read, diagnosed and written in one piece, in whichever process."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rig.app.gap.baselines import EarlierDay, earlier_days
from rig.app.gap.diagnosis_files import DiagnosedCase, tags_and_notes, write_files
from rig.app.gap.diagnosis_options import DiagnosisOptions, NamedDay
from rig.app.gap.feedforward_worth import gains_of, with_feedforward_worth
from rig.errors import RigError

if TYPE_CHECKING:
    from rig.gap.answer.result import Diagnosis
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

    gains = None if options.tracking is None else gains_of(options.tracking)
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
        diagnosis = with_feedforward_worth(gains, model, diagnosis, grounds, records)
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


def _read(paths: Sequence[Path]) -> "list[Record]":
    from rig.log.reader import read_all

    return read_all(paths)

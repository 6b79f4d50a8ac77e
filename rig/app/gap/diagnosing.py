"""Diagnosing cases, one or a whole campaign of days: each case is read, diagnosed and written in one piece, in
whichever process."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rig.app.gap.baselines import EarlierDay, EarlierDays, days_in, earlier_days
from rig.counted import counted
from rig.errors import ConfigError, RigError
from rig.outputs import OutputKind, write_text
from rig.tags import tags_and_note

if TYPE_CHECKING:
    from rig.gains import ClosedLoop
    from rig.gap.answer.result import Diagnosis
    from rig.gap.pipeline import Grounds
    from rig.model.parameters import Model
    from rig.record import Record


@dataclass(frozen=True)
class DiagnosisOptions:
    """What every case of one call has in common."""

    model: Path
    baselines: tuple[Path, ...]
    """Folders of one earlier day each, or of such folders."""
    every_day: bool = False
    """Earlier days that disagree with the others count as well."""
    html_to: Path | None = None
    """Where the report goes; with several cases the overview, and the reports beside it."""
    augmented_to: Path | None = None
    """Where the simulator with the causes goes."""
    retuned_to: Path | None = None
    """Where the simulator goes as it was fitted again to these records."""
    next_to: Path | None = None
    """Where the sweep goes that is recommended, if there is one."""
    no_pressures: bool = False
    """By the angle alone, whatever pressures were measured."""
    effects: tuple[str, ...] = ()
    """The effects that are asked about; empty: all that the rig can have."""
    reference: str = "auto"
    """As `rig.gap.diagnose` takes it."""
    rig: Path | None = None
    """The rig's YAML, for the effects that it can have."""
    tracking: Path | None = None
    """A reference with gains: how much closer the feed-forward would follow with the causes in it."""
    command: str = ""
    """The command line, for the report."""


@dataclass(frozen=True)
class NamedDay:
    """One day's records; `name` goes into the names of its files when there are several."""

    name: str | None
    logs: tuple[Path, ...]


def cases_of(logs: tuple[Path, ...]) -> list[NamedDay]:
    """A single folder that holds days (`days_in`) is a campaign, one case each; anything else is one case."""
    days = days_in(logs[0]) if len(logs) == 1 else []
    return [NamedDay(day.name, (day,)) for day in days] or [NamedDay(None, logs)]


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
        effects=None if options.rig is None else load_rig(find_config(options.rig, "rigs")).effects,
        envelope=None if options.rig is None else envelope_of(options.rig),
    )
    if gains is not None:
        diagnosis = _with_worth(gains, model, diagnosis, grounds, records)
    if said := {name: text for name, text in _told_once(records).items() if text}:
        diagnosis = replace(diagnosis, evidence=replace(diagnosis.evidence, said=said))
    try:
        _write(options, case, model, diagnosis, grounds, _origin(options, case, records, sessions))
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


@dataclass(frozen=True)
class Campaign:
    """What became of every day of a campaign, by its name; or of the only case, which has none."""

    diagnoses: "dict[str | None, Diagnosis]"
    failed: dict[str, str]
    """Day -> why it could not be diagnosed, in one line."""
    unwritten: list[str]
    """Why files of some diagnoses were not written, a line each."""

    def complain(self) -> None:
        """RigError when days could not be diagnosed, all of them named, or files not written."""
        lines = [f"{day}: {why}" for day, why in self.failed.items()]
        if lines:
            count = len(self.failed) + len(self.diagnoses)
            lines[0] = f"{len(self.failed)} of {counted(count, 'day')} could not be diagnosed: {lines[0]}"
        if lines or self.unwritten:
            raise RigError("; ".join([*lines, *self.unwritten]))


def diagnose_campaign(
    options: DiagnosisOptions, cases: Sequence[NamedDay], dask: str | None, workers: int | None
) -> Campaign:
    """Every case over processes or a cluster; a day that cannot be diagnosed does not end it, unless none can."""
    from functools import partial

    from rig.app.terminal import progress
    from rig.parallel import each, executor

    with executor(dask, workers) as pool, progress("diagnosing", len(cases)) as update:
        update(0.0, first_time())
        outcomes = dict(
            each(
                pool,
                partial(_diagnosed, options),
                cases,
                lambda done: update(done, f"{done} of {counted(len(cases), 'day')}"),
            )
        )
    ordered = [(case.name, *outcomes[case.name]) for case in cases]
    found = {name: one for name, one, _ in ordered if one is not None}
    failed = {str(name): why for name, one, why in ordered if one is None}
    campaign = Campaign(found, failed, [why for _, one, why in ordered if one is not None and why])
    if not campaign.diagnoses:
        campaign.complain()
    return campaign


def _diagnosed(options: DiagnosisOptions, case: NamedDay) -> "tuple[str | None, tuple[Diagnosis | None, str]]":
    """A case's name with its diagnosis and why a file of it is missing, or with why there is none."""
    try:
        return case.name, diagnose_case(options, case)
    except RigError as error:
        return case.name, (None, str(error))


def _read(paths: Sequence[Path]) -> "list[Record]":
    from rig.log.reader import read_all

    return read_all(paths)


def _write(
    options: DiagnosisOptions,
    case: NamedDay,
    model: "Model",
    diagnosis: "Diagnosis",
    grounds: "Grounds",
    origin: Mapping[str, str],
) -> None:
    """RigError when a file cannot be written, after all that can be have been."""

    def page(path: Path) -> None:
        from rig.report.gap_page import write_page

        write_page(path, diagnosis, grounds, model, origin)

    def with_causes(path: Path) -> None:
        from rig.gap.answer.how_far.augment import augmented
        from rig.model.parameters import save_model

        save_model(augmented(model, diagnosis, grounds.expected), path)

    def fitted_again(path: Path) -> None:
        from rig.gap.answer.how_far.retuning import retuned_model
        from rig.model.parameters import save_model

        save_model(retuned_model(model, grounds.expected), path)

    def next_sweep(path: Path) -> None:
        if diagnosis.next_experiment:
            write_text(path, diagnosis.next_experiment.sweep(), OutputKind.SWEEP)

    missing = []
    for write, path in (
        (page, options.html_to),
        (with_causes, options.augmented_to),
        (fitted_again, options.retuned_to),
        (next_sweep, options.next_to),
    ):
        try:
            if path is not None:
                write(place_of(path, case.name))
        except RigError as error:
            missing.append(str(error))
    if missing:
        raise RigError("; ".join(missing))


def place_of(path: Path, day: str | None) -> Path:
    """Where the file of that day goes, when there are several."""
    return path if day is None else path.with_name(f"{path.stem}_{day}{path.suffix}")


def write_overview(
    options: DiagnosisOptions, results: "Mapping[str | None, Diagnosis]", days: Sequence[EarlierDay]
) -> None:
    """The page of a whole campaign, at the name that was asked for; each day has its own beside it."""
    named = {name: diagnosis for name, diagnosis in results.items() if name is not None}
    if options.html_to is not None and named:
        from rig.report import campaign_page

        pages = {name: place_of(options.html_to, name) for name in named}
        campaign_page.write_page(options.html_to, named, pages, [str(day.path) for day in days])


def without_next(options: DiagnosisOptions, results: "Mapping[str | None, Diagnosis]") -> Iterator[str]:
    """A line for each case that `--next-experiment` was asked for and that has none, with why."""
    from rig.gap.answer.words.next_record import why_no_next

    for name, diagnosis in results.items():
        if options.next_to is not None and not diagnosis.next_experiment:
            place = place_of(options.next_to, name)
            old = "; what lies there is from before" if place.exists() else ""
            whose = f" for {name}" if name else ""
            yield f"no next experiment{whose}: {why_no_next(diagnosis)}; {place} was not written{old}"


def _origin(
    options: DiagnosisOptions, case: NamedDay, records: "Sequence[Record]", sessions: Sequence[EarlierDay]
) -> dict[str, str]:
    """Whose the answer is: what the report says of where it comes from."""
    from importlib.metadata import version

    shown = [*records, *(record for day in sessions for record in day.records)]
    begun = sorted(float(record.facts["started_ns"]) for record in shown if record.facts.get("started_ns"))
    days = [datetime.fromtimestamp(1e-9 * at, UTC).strftime("%Y-%m-%d") for at in begun]
    rigs = sorted({str(record.facts["rig"]) for record in shown if record.facts.get("rig")})
    origin = {
        "Rig": ", ".join(rigs),
        "Recorded on": " to ".join(dict.fromkeys([*days[:1], *days[-1:]])),
        "Records": ", ".join(map(str, case.logs)),
        "Earlier days": ", ".join(str(day.path) for day in sessions),
        "Simulator": str(options.model),
        **_told_once(records),
        "Program": f"pamrig {version('pamrig')}",
        "Command": options.command,
    }
    return {name: text for name, text in origin.items() if text}


def _told_once(records: "Sequence[Record]") -> dict[str, str]:
    """Tags and notes of the records, each text once."""
    each = [tags_and_note(record.facts) for record in records]
    return {name: "; ".join(dict.fromkeys(one[name] for one in each if name in one)) for name in ("Tags", "Note")}


def report(results: "Mapping[str | None, Diagnosis]", days: EarlierDays) -> dict[str, object]:
    """The JSON of the command: one diagnosis as it is, several by the names of their days; and what they were compared
    with."""
    plain = {name: diagnosis.to_json() for name, diagnosis in results.items()}
    sessions = [{"path": str(day.path), "records": len(day.records)} for day in days.days]
    return plain.get(None, {"days": plain}) | {"baseline": {"sessions": sessions, "disagree": list(days.odd.values())}}

"""The files of a diagnosis: the report, the simulator with its causes or fitted again, the sweep that is recommended;
of a campaign the overview as well."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rig.app.gap.baselines import EarlierDay
from rig.app.gap.diagnosis_options import DiagnosisOptions, NamedDay
from rig.app.shipped import find_config
from rig.errors import RigError
from rig.outputs import OutputKind, check_apart, check_place, write_text
from rig.tags import tags_and_note

if TYPE_CHECKING:
    from rig.gap.answer.result import Diagnosis
    from rig.gap.pipeline import Grounds
    from rig.model.parameters import Model
    from rig.record import Record


@dataclass(frozen=True)
class DiagnosedCase:
    """A case with its answer and what that was found from."""

    case: NamedDay
    model: "Model"
    records: "Sequence[Record]"
    sessions: Sequence[EarlierDay]
    diagnosis: "Diagnosis"
    grounds: "Grounds"


class _AskedFile(NamedTuple):
    """One of the files that a diagnosis may write."""

    option: str
    kind: OutputKind
    path: Path
    write: "Callable[[Path, DiagnosisOptions, DiagnosedCase], None]"


def _asked(options: DiagnosisOptions) -> list[_AskedFile]:
    """Those that were asked for."""
    files = (
        ("--html", OutputKind.PAGE, options.html_to, _write_page),
        ("--augmented-model", OutputKind.MODEL, options.augmented_to, _write_with_causes),
        ("--retuned", OutputKind.MODEL, options.retuned_to, _write_fitted_again),
        ("--next-experiment", OutputKind.SWEEP, options.next_to, _write_next_sweep),
    )
    return [_AskedFile(option, kind, path, write) for option, kind, path, write in files if path is not None]


def write_files(options: DiagnosisOptions, done: DiagnosedCase) -> None:
    """All files that were asked for; RigError when one cannot be written, after all that can be have been."""
    missing = []
    for asked in _asked(options):
        try:
            asked.write(place_of(asked.path, done.case.name), options, done)
        except RigError as error:
            missing.append(str(error))
    if missing:
        raise RigError("; ".join(missing))


def check_files_of_days(options: DiagnosisOptions, cases: Sequence[NamedDay]) -> None:
    """RigError, before the work, when a file of one of several days cannot be written, is another one's, or is one that
    the call reads: a day's name puts it elsewhere than the option says."""
    outputs = [
        (f"{asked.option} ({case.name})", asked.kind, place_of(asked.path, case.name))
        for asked in _asked(options)
        for case in cases
        if case.name is not None
    ]
    for _, kind, place in outputs:
        check_place(place, kind)
    read = [("--model", find_config(options.model, "models")), ("--rig", options.rig), ("--tracking", options.tracking)]
    overview = [("--html", options.html_to)] if outputs and options.html_to is not None else []
    check_apart(
        [*overview, *((option, place) for option, _, place in outputs)],
        [(option, path) for option, path in read if path is not None],
    )


def _write_page(path: Path, options: DiagnosisOptions, done: DiagnosedCase) -> None:
    from rig.report.gap_page import write_page

    write_page(path, done.diagnosis, done.grounds, done.model, _origin(options, done))


def _write_with_causes(path: Path, _: DiagnosisOptions, done: DiagnosedCase) -> None:
    from rig.gap.answer.how_far.augment import augmented
    from rig.model.parameters import save_model

    save_model(augmented(done.model, done.diagnosis, done.grounds.expected), path)


def _write_fitted_again(path: Path, _: DiagnosisOptions, done: DiagnosedCase) -> None:
    from rig.gap.answer.how_far.retuning import retuned_model
    from rig.model.parameters import save_model

    save_model(retuned_model(done.model, done.grounds.expected), path)


def _write_next_sweep(path: Path, _: DiagnosisOptions, done: DiagnosedCase) -> None:
    if done.diagnosis.next_experiment:
        write_text(path, done.diagnosis.next_experiment.sweep(), OutputKind.SWEEP)


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


def _origin(options: DiagnosisOptions, done: DiagnosedCase) -> dict[str, str]:
    """Whose the answer is: what the report says of where it comes from."""
    from importlib.metadata import version

    shown = [*done.records, *(record for day in done.sessions for record in day.records)]
    begun = sorted(float(record.facts["started_ns"]) for record in shown if record.facts.get("started_ns"))
    days = [datetime.fromtimestamp(1e-9 * at, UTC).strftime("%Y-%m-%d") for at in begun]
    rigs = sorted({str(record.facts["rig"]) for record in shown if record.facts.get("rig")})
    origin = {
        "Rig": ", ".join(rigs),
        "Recorded on": " to ".join(dict.fromkeys([*days[:1], *days[-1:]])),
        "Records": ", ".join(map(str, done.case.logs)),
        "Earlier days": ", ".join(str(day.path) for day in done.sessions),
        "Simulator": str(options.model),
        **tags_and_notes(done.records),
        "Program": f"pamrig {version('pamrig')}",
        "Command": options.command,
    }
    return {name: text for name, text in origin.items() if text}


def tags_and_notes(records: "Sequence[Record]") -> dict[str, str]:
    """Tags and notes of the records, each text once."""
    each = [tags_and_note(record.facts) for record in records]
    return {name: "; ".join(dict.fromkeys(facts[name] for facts in each if name in facts)) for name in ("Tags", "Note")}

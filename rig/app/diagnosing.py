"""Diagnosing cases, one or a whole campaign of days: each case is read, diagnosed and written in one piece, in whichever process."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import ConfigError
from rig.outputs import Kind, write_text

if TYPE_CHECKING:
    from rig.gap.answer.result import Diagnosis
    from rig.gap.days.findings import Findings
    from rig.gap.pipeline import Grounds
    from rig.model.parameters import Model
    from rig.record import Record


@dataclass(frozen=True)
class DiagnosisOptions:
    """What every case of one call has in common."""

    model: Path
    baselines: tuple[Path, ...]
    html_to: Path | None = None
    augmented_to: Path | None = None
    next_to: Path | None = None
    no_pressures: bool = False
    effects: tuple[str, ...] = ()
    reference: str = "auto"
    retuned_to: Path | None = None


@dataclass(frozen=True)
class Case:
    """One day's records; `name` goes into the names of its files when there are several."""

    name: str | None
    logs: tuple[Path, ...]


def cases_of(logs: tuple[Path, ...]) -> list[Case]:
    """A single folder that holds nothing but folders is a campaign, one case each; anything else is one case."""
    days = _days_in(logs[0]) if len(logs) == 1 else []
    return [Case(day.name, (day,)) for day in days] or [Case(None, logs)]


def sessions_of(baselines: tuple[Path, ...]) -> list[Path]:
    """One path a session: a folder that holds nothing but folders holds one session in each."""
    return [session for baseline in baselines for session in _days_in(baseline) or [baseline]]


def _days_in(folder: Path) -> list[Path]:
    """The folders of a folder that holds several of them and nothing else; else none."""
    if not folder.is_dir():
        return []
    inside = [entry for entry in sorted(folder.iterdir()) if not entry.name.startswith(".")]
    return inside if len(inside) > 1 and all(entry.is_dir() for entry in inside) else []


def check_effects(names: Sequence[str]) -> None:
    """ConfigError for a name that is not in the library."""
    from rig.config import suggest
    from rig.gap.hypotheses.library import LIBRARY

    for name in names:
        if name not in LIBRARY:
            raise ConfigError(f"--effect: unknown effect {name!r}; {suggest(name, list(LIBRARY))}")


def diagnose_case(options: DiagnosisOptions, case: Case) -> "tuple[Case, Diagnosis]":
    """Read, diagnose, write the report, the model and the next sweep where they were asked for."""
    from rig.gap.diagnosis import diagnose_with_grounds
    from rig.model.parameters import load_model

    model = load_model(options.model)
    records = _read(case.logs)
    sessions = [_read([path]) for path in sessions_of(options.baselines)]
    library = list(options.effects) or None
    diagnosis, grounds = diagnose_with_grounds(
        model, records, sessions, pressures=not options.no_pressures, library=library, reference=options.reference
    )
    _write(options, case, model, diagnosis, grounds)
    return case, diagnosis


def diagnose_campaign(
    options: DiagnosisOptions, cases: Sequence[Case], dask: str | None, workers: int | None
) -> "Iterator[tuple[Case, Diagnosis]]":
    """Every case over processes or a cluster; results as they come."""
    from functools import partial

    from rig.app.terminal import progress
    from rig.parallel import each, executor

    with executor(dask, workers) as pool, progress("diagnosing", len(cases)) as update:
        yield from each(pool, partial(diagnose_case, options), cases, lambda done: update(done, f"{done} of {len(cases)} days"))


def _read(paths: Sequence[Path]) -> "list[Record]":
    from rig.log.reader import read_all

    return read_all(paths)


def _write(options: DiagnosisOptions, case: Case, model: "Model", diagnosis: "Diagnosis", grounds: "Findings | Grounds") -> None:
    def place(path: Path) -> Path:
        return path if case.name is None else path.with_name(f"{path.stem}_{case.name}{path.suffix}")

    if options.html_to:
        from rig.report.page import write_page

        write_page(place(options.html_to), diagnosis, grounds, model)
    if options.augmented_to:
        from rig.gap.answer.augment import augmented
        from rig.model.parameters import save_model

        save_model(augmented(model, diagnosis, grounds.prepared), place(options.augmented_to))
    if options.retuned_to:
        from rig.gap.answer.retuning import retuned_model
        from rig.model.parameters import save_model

        save_model(retuned_model(model, grounds.prepared), place(options.retuned_to))
    if options.next_to and diagnosis.next_experiment:
        write_text(place(options.next_to), str(diagnosis.next_experiment["config"]), Kind.SWEEP)


def report(results: "Mapping[str | None, Diagnosis]") -> dict[str, object]:
    """The JSON of the command: one diagnosis as it is, several by the names of their days."""
    plain = {name: diagnosis.to_json() for name, diagnosis in results.items()}
    return plain.get(None, {"days": plain})

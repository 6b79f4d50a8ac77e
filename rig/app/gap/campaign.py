"""Diagnosing a campaign of days: every day over processes or a cluster, and the JSON of them all."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rig.app.gap.baselines import EarlierDay, EarlierDays
from rig.app.gap.diagnosing import diagnose_case, first_time
from rig.app.gap.diagnosis_options import DiagnosisOptions, NamedDay
from rig.errors import RigError
from rig.number_text import counted

if TYPE_CHECKING:
    from rig.gap.answer.result import Diagnosis


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


def diagnose_only(options: DiagnosisOptions, case: NamedDay, sessions: Sequence[EarlierDay]) -> Campaign:
    """A call's only case, in this process, beside earlier days that have been read."""
    from rig.app.terminal import progress

    with progress("diagnosing") as update:
        update(0.0, first_time())
        diagnosis, unwritten = diagnose_case(options, case, sessions)
    return Campaign({case.name: diagnosis}, {}, [unwritten] if unwritten else [])


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


def report(results: "Mapping[str | None, Diagnosis]", days: EarlierDays) -> dict[str, object]:
    """The JSON of the command: one diagnosis as it is, several by the names of their days; and what they were compared
    with."""
    plain = {name: diagnosis.to_json() for name, diagnosis in results.items()}
    sessions = [{"path": str(day.path), "records": len(day.records)} for day in days.days]
    return plain.get(None, {"days": plain}) | {"baseline": {"sessions": sessions, "disagree": list(days.odd.values())}}

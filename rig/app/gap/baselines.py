"""The earlier days that a diagnosis compares with: which days they are, that the log under test is not one of them,
and that one which does not go with the others (`rig.gap.records.odd_days`) is left out."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from rig.errors import RigError
from rig.number_text import counted

if TYPE_CHECKING:
    from rig.record import Record


@dataclass(frozen=True)
class EarlierDay:
    """One earlier day: where it lies, and its records."""

    path: Path
    records: "list[Record]"


MODEL: Final = Path("model")
"""As a baseline: the logs that the model was identified from, as one day."""


def logs_of_model(model_file: Path) -> list[Path]:
    """The logs that a model was identified from; RigError when they are not at hand."""
    from rig.app.shipped import find_config
    from rig.identify.provenance import find_logs
    from rig.model.parameters import load_model

    found, missing = find_logs(load_model(find_config(model_file, "models")))
    if missing:
        more = f" (and {len(missing) - 1} more)" if len(missing) > 1 else ""
        raise RigError(f"--baseline model: {missing[0]}{more}")
    if not found:
        raise RigError(f"--baseline model: {model_file} does not say which logs it was identified from")
    return found


def sessions_of(baselines: Sequence[Path]) -> list[Path]:
    """One path a session: a folder that holds days holds one session in each, or more where those hold days again, as
    the days of several months."""
    return [session for baseline in baselines for session in sessions_of(days_in(baseline)) or [baseline]]


def days_in(folder: Path) -> list[Path]:
    """The folders of a folder that has its logs in several of them and none beside them; else none. What else lies
    there, a note or a page, is not a log: it would make one session of all days."""
    from rig.log.log_files import holds_logs, is_log

    if not folder.is_dir():
        return []
    inside = [entry for entry in sorted(folder.iterdir()) if not entry.name.startswith(".")]
    days = [entry for entry in inside if holds_logs(entry)]
    return days if len(days) > 1 and not any(map(is_log, inside)) else []


def check_no_own_baseline(logs: Sequence[Path], baselines: Sequence[Path]) -> None:
    """RigError when a log under test is among its own baseline: the rig would be compared with itself, and nothing
    would be found."""
    for baseline in baselines:
        for log in logs:
            here, there = log.resolve(), baseline.resolve()
            if here == there:
                raise RigError(f"--baseline {baseline}: that is the log under test; a rig has no gap to itself")
            if there in here.parents:
                raise RigError(
                    f"--baseline {baseline}: it contains the log under test, {log}; name the earlier days one by one"
                )
            if here in there.parents:
                raise RigError(
                    f"--baseline {baseline}: it is a part of the log under test, {log}; name that without it"
                )


def read_days(baselines: Sequence[Path], model_file: Path | None = None) -> list[EarlierDay]:
    """Every session with its records; RecordError when one cannot be read.

    `model` stands for the logs that `model_file` was identified from, unless something is really called so.
    """
    from rig.log.reader import read, read_all

    of_model = model_file is not None and MODEL in baselines and not MODEL.exists()
    named = [path for path in baselines if not (of_model and path == MODEL)]
    days = [EarlierDay(path, read(path)) for path in sessions_of(named)]
    if of_model and model_file is not None:
        days.append(EarlierDay(MODEL, read_all(logs_of_model(model_file))))
    return days


@dataclass(frozen=True)
class EarlierDays:
    """The days that the records are compared with, and those that were given and are not."""

    days: list[EarlierDay]
    odd: dict[Path, str]
    """Day that disagrees with the others -> how, in one line."""

    @property
    def records(self) -> "list[list[Record]]":
        """Of each day."""
        return [day.records for day in self.days]

    def listed(self) -> Iterator[str]:
        """A line for each day that is compared with."""
        for day in self.days:
            yield f"earlier day {day.path}: {counted(len(day.records), 'record')}"

    def lines(self) -> Iterator[str]:
        """The same, and a line for each that disagrees with the others."""
        yield from self.listed()
        yield from (f"note: {why}" for why in self.odd.values())


def earlier_days(baselines: Sequence[Path], model_file: Path | None, *, every: bool) -> EarlierDays:
    """The earlier days (`read_days`) without those that disagree with the others; `every` keeps these too."""
    return agreeing(read_days(baselines, model_file), every=every)


def agreeing(days: Sequence[EarlierDay], *, every: bool = False) -> EarlierDays:
    """The days without those that disagree with the others, which must be most of them; `every` keeps these too."""
    from rig.gap.records.odd_days import odd_days, two_apart

    records = [day.records for day in days]
    if len(days) == 2 and (apart := two_apart(*records)):
        both = " and ".join(str(day.path) for day in days)
        doubt = f"{both} differ by {apart}: another rig, or a day with a fault; a third day tells which"
        return EarlierDays(list(days), {days[-1].path: doubt})
    found = {
        days[k].path: f"the other days: {apart}; was the rig well on that day?"
        for k, apart in odd_days(records).items()
    }
    if every or 2 * len(found) >= len(days):
        kept = "" if every else "; and so do too many to say which days are the healthy ones: all are kept"
        return EarlierDays(list(days), {path: f"{path} disagrees with {how}{kept}" for path, how in found.items()})
    out = "left out (--every-day keeps it)"
    odd = {path: f"{path} is {out}: it disagrees with {how}" for path, how in found.items()}
    return EarlierDays([day for day in days if day.path not in found], odd)

"""What `pamrig gap history` does: the same diagnosis over many days, put in order of time."""

import re
from collections.abc import Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from rig.app.gap.campaign import Campaign, diagnose_campaign
from rig.app.gap.diagnosis_options import DiagnosisOptions, NamedDay
from rig.errors import ConfigError
from rig.gap.history.trends import Day, History, day_of
from rig.gap.settings import FALSE_ALARM_RATE
from rig.own_units import own_plain

_DATE: Final = re.compile(r"(\d{4})-?(\d{2})-?(\d{2})(?:T(\d{2})(\d{2})(\d{2})Z)?")
"""A day, and the time of day (UTC) as the folders have it that pamrig names itself."""
_DAY_S: Final = 86400.0


def history_days(
    options: DiagnosisOptions, cases: Sequence[NamedDay], workers: int | None
) -> tuple[list[Day], Campaign]:
    """Every day's diagnosis in order of time, and what became of each; ConfigError where there are not several days, or
    of some of them nothing says when they were."""
    if len(cases) < 2 or cases[0].name is None:
        raise ConfigError(f"{cases[0].logs[0]}: a history needs a folder that holds a folder for each of several days")
    at = _begun(cases)
    campaign = diagnose_campaign(options, cases, None, workers)
    made = {str(name): diagnosis for name, diagnosis in campaign.diagnoses.items()}
    first = min(at[name] for name in made)
    days = [day_of(name, (at[name] - first) / _DAY_S, made[name]) for name in sorted(made, key=lambda one: at[one])]
    return days, campaign


def _begun(cases: Sequence[NamedDay]) -> dict[str, float]:
    """Day -> seconds at which its records began, since one moment for all; where nothing says so of any, a day apart in
    the order of their names."""
    begun_s = {str(case.name): _when(case) for case in cases}
    unknown = [name for name, at in begun_s.items() if at is None]
    if len(unknown) == len(begun_s):
        return {name: number * _DAY_S for number, name in enumerate(begun_s)}
    if unknown:
        more = f" (and of {len(unknown) - 1} more)" if len(unknown) > 1 else ""
        raise ConfigError(
            f"{unknown[0]}: neither the folder's name nor its records say when it was{more}, as others do; put the "
            f"date into the name, as {unknown[0]}_2026-03-09"
        )
    return {name: at for name, at in begun_s.items() if at is not None}


def _when(case: NamedDay) -> float | None:
    """Seconds since 1970 at which a day's records began: from the folder's name where it holds a date, else from the
    records; None where they do not say either."""
    if found := _DATE.search(str(case.name)):
        try:
            parts = [part for part in found.groups() if part]
            form = "%Y%m%d%H%M%S"[: 2 * len(parts)]
            return datetime.strptime("".join(parts), form).replace(tzinfo=UTC).timestamp()
        except ValueError:
            pass
    from rig.log.reader import read_all

    begun = [record.facts.get("started_ns") for record in read_all(case.logs)]
    started_s = [1e-9 * float(at) for at in begun if at]
    return min(started_s, default=None)


def history_report(history: History) -> dict[str, Any]:
    """The JSON of the command, in the rig's own units."""
    units = {effect: size.unit for day in history.days for effect, size in day.sizes.items()}
    plain: dict[str, Any] = {
        "days": [_plain(day) for day in history.days],
        "changes": [asdict(change) | {"unit": units.get(change.quantity, "deg")} for change in history.changes],
        "growth": [asdict(slope) for slope in history.growth],
        "false_alarm_rate": FALSE_ALARM_RATE,
    }
    own = history.channels
    in_own_units: dict[str, Any] = own_plain(plain, own)
    return in_own_units if own.has_valves else in_own_units | {"channels": own.plain()}


def _plain(day: Day) -> dict[str, Any]:
    sizes = {effect: size.to_json() for effect, size in day.sizes.items()}
    plain = asdict(day) | {"sizes": sizes}
    del plain["channels"]
    return plain


def draw_history(history: History, path: Path) -> None:
    """The picture: gap and floor over time with the changes marked, and the sizes of what was named."""
    from rig.report.history_figure import history_figure
    from rig.report.log_figures import save

    save(history_figure(history.days, history.changes), path)

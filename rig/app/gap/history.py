"""What `pamrig gap history` does: the same diagnosis over many days, put in order of time."""

import logging
import math
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict
from datetime import UTC, datetime
from hashlib import file_digest
from pathlib import Path
from typing import Any, Final

from rig.app.gap.campaign import Campaign, diagnose_campaign
from rig.app.gap.diagnosis_options import DiagnosisOptions, NamedDay
from rig.errors import ConfigError, RecordError
from rig.gap.history.trends import Day, History, day_of
from rig.gap.settings import FALSE_ALARM_RATE
from rig.log.log_files import logs_in
from rig.log.reader import read_all
from rig.own_units import own_plain
from rig.report.shown_text import in_one_line

_DATE: Final = re.compile(r"(?=((?:19|20)\d{2})-?(\d{2})-?(\d{2})(?:T(\d{2})(\d{2})(\d{2})Z)?)")
"""A day, and the time of day (UTC) as the folders have it that pamrig names itself; wherever one may begin."""
_DAY_S: Final = 86400.0
_ZONES_S: Final = 14 * 3600.0
"""As far as a day of some place may begin before that of Greenwich, or end after it."""
_UNREADABLE: Final = math.inf
"""Of a day whose records cannot be read: which its diagnosis will say."""
_LOG = logging.getLogger("pamrig")


def history_days(
    options: DiagnosisOptions, cases: Sequence[NamedDay], workers: int | None
) -> tuple[list[Day], Campaign]:
    """Every day's diagnosis in order of time, and what became of each; ConfigError where there are not several days, or
    of some of them nothing says when they were."""
    if len(cases) < 2 or cases[0].name is None:
        raise ConfigError(f"{cases[0].logs[0]}: a history needs a folder that holds a folder for each of several days")
    once = _each_once(cases)
    if len(once) < 2:
        raise ConfigError(f"{cases[0].logs[0]}: its folders are copies of one day; a history needs several")
    at = _begun(once)
    campaign = diagnose_campaign(options, once, None, workers)
    made = {str(name): diagnosis for name, diagnosis in campaign.diagnoses.items()}
    first = min(at[name] for name in made)
    days = [day_of(name, (at[name] - first) / _DAY_S, made[name]) for name in sorted(made, key=lambda one: at[one])]
    return days, campaign


def _each_once(cases: Sequence[NamedDay]) -> list[NamedDay]:
    """Without a folder whose files are those of one before it, byte by byte, which is said: a backup is no further day,
    and would make levels and slopes too sure (0228). Files are read only where another folder has as many of the same
    sizes."""
    sizes = [_sizes(case) for case in cases]
    seen: dict[tuple[bytes, ...], NamedDay] = {}
    kept = []
    for case, own in zip(cases, sizes, strict=True):
        if own and sizes.count(own) > 1:
            first = seen.setdefault(_digests(case), case)
            if first is not case:
                _LOG.warning("%s: passed over: the same files as %s, which counts once", _said(case), _said(first))
                continue
        kept.append(case)
    return kept


def _sizes(case: NamedDay) -> tuple[int, ...]:
    """Of its files; none where they cannot be read, which its diagnosis will say."""
    try:
        return tuple(sorted(file.stat().st_size for log in case.logs for file in logs_in(log)))
    except (OSError, RecordError):
        return ()


def _digests(case: NamedDay) -> tuple[bytes, ...]:
    """Of its files; its name where they cannot be read: a copy of none."""
    try:
        return tuple(sorted(_digest(file) for log in case.logs for file in logs_in(log)))
    except (OSError, RecordError):
        return (str(case.name).encode("utf-8", "surrogateescape"),)


def _digest(file: Path) -> bytes:
    with file.open("rb") as opened:
        return file_digest(opened, "sha256").digest()


def _said(case: NamedDay) -> str:
    return in_one_line(str(case.logs[0]))


def _begun(cases: Sequence[NamedDay]) -> dict[str, float]:
    """Day -> seconds at which its records began, since one moment for all; where nothing says so of any, a day apart in
    the order of their names. Several folders of one date go by their records where these are of that day."""
    named_s = {str(case.name): _by_name(str(case.name)) for case in cases}
    dated = list(named_s.values())
    begun_s: dict[str, float | None] = {}
    for case in cases:
        name, at = str(case.name), named_s[str(case.name)]
        sure = at is not None and dated.count(at) == 1
        begun_s[name] = at if sure else _within_date(at, _by_records(case))
    unknown = [name for name, at in begun_s.items() if at is None]
    if len(unknown) == sum(at != _UNREADABLE for at in begun_s.values()):
        return {name: number * _DAY_S for number, name in enumerate(begun_s)}
    if unknown:
        more = f" (and of {len(unknown) - 1} more)" if len(unknown) > 1 else ""
        raise ConfigError(
            f"{unknown[0]}: neither the folder's name nor its records say when it was{more}, as others do; put the "
            f"date into the name, as {unknown[0]}_2026-03-09"
        )
    return {name: at for name, at in begun_s.items() if at is not None}


def _within_date(at: float | None, recorded: float | None) -> float | None:
    """When a day was recorded, where its folder has no date, or its records are of that date; else the date."""
    if at is None or (recorded is not None and -_ZONES_S <= recorded - at < _DAY_S + _ZONES_S):
        return recorded
    return at


def _by_name(name: str) -> float | None:
    """Seconds since 1970 of the first date in a name; None where it holds none. Other digits, as of a serial number,
    may stand before it."""
    for found in _DATE.finditer(name):
        parts = [part for part in found.groups() if part]
        form = "%Y%m%d%H%M%S"[: 2 * len(parts)]
        with suppress(ValueError):
            return datetime.strptime("".join(parts), form).replace(tzinfo=UTC).timestamp()
    return None


def _by_records(case: NamedDay) -> float | None:
    """Seconds since 1970 at which a day's records began; None where they do not say."""
    try:
        begun = [record.facts.get("started_ns") for record in read_all(case.logs)]
    except RecordError:
        return _UNREADABLE
    return min((1e-9 * float(at) for at in begun if at), default=None)


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

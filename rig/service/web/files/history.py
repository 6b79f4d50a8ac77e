"""What the page's diagnoses say together: gap and causes over the days, where they changed, how they grow.

Called in the process for what takes long: what it needs is imported there only.
"""

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from rig.service.web.files.diagnosis_json import DiagnosedDay, gap_of, unit_of

if TYPE_CHECKING:
    from rig.gap.answer.result import Interval
    from rig.gap.history.trends import Day, History

_DAY_S = 86400.0


def history_json(days: list[DiagnosedDay]) -> dict[str, Any]:
    """The days in order of time with gap, floor and sizes in the rig's own unit; what changed and what grows, also in
    sentences. Days of another unit than the last are of another rig and left out, as one is whose diagnosis is none."""
    from rig.gap.history.sentences import history_sentences
    from rig.gap.history.trends import History, look_back

    ordered = sorted(filter(_is_whole, days), key=lambda one: one.recorded_s)
    unit = unit_of(ordered[-1].found) if ordered else "deg"
    kept = [one for one in ordered if unit_of(one.found) == unit]
    history = look_back([_day(one, kept[0].recorded_s) for one in kept]) if kept else History((), (), ())
    return {
        "unit": unit,
        "days": [_plain(day, one) for day, one in zip(history.days, kept, strict=True)],
        "changes": [asdict(change) for change in history.changes],
        "words": history_sentences(history, unit) if len(kept) > 1 else [],
        "effects": _units(history),
    }


def _is_whole(one: DiagnosedDay) -> bool:
    """It holds what a diagnosis does, of these kinds; somebody may have written to it."""
    try:
        _day(one, one.recorded_s)
    except (ValueError, LookupError, TypeError, AttributeError):
        return False
    return True


def _day(one: DiagnosedDay, first_s: float) -> "Day":
    from rig.gap.history.trends import Day

    causes = [cause for cause in one.found.get("causes", []) if isinstance(cause, dict)]
    sizes = {quantity: size for cause in causes for quantity, size in _size(cause).items()}
    gap, floor = gap_of(one.found, "rms") or 0.0, gap_of(one.found, "floor") or 0.0
    days = (one.recorded_s - first_s) / _DAY_S
    return Day(one.session, days, gap, floor, str(one.found.get("verdict")), sizes)


def _size(cause: dict[str, Any]) -> "dict[str, Interval]":
    from rig.gap.answer.result import Interval
    from rig.gap.history.trends import size_of

    parameters = {name: Interval(**each) for name, each in cause.get("parameters", {}).items()}
    return size_of(str(cause.get("effect")), parameters)


def _plain(day: "Day", one: DiagnosedDay) -> dict[str, Any]:
    sizes = {effect: size.to_json() for effect, size in day.sizes.items()}
    plain = {"name": day.name, "at_s": one.recorded_s, "verdict": day.verdict, "sizes": sizes}
    return plain | {"gap": day.gap_deg, "floor": day.floor_deg}


def _units(history: "History") -> dict[str, str]:
    """Effect -> the unit of its size, the one that was named most often first."""
    named = [(effect, size.unit) for day in history.days for effect, size in day.sizes.items()]
    return dict(sorted(named, key=lambda one: -named.count(one)))

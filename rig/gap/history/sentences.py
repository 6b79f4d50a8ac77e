"""A history in sentences."""

from rig.gap.history.change_points import fewest_days
from rig.gap.history.trends import GAP, Change, Growth, History
from rig.gap.settings import FALSE_ALARM_RATE
from rig.number_text import counted


def history_sentences(history: History, unit: str = "deg") -> list[str]:
    """What changed and what grows, a sentence each; `unit` is the gap's."""
    units = {quantity: size.unit for day in history.days for quantity, size in day.sizes.items()} | {GAP: unit}
    lines = [_change_sentence(change, units[change.quantity]) for change in history.changes]
    lines += [_growth_sentence(one) for one in history.growth]
    if len(history.days) < (fewest := fewest_days(FALSE_ALARM_RATE)):
        return [
            *lines,
            f"{counted(len(history.days), 'day is', 'days are')} too few to tell a change of level: at a false-alarm "
            f"rate of {100 * FALSE_ALARM_RATE:.0f} % it takes {fewest}",
        ]
    return lines or [f"nothing changed over these days (at a false-alarm rate of {100 * FALSE_ALARM_RATE:.0f} %)"]


def _change_sentence(change: Change, unit: str) -> str:
    levels = f"from {change.before:.2g} to {change.after:.2g}{'' if unit == '1' else f' {unit}'}"
    what = "the gap" if change.quantity == GAP else change.quantity
    return f"{what} went {levels} on {change.day} (p = {change.p_value:.2g})"


def _growth_sentence(one: Growth) -> str:
    unit = "" if one.unit == "1" else f" {one.unit}"
    sure = "" if one.low * one.high > 0.0 else "; it may as well stand still"
    return (
        f"{one.effect}, named since {one.first_day}, moves by {one.per_day:.2g}{unit} a day "
        f"({one.low:.2g} to {one.high:.2g}){sure}"
    )

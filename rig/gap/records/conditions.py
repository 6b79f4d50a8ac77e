"""In which condition two records differ: a sweep under another condition is another sweep, whatever its command.

What only one of two records says is not compared.
"""

from dataclasses import dataclass

from rig.conditions import commanded_rest, conditions, stated, word_of
from rig.gap.records.settings import CONDITION_LIMITS
from rig.identify.records.rest import SHIFTED_MPA, measured_rest
from rig.record import Record


@dataclass(frozen=True)
class ConditionDifference:
    """A condition in which two records differ."""

    name: str
    """As the records have it, the unit in the name (load_kg, temperature_c)."""
    mine: float | str
    other: float | str
    limit: float
    """What they may differ by, in the unit of the name."""

    @property
    def text(self) -> str:
        if isinstance(self.mine, str) or isinstance(self.other, str):
            return f"{self.name} is {self.mine}, not {self.other}"
        return f"{self.name} is {self.mine:.4g}, not {self.other:.4g} (allowed: {self.limit:.2g} off)"


def difference(record: Record, other: Record) -> ConditionDifference | None:
    """The first condition in which the two differ by more than it may; None when they agree in all that both say, and
    in P0 where one says it and the other measured it."""
    mine, theirs = conditions(record), conditions(other)
    for name in (name for name in mine if name in theirs):
        one, two = mine[name], theirs[name]
        if isinstance(one, str) or isinstance(two, str):
            if str(one) != str(two):
                return ConditionDifference(name, one, two, 0.0)
            continue
        limit = _limit(name, max(abs(one), abs(two)), record)
        if abs(one - two) > limit:
            return ConditionDifference(name, one, two, limit)
    return _other_rest(record, other)


def _other_rest(record: Record, other: Record) -> ConditionDifference | None:
    """Where only one of two records says its P0, the other's measured one must not be far from it; nor may the
    pressures that both measured be near each other, which is how a shift of both looks."""
    commanded = [commanded_rest(each) for each in (record, other)]
    if (commanded[0] is None) == (commanded[1] is None):
        return None
    measured = [measured_rest(each) for each in (record, other)]  # by both monitors' whole courses: takes longest
    if measured[0] is None or measured[1] is None:
        return None
    mine, theirs = (own if own is not None else read for own, read in zip(commanded, measured, strict=True))
    if mine is None or theirs is None or min(abs(mine - theirs), abs(measured[0] - measured[1])) <= SHIFTED_MPA:
        return None
    return ConditionDifference("p0_mpa", mine, theirs, SHIFTED_MPA)


def _limit(name: str, size: float, record: Record) -> float:
    """What a condition may differ by: as its further channel says, else by its word."""
    own = [each.same_within for each in stated(record) if each.name == name]
    absolute, share = CONDITION_LIMITS.get(word_of(name), (0.0, 0.0))
    return own[0] if own else absolute + share * size

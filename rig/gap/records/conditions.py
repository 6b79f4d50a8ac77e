"""Under which condition a record was taken: rest pressure, load, tension, temperature; from its facts, its columns or
its session's YAML.

A sweep under another condition is another sweep, whatever its command. What only one of two records says is not
compared.
"""

from dataclasses import dataclass

import numpy as np

from rig.further import Further, furthers_of
from rig.gap.records.settings import CONDITION_LIMITS, SHIFTED_MPA
from rig.record import Record
from rig.tags import tags_of


@dataclass(frozen=True)
class Difference:
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


def commanded_rest(record: Record) -> float | None:
    """P0 that the record was commanded around, MPa; None where it does not say."""
    if record.p1_cmd_mpa is not None and record.p2_cmd_mpa is not None:
        return float(np.nanmedian(0.5 * (record.p1_cmd_mpa + record.p2_cmd_mpa)))
    return float(record.facts["p0_mpa"]) if "p0_mpa" in record.facts else None


def measured_rest(record: Record) -> float | None:
    """P0 by the measured pressures, MPa; None where one of them was not measured."""
    if record.p1_mpa is None or record.p2_mpa is None:
        return None
    return float(np.nanmedian(0.5 * (record.p1_mpa + record.p2_mpa)))


def conditions(record: Record) -> dict[str, float | str]:
    """Name -> value of every condition that the record says: a fact, or the median of a column of that name."""
    said: dict[str, float | str] = {
        name: float(np.nanmedian(column))
        for name, column in record.extra.items()
        if (_is_condition(name) or name in {one.name for one in _stated(record)}) and np.isfinite(column).any()
    }
    for name, value in (dict(record.facts) | tags_of(record.facts)).items():
        if _is_condition(name) and isinstance(value, (int, float, str)):
            said[name] = value if isinstance(value, str) else float(value)
    rest = commanded_rest(record)
    return said if rest is None else said | {"p0_mpa": rest}


def difference(record: Record, other: Record) -> Difference | None:
    """The first condition in which the two differ by more than it may; None when they agree in all that both say, and
    in P0 where one says it and the other measured it."""
    mine, theirs = conditions(record), conditions(other)
    for name in mine.keys() & theirs.keys():
        one, two = mine[name], theirs[name]
        if isinstance(one, str) or isinstance(two, str):
            if str(one) != str(two):
                return Difference(name, one, two, 0.0)
            continue
        limit = _limit(name, max(abs(one), abs(two)), record)
        if abs(one - two) > limit:
            return Difference(name, one, two, limit)
    return _other_rest(record, other)


def _other_rest(record: Record, other: Record) -> Difference | None:
    """Where only one of two records says its P0, the other's measured one must not be far from it; nor may the
    pressures that both measured be near each other, which is how a shift of both looks."""
    said = [commanded_rest(each) for each in (record, other)]
    seen = [measured_rest(each) for each in (record, other)]
    if (said[0] is None) == (said[1] is None) or seen[0] is None or seen[1] is None:
        return None
    mine, theirs = (told if told is not None else read for told, read in zip(said, seen, strict=True))
    if mine is None or theirs is None or min(abs(mine - theirs), abs(seen[0] - seen[1])) <= SHIFTED_MPA:
        return None
    return Difference("p0_mpa", mine, theirs, SHIFTED_MPA)


def _limit(name: str, size: float, record: Record) -> float:
    """What a condition may differ by: as its further channel says, else by its word."""
    stated = [each.same_within for each in _stated(record) if each.name == name]
    absolute, share = CONDITION_LIMITS.get(_word(name), (0.0, 0.0))
    return stated[0] if stated else absolute + share * size


def _stated(record: Record) -> list[Further]:
    """The further channels that say within what their medians are one condition."""
    return [one for one in furthers_of(record.facts) if one.same_within > 0.0]


def _is_condition(name: str) -> bool:
    return _word(name) in CONDITION_LIMITS


def _word(name: str) -> str:
    """load of load_kg."""
    return name.partition("_")[0]

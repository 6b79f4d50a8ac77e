"""Further channels of a rig (load cell, temperature, supply pressure): their names, units, and what a condition allows.

A sample has a fixed number of places for them; which is which stands in the run's facts, and records name them by
their own names.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from rig.channels import LONGEST_NAME, Channels
from rig.config import structure
from rig.errors import ConfigError
from rig.fields import bounded

FACT: Final = "further"
"""The run fact that lists them, in the order of the places."""
PLACES: Final = ("further_1", "further_2", "further_3", "further_4")
"""The fields of a sample."""
RESERVED: Final = (
    *("t_s", "log_time_ns", "sequence", "lateness_us", "p1_age_s", "p2_age_s", "angle_age_s"),
    *("units", "meanings", "pamrig"),
)
"""Columns that records and exports have beside the fields of samples: a further channel of that name would stand in
their place."""


@dataclass(frozen=True)
class Further:
    """One further channel."""

    name: str
    """Of its column, the unit in it by custom: load_n."""
    unit: str = "1"
    same_within: float = bounded(0.0, 1e12, default=0.0)
    """Above 0, in its unit: records whose medians differ by more were taken under another condition and do not pair."""


def furthers_of(facts: Mapping[str, Any]) -> tuple[Further, ...]:
    """The further channels that facts list; none where they list none, or something else."""
    raw = facts.get(FACT)
    if not isinstance(raw, list | tuple) or len(raw) > len(PLACES):
        return ()
    try:
        return check_furthers([structure(one, Further, FACT) for one in raw], FACT)
    except ConfigError:
        return ()


def check_new(further: Sequence[Further], where: str, channels: Channels, sample: Iterable[str]) -> tuple[Further, ...]:
    """The channels that somebody gives a rig with these input and output, whose samples have those fields; ConfigError
    as for `check_furthers`, and for a name that files or other tools have another use for."""
    hidden = next((one.name for one in further if one.name.startswith("_")), None)
    if hidden is not None:
        raise ConfigError(f"{where}: {hidden!r} begins with _, which MAT files leave out; give it another name")
    return check_furthers(further, where, (*sample, *RESERVED, channels.input.column, channels.output.column))


def check_furthers(further: Sequence[Further], where: str, taken: Sequence[str] = ()) -> tuple[Further, ...]:
    """The channels themselves; ConfigError when a name is none, stands twice or is `taken`, or they are too many."""
    if len(further) > len(PLACES):
        raise ConfigError(f"{where}: {len(further)} further channels; a sample has place for {len(PLACES)}")
    names = [one.name for one in further]
    for name in names:
        if not name.isidentifier() or len(name) > LONGEST_NAME:
            raise ConfigError(
                f"{where}: {name[:LONGEST_NAME]!r} is no name of a column; letters, digits and _ are allowed, at most "
                f"{LONGEST_NAME}"
            )
        if name in taken or names.count(name) > 1:
            raise ConfigError(f"{where}: the column {name!r} is there already; give the channel another name")
    return tuple(further)


def plain(further: Sequence[Further]) -> list[dict[str, Any]]:
    """As facts hold them."""
    return [
        {"name": one.name, "unit": one.unit} | ({"same_within": one.same_within} if one.same_within else {})
        for one in further
    ]

"""Under which condition a record was taken: rest pressure, load, tension, temperature; from its facts, its columns or
its session's YAML."""

from typing import Final

import numpy as np

from rig.further_channels import Further, furthers_of
from rig.record import Record
from rig.tags import tags_of

WORDS: Final = ("p0", "load", "tension", "temperature")
"""A fact or a column whose name begins with one of these is a condition: load_kg."""

MEASURED_REST: Final = "measured_p0_mpa"
"""Fact of a record that does not say its P0, beside others around another one: what it is taken for. No condition: it
was commanded, or both pressures are shifted."""


def conditions(record: Record) -> dict[str, float | str]:
    """Name -> value of every condition that the record says: a fact, or the median of a column of that name."""
    found: dict[str, float | str] = {
        name: float(np.nanmedian(column))
        for name, column in record.extra.items()
        if (is_condition(name) or name in {one.name for one in stated(record)}) and np.isfinite(column).any()
    }
    for name, value in (dict(record.facts) | tags_of(record.facts)).items():
        if is_condition(name) and isinstance(value, (int, float, str)):
            found[name] = value if isinstance(value, str) else float(value)
    rest = commanded_rest(record)
    return found if rest is None else found | {"p0_mpa": rest}


def commanded_rest(record: Record) -> float | None:
    """P0 that the record was commanded around, MPa: by its set-points, which went to the rig, else as a fact says it;
    None where it does not say."""
    if record.p1_cmd_mpa is not None and record.p2_cmd_mpa is not None:
        middle = 0.5 * (record.p1_cmd_mpa + record.p2_cmd_mpa)
        if np.isfinite(middle).any():
            return float(np.nanmedian(middle))
    return float(record.facts["p0_mpa"]) if "p0_mpa" in record.facts else None


def taken_rest(record: Record, p0_mpa: float) -> float:
    """P0 (MPa) about which a record's difference of set-points is split: its own, else what was read from its measured
    pressures because the records of its day lie around several (`MEASURED_REST`), else `p0_mpa`."""
    commanded = commanded_rest(record)
    return commanded if commanded is not None else float(record.facts.get(MEASURED_REST, p0_mpa))


def stated(record: Record) -> list[Further]:
    """The further channels that say within what their medians are one condition."""
    return [one for one in furthers_of(record.facts) if one.same_within > 0.0]


def is_condition(name: str) -> bool:
    """Whether a fact or column of this name is one whatever its channel says."""
    return word_of(name) in WORDS


def word_of(name: str) -> str:
    """load of load_kg."""
    return name.partition("_")[0]

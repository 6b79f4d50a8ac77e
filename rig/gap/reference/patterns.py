"""The nuisances: what may differ on a healthy rig without being a gap, each a pattern in the records and a level in
`priors.yaml`, its standard deviation.

Two factors have them, the pressures under the commands and the angle under the pressures. Larger levels: smaller
effects of that kind are no gap; smaller ones: what days differ in is given a cause. They are fitted by `pamrig gap
calibrate` on healthy days; docs/reference/levels.md lists them with the shipped values.
"""

# ruff: noqa: E501 (one line a nuisance reads best as a table)
from dataclasses import dataclass


@dataclass(frozen=True)
class Nuisance:
    """One of them."""

    unit: str
    """Of its level."""
    meaning: str
    elsewhere: str = ""
    """Where another number takes its level's place, or widens it."""


VALVE_NUISANCES = {
    "offset_mpa": Nuisance("MPa", "zero of a regulator with its monitor"),
    "gain": Nuisance("1", "gain of a regulator with its monitor, of what it is off P0", "wider unless several days tell it (`GAIN_BY_DAY`)"),
    "lag_s": Nuisance("s", "first order of its answer", "wider for records coarser than the simulator's steps (`Expected.unsure_lag_s`)"),
    "curvature_s2": Nuisance("s^2", "second order of its answer"),
    "one_way_s": Nuisance("s", "exhausting against filling: in proportion to the speed, whichever way it goes"),
    "bend": Nuisance("1", "curvature of its characteristic: of (p - P0)^2 / P0"),
}  # fmt: skip
"""Of each regulator with its monitor, the first of `rig.model.response.model.regulator_terms`, in their order."""
REGULATOR_NUISANCES = {
    "regulators": Nuisance("1", "time constant of both regulators, which are of one make; relative"),
    "one_way": Nuisance("1", "time constant of exhausting against filling of both; relative"),
}
ANGLE_NUISANCES = {
    "offset": Nuisance("span", "zero of the angle", "wider beside a sister's simulator with a zero of its own (`ZERO_BY_HAND`)"),
    "gain": Nuisance("1", "gain of the angle"),
    "lag_s": Nuisance("s", "lag of the angle", "as the regulators', where no pressures were measured"),
    "loop": Nuisance("1", "the joint's own friction, at the same gain, so the width of its loop; its mass is the same every day"),
    "viscous_s": Nuisance("s", "viscous friction over stiffness, beyond a lag and a wider loop", "none beside a simulator: there it is what is asked for (docs/decisions/0613)"),
    "monitor_mpa": Nuisance("MPa", "zero of each pressure monitor, through the muscles", "known once the pressures are judged (`reference/monitors.py`)"),
    "monitor_gain": Nuisance("1", "gain of each pressure monitor, through the muscles; at most the data sheet's (`levels.MOST`)"),
    "mean_law": Nuisance("1", "exponent of the law of the mean pressure", "wider where the reference saw one P0 only (`UNSEEN_MEAN_LAW`)"),
    "drift": Nuisance("span", "drift of the angle from the start of a record to its end"),
    "warming": Nuisance("1", "growth of the motion from the start of a record to its end; relative"),
    "bank": Nuisance("span", "rms of each of the response model's terms: powers, low-passes and plays of the drive"),
}  # fmt: skip
VISCOUS, BANK = "viscous_s", "bank"
EACH_MONITOR = ("monitor_mpa", "monitor_gain")
"""Two patterns each, for muscle 1 and for muscle 2."""

VALVE_PATTERNS = tuple(VALVE_NUISANCES)
REGULATOR_PATTERNS = tuple(REGULATOR_NUISANCES)
ANGLE_PATTERNS = tuple(
    name for name in ANGLE_NUISANCES if name != BANK for _ in range(2 if name in EACH_MONITOR else 1)
)
"""In the order of the columns of `rig.gap.reference.expectation`, which goes on with as many of BANK as there are."""

"""What drives the joint: the difference of the pressures, scaled by their mean, d = (p1 - p2) (2 P0 / (p1 + p2))^n.

The stiffness of both muscles rises with their mean pressure, so the same difference turns the joint less at a higher
mean (n = 1 in proportion, 0 not at all). Pure Python that numba compiles; on columns:
`rig.model.compiled.columns.drive`.
"""

from collections.abc import Sequence

from rig.model.slots import Values

LEAST_SHARE = 0.2
"""The sum of the pressures counts as at least this share of P0: an empty muscle does not make the drive infinite."""


def mean_pressure_factor(p1_mpa: float, p2_mpa: float, p0_mpa: float, exponent: float) -> float:
    """(2 P0 / (p1 + p2))^n: what a mean pressure other than P0 makes of the difference. The usual exponent apart, since
    a power takes several times as long as all the rest."""
    total, least = p1_mpa + p2_mpa, LEAST_SHARE * p0_mpa
    factor: float = 2.0 * p0_mpa / (least if total < least else total)
    return factor if exponent == 1.0 else factor**exponent


def drives(p1: Sequence[float], p2: Sequence[float], p0_mpa: float, exponent: float, out: Values) -> None:
    """The drive d (MPa) of every row, into `out`."""
    for k in range(len(p1)):
        out[k] = (p1[k] - p2[k]) * mean_pressure_factor(p1[k], p2[k], p0_mpa, exponent)

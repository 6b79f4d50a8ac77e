"""A bundle of thin braided strands: what it holds and how it pulls. Compiled.

Force by virtual work: pressure times the volume won less the strain energy of the bladder, for the length given up.
Unlike the ideal braid of Chou and Hannaford, the yarns' thickness counts, which is much for thin strands (Kurumaya and
others 2017), the bladder is a wall that cannot be compressed, of Gent's rubber (1996), and the yarns jam. The strands
of a bundle are not of one length: they pull one after another.
"""

import math

from hil.reference.bundle.physics import Physics
from hil.reference.compiling import compiled

GROUPS = 3
"""Short, middle and long strands, a third of them each."""
JAM_WIDTH = 0.04
NEAR_LIMIT = 0.98
"""Gent's rubber is not stretched further than this share of its limit; a braid not closer to straight yarns."""


@compiled
def swelling(stretch: float, physics: Physics) -> tuple[float, float]:
    """(radius of a braid against that before inflation, its slope by the axial stretch)."""
    cosine, sine = math.cos(physics.braid_rad), math.sin(physics.braid_rad)
    along = min(NEAR_LIMIT, stretch * cosine)
    swell = math.sqrt(1.0 - along * along) / sine
    return swell, -along * cosine / (sine * sine * swell)


@compiled
def cavity(stretch: float, physics: Physics) -> tuple[float, float]:
    """(volume inside a strand's bladder against that within the braid before inflation, its slope by the stretch)."""
    swell, slope = swelling(stretch, physics)
    inner = swell - physics.yarn
    return inner * inner * stretch - physics.wall, inner * inner + 2.0 * stretch * inner * slope


@compiled
def invariant(stretch: float, physics: Physics) -> tuple[float, float]:
    """(first invariant of a bladder's stretch, its slope by the axial stretch)."""
    swell, slope = swelling(stretch, physics)
    hoop, hoop_slope = (swell - physics.yarn) / (1.0 - physics.yarn), slope / (1.0 - physics.yarn)
    thin = 1.0 / (stretch * hoop)
    thin_slope = -thin * (1.0 / stretch + hoop_slope / hoop)
    total = stretch * stretch + hoop * hoop + thin * thin
    return total, 2.0 * (stretch + hoop * hoop_slope + thin * thin_slope)


@compiled
def strand_force(pressure_mpa: float, contraction: float, physics: Physics) -> float:
    """Force (N) of a bundle all of whose strands are contracted alike; strands only pull."""
    stretch = 1.0 - contraction
    _, opening = cavity(stretch, physics)
    total, slope = invariant(stretch, physics)
    used = min(NEAR_LIMIT, (total - 3.0) / physics.rubber_limit)
    rubber = 0.5 * physics.rubber_mpa * physics.wall * slope / (1.0 - used)
    beyond = max(0.0, contraction - physics.jam_contraction) / JAM_WIDTH
    return max(0.0, physics.area_n_mpa * (rubber - pressure_mpa * opening) - physics.jam_n * beyond * beyond)


@compiled
def bundle_force(pressure_mpa: float, contraction: float, torn: float, physics: Physics) -> float:
    """Force (N) of a bundle of uneven strands, of which a share is torn, the shortest first."""
    total = 0.0
    for group in range(GROUPS):
        lost = min(1.0 / GROUPS, torn)
        torn -= lost
        share = 1.0 / GROUPS - lost
        if share > 0.0:
            total += share * strand_force(pressure_mpa, contraction + (group - 1) * physics.uneven, physics)
    return total


@compiled
def bundle_air(contraction: float, at_zero: float, physics: Physics) -> tuple[float, float]:
    """(a bundle's volume against that at angle zero, its slope by the contraction); `at_zero`: a strand's there."""
    volume, slope = cavity(1.0 - contraction, physics)
    changing = (1.0 - physics.dead_share) / at_zero
    return physics.dead_share + changing * volume, -changing * slope


@compiled
def slit_opening(contraction: float, physics: Physics) -> float:
    """How far a slit in a bladder is open, against angle zero: with the cube of the hoop's strain."""
    now, _ = swelling(1.0 - contraction, physics)
    there, _ = swelling(1.0 - physics.contraction, physics)
    return (max(0.0, now - 1.0) / (there - 1.0)) ** 3

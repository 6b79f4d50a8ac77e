"""The floor: how far the angle is off when nothing is wrong, and on what that rests."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from rig.gap.hypotheses.inverse_problems import floor_deg
from rig.gap.priors import Fitted
from rig.gap.reference.expected import Expected
from rig.gap.reference.gaps import rms_of
from rig.gap.reference.kinds import ReferenceKind
from rig.gap.reference.own_days import angle_days, own_floor
from rig.gap.reference.unrepeated import Unrepeated, of_contexts

LEAST_FLOOR_DEG = 1e-6
"""No floor is lower: gaps are told as multiples of it."""


@dataclass(frozen=True)
class Floor:
    """Of the angle under the commands."""

    deg: float
    """Rms when nothing is wrong."""
    notes: tuple[str, ...]
    """A line where the rig repeats itself less closely than such references usually know a rig."""


def floor_of(expected: Expected, settings: Fitted) -> Floor:
    """What is usual, or what the rig's own days differ by, and no less than what the reference is known to miss, of the
    angle and through the pressures, or than what the rig does not repeat."""
    usual = floor_deg(expected, settings)
    commanded = partial(angle_days, response=expected.response, driven=False)
    own = own_floor(usual, commanded(expected.contexts), np.concatenate([pair.used for pair in expected.pairs]))
    known = float(np.hypot(expected.missed_deg, _through_pressures(expected)))
    anew = of_contexts(expected.contexts, commanded)
    notes = (_unsteady(anew),) if anew.rms > usual else ()
    return Floor(max(own, known, anew.rms, LEAST_FLOOR_DEG), notes)


def floor_source(expected: Expected) -> str:
    """What the floor rests on: the rig's own days from two on, else what is usual of such a reference."""
    return ReferenceKind.SESSIONS.value if expected.pairing.day_count > 1 else expected.levels


def _unsteady(anew: Unrepeated) -> str:
    return (
        f"the rig does not repeat itself: from one period of a sweep to the next the angle is off by {anew.rms:.2g} "
        f"deg rms, most of it near {anew.loudest_hz:.2g} Hz (regulators that hunt, something loose?); that is no gap, "
        "and smaller ones hide in it"
    )


def _through_pressures(expected: Expected) -> float:
    """Rms of the angle, deg, for what the reference's regulators miss of the pressures, each for itself (propagation of
    errors to first order)."""
    missed, response = expected.missed_mpa, expected.response
    one, other = [], []
    for context in expected.contexts:
        p1, p2, dt_s = context.reference.p1_mpa, context.reference.p2_mpa, context.pair.dt_s
        here = response.angle(p1, p2, dt_s)
        one.append(response.angle(p1 + missed, p2, dt_s) - here)
        other.append(response.angle(p1, p2 + missed, dt_s) - here)
    pairs = [context.pair for context in expected.contexts]
    return float(np.hypot(rms_of(one, pairs), rms_of(other, pairs)))

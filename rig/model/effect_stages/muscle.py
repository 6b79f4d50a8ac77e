"""Effects of the muscles behind the pressure monitors; block stages as in `timing`.

Leak, mismatch and one muscle that warms stand before the hysteresis and change the pressures that it sees; creep and
thermal drift change the angle behind it.
"""

import math
from collections.abc import Sequence

from rig.model.effect_stages.valve import ATMOSPHERE_MPA, of_valve
from rig.model.slots import Values

CREEP_TIMES = 5
"""Time constants of a creep whose times spread: one for each half decade of two. Fewer: the loop's width goes up and
down with the frequency."""
HEATING_MPA_S = 0.1
"""Mean rate of a muscle's pressure that counts as usual for its heat: 0.08 MPa at a third of a hertz."""


def muscle_mismatch(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """Muscle 1 is stronger by the share mismatch (negative: muscle 2); params: mismatch, balance (0 half of it in each,
    1 all of it in muscle 1, -1 in muscle 2, which is weaker)."""
    first, second = 1.0 + 0.5 * params[0] * (1.0 + params[1]), 1.0 - 0.5 * params[0] * (1.0 - params[1])
    for i in range(len(p1)):
        p1[i] *= first
        p2[i] *= second


def leak(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """One muscle's line loses pressure: ahead of the monitor, or behind it, and the muscle gets less than that says;
    params: loss (share of the pressure), muscle (1 or 2), absolute (0 the gauge pressure's, 1 the absolute one's: a
    choked leak takes in proportion to that)."""
    for i in range(len(p1)):
        if params[1] < 1.5:
            p1[i] -= params[0] * (p1[i] + params[2] * ATMOSPHERE_MPA)
        else:
            p2[i] -= params[0] * (p2[i] + params[2] * ATMOSPHERE_MPA)


def one_muscle_warms(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """One muscle's strength changes steadily, as if its pressure counted more, or less; params: rate_per_min, muscle
    (1 or 2), whole_session."""
    for i in range(len(p1)):
        if params[1] < 1.5:
            p1[i] *= 1.0 + params[0] * state[0] / 60.0
        else:
            p2[i] *= 1.0 + params[0] * state[0] / 60.0
        state[0] += dt_s


def creep(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """A share of the response comes late: y + share (low pass of y - relaxed y); params: share, tau_s, relaxed,
    decades.

    relaxed = 1 keeps the final angle and weakens the quick response; relaxed = 0 keeps the quick response and adds to
    the final angle. What comes late comes with one time constant, or with five that spread over so many decades around
    it, as rubber and fabric creep: a power of time, or its logarithm (Findley, Lai and Onaran, Creep and Relaxation of
    Nonlinear Viscoelastic Materials, 1976).
    """
    for k in range(CREEP_TIMES):
        each_s = params[1] * math.pow(10.0, params[3] * (k / (CREEP_TIMES - 1.0) - 0.5))
        state[1 + CREEP_TIMES + k] = math.exp(-dt_s / max(each_s, 1e-3))
    for i in range(len(y)):
        late = 0.0
        for k in range(CREEP_TIMES):
            before = state[1 + k] if state[0] != 0.0 else y[i]
            state[1 + k] = y[i] + state[1 + CREEP_TIMES + k] * (before - y[i])
            late += state[1 + k] / CREEP_TIMES
        state[0] = 1.0
        y[i] += params[0] * (late - params[2] * y[i])


def thermal_drift(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """The strength, and with it the angle, changes steadily; of muscles that change unequally about another angle than
    0; params: rate_per_min, about_deg, whole_session."""
    for i in range(len(y)):
        y[i] += params[0] * state[0] / 60.0 * (y[i] - params[1])
        state[0] += dt_s


def heated_muscles(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """The strength of each muscle changes by heat that its air and its friction bring when it works, and that goes
    again; params: rate_per_min at HEATING_MPA_S, heat_s, balance."""
    keeps = math.exp(-dt_s / max(params[1], 1e-3))
    for i in range(len(p1)):
        for muscle in range(2):
            now = p1[i] if muscle == 0 else p2[i]
            worked = abs(now - state[3 + muscle]) if state[0] != 0.0 else 0.0
            state[3 + muscle] = now
            state[1 + muscle] = keeps * state[1 + muscle] + worked / (60.0 * HEATING_MPA_S)
        state[0] = 1.0
        p1[i] *= 1.0 + of_valve(params[0], params[2], 0) * state[1]
        p2[i] *= 1.0 + of_valve(params[0], params[2], 1) * state[2]

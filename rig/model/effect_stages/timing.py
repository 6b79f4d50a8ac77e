"""Effects of time: a late command, a clock that runs fast or slow, samples that repeat.

Block stages as everywhere in the chain: in place on p1, p2 (MPa) and y (deg), lists or arrays of equal length; `state`
is all zero at rest and kept between blocks; `params` in the order of the table. No numpy: they also run on the
controller.
"""

import math
from collections.abc import Sequence

from rig.model.slots import Values

BUFFER_TICKS = 800
"""Longest delay that a stage can hold, in ticks (4 s at 5 ms)."""
MOST_TICKS = BUFFER_TICKS - 2
"""Longest that a command may be late."""
MOST_AHEAD_TICKS = 10.0
"""How far a command is extrapolated, in ticks."""
PACE_STATE = 3 + 2 * BUFFER_TICKS
"""Numbers that a stage which delays both valves keeps: where it is, and a ring of ticks for each."""
RANDOM_MODULUS = 2147483647.0
RANDOM_FACTOR = 16807.0
"""Park and Miller's minimal standard generator; exact in double precision."""


def delay(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """u(t - delay_s), between samples by a straight line; params: delay_s, at most MOST_TICKS ticks (who lays out a
    chain refuses more)."""
    lag = min(max(params[0] / dt_s, 0.0), MOST_TICKS)
    whole = int(lag)
    part = lag - whole
    for i in range(len(p1)):
        if state[0] == 0.0:
            for k in range(BUFFER_TICKS):
                state[3 + k] = p1[i]
                state[3 + BUFFER_TICKS + k] = p2[i]
            state[0] = 1.0
        head = int(state[1])
        state[3 + head] = p1[i]
        state[3 + BUFFER_TICKS + head] = p2[i]
        near = 3 + (head - whole) % BUFFER_TICKS
        far = 3 + (head - whole - 1) % BUFFER_TICKS
        p1[i] = (1.0 - part) * state[near] + part * state[far]
        p2[i] = (1.0 - part) * state[BUFFER_TICKS + near] + part * state[BUFFER_TICKS + far]
        state[1] = float((head + 1) % BUFFER_TICKS)


def clock_drift(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """u((1 + drift) t): what a rig with a fast (drift > 0) or slow clock does with the commands; params: drift,
    whole_session. The clocks were together at the record's start, or at that of the session.

    A slow clock looks back into the buffer, MOST_TICKS at most; a fast one ahead into the block, as far as that goes:
    whole records are known to their end. Beyond it, as on the controller, which knows no later command, it extrapolates
    from the last slope, for MOST_AHEAD_TICKS.
    """
    last = len(p1) - 1
    for i in range(last + 1):
        if state[2] == 0.0:
            for k in range(BUFFER_TICKS):
                state[3 + k] = p1[i]
                state[3 + BUFFER_TICKS + k] = p2[i]
            state[2] = 1.0
        head = int(state[1])
        state[3 + head] = p1[i]
        state[3 + BUFFER_TICKS + head] = p2[i]
        lag = min(-params[0] * state[0] / dt_s, MOST_TICKS)
        ahead = math.floor(-lag)
        if 0 <= ahead < last - i:
            part = -lag - ahead
            k = i + int(ahead)
            p1[i] = (1.0 - part) * p1[k] + part * p1[k + 1]
            p2[i] = (1.0 - part) * p2[k] + part * p2[k + 1]
        else:
            lag = max(lag, -MOST_AHEAD_TICKS)
            whole = max(math.floor(lag), 0)
            part = lag - whole
            near = 3 + (head - whole) % BUFFER_TICKS
            far = 3 + (head - whole - 1) % BUFFER_TICKS
            p1[i] = (1.0 - part) * state[near] + part * state[far]
            p2[i] = (1.0 - part) * state[BUFFER_TICKS + near] + part * state[BUFFER_TICKS + far]
        state[1] = float((head + 1) % BUFFER_TICKS)
        state[0] += dt_s


def lost_samples(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """A sample is the one before it again, with the given probability; params: probability, seed."""
    for i in range(len(y)):
        if state[0] == 0.0:
            state[0] = 1.0
            state[1] = (abs(params[1]) * 69621.0 + 1.0) % RANDOM_MODULUS
            state[2] = y[i]
        state[1] = state[1] * RANDOM_FACTOR % RANDOM_MODULUS
        if state[1] / RANDOM_MODULUS < params[0]:
            y[i] = state[2]
        else:
            state[2] = y[i]

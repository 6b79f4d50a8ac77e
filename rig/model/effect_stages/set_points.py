"""What a set-point goes through ahead of a regulator's controller: a ramp, a signal volume; block stages as in
`timing`.

They stand on the commands, and the regulators then follow what they leave. State: whether it runs, and what is left of
both set-points, with how fast they go.
"""

import math
from collections.abc import Sequence

from rig.model.effect_stages.valve import behind_throttle
from rig.model.slots import Values

SET, RATE = 1, 3
"""Places in the state, of both valves each."""
SET_POINT_STATE = 5
SETTLES = 4.0
"""Ticks in which a ramp with brakes goes the last bit at least: else it would swing about its end."""


def _begun(p1: Values, p2: Values, state: Values) -> None:
    """Both set-points where they are first."""
    if state[0] == 0.0:
        state[0], state[SET], state[SET + 1] = 1.0, p1[0], p2[0]


def set_point_ramp(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """A regulator's program moves its set-point at a limited rate; params: rate_mpa_s, brakes_s.

    brakes_s above 0: the rate changes at a limited pace as well, so that this long passes until it is reached, and it
    brakes in time (profile generator of a motion controller).
    """
    _begun(p1, p2, state)
    for i in range(len(p1)):
        for valve in range(2):
            off = (p1[i] if valve == 0 else p2[i]) - state[SET + valve]
            if params[1] > 0.0:
                change = params[0] / params[1]
                most = min(params[0], math.sqrt(2.0 * change * abs(off)), abs(off) / (SETTLES * dt_s))
                wanted = math.copysign(most, off) - state[RATE + valve]
                state[RATE + valve] += min(max(wanted, -change * dt_s), change * dt_s)
            else:
                state[RATE + valve] = min(max(off / dt_s, -params[0]), params[0])
            state[SET + valve] += dt_s * state[RATE + valve]
        p1[i], p2[i] = state[SET], state[SET + 1]


def signal_volume(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """A pneumatic signal fills a volume behind a restriction, whose flow is turbulent when much is missing; params:
    signal_s, turbulent_mpa_s."""
    _begun(p1, p2, state)
    for i in range(len(p1)):
        for valve in range(2):
            now = p1[i] if valve == 0 else p2[i]
            if params[0] > 0.0:
                now = behind_throttle(state[SET + valve], now, params[0], params[1], dt_s)
            state[SET + valve] = now
        p1[i], p2[i] = state[SET], state[SET + 1]

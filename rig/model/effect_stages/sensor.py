"""Effects of the angle sensor and its converter; block stages as in `timing`."""

import math
from collections.abc import Sequence

from rig.model.effect_stages.low_pass import through_poles
from rig.model.effect_stages.timing import RANDOM_FACTOR, RANDOM_MODULUS
from rig.model.slots import Values

SENSOR_POLES = 8
"""Most poles of a filter behind the joint."""


def sensor_gain(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """y = (1 + gain) y; params: gain."""
    for i in range(len(y)):
        y[i] *= 1.0 + params[0]


def sensor_offset(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """y = y + offset; params: offset_deg."""
    for i in range(len(y)):
        y[i] += params[0]


def sensor_drift(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """The zero wanders steadily; params: rate_deg_min, whole_session."""
    for i in range(len(y)):
        y[i] += params[0] * state[0] / 60.0
        state[0] += dt_s


def slipping_sensor(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """The zero wanders as the joint moves, by a share of the way that it goes either way: a potentiometer that slips on
    its shaft, an encoder that loses counts in one direction; params: share."""
    for i in range(len(y)):
        now = y[i]
        if state[0] != 0.0:
            state[2] += params[0] * abs(now - state[1])
        state[0], state[1] = 1.0, now
        y[i] = now + state[2]


def sensor_nonlinearity(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """y + slope y + square y^2 / scale + cube y^3 / scale^2; params: square, cube, scale_deg, slope."""
    for i in range(len(y)):
        share = y[i] / params[2]
        y[i] *= 1.0 + params[3] + params[0] * share + params[1] * share * share


def sensor_lag(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """A low pass of as many equal poles as `poles`, whose time constants sum to tau: one for an RC filter, about three
    for a moving mean of samples, more for several in a row, which is nearly a dead time; params: tau_s, poles."""
    through_poles(y, state, 1, params[0], int(params[1]), dt_s)
    state[0] = 1.0


def quantisation(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """Only multiples of the step; params: step_deg, code (0: the nearest one, 1: the next lower one, 2: the next one
    towards zero)."""
    for i in range(len(y)):
        steps = y[i] / params[0]
        if params[1] < 0.5:
            y[i] = params[0] * math.floor(steps + 0.5)
        elif params[1] < 1.5 or steps >= 0.0:
            y[i] = params[0] * math.floor(steps)
        else:
            y[i] = params[0] * math.ceil(steps)


def mains_hum(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """A line at the mains' frequency; params: amplitude_deg, frequency_hz, phase_deg."""
    for i in range(len(y)):
        y[i] += params[0] * math.sin(2.0 * math.pi * params[1] * state[0] + params[2] * math.pi / 180.0)
        state[0] += dt_s


def sensor_noise(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """White noise, the sum of twelve uniform numbers; params: std_deg, seed."""
    for i in range(len(y)):
        if state[0] == 0.0:
            state[0] = 1.0
            state[1] = (abs(params[1]) * 69621.0 + 1.0) % RANDOM_MODULUS
        total = -6.0
        for _ in range(12):
            state[1] = state[1] * RANDOM_FACTOR % RANDOM_MODULUS
            total += state[1] / RANDOM_MODULUS
        y[i] += params[0] * total


def sensor_dropout(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """Samples that fall to a rail, in bursts of geometric length (Gilbert's channel, 1960); params: probability,
    rail_deg, burst, seed. `probability` is the share of samples at the rail, `burst` how many fall in a row in the
    mean, or more where the share asks for it: of nine in ten no fewer than nine in a row can fall."""
    up = max(1.0 - params[0], 1e-9)
    leave = min(1.0 / max(params[2], 1.0), up / max(params[0], 1e-9))
    enter = min(params[0] * leave / up, 1.0)
    for i in range(len(y)):
        if state[0] == 0.0:
            state[0] = 1.0
            state[1] = (abs(params[3]) * 69621.0 + 1234567.0) % RANDOM_MODULUS
        state[1] = state[1] * RANDOM_FACTOR % RANDOM_MODULUS
        falls = 1.0 - leave if state[2] > 0.0 else enter
        state[2] = 1.0 if state[1] / RANDOM_MODULUS < falls else 0.0
        if state[2] > 0.0:
            y[i] = params[1]

"""A low pass of equal poles, which filters of pressures and of sensors share. No numpy: it also runs on the
controller."""

import math

from rig.model.slots import Values


def through_poles(column: Values, state: Values, at: int, tau_s: float, poles: int, dt_s: float) -> None:
    """The column behind `poles` equal poles whose time constants sum to tau, in place; exact for a course that runs
    straight from sample to sample, so that the same tau lags by as much at every sample time.

    state[0] says whether it runs, which the caller sets; from `at` on stand each pole's value and its last input.
    """
    tau = max(tau_s / poles, 1e-9)
    keep = math.exp(-dt_s / tau)
    new = 1.0 - (1.0 - keep) * tau / dt_s
    for pole in range(poles):
        here = at + 2 * pole
        if state[0] == 0.0:
            state[here], state[here + 1] = column[0], column[0]
        for i in range(len(column)):
            state[here] = keep * state[here] + new * column[i] + (1.0 - keep - new) * state[here + 1]
            state[here + 1] = column[i]
            column[i] = state[here]

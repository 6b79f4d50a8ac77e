"""The nominal stages of the chain: regulators, Bouc-Wen and modified Bouc-Wen muscles, joint, sensor.

Each is a plain function of the form described in `rig.model.slots`; this file imports neither numpy nor numba, so that
the same code runs tick by tick on the controller and compiled over whole records. Effects that the nominal chain leaves
out are in `rig.model.effect_stages`. The two stages that every rig has choose by comparison: in pure Python `min` and
`max` cost more than all their arithmetic.
"""

import math
from collections.abc import Sequence

from rig.model.equations.drive import mean_pressure_factor
from rig.model.slots import Values

OUTPUT_LIMIT = 1e6
"""A muscle's output is held within this many of its units: a diverging parameter set stays finite, and is found out."""


def regulators(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """Two pressure regulators: gain, offset, first-order lag and a limit of the flow, both apart for filling and
    exhausting.

    dp/dt = clip((gain p_cmd + offset - p) / tau, -exhaust_limit, fill_limit), exact between ticks for a held set-point;
    while it exhausts, tau is exhaust_ratio times as long.
    params, for regulator 1 then 2: gain, offset_mpa, tau_s, fill_limit_mpa_per_s, exhaust_limit_mpa_per_s,
    exhaust_ratio.
    state: started, p1, p2. The first tick starts settled at its set-points.
    """
    fills1, exhausts1 = 1.0 - math.exp(-dt_s / params[2]), 1.0 - math.exp(-dt_s / (params[5] * params[2]))
    fills2, exhausts2 = 1.0 - math.exp(-dt_s / params[8]), 1.0 - math.exp(-dt_s / (params[11] * params[8]))
    if state[0] == 0.0:
        state[0] = 1.0
        state[1] = params[0] * p1[0] + params[1]
        state[2] = params[6] * p2[0] + params[7]
    most1, least1, most2, least2 = params[3] * dt_s, -params[4] * dt_s, params[9] * dt_s, -params[10] * dt_s
    for k in range(len(p1)):
        away = params[0] * p1[k] + params[1] - state[1]
        move = (exhausts1 if away < 0.0 else fills1) * away
        state[1] += least1 if move < least1 else most1 if move > most1 else move
        away = params[6] * p2[k] + params[7] - state[2]
        move = (exhausts2 if away < 0.0 else fills2) * away
        state[2] += least2 if move < least2 else most2 if move > most2 else move
        p1[k] = state[1]
        p2[k] = state[2]


def modified_bouc_wen(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """Modified Bouc-Wen model, eqs. (10) and (11) of the paper; with xi2 = phi2 = beta2 = 0 the discrete Bouc-Wen model
    (8), (9).

    theta_k = (u_k - lambda2 u_{k-1}) / divisor, nu_k = |u_k - u_{k-1}|,
    y_k = lambda1 y_{k-1} + (xi1 + xi2 nu_k) theta_k
          - (phi1 + phi2 nu_k) |theta_k| y_{k-1} - (beta1 + beta2 nu_k) theta_k |y_{k-1}|.
    u = (p1 - p2) / u_unit, scaled by (2 p0 / (p1 + p2))^mean_exponent; the angle is y * y_unit.
    params: lambda1, lambda2, xi1, xi2, phi1, phi2, beta1, beta2, theta_divisor_s, u_unit_mpa, y_unit_deg,
    mean_exponent, p0_mpa.
    state: started, u_{k-1}, y_{k-1}. The first tick starts at rest under its input.
    """
    lambda1, lambda2, xi1, xi2 = params[0], params[1], params[2], params[3]
    phi1, phi2, beta1, beta2 = params[4], params[5], params[6], params[7]
    per_divisor, per_unit, y_unit = 1.0 / params[8], 1.0 / params[9], params[10]
    exponent, p0 = params[11], params[12]
    for k in range(len(p1)):
        u = (p1[k] - p2[k]) * per_unit
        if exponent != 0.0:
            u *= mean_pressure_factor(p1[k], p2[k], p0, exponent)
        if state[0] == 0.0:
            state[0] = 1.0
            state[1] = u
            y[k] = state[2] * y_unit
            continue
        nu = abs(u - state[1])
        theta = (u - lambda2 * state[1]) * per_divisor
        last = state[2]
        now = (
            lambda1 * last
            + (xi1 + xi2 * nu) * theta
            - (phi1 + phi2 * nu) * abs(theta) * last
            - (beta1 + beta2 * nu) * theta * abs(last)
        )
        now = -OUTPUT_LIMIT if now < -OUTPUT_LIMIT else OUTPUT_LIMIT if now > OUTPUT_LIMIT else now
        state[1] = u
        state[2] = now
        y[k] = now * y_unit


def bouc_wen(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """Continuous Bouc-Wen model (1) for any n >= 1; n = 1, k = 1, rho = 0 is eq. (3).

    y = rho k u + (1 - rho) k w, w' = eps u' - psi |u'| |w|^(n-1) w - gamma u' |w|^n. It does not depend on the rate, so
    the time drops out: dw/du is integrated over the change of u in each tick, Runge-Kutta 4 in steps of at most 0.05
    units.
    params: rho, k, eps, psi, gamma, n, u_unit_mpa, y_unit_deg. state: started, u_{k-1}, w_{k-1}.
    """
    rho, gain, eps, psi, gamma, power = params[0], params[1], params[2], params[3], params[4], params[5]
    for k in range(len(p1)):
        u = (p1[k] - p2[k]) / params[6]
        if state[0] == 0.0:
            state[0] = 1.0
            state[1] = u
        steps = max(1, math.ceil(abs(u - state[1]) / 0.05))
        du = (u - state[1]) / steps
        w = state[2]
        for _ in range(steps):
            total, at = 0.0, w
            for weight, reach in ((1.0, 0.5), (2.0, 0.5), (2.0, 1.0), (1.0, 0.0)):
                change = eps * du - abs(at) ** (power - 1.0) * (psi * abs(du) * at + gamma * du * abs(at))
                total += weight * change
                at = min(max(w + reach * change, -OUTPUT_LIMIT), OUTPUT_LIMIT)
            w = min(max(w + total / 6.0, -OUTPUT_LIMIT), OUTPUT_LIMIT)
        state[1] = u
        state[2] = w
        y[k] = (rho * gain * u + (1.0 - rho) * gain * w) * params[7]


def second_order_joint(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """Inertia on the springs of the muscles: y'' = omega^2 (y_in - y) - 2 zeta omega y', exact for an input held over a
    tick.

    params: omega_rad_per_s, damping (zeta, below 1). state: started, angle, speed in deg/s.
    """
    omega, zeta = params[0], params[1]
    damped = omega * math.sqrt(1.0 - zeta * zeta)
    decay = math.exp(-zeta * omega * dt_s)
    cosine, sine = decay * math.cos(damped * dt_s), decay * math.sin(damped * dt_s)
    if state[0] == 0.0:
        state[0] = 1.0
        state[1] = y[0]
    for k in range(len(y)):
        gap = state[1] - y[k]
        speed = state[2]
        state[1] = y[k] + cosine * gap + sine * (speed + zeta * omega * gap) / damped
        state[2] = cosine * speed - sine * (zeta * omega * speed + omega * omega * gap) / damped
        y[k] = state[1]


def affine_sensor(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """A sensor with gain and offset. params: gain, offset_deg. No state."""
    for k in range(len(y)):
        y[k] = params[0] * y[k] + params[1]

"""The models that identification starts from: which parameters are free, and the bounds of the search.

The bounds follow from what the model must do, not from one rig. With the gain g (degrees per unit of u), theta's
divisor D and the sample time Ts, a constant u gives y = xi (1 - lambda2) u / (D (1 - lambda1)), so xi is of the order g
D; phi theta and beta theta are decays per tick of the order 1, so phi and beta are of the order D; and the second
parameters of (11) count per change of u in a tick, which is of the order Ts / 0.2 s.
"""

from dataclasses import dataclass

import numpy as np

from rig.conditions import commanded_rest
from rig.config import suggest
from rig.errors import ModelError
from rig.identify.records.rest import REST_DIGITS, measured_rest
from rig.identify.response.response_fit import MOST_EXPONENT
from rig.model.parameters import KINDS, Input, Model, MuscleModel, Parameter, StageKind, StageModel
from rig.record import Record

_LEAK = {"lambda1": (0.005, 0.1), "lambda2": (0.02, 1.0)}
"""1 - lambda at a sample time of 5 ms: the first must not integrate without end, the second not cancel u."""
_BOUNDS_AT_S = 0.005
"""Sample time (s) at which the bounds per tick are written; at another one they are scaled to it."""
_GAIN_DEG = 40.0
"""g of the paper's rig, deg per unit of u: where no record moves both command and angle."""
_P0_MPA = 0.2
"""The paper's."""
_COMMANDED_DIGITS = 6
"""A commanded P0 is kept to 1 Pa: what is left is the rounding of its set-points."""
_XI, _PHI = 2.0, 2.0
_XI2, _PHI2 = 20.0, 50.0
"""Bounds of xi1 / (g D), phi1 / D, xi2 / (g D), phi2 / D, the last two at a sample time of 5 ms."""
_CONTINUOUS = {"rho": (0.0, 1.0), "eps": (0.0, 5.0), "psi": (-5.0, 5.0), "gamma": (-5.0, 5.0), "n": (1.0, 3.0)}
"""Bounds of the continuous Bouc-Wen model (1), without unit; that of k follows from g."""
_UNITS_OF = {"theta_divisor_s": "s", "u_unit_mpa": "MPa", "y_unit_deg": "deg"}
_JOINT_BOUNDS = {"omega_rad_per_s": (5.0, 200.0, "rad/s"), "damping": (0.01, 0.99, "1")}
"""Bounds of a joint with inertia: 0.8 to 32 Hz, and any damping short of critical."""


@dataclass(frozen=True)
class Template:
    """What kind of model to identify."""

    kind: str = StageKind.MBW
    drive: Input = Input.COMMAND
    sample_time_s: float = _BOUNDS_AT_S
    p0_mpa: float = _P0_MPA
    u_unit_mpa: float = 0.2
    joint: str = StageKind.RIGID
    free_offset: bool = False
    """The sensor's zero is not known: identify an offset of the angle."""
    mean_exponent: float | None = 0.0
    """How the mean pressure counts: 0 only the difference (the paper), 1 the difference over the mean; None to identify
    it."""


def template_model(template: Template, gain_deg: float = _GAIN_DEG) -> Model:
    """A model with free parameters in the middle of their bounds; ModelError for a kind that does not exist.

    `gain_deg` is g, see `input_gain`; its sign is that of the rig's.
    """
    for slot, kind in (("muscle", template.kind), ("joint", template.joint)):
        if kind not in KINDS[slot]:
            raise ModelError(f"{slot} kind {kind!r}: {suggest(kind, list(map(str, KINDS[slot])))}")
    fixed = {
        "theta_divisor_s": template.sample_time_s,
        "u_unit_mpa": template.u_unit_mpa,
        "y_unit_deg": 1.0,
    } | ({} if template.mean_exponent is None else {"mean_exponent": template.mean_exponent})
    bounds = _muscle_bounds(template, gain_deg) | {"mean_exponent": (0.0, MOST_EXPONENT)}
    muscle = {
        name: Parameter(fixed[name], _UNITS_OF.get(name, "1")) if name in fixed else _free(*bounds[name])
        for name in KINDS["muscle"][template.kind]
    }
    joint = {
        name: _free(low, high, unit)
        for name, (low, high, unit) in _JOINT_BOUNDS.items()
        if template.joint == StageKind.SECOND_ORDER
    }
    offset = {"gain": Parameter(1.0), "offset_deg": Parameter(0.0, "deg", -abs(gain_deg), abs(gain_deg), free=True)}
    return Model(
        muscle=MuscleModel(template.kind, muscle, template.drive),
        sample_time_s=template.sample_time_s,
        p0_mpa=template.p0_mpa,
        joint=StageModel(template.joint, joint),
        sensor=StageModel(StageKind.AFFINE, offset) if template.free_offset else StageModel(StageKind.IDEAL),
    )


def input_gain(records: list[Record], u_unit_mpa: float) -> float:
    """g: degrees peak to peak per unit of the commanded u, the largest of the records; negative where the angle falls
    with it."""
    gains = [0.0]
    for record in records:
        if record.angle_deg is None or len(record) < 2:
            continue
        known = np.isfinite(record.angle_deg) & np.isfinite(record.dp_cmd_mpa)
        dp, angle = record.dp_cmd_mpa[known], record.angle_deg[known]
        if len(dp) and np.ptp(dp) > 0:
            # sums over time: in a fast sweep the angle lags by more than a quarter turn, only its slow part has the
            # sign
            sign = np.sign(np.dot(np.cumsum(dp - dp.mean()), np.cumsum(angle - angle.mean())))
            gains.append(float(sign * np.ptp(angle) / np.ptp(dp)) * u_unit_mpa)
    return max(gains, key=abs) or _GAIN_DEG


def template_rest(records: list[Record]) -> float:
    """P0 (MPa) of a template: of the first record that says its own, else that of the first by its measured pressures,
    else the paper's."""
    for rest, digits in ((commanded_rest, _COMMANDED_DIGITS), (measured_rest, REST_DIGITS)):
        for record in records:
            if (found := rest(record)) is not None:
                return round(found, digits)
    return _P0_MPA


def _muscle_bounds(template: Template, gain_deg: float) -> dict[str, tuple[float, float]]:
    divisor, ticks = template.sample_time_s, template.sample_time_s / _BOUNDS_AT_S
    scale = gain_deg * divisor
    bounds = {name: (max(0.0, 1.0 - high * ticks), 1.0 - low * ticks) for name, (low, high) in _LEAK.items()}
    xi = (min(0.0, _XI * scale), max(0.0, _XI * scale))
    if template.kind == StageKind.BW:
        return bounds | {"xi": xi, "psi": _both(_PHI * divisor), "beta": _both(_PHI * divisor)}
    if template.kind == StageKind.BW_CONTINUOUS:
        return _CONTINUOUS | {"k": (min(0.0, 2.0 * gain_deg), max(0.0, 2.0 * gain_deg))}
    first = {"xi1": xi, "phi1": _both(_PHI * divisor), "beta1": _both(_PHI * divisor)}
    second = {
        "xi2": _both(_XI2 * abs(scale) / ticks),
        "phi2": _both(_PHI2 * divisor / ticks),
        "beta2": _both(_PHI2 * divisor / ticks),
    }
    return bounds | first | second


def _both(size: float) -> tuple[float, float]:
    return -size, size


def _free(low: float, high: float, unit: str = "1") -> Parameter:
    return Parameter(0.5 * (low + high), unit, low, high, free=True)

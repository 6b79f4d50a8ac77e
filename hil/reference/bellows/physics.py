"""Parameters of the fourth family: nominal values, the spread between units, what days bring.

No equations here. Pressures are gauge MPa unless said. Days differ by temperature and by how long the rig has run
(folds run in, seams give), each of which moves several parameters together; what moves by itself has Laplace's tails.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.random import Generator

from hil.reference.plant import PlantDay, varied

ATMOSPHERE_MPA: Final = 0.1013


class Physics(NamedTuple):
    """One healthy rig. +-0.2 MPa around 0.2 MPa turn the joint about +-40 degrees. Regulators: in the order of SMC's
    ITV, which reach a set-point within about 0.1 s."""

    main_mpa: float = 0.61
    """Absolute pressure of the main."""
    sample_s: float = 0.004
    """Period of a regulator's controller, and of the pulses of its pilot solenoids."""
    sensitive_mpa: float = 0.0005
    """Error from which on a pilot is pulsed: 0.1 % of the 0.5 MPa of full scale."""
    full_pulse_mpa: float = 0.090
    """Error at which a pilot stays open for the whole period."""
    pilot_fill_mpa_s: float = 2.6
    pilot_exhaust_mpa_s: float = 2.3
    """Rates of the pilot chamber, held open: from the main, choked; to the atmosphere from 0.3 MPa absolute."""
    pilot_ratio_2: float = 1.0
    crack_mpa: float = 0.0008
    """Difference over the diaphragm from which on a main valve opens, and at which it is fully open."""
    full_open_mpa: float = 0.04
    rub_mpa: float = 0.0012
    """Friction of the diaphragm, as a difference of pressure."""
    lift_s: float = 0.003
    fill_mpa_s: float = 4.2
    exhaust_mpa_s: float = 3.3
    """Rates of pressure with a main valve fully open: from the main, choked; from 0.3 MPa absolute."""
    outlet_share: float = 0.35
    """Volume between main valve and tube, where sensor and monitor sit, against the muscle's."""
    tube: float = 13.0
    """Flow through the tube (MPa/s) per root of the difference of the squares of absolute pressure."""
    dead_share: float = 0.12
    """Of a muscle's volume at angle zero: what does not change with its contraction."""
    pouch_n_mpa: float = 2450.0
    """Length times width of a pouch: force per pressure where cos(t) / t of its half angle t is one."""
    strength_2: float = 1.0
    length_m: float = 0.30
    contraction: float = 0.15
    """Both muscles' contraction at angle zero."""
    apart: float = 0.004
    """By how much muscle 2 hangs more contracted."""
    stretch_per_mpa: float = 0.03
    """Strain of the skin per pressure."""
    fold_n: float = 10.0
    lock_contraction: float = 0.36
    """Bending of the folds: pushes back by fold_n c / (lock - c)."""
    cam_m: float = 0.0235
    off_m: float = 0.004
    cam_rad: float = 0.25
    """Radius of the cams, how far from their centre the axis is, and in which direction."""
    passive_nm_rad: float = 0.9
    loop_n: float = 2.5
    loop_n_mpa: float = 25.0
    """Largest friction of a muscle's folds: without pressure, and per pressure."""
    loop_m: float = 0.0007
    """Scale of the strokes at which its parts let go."""
    creep: float = 0.04
    bearing_nm: float = 0.05
    oil_nm_s: float = 0.16
    inertia_kgm2: float = 0.010
    load: float = 0.03
    """Resistance of the potentiometer's track against that of what reads it."""
    wiper_deg: float = 0.05
    """By how much the wiper bends before it moves along the track."""
    track_deg: float = 0.05
    track_1_rad: float = 0.0
    track_2_rad: float = 0.0
    """Waviness of the track."""
    filter_s: float = 0.0018
    """Time constant of the angle's filter."""


_UNIT_SPREAD: Final = {
    "main_mpa": 0.03, "sample_s": 0.03, "sensitive_mpa": 0.2, "full_pulse_mpa": 0.12, "pilot_fill_mpa_s": 0.12,
    "pilot_exhaust_mpa_s": 0.12, "pilot_ratio_2": 0.06, "crack_mpa": 0.3, "full_open_mpa": 0.15, "rub_mpa": 0.3,
    "lift_s": 0.2, "fill_mpa_s": 0.12, "exhaust_mpa_s": 0.12, "outlet_share": 0.15, "tube": 0.15, "dead_share": 0.2,
    "pouch_n_mpa": 0.03, "strength_2": 0.01, "contraction": 0.02, "apart": 0.3, "stretch_per_mpa": 0.2, "fold_n": 0.25,
    "lock_contraction": 0.02, "cam_m": 0.01, "off_m": 0.1, "cam_rad": 0.3, "passive_nm_rad": 0.2, "loop_n": 0.3,
    "loop_n_mpa": 0.2, "loop_m": 0.25, "creep": 0.3, "bearing_nm": 0.3, "oil_nm_s": 0.25, "inertia_kgm2": 0.15,
    "load": 0.3, "wiper_deg": 0.3, "track_deg": 0.3, "filter_s": 0.2,
}  # fmt: skip
"""Relative standard deviation between rigs of the same build."""

_WARM: Final = {
    "loop_n": -1.2, "loop_n_mpa": -0.9, "fold_n": -1.5, "stretch_per_mpa": 1.5, "creep": 2.0, "oil_nm_s": -2.5,
    "bearing_nm": -0.8, "rub_mpa": -1.5, "pilot_fill_mpa_s": 0.4, "pilot_exhaust_mpa_s": 0.4, "tube": 0.2,
    "passive_nm_rad": -0.6,
}  # fmt: skip
"""By how many drifts a parameter moves on a day that is one drift warmer."""
_RUN_IN: Final = {
    "loop_n": -1.0, "loop_m": 0.6, "fold_n": -1.0, "contraction": 0.2, "pouch_n_mpa": -0.1, "creep": -1.0,
    "wiper_deg": 1.5, "crack_mpa": 1.0,
}  # fmt: skip
"""The same when it has run for longer."""
_OWN: Final = {
    "main_mpa": 0.8, "contraction": 0.3, "strength_2": 0.1, "apart": 4.0, "full_pulse_mpa": 0.5, "loop_n_mpa": 0.6,
    "pilot_ratio_2": 0.4, "cam_rad": 0.5,
}  # fmt: skip
"""By how many drifts it moves by itself: how the muscles were hung, the main, the solenoids."""


def draw_unit(random: Generator) -> Physics:
    """Another rig of the same build."""
    phases = dict(zip(("track_1_rad", "track_2_rad"), random.uniform(0.0, 6.283, 2).tolist(), strict=True))
    return Physics(**varied(Physics()._asdict(), _UNIT_SPREAD, random) | phases)


def draw_session(physics: Physics, drift: float, random: Generator) -> PlantDay:
    """One day. `drift`: relative standard deviation of what drifts by itself, 0.004 to 0.02."""
    scale, values = (drift / 0.004) ** 0.5, physics._asdict()
    for weights in (_WARM, _RUN_IN):
        step = drift * float(np.clip(random.standard_normal(), -2.5, 2.5))
        for name, weight in weights.items():
            values[name] *= float(np.exp(weight * step))
    for name, weight in _OWN.items():
        values[name] *= float(np.exp(weight * drift * _laplace(random)))
    bias_1, bias_2, gain_1, gain_2, offset, gain = (_laplace(random) for _ in range(6))
    return PlantDay(
        Physics(**values), 0.0006 * scale * bias_1, 0.0006 * scale * bias_2, 1.0 + 0.0012 * scale * gain_1,
        1.0 + 0.0012 * scale * gain_2, 0.09 * scale * offset, 1.0 + 0.0012 * scale * gain,
        warm=float(random.uniform(0.0, 0.4)), seed=int(random.integers(2**31)),
    )  # fmt: skip


def _laplace(random: Generator) -> float:
    """Of unit standard deviation, at most 3."""
    return float(np.clip(random.laplace(0.0, 0.5**0.5), -3.0, 3.0))

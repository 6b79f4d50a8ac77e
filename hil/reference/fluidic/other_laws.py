"""Every effect of the library by this family's own laws, and effects that no library has.

An entry turns one signed size into disturbance parameters; chance details that are no size (which valve, which phase,
how uneven) are drawn. The comment at each entry says: law here | law in the first family | law in the library.
"""

import math
from typing import Any, Final

from numpy.random import Generator

from hil.reference.effect_law import EffectLaw
from hil.reference.fluidic.disturbance import Disturbance, ReadingLaw, RigLaw, TimingLaw


def rig(**parameters: float) -> Disturbance:
    return Disturbance(rig=RigLaw(**parameters))


def timing(**parameters: float) -> Disturbance:
    return Disturbance(timing=TimingLaw(**parameters))


def reading(**parameters: float) -> Disturbance:
    return Disturbance(reading=ReadingLaw(**parameters))


def _between(random: Generator, low: float, high: float) -> float:
    return float(random.uniform(low, high))


def _one_of(random: Generator, *choices: Any) -> Any:
    return choices[int(random.integers(len(choices)))]


def _lost(size: float, random: Generator) -> Disturbance:
    return timing(lost_share=size, lost_every=_between(random, 6.0, 20.0))


def _valve_gain(size: float, random: Generator) -> Disturbance:
    return rig(gain_1=size, gain_2=size * _between(random, 0.8, 1.2), gain_bend=_between(random, -0.15, 0.15))


def _valve_offset(size: float, random: Generator) -> Disturbance:
    return rig(offset_1_mpa=size) if random.integers(2) else rig(offset_2_mpa=size)


def _asymmetry(size: float, random: Generator) -> Disturbance:
    return rig(silencer=size) if size > 0.0 else rig(inlet_filter=-size)


def _leak(size: float, random: Generator) -> Disturbance:
    return rig(**{_one_of(random, "leak_1_s", "leak_2_s"): 20.0 * size})


def _mismatch(size: float, random: Generator) -> Disturbance:
    return rig(weak_2=size) if size > 0.0 else rig(weak_1=-size)


def _co_contraction(size: float, random: Generator) -> Disturbance:
    uneven = _between(random, -0.03, 0.03)
    return rig(offset_1_mpa=size * (1.0 + uneven), offset_2_mpa=size * (1.0 - uneven))


def _heat(size: float, random: Generator) -> Disturbance:
    return rig(heat=size, heat_s=_between(random, 20.0, 45.0))


def _weight(size: float, random: Generator) -> Disturbance:
    return rig(weight_nm=size, weight_rad=_between(random, -1.2, 1.2))


def _end_stop(size: float, random: Generator) -> Disturbance:
    limit = math.radians(size)
    stops = ({"stop_high_rad": limit}, {"stop_low_rad": -limit}, {"stop_high_rad": limit, "stop_low_rad": -limit})
    return rig(**_one_of(random, *stops))


def _play(size: float, random: Generator) -> Disturbance:
    return reading(play_deg=2.0 * size, play_wave_deg=_between(random, 15.0, 30.0))


def _sensor_gain(size: float, random: Generator) -> Disturbance:
    return reading(gain=size, gain_uneven=_between(random, -0.1, 0.1))


def _bend(size: float, random: Generator) -> Disturbance:
    return reading(bend_deg=size, bend_even=_between(random, 0.0, 1.0))


def _coarse(size: float, random: Generator) -> Disturbance:
    return reading(step_deg=size, step_grip=_between(random, 0.02, 0.15))


def _hum(size: float, random: Generator) -> Disturbance:
    return reading(hum_deg=size, hum_hz=float(_one_of(random, 50.0, 60.0)))


def _dropout(size: float, random: Generator) -> Disturbance:
    return reading(
        dropout=size, dropout_run=_between(random, 1.0, 5.0), dropout_deg=float(_one_of(random, 0.0, -180.0, 180.0))
    )


OTHER_LAWS: Final[dict[str, EffectLaw]] = {
    # fixed part and exponential tail | jittering queue | fixed delay
    "delay": EffectLaw("timing", "s", 1e-3, 0.15, False, lambda size, _: timing(delay_s=size), "delay_s"),
    # corrected too little and too much in turns | settles | constant rate
    "clock_drift": EffectLaw("timing", "relative", 5e-5, 0.02, True, lambda size, _: timing(clock_rate=size), "drift"),
    # runs with the beat of two clocks | random bursts | independent repeats
    "lost_samples": EffectLaw("timing", "probability", 0.01, 0.85, False, _lost),
    # converter of the set-point, bent and uneven | sensor in the control loop | factor
    "valve_gain": EffectLaw("valve", "relative", 2e-3, 0.25, True, _valve_gain, "gain"),
    "valve_offset": EffectLaw("valve", "MPa", 2e-4, 0.04, True, _valve_offset, "offset_mpa"),
    # filter of second order on the set-point | laminar pilot | first order
    "valve_lag": EffectLaw("valve", "s", 1e-3, 0.3, False, lambda size, _: rig(filter_s=size), "tau_s"),
    # ramp in the regulator's program, faster at high pressure | choked orifice | limit of dp/dt
    "valve_slew": EffectLaw("valve", "MPa/s", 0.04, 1.5, False, lambda size, _: rig(ramp_mpa_s=size), falling=True),
    # filter cake: flow falls behind in proportion to itself | clogged orifice | two time constants
    "fill_exhaust_asymmetry": EffectLaw("valve", "ratio - 1", 0.05, 60.0, True, _asymmetry),
    # insensitive to small errors, continuous | overlap with hysteresis | hold or play of the set-point
    "valve_dead_band": EffectLaw("valve", "MPa", 1e-3, 0.08, False, lambda size, _: rig(insensitive_mpa=size),
    "width_mpa"),
    # main set too low: no flow left | relief valve that yields | sharp ceiling
    "pressure_ceiling": EffectLaw("valve", "MPa", 0.16, 0.42, False, lambda size, _: rig(supply_mpa=size),
    "ceiling_mpa", falling=True),
    # drop of a shared hose, square of the flow, at once | tank | sag in proportion to the flow
    "supply_droop": EffectLaw("valve", "MPa", 0.5, 600.0, False, lambda size, _: rig(hose_drop_mpa=size)),
    "co_contraction": EffectLaw("muscle", "MPa", 5e-4, 0.08, True, _co_contraction, "shift_mpa"),
    # pressure's force weaker, membrane as before | braid angle | factor on the pressure
    "muscle_mismatch": EffectLaw("muscle", "relative", 1e-3, 0.25, True, _mismatch),
    # laminar leak behind the hose, seen by the monitor | choked leak, or tap behind the monitor | share of the pressure
    "leak": EffectLaw("muscle", "relative", 1e-3, 0.6, False, _leak),
    # length creeps with the stroke, faster under pressure | relaxing springs | one low pass
    "creep": EffectLaw("muscle", "relative", 0.003, 0.9, False, lambda size, _: rig(creep=size)),
    # heat of the motion | warming towards an end | straight line
    "thermal_drift": EffectLaw("muscle", "relative", 0.005, 0.5, True, _heat),
    # stick and slip (Karnopp), growing with the bearing's load | LuGre | play of fixed width
    "coulomb_friction": EffectLaw("joint", "N m", 0.01, 8.0, False, lambda size, _: rig(dry_nm=size)),
    # shock absorber, with the square of the speed | shear-thinning grease | proportional to speed
    "viscous_friction": EffectLaw("joint", "N m s/rad", 0.03, 12.0, False, lambda size, _: rig(damper_nm_s=size)),
    # arm that folds | mass | linear second order
    "inertia": EffectLaw("joint", "kg m2", 1e-3, 0.3, False, lambda size, _: rig(arm_kgm2=size)),
    # rope over a cam | sine | sine
    "gravity_load": EffectLaw("joint", "N m", 0.02, 10.0, True, _weight),
    # gear whose clearance waves | soft coupling, wider where worn | play operator
    "backlash": EffectLaw("joint", "deg", 0.01, 6.0, False, _play, "width_deg"),
    # air cushion | Hunt-Crossley buffer | clipped angle
    "end_stop": EffectLaw("joint", "deg", 4.0, 44.0, False, _end_stop, falling=True),
    # other gain on either side | cubic bend | factor
    "sensor_gain": EffectLaw("sensor", "relative", 1e-3, 0.25, True, _sensor_gain, "gain"),
    "sensor_offset": EffectLaw("sensor", "deg", 0.03, 8.0, True, lambda size, _: reading(offset_deg=size),
    "offset_deg"),
    # becomes faster | settles | straight line
    "sensor_drift": EffectLaw("sensor", "deg/min", 0.2, 40.0, True, lambda size, _: reading(drift_deg_min=size),
    "rate_deg_min"),
    # odd and even square | eccentric disc | square and cube
    "sensor_nonlinearity": EffectLaw("sensor", "deg", 0.1, 12.0, True, _bend),
    # moving mean | two or three poles | one pole
    "sensor_lag": EffectLaw("sensor", "s", 1e-3, 0.2, False, lambda size, _: reading(window_s=2.0 * size), "tau_s"),
    # even codes that hold on to the angle | uneven converter | even rounding
    "quantisation": EffectLaw("sensor", "deg", 0.12, 10.0, False, _coarse, "step_deg"),
    # second harmonic, wandering phase | third harmonic, swelling | sine
    "mains_hum": EffectLaw("sensor", "deg", 0.02, 4.0, False, _hum),
    # bounded, stronger at high frequency | heavy tails | white and normal
    "sensor_noise": EffectLaw("sensor", "deg", 0.02, 4.0, False, lambda size, _: reading(noise_deg=size), "std_deg"),
    # random runs at zero or a rail | bursts with recovery | independent samples
    "sensor_dropout": EffectLaw("sensor", "probability", 1e-4, 0.2, False, _dropout, "probability"),
}  # fmt: skip


def _beat(size: float, random: Generator) -> Disturbance:
    return timing(beat_s=size, beat_hz=_between(random, 0.3, 1.5))


def _snap(size: float, random: Generator) -> Disturbance:
    return rig(snap=size, snap_mpa=_between(random, 0.18, 0.24))


def _detent(size: float, random: Generator) -> Disturbance:
    return rig(detent_nm=size, detent_rad=_between(random, -0.2, 0.2))


def _rubbing(size: float, random: Generator) -> Disturbance:
    return rig(rub_nm=size, rub_rad=_between(random, 0.0, 0.2))


def _ripple(size: float, random: Generator) -> Disturbance:
    return reading(ripple_deg=size, ripple_per_deg=1.0 / _between(random, 7.0, 14.0))


FOREIGN: Final[dict[str, EffectLaw]] = {
    "delay_beat": EffectLaw("timing", "s", 2e-3, 0.25, False, _beat),
    "spool_stiction": EffectLaw("valve", "share", 0.01, 1.0, False, lambda size, _: rig(stiction=size)),
    "bladder_snap": EffectLaw("muscle", "share", 0.003, 0.5, False, _snap),
    "mesh_lockup": EffectLaw("muscle", "kN", 0.05, 60.0, False, lambda size, _: rig(lockup=size)),
    "detent": EffectLaw("joint", "N m", 0.02, 6.0, False, _detent),
    "rubbing_cable": EffectLaw("joint", "N m", 0.05, 12.0, False, _rubbing),
    "interpolation_ripple": EffectLaw("sensor", "deg", 0.05, 8.0, False, _ripple),
}
"""Effects that no library has, of every stage; none of them is one of the first family's."""

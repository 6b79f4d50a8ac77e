"""Every effect of the library as another law: what the blind check switches on in the physics plant.

An entry turns one signed size into the plant's disturbance parameters; chance details that are no size (which valve,
which phase, how uneven) are drawn. The comment at each entry says which law stands here against which one in the
library.
"""

import math
from typing import Final

from numpy.random import Generator

from hil.reference.disturbance import Disturbance, setter
from hil.reference.effect_law import (
    EffectLaw,
    between,
    both_offsets,
    known,
    one_of,
    one_offset,
    sized,
    stops,
    uneven_gains,
)
from hil.reference.mckibben.disturbance import HEALTHY

timing, rig, reading = (setter(HEALTHY, place) for place in ("timing", "rig", "reading"))


def _slew(size: float, _: Generator) -> Disturbance:
    return rig(orifice_fill=size, orifice_exhaust=size, keep_bandwidth=1.0)


def _asymmetry(size: float, _: Generator) -> Disturbance:
    clogged = 1.0 / (1.0 + abs(size))
    return rig(orifice_exhaust=clogged) if size > 0.0 else rig(orifice_fill=clogged)


def _leak(size: float, random: Generator) -> Disturbance:
    name = one_of(random, "leak_1_s", "leak_2_s", "tap_1", "tap_2")
    return rig(**{name: size * (22.0 if name.startswith("leak") else 1.0)})


def _mismatch(size: float, _: Generator) -> Disturbance:
    return rig(braid_1=-0.25 * size, braid_2=0.25 * size)


def _sensor_drift(size: float, random: Generator) -> Disturbance:
    tau_s = between(random, 20.0, 60.0)
    return reading(drift_deg=size / 60.0 * 20.0 / (1.0 - math.exp(-20.0 / tau_s)), drift_s=tau_s)


OTHER_LAWS: Final[dict[str, EffectLaw]] = dict((
    # jittering queue | fixed delay
    known("delay", 1e-3, 0.15, sized(timing, "delay_s", delay_spread=(0.05, 0.2))),
    # drift that settles as the clock warms up | constant rate
    known("clock_drift", 5e-5, 0.02, sized(timing, "clock_rate")),
    # bursts of repeated packets, whole or angle only | independent repeats
    known("lost_samples", 0.01, 0.85, sized(timing, "repeat", repeat_run=(1.0, 4.0), repeat_all=[0.0, 1.0])),
    # bent, uneven pressure sensors inside the control loop | gain on the set-point
    known("valve_gain", 2e-3, 0.25, uneven_gains(rig)),
    known("valve_offset", 2e-4, 0.04, one_offset(rig)),
    # laminar filling of a pilot chamber | linear first order
    known("valve_lag", 1e-3, 0.3, sized(rig, "pilot_s")),
    # choked orifice behind a spool of unchanged bandwidth | limit of dp/dt
    known("valve_slew", 0.03, 0.9, _slew, "orifice"),
    # one of two orifices clogged | two time constants
    known("fill_exhaust_asymmetry", 0.05, 12.0, _asymmetry),
    # spool overlap: opens late, closes late (hysteretic hold) | dead-band
    known("valve_dead_band", 1e-3, 0.06, sized(rig, "overlap_mpa")),
    # relief valve that yields to the regulator | sharp ceiling
    known("pressure_ceiling", 0.16, 0.40, sized(rig, "relief_mpa")),
    # tank refilled through a restriction | sag in proportion to the flow, at once
    known("supply_droop", 0.5, 60.0, sized(rig, "tank"), "ratio"),
    known("co_contraction", 5e-4, 0.08, both_offsets(rig)),
    # braid angle: strength with another force law | factor on the pressure
    known("muscle_mismatch", 1e-3, 0.25, _mismatch),
    # choked leak against the regulator, or tap with a quadratic drop behind the monitor | share of the pressure
    known("leak", 1e-3, 0.2, _leak),
    # four relaxing springs, 0.3 to 30 s | one low pass
    known("creep", 0.003, 0.9, sized(rig, "relaxing")),
    # warming towards an end, rubber softens and force sinks | straight line
    known("thermal_drift", 0.005, 0.35, sized(rig, "warm_up", warm_up_s=(20.0, 45.0))),
    # LuGre with Stribeck | play of fixed width
    known("coulomb_friction", 0.01, 8.0, sized(rig, "lugre_nm")),
    # shear-thinning grease | proportional to speed
    known("viscous_friction", 0.03, 12.0, sized(rig, "grease_nm_s")),
    # mass inside the non-linear joint | linear second order
    known("inertia", 1e-3, 1.2, sized(rig, "inertia_kgm2")),
    known("gravity_load", 0.02, 10.0, sized(rig, "gravity_nm", gravity_rad=(-1.2, 1.2))),
    # muscles and springs stronger, friction and mass as before
    known("stiffness", 0.02, 0.7, sized(rig, "stiff")),
    # worn coupling that pulls softly, wider where worn | play operator
    known("backlash", 0.01, 6.0, sized(reading, "play_deg", 2.0, play_spread=(0.0, 0.3))),
    # Hunt-Crossley buffer | clipped angle
    known("end_stop", 6.0, 44.0, stops(rig)),
    known("sensor_gain", 1e-3, 0.25, sized(reading, "gain", gain_bend=(-0.1, 0.1))),
    known("sensor_offset", 0.03, 8.0, sized(reading, "offset_deg")),
    # drift that settles | straight line
    known("sensor_drift", 0.2, 40.0, _sensor_drift),
    # eccentric disc | square and cube
    known("sensor_nonlinearity", 0.1, 12.0, sized(reading, "bend_deg", bend_rad=(0.0, 2.0 * math.pi))),
    # two or three poles | one pole
    known("sensor_lag", 1e-3, 0.2, sized(reading, "lag_s", lag_poles=[2, 3])),
    # uneven converter | even rounding
    known("quantisation", 0.12, 10.0, sized(reading, "step_deg", step_uneven=(0.05, 0.2))),
    # swelling line with third harmonic | sine
    known("mains_hum", 0.02, 4.0, sized(reading, "hum_deg", hum_hz=[50.0, 60.0])),
    # heavy tails, stronger when moving | white and normal
    known("sensor_noise", 0.02, 4.0, sized(reading, "noise_deg")),
    # bursts (Gilbert) that fall to one value and come back within a few samples | independent samples
    known("sensor_dropout", 1e-4, 0.2, sized(reading, "dropout", dropout_run=(1.0, 4.0), dropout_deg=[0.0, -172.5])),
))  # fmt: skip


def _hose(size: float, random: Generator) -> Disturbance:
    return rig(hose_hz=3.0 / size, hose_damping=between(random, 0.08, 0.15))


def _jam(size: float, random: Generator) -> Disturbance:
    every_s, start_s = between(random, 2.5, 6.0), between(random, 0.5, 2.5)
    return rig(jam_nm=25.0, jam_length_s=size, jam_every_s=every_s, jam_start_s=start_s)


def _cogging(size: float, random: Generator) -> Disturbance:
    return rig(cog_nm=size, cog_per_rad=2.0 * math.pi / math.radians(between(random, 9.0, 16.0)))


def _dead_spot(size: float, random: Generator) -> Disturbance:
    middle = between(random, -12.0, 12.0)
    return reading(dead_low_deg=middle - 0.5 * size, dead_high_deg=middle + 0.5 * size)


FOREIGN: Final[dict[str, EffectLaw]] = {
    "command_stall": EffectLaw("timing", "s", 0.01, 0.8, False, sized(timing, "stall_s", stall_every_s=(1.5, 4.0))),
    "hose_ringing": EffectLaw("valve", "3 Hz / f", 0.12, 2.2, False, _hose),
    "valve_hunting": EffectLaw("valve", "MPa", 5e-4, 0.05, False, sized(rig, "hunt_mpa", hunt_hz=(1.3, 4.5))),
    "bladder_threshold": EffectLaw("muscle", "MPa", 1e-3, 0.09, False, sized(rig, "threshold_mpa")),
    "bladder_kink": EffectLaw(
        "muscle", "share", 0.005, 0.5, True, sized(rig, "notch", notch_rad=(-0.25, 0.25), notch_width_rad=(0.05, 0.09))
    ),
    "cogging": EffectLaw("joint", "N m", 0.03, 3.0, False, _cogging),
    "brake_grabs": EffectLaw("joint", "s", 0.015, 1.5, False, _jam),
    "foreign_push": EffectLaw("joint", "N m", 0.02, 6.0, False, sized(rig, "push_nm", push_hz=(1.1, 3.7))),
    "worn_track": EffectLaw("sensor", "deg", 0.4, 25.0, False, _dead_spot),
}
"""Effects that no library has, of every stage."""

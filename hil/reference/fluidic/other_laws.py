"""Every effect of the library by this family's own laws, and effects that no library has.

An entry turns one signed size into disturbance parameters; chance details that are no size (which valve, which phase,
how uneven) are drawn. The comment at each entry says: law here | law in the first family | law in the library.
"""

from typing import Final

from numpy.random import Generator

from hil.reference.disturbance import Disturbance, setter
from hil.reference.effect_law import (
    EffectLaw,
    between,
    both_offsets,
    by_sign,
    known,
    one_leak,
    one_offset,
    sized,
    stops,
    uneven_gains,
)
from hil.reference.fluidic.disturbance import HEALTHY

timing, rig, reading = (setter(HEALTHY, place) for place in ("timing", "rig", "reading"))


OTHER_LAWS: Final[dict[str, EffectLaw]] = dict((
    # fixed part and exponential tail | jittering queue | fixed delay
    known("delay", 1e-3, 0.15, sized(timing, "delay_s")),
    # corrected too little and too much in turns | settles | constant rate
    known("clock_drift", 5e-5, 0.02, sized(timing, "clock_rate")),
    # runs with the beat of two clocks | random bursts | independent repeats
    known("lost_samples", 0.01, 0.85, sized(timing, "lost_share", lost_every=(6.0, 20.0))),
    # converter of the set-point, bent and uneven | sensor in the control loop | factor
    known("valve_gain", 2e-3, 0.25, uneven_gains(rig)),
    known("valve_offset", 2e-4, 0.04, one_offset(rig)),
    # filter of second order on the set-point | laminar pilot | first order
    known("valve_lag", 1e-3, 0.3, sized(rig, "filter_s")),
    # ramp in the regulator's program, faster at high pressure | choked orifice | limit of dp/dt
    known("valve_slew", 0.04, 1.5, sized(rig, "ramp_mpa_s")),
    # filter cake: flow falls behind in proportion to itself | clogged orifice | two time constants
    known("fill_exhaust_asymmetry", 0.05, 60.0, by_sign(rig, "silencer", "inlet_filter")),
    # insensitive to small errors, continuous | overlap with hysteresis | hold or play of the set-point
    known("valve_dead_band", 1e-3, 0.08, sized(rig, "insensitive_mpa")),
    # main set too low: no flow left | relief valve that yields | sharp ceiling
    known("pressure_ceiling", 0.16, 0.42, sized(rig, "supply_mpa")),
    # drop of a shared hose, square of the flow, at once | tank | sag in proportion to the flow
    known("supply_droop", 0.5, 600.0, sized(rig, "hose_drop_mpa")),
    known("co_contraction", 5e-4, 0.08, both_offsets(rig)),
    # pressure's force weaker, membrane as before | braid angle | factor on the pressure
    known("muscle_mismatch", 1e-3, 0.25, by_sign(rig, "weak_2", "weak_1")),
    # laminar leak behind the hose, seen by the monitor | choked leak, or tap behind the monitor | share of the pressure
    known("leak", 1e-3, 0.6, one_leak(rig, ("leak_1_s", "leak_2_s"), 20.0)),
    # length creeps with the stroke, faster under pressure | relaxing springs | one low pass
    known("creep", 0.003, 0.9, sized(rig, "creep")),
    # heat of the motion | warming towards an end | straight line
    known("thermal_drift", 0.005, 0.5, sized(rig, "heat", heat_s=(20.0, 45.0))),
    # stick and slip (Karnopp), growing with the bearing's load | LuGre | play of fixed width
    known("coulomb_friction", 0.01, 8.0, sized(rig, "dry_nm")),
    # shock absorber, with the square of the speed | shear-thinning grease | proportional to speed
    known("viscous_friction", 0.03, 12.0, sized(rig, "damper_nm_s")),
    # arm that folds | mass | linear second order
    known("inertia", 1e-3, 0.3, sized(rig, "arm_kgm2")),
    # rope over a cam | sine | sine
    known("gravity_load", 0.02, 10.0, sized(rig, "weight_nm", weight_rad=(-1.2, 1.2))),
    # muscles and springs stronger, friction and mass as before
    known("stiffness", 0.02, 0.7, sized(rig, "stiff")),
    # gear whose clearance waves | soft coupling, wider where worn | play operator
    known("backlash", 0.01, 6.0, sized(reading, "play_deg", 2.0, play_wave_deg=(15.0, 30.0))),
    # air cushion | Hunt-Crossley buffer | clipped angle
    known("end_stop", 4.0, 44.0, stops(rig)),
    # other gain on either side | cubic bend | factor
    known("sensor_gain", 1e-3, 0.25, sized(reading, "gain", gain_uneven=(-0.1, 0.1))),
    known("sensor_offset", 0.03, 8.0, sized(reading, "offset_deg")),
    # becomes faster | settles | straight line
    known("sensor_drift", 0.2, 40.0, sized(reading, "drift_deg_min")),
    # odd and even square | eccentric disc | square and cube
    known("sensor_nonlinearity", 0.1, 12.0, sized(reading, "bend_deg", bend_even=(0.0, 1.0))),
    # moving mean | two or three poles | one pole
    known("sensor_lag", 1e-3, 0.2, sized(reading, "window_s", 2.0)),
    # even codes that hold on to the angle | uneven converter | even rounding
    known("quantisation", 0.12, 10.0, sized(reading, "step_deg", step_hold=(0.02, 0.15))),
    # second harmonic, wandering phase | third harmonic, swelling | sine
    known("mains_hum", 0.02, 4.0, sized(reading, "hum_deg", hum_hz=[50.0, 60.0])),
    # bounded, stronger at high frequency | heavy tails | white and normal
    known("sensor_noise", 0.02, 4.0, sized(reading, "noise_deg")),
    # random runs at zero or a rail | bursts with recovery | independent samples
    known("sensor_dropout", 1e-4, 0.2,
          sized(reading, "dropout", dropout_run=(1.0, 5.0), dropout_deg=[0.0, -180.0, 180.0])),
))  # fmt: skip


def _ripple(size: float, random: Generator) -> Disturbance:
    return reading(ripple_deg=size, ripple_per_deg=1.0 / between(random, 7.0, 14.0))


FOREIGN: Final[dict[str, EffectLaw]] = {
    "delay_beat": EffectLaw("timing", "s", 2e-3, 0.25, False, sized(timing, "beat_s", beat_hz=(0.3, 1.5))),
    "spool_stiction": EffectLaw("valve", "share", 0.01, 1.0, False, sized(rig, "stiction")),
    "bladder_snap": EffectLaw("muscle", "share", 0.003, 0.5, False, sized(rig, "snap", snap_mpa=(0.18, 0.24))),
    "mesh_lockup": EffectLaw("muscle", "kN", 0.05, 60.0, False, sized(rig, "lockup")),
    "detent": EffectLaw("joint", "N m", 0.02, 6.0, False, sized(rig, "detent_nm", detent_rad=(-0.2, 0.2))),
    "rubbing_cable": EffectLaw("joint", "N m", 0.05, 12.0, False, sized(rig, "rub_nm", rub_rad=(0.0, 0.2))),
    "interpolation_ripple": EffectLaw("sensor", "deg", 0.05, 8.0, False, _ripple),
}
"""Effects that no library has, of every stage; none of them is one of the first family's."""

"""Every effect of the library by this family's own laws, and effects that no library has.

An entry turns one signed size into disturbance parameters; chance details that are no size (which muscle, which phase)
are drawn. The comment at each entry says the law here; `hil.reference.fluidic.other_laws` says those of
fluidic, McKibben and the library.
"""

import math
from typing import Final

from hil.reference.disturbance import setter
from hil.reference.effect_law import (
    EffectLaw,
    both_offsets,
    by_sign,
    known,
    one_leak,
    one_offset,
    sized,
    stops,
    uneven_gains,
)
from hil.reference.pleated.disturbance import HEALTHY

timing, rig, reading = (setter(HEALTHY, place) for place in ("timing", "rig", "reading"))


OTHER_LAWS: Final[dict[str, EffectLaw]] = dict((
    # one of two routes for a while
    known("delay", 1e-3, 0.15, sized(timing, "delay_s", delay_apart=(0.05, 0.2))),
    # swings about its mean
    known("clock_drift", 5e-5, 0.02, sized(timing, "clock_rate")),
    # runs of any length up to a longest
    known("lost_samples", 0.01, 0.85, sized(timing, "lost_share", lost_run=[1, 3, 6], lost_all=[0.0, 1.0])),
    # span that settles within seconds
    known("valve_gain", 2e-3, 0.25, uneven_gains(rig)),
    known("valve_offset", 2e-4, 0.04, one_offset(rig)),
    # three unequal poles
    known("valve_lag", 1e-3, 0.3, sized(rig, "lag_s")),
    # limit that is approached softly
    known("valve_slew", 0.04, 1.5, sized(rig, "rate_mpa_s")),
    # small openings of one edge are narrow, large ones are not
    known("fill_exhaust_asymmetry", 0.05, 60.0, by_sign(rig, "narrow_exhaust", "narrow_fill")),
    # small errors hardly count
    known("valve_dead_band", 1e-3, 0.08, sized(rig, "idle_mpa"), "MPa, softened"),
    # rounded corner of the set-point
    known("pressure_ceiling", 0.16, 0.42, sized(rig, "ceiling_mpa")),
    # long line with inertia
    known("supply_droop", 0.3, 120.0, sized(rig, "line"), "ratio"),
    known("co_contraction", 5e-4, 0.08, both_offsets(rig)),
    # membrane cut too short
    known("muscle_mismatch", 1e-3, 0.25, by_sign(rig, "short_2", "short_1")),
    # turbulent, at the muscle
    known("leak", 1e-3, 0.6, one_leak(rig, ("leak_1", "leak_2"), 4.0)),
    # Eyring's: large steps go faster
    known("creep", 0.003, 3.0, sized(rig, "creep")),
    # heat of the air's compression
    known("thermal_drift", 0.005, 0.5, sized(rig, "heat", heat_s=(20.0, 45.0))),
    # rate-and-state friction
    known("coulomb_friction", 0.01, 5.0, sized(rig, "dry_nm")),
    # film that gives way at speed
    known("viscous_friction", 0.02, 12.0, sized(rig, "film_nm_s")),
    # mass at the end of an elastic shaft
    known("inertia", 1e-3, 0.05, sized(rig, "load_kgm2")),
    # behind a gear of 1.3
    known("gravity_load", 0.01, 3.0, sized(rig, "weight_nm", weight_rad=(-1.2, 1.2))),
    # muscles and springs stronger, friction and mass as before
    known("stiffness", 0.02, 0.7, sized(rig, "stiff")),
    # clearance that creeps back to its middle
    known("backlash", 0.01, 4.0, sized(reading, "play_deg", 2.0, play_back_s=(0.6, 2.0))),
    # wire that comes taut
    known("end_stop", 4.0, 44.0, stops(rig)),
    # swings over the angle
    known("sensor_gain", 1e-3, 0.25, sized(reading, "gain", gain_wave=(-0.1, 0.1))),
    known("sensor_offset", 0.03, 8.0, sized(reading, "offset_deg")),
    # with a slow swing on it
    known("sensor_drift", 0.2, 40.0, sized(reading, "drift_deg_min")),
    # three times per turn
    known("sensor_nonlinearity", 0.1, 12.0, sized(reading, "bend_deg", bend_rad=(0.0, 2.0 * math.pi))),
    # second order, well damped
    known("sensor_lag", 1e-3, 0.2, sized(reading, "lag_s")),
    # noise ahead of the codes
    known("quantisation", 0.12, 10.0, sized(reading, "step_deg", step_dither=(0.0, 0.08))),
    # flattened wave
    known("mains_hum", 0.02, 4.0, sized(reading, "hum_deg", hum_hz=[50.0, 60.0])),
    # loud and quiet in turns
    known("sensor_noise", 0.02, 4.0, sized(reading, "noise_deg")),
    # wrong parity, up to three at once
    known("sensor_dropout", 1e-4, 0.2,
          sized(reading, "dropout", dropout_run=[1, 2, 3], dropout_deg=[0.0, 120.0, -120.0])),
))  # fmt: skip

FOREIGN: Final[dict[str, EffectLaw]] = {
    "backlog": EffectLaw("timing", "s", 2e-3, 0.25, False, sized(timing, "backlog_s", backlog_every_s=(1.5, 4.0))),
    "cross_talk": EffectLaw("valve", "share", 0.005, 1.5, False, sized(rig, "cross_talk")),
    "fold_stiction": EffectLaw("muscle", "MPa", 5e-4, 0.05, False, sized(rig, "fold_play_mpa")),
    "freewheel_drag": EffectLaw("joint", "N m s/rad", 0.01, 6.0, False, sized(rig, "one_way_nm_s")),
    "absorber": EffectLaw("joint", "kg m2", 5e-4, 0.025, False, sized(rig, "absorber_kgm2", absorber_hz=(1.2, 3.0))),
    "tilting_magnet": EffectLaw("sensor", "deg s/rad", 0.03, 8.0, False, sized(reading, "tilt_deg_s")),
}
"""Effects that no library has, of every stage; none of them is one of the other families'."""

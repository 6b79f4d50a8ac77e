"""Every effect of the library by this family's own laws, and effects that no library has.

An entry turns one signed size into disturbance parameters; chance details that are no size (which bundle, which phase)
are drawn. The comment at each entry says the law here; `hil.reference.fluidic.other_laws` says those of
fluidic, McKibben and the library.
"""

import math
from typing import Final

from hil.reference.bundle.disturbance import HEALTHY
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

timing, rig, reading = (setter(HEALTHY, place) for place in ("timing", "rig", "reading"))


OTHER_LAWS: Final[dict[str, EffectLaw]] = dict((
    # queue that fills and empties within seconds
    known("delay", 1e-3, 0.15, sized(timing, "delay_s", delay_wander=(0.08, 0.25))),
    # whole ticks too many or too few
    known("clock_drift", 5e-5, 0.02, sized(timing, "clock_rate", clock_tick_s=[0.001, 0.002, 0.005])),
    # whole packets on a link that fades
    known("lost_samples", 0.01, 0.85, sized(timing, "lost_share", lost_fade=(2.0, 12.0))),
    # amplifier whose span bends at both ends
    known("valve_gain", 2e-3, 0.25, uneven_gains(rig)),
    # zero of the sensor in the loop
    known("valve_offset", 2e-4, 0.04, one_offset(rig)),
    # signal volume behind a turbulent restriction
    known("valve_lag", 1e-3, 0.3, sized(rig, "signal_s")),
    # generator that also limits the change of the rate
    known("valve_slew", 0.04, 1.5, sized(rig, "profile_mpa_s")),
    # throttle with a check valve in the tube, behind the monitor
    known("fill_exhaust_asymmetry", 0.05, 60.0, by_sign(rig, "throttle_out", "throttle_in")),
    # bender that sticks to its seat, under an integral action
    known("valve_dead_band", 1e-3, 0.08, sized(rig, "seat_mpa")),
    # safety switch that shuts the supply, and opens it again further down
    known("pressure_ceiling", 0.16, 0.42, sized(rig, "cut_off_mpa")),
    # pressure reducer with a lag and a lock-up
    known("supply_droop", 0.02, 3.0, sized(rig, "droop_s"), "s"),
    known("co_contraction", 5e-4, 0.08, both_offsets(rig)),
    # torn strands, the shortest first
    known("muscle_mismatch", 1e-3, 0.25, by_sign(rig, "torn_2", "torn_1")),
    # slit that opens with the bladder's hoop stretch
    known("leak", 1e-3, 0.6, one_leak(rig, ("leak_1", "leak_2"), 4.0)),
    # ageing yarns: the slower, the longer nothing changes
    known("creep", 0.003, 3.0, sized(rig, "creep")),
    # heat of the bundles' own friction
    known("thermal_drift", 0.005, 0.5, sized(rig, "heat", heat_s=(20.0, 45.0))),
    # two Dahl elements against each other, loaded by the belts
    known("coulomb_friction", 0.01, 5.0, sized(rig, "dry_nm")),
    # silicone that thins when sheared and recovers
    known("viscous_friction", 0.02, 12.0, sized(rig, "silicone_nm_s")),
    # wheel that friction carries along
    known("inertia", 1e-3, 0.15, sized(rig, "wheel_kgm2")),
    # weight that swings on a string
    known("gravity_load", 0.01, 3.0, sized(rig, "bob_nm", bob_rad=(-1.2, 1.2))),
    # more strands: with friction and volume of their own
    known("stiffness", 0.02, 0.7, sized(rig, "stiff")),
    # spline whose teeth touch one after another
    known("backlash", 0.01, 5.0, sized(reading, "play_deg", 2.0, play_spread=(0.1, 0.4))),
    # foam that gives way and recovers slowly
    known("end_stop", 4.0, 44.0, stops(rig)),
    # carrier whose amplitude breathes
    known("sensor_gain", 1e-3, 0.25, sized(reading, "gain", gain_breath=(0.0, 0.12), gain_turn_s=(8.0, 25.0))),
    known("sensor_offset", 0.03, 8.0, sized(reading, "offset_deg")),
    # walks with the motion
    known("sensor_drift", 0.2, 40.0, sized(reading, "drift_deg_min")),
    # another sensitivity beyond the linear range
    known("sensor_nonlinearity", 0.1, 12.0, sized(reading, "bend_deg", bend_null_deg=(-12.0, 12.0))),
    # three means in series
    known("sensor_lag", 1e-3, 0.2, sized(reading, "lag_s")),
    # cut off towards zero
    known("quantisation", 0.12, 10.0, sized(reading, "step_deg")),
    # whole waves, on and off
    known("mains_hum", 0.02, 4.0, sized(reading, "hum_deg", hum_hz=[50.0, 60.0], hum_every_s=(0.8, 2.5))),
    # multiplies the reading
    known("sensor_noise", 0.02, 4.0, sized(reading, "noise_deg")),
    # cable that breaks contact towards one end; the open input runs away
    known("sensor_dropout", 1e-4, 0.2,
          sized(reading, "dropout", dropout_run=(1.0, 5.0), dropout_deg=[0.0, 60.0, -60.0])),
))  # fmt: skip

FOREIGN: Final[dict[str, EffectLaw]] = {
    "channel_skew": EffectLaw("timing", "s", 4e-3, 0.4, False, sized(timing, "skew_s")),
    "greedy_neighbour": EffectLaw("valve", "MPa", 0.1, 0.5, False, sized(rig, "neighbour_mpa", neighbour_s=(1.4, 3.0))),
    "bursting_strands": EffectLaw("muscle", "share", 1e-3, 0.4, False, sized(rig, "burst", burst_s=(3.0, 7.0))),
    "clogged_strands": EffectLaw("muscle", "share", 5e-3, 0.9, False, sized(rig, "clogged", clogged_s=(0.15, 0.5))),
    "pulley_off_centre": EffectLaw("joint", "relative", 2e-3, 0.4, False,
                                   sized(rig, "off_centre", off_rad=(0.0, 2.0 * math.pi))),
    "carrier_beat": EffectLaw("sensor", "deg", 0.05, 10.0, False, sized(reading, "beat_deg", beat_hz=(0.6, 2.5))),
    "slow_tracking": EffectLaw("sensor", "deg/s", 25.0, 280.0, False, sized(reading, "slew_deg_s"), "", True),
}  # fmt: skip
"""Effects that no library has, of every stage; none of them is one of the other families'."""

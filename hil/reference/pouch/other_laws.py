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
from hil.reference.pouch.disturbance import HEALTHY

timing, rig, reading = (setter(HEALTHY, place) for place in ("timing", "rig", "reading"))

OTHER_LAWS: Final[dict[str, EffectLaw]] = dict((
    # lognormal waits that go on for a while
    known("delay", 1e-3, 0.15, sized(timing, "delay_s", delay_goes_on_s=(0.03, 0.3))),
    # clock whose rate is set anew now and then
    known("clock_drift", 5e-5, 0.02, sized(timing, "clock_rate", clock_set_s=(2.0, 6.0))),
    # telegrams that hold what has changed: the longer ones are lost more often
    known("lost_samples", 0.01, 0.85, sized(timing, "lost_share", lost_busy=(0.3, 0.8), lost_all=[0.0, 1.0])),
    # sensor in the loop that reads too little, less so over its range
    known("valve_gain", 2e-3, 0.25, uneven_gains(rig)),
    known("valve_offset", 2e-4, 0.04, one_offset(rig)),
    # filter that a diode bridges: quicker when it is far behind
    known("valve_lag", 1e-3, 0.3, sized(rig, "lag_s")),
    # protection of the coils: bursts go free, for long a rate
    known("valve_slew", 0.04, 1.5, sized(rig, "budget_mpa_s", budget_mpa=(0.004, 0.012))),
    # long pipe with a small volume: square of the flow
    known("fill_exhaust_asymmetry", 0.05, 60.0, by_sign(rig, "pipe_out", "pipe_in")),
    # zone that narrows as long as the bank stays shut
    known("valve_dead_band", 1e-3, 0.06, sized(rig, "zone_mpa")),
    # program that asks for less, the more it is asked for
    known("pressure_ceiling", 0.16, 0.42, sized(rig, "fold_mpa")),
    # hose behind a receiver, both in proportion to the flow: a quick part and a slow one
    known("supply_droop", 0.05, 20.0, sized(rig, "sag_mpa")),
    known("co_contraction", 5e-4, 0.08, both_offsets(rig)),
    # pouches that are welded shut
    known("muscle_mismatch", 1e-3, 0.25, by_sign(rig, "shut_2", "shut_1")),
    # channel in a weld that gapes as the film is taut: cube of the gap
    known("leak", 1e-3, 0.6, one_leak(rig, ("leak_1", "leak_2"), 4.0)),
    # delayed strain of the film (Kohlrausch)
    known("creep", 0.003, 3.0, sized(rig, "creep", 3.0)),
    # film that softens as the sun comes round (logistic)
    known("thermal_drift", 0.005, 0.5, sized(rig, "heat", 4.0, heat_s=(3.0, 9.0))),
    # continuous friction whose Stribeck part is late (Makkar, Hess and Soom)
    known("coulomb_friction", 0.005, 3.0, sized(rig, "dry_nm")),
    # grease in a gap that is narrower off the middle
    known("viscous_friction", 0.01, 4.0, sized(rig, "squeeze_nm_s")),
    # mass far out on a link that rolls: inertia by the cosine of half the angle
    known("inertia", 5e-4, 0.05, sized(rig, "outer_kgm2")),
    # weight on a link that rolls: half of the angle and the whole
    known("gravity_load", 0.01, 2.0, sized(rig, "load_nm", load_rad=(-1.2, 1.2))),
    # more rows, with their volume, on stronger cords; friction and mass as before
    known("stiffness", 0.02, 0.7, sized(rig, "stiff")),
    # clearance whose grease takes the pin along by a share
    known("backlash", 0.01, 5.0, sized(reading, "play_deg", 2.0, play_drag=(0.05, 0.35))),
    # block of cork (exponential, with a Maxwell element)
    known("end_stop", 4.0, 44.0, stops(rig)),
    # daylight on the detector, which grows
    known("sensor_gain", 1e-3, 0.25, sized(reading, "gain", gain_day=(-0.2, 0.2))),
    known("sensor_offset", 0.03, 8.0, sized(reading, "offset_deg")),
    # begins slowly and ends slowly
    known("sensor_drift", 0.2, 40.0, sized(reading, "drift_deg_min")),
    # projection onto a detector that stands askew
    known("sensor_nonlinearity", 0.1, 12.0, sized(reading, "bend_deg", bend_tilt=(-0.5, 0.5))),
    # carriers of which a share diffuses
    known("sensor_lag", 1e-3, 0.2, sized(reading, "lag_s", lag_tail=(0.2, 0.5))),
    # both currents coded each for itself
    known("quantisation", 0.12, 10.0, sized(reading, "step_deg", step_apart=(0.2, 0.8))),
    # lamp that draws the spot towards itself
    known("mains_hum", 0.02, 4.0, sized(reading, "hum_deg", hum_hz=[50.0, 60.0], hum_at_deg=[-70.0, 70.0])),
    # partly warm air
    known("sensor_noise", 0.02, 4.0, sized(reading, "noise_deg", noise_shimmer=(0.2, 0.6))),
    # beam interrupted: the dark reads anything
    known("sensor_dropout", 1e-4, 0.2, sized(reading, "dropout", dropout_run=(1.0, 4.0))),
))  # fmt: skip

FOREIGN: Final[dict[str, EffectLaw]] = {
    "hearing_in_turns": EffectLaw("timing", "s", 0.01, 0.35, False, sized(timing, "turns_s")),
    "wandering_zero": EffectLaw("valve", "MPa", 5e-4, 0.03, False,
                                sized(rig, "wander_mpa", wander_s=(0.6, 2.0), wander_rad=(0.0, 2.0 * math.pi))),
    "peeling_weld": EffectLaw("muscle", "mm/s", 0.01, 2.0, False,
                              sized(rig, "peel_mm_s", peel_muscle=[0.0, 1.0])),
    "giving_anchor": EffectLaw("muscle", "mm/N", 5e-4, 0.05, False, sized(rig, "give_mm_n", give_muscle=[0.0, 1.0])),
    "over_centre_spring": EffectLaw("joint", "N m", 0.01, 1.5, False, sized(rig, "centre_nm")),
    "switching_ranges": EffectLaw("sensor", "relative", 3e-3, 0.3, True,
                                  sized(reading, "range_gain", range_deg=(6.0, 18.0))),
    "bending_frame": EffectLaw("sensor", "deg/MPa", 0.5, 60.0, True,
                               sized(reading, "frame_deg_mpa", frame_muscle=[0.0, 1.0])),
}  # fmt: skip
"""Effects that no library has, of every stage; none of them is one of the other families'."""

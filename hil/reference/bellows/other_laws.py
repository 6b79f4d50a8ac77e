"""Every effect of the library by this family's own laws, and effects that no library has.

An entry turns one signed size into disturbance parameters; chance details that are no size (which muscle, which phase)
are drawn. The comment at each entry says the law here; `hil.reference.fluidic.other_laws` says those of
fluidic, McKibben and the library.
"""

from typing import Final

from numpy.random import Generator

from hil.reference.bellows.disturbance import HEALTHY
from hil.reference.disturbance import Disturbance, setter
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


def _mismatch(size: float, _: Generator) -> Disturbance:
    return rig(wide_1=0.5 * size, wide_2=-0.5 * size)


OTHER_LAWS: Final[dict[str, EffectLaw]] = dict((
    # waits for the bus's next frame
    known("delay", 1e-3, 0.15, sized(timing, "delay_s", delay_frame=(0.1, 0.4))),
    # ages: ever faster
    known("clock_drift", 5e-5, 0.02, sized(timing, "clock_rate")),
    # each channel for itself, swelling and fading
    known("lost_samples", 0.01, 0.85, sized(timing, "lost_share", lost_fade=(400.0, 1200.0))),
    # span that bends by a power
    known("valve_gain", 2e-3, 0.25, uneven_gains(rig)),
    known("valve_offset", 2e-4, 0.04, one_offset(rig)),
    # signal tube as a ladder of restrictions and volumes
    known("valve_lag", 1e-3, 0.3, sized(rig, "lag_s")),
    # throat behind the main valves, choked by degrees
    known("valve_slew", 0.04, 1.5, sized(rig, "throat_mpa_s")),
    # one of both pilot solenoids is worn
    known("fill_exhaust_asymmetry", 0.05, 20.0, by_sign(rig, "weak_exhaust", "weak_fill")),
    # no pulse below an error, a full one above
    known("valve_dead_band", 1e-3, 0.06, sized(rig, "numb_mpa")),
    # pilots are fed with too little
    known("pressure_ceiling", 0.16, 0.50, sized(rig, "pilot_supply_mpa")),
    # tank with a compressor that switches on and off
    known("supply_droop", 20.0, 400.0, sized(rig, "tank"), "percent"),
    known("co_contraction", 5e-4, 0.08, both_offsets(rig)),
    # pouches of another width: force and volume
    known("muscle_mismatch", 1e-3, 0.25, _mismatch),
    # hole that is as wide as the skin is taut
    known("leak", 1e-3, 0.6, one_leak(rig, ("leak_1", "leak_2"), 4.0)),
    # power of time, under the skin's own tension
    known("creep", 0.003, 3.0, sized(rig, "creep")),
    # warm air that is let in
    known("thermal_drift", 0.005, 0.5, sized(rig, "heat", heat_s=(20.0, 45.0))),
    # elasto-plastic, with Stribeck's rise
    known("coulomb_friction", 0.01, 5.0, sized(rig, "dry_nm")),
    # damper behind an elastic link
    known("viscous_friction", 0.02, 12.0, sized(rig, "damper_nm_s")),
    # mass driven by a link
    known("inertia", 1e-3, 0.08, sized(rig, "link_kgm2")),
    # weight on a cord over a fixed pulley
    known("gravity_load", 0.01, 3.0, sized(rig, "weight_nm", weight_rad=(-1.2, 1.2))),
    # muscles and springs stronger, friction and mass as before
    known("stiffness", 0.02, 0.7, sized(rig, "stiff")),
    # shaft that coasts through its clearance
    known("backlash", 0.01, 5.0, sized(reading, "play_deg", 2.0, play_hz=(30.0, 60.0))),
    # hard stop with a restitution
    known("end_stop", 4.0, 44.0, stops(rig)),
    # about a pivot off zero
    known("sensor_gain", 1e-3, 0.25, sized(reading, "gain", gain_pivot_deg=(-5.0, 5.0))),
    known("sensor_offset", 0.03, 8.0, sized(reading, "offset_deg")),
    # in stairs
    known("sensor_drift", 0.2, 40.0, sized(reading, "drift_deg_min", drift_stair_s=(0.5, 2.0))),
    # heavily loaded track
    known("sensor_nonlinearity", 0.1, 12.0, sized(reading, "bend_deg", bend_place=[0.3, 0.5, 0.6])),
    # a quick and a slow path side by side
    known("sensor_lag", 1e-3, 0.2, sized(reading, "lag_s")),
    # codes some of which are missing
    known("quantisation", 0.12, 10.0, sized(reading, "step_deg", step_missing=[4, 5, 7])),
    # second harmonic, more at one end of the track
    known("mains_hum", 0.02, 4.0, sized(reading, "hum_deg", hum_hz=[50.0, 60.0])),
    # two colours
    known("sensor_noise", 0.02, 4.0, sized(reading, "noise_deg")),
    # wiper that jumps off, more often at speed
    known("sensor_dropout", 1e-4, 0.2,
          sized(reading, "dropout", dropout_run=(1.0, 4.0), dropout_deg=[0.0, 150.0, -150.0])),
))  # fmt: skip

FOREIGN: Final[dict[str, EffectLaw]] = {
    "stale_frames": EffectLaw("timing", "s", 5e-3, 0.4, False, sized(timing, "stale_s", stale_share=(0.15, 0.3))),
    "kinked_tube": EffectLaw("valve", "ratio", 0.3, 120.0, False, sized(rig, "kink", kink_mpa=(0.12, 0.2))),
    "shared_exhaust": EffectLaw("valve", "ratio", 0.3, 6.0, False, sized(rig, "manifold")),
    "slipping_clamp": EffectLaw("muscle", "mm/s", 0.01, 20.0, False,
                                sized(rig, "slip_mm_s", slip_n=(170.0, 220.0), slip_muscle=[0.0, 1.0])),
    "rattling_load": EffectLaw("joint", "kg m2", 1e-3, 0.06, False, sized(rig, "loose_kgm2", loose_rad=(0.03, 0.08))),
    "block_mean": EffectLaw("sensor", "s", 5e-3, 0.4, False, sized(reading, "block_s")),
    "multiplexer_bleed": EffectLaw("sensor", "deg", 0.05, 8.0, False, sized(reading, "bleed_deg")),
}  # fmt: skip
"""Effects that no library has, of every stage; none of them is one of the other families'."""

"""Every effect of the library by this family's own laws, and effects that no library has.

An entry turns one signed size into disturbance parameters; chance details that are no size (which cylinder, which
phase) are drawn. The comment at each entry says the law here; `hil.reference.fluidic.other_laws` says those of
fluidic, McKibben and the library.
"""

from typing import Final

from numpy.random import Generator

from hil.reference.diaphragm.disturbance import HEALTHY
from hil.reference.disturbance import Disturbance, setter
from hil.reference.effect_law import (
    EffectLaw,
    between,
    both_offsets,
    by_sign,
    known,
    one_leak,
    one_of,
    one_offset,
    sized,
    stops,
    uneven_gains,
)

timing, rig, reading = (setter(HEALTHY, place) for place in ("timing", "rig", "reading"))


def _mismatch(size: float, _: Generator) -> Disturbance:
    return rig(wide_1=0.25 * size, wide_2=-0.25 * size)


def _leak(size: float, random: Generator) -> Disturbance:
    holed = one_leak(rig, ("leak_1", "leak_2"), 6.0)(size, random)
    return holed._replace(rig=holed.rig._replace(leak_at_m=between(random, -0.006, 0.006)))


def _weeping(size: float, random: Generator) -> Disturbance:
    return rig(**{one_of(random, "weep_1_mpa_s", "weep_2_mpa_s"): size})


OTHER_LAWS: Final[dict[str, EffectLaw]] = dict((
    # gateway with a queue: waits by the gamma law, in order
    known("delay", 1e-3, 0.15, sized(timing, "delay_s", delay_shape=(0.4, 2.0))),
    # crystal that ages as the logarithm
    known("clock_drift", 5e-5, 0.02, sized(timing, "clock_rate", clock_ages_s=(1.0, 6.0))),
    # clusters: gaps by Weibull's law
    known("lost_samples", 0.01, 0.85, sized(timing, "lost_share", lost_shape=(0.35, 0.8), lost_all=[0.0, 1.0])),
    # span ahead of the comparator, swollen in the middle of the range
    known("valve_gain", 2e-3, 0.25, uneven_gains(rig)),
    known("valve_offset", 2e-4, 0.04, one_offset(rig)),
    # compensated amplifier, a quick part and a slow one
    known("valve_lag", 1e-3, 0.3, sized(rig, "amplifier_s")),
    # jet in the dome's line, choked: steady when it fills, less and less when it empties
    known("valve_slew", 0.04, 1.5, sized(rig, "jet_mpa_s")),
    # cloth in series with poppet and body (Eckersten)
    known("fill_exhaust_asymmetry", 0.05, 60.0, by_sign(rig, "silencer", "strainer")),
    # stem that sticks, under a program that leaves it alone
    known("valve_dead_band", 1e-3, 0.06, sized(rig, "sticky_mpa")),
    # dome that gives way
    known("pressure_ceiling", 0.16, 0.42, sized(rig, "dome_limit_mpa")),
    # membrane dryer: difference of the squares, before a small volume
    known("supply_droop", 0.05, 20.0, sized(rig, "dryer_mpa")),
    known("co_contraction", 5e-4, 0.08, both_offsets(rig)),
    # diaphragms of another width: force by the stroke, and volume
    known("muscle_mismatch", 1e-3, 0.25, _mismatch),
    # pinhole that the bore covers until the lobe has rolled by
    known("leak", 1e-3, 0.6, _leak),
    # fractional derivative of the stroke
    known("creep", 0.003, 3.0, sized(rig, "rubber", 0.3)),
    # diaphragm that warms quickly in a housing that warms slowly
    known("thermal_drift", 0.005, 0.5, sized(rig, "heat", heat_s=(4.0, 15.0))),
    # bristle that slides by degrees and holds firmer after a dwell (Gonthier)
    known("coulomb_friction", 0.01, 5.0, sized(rig, "dry_nm")),
    # damper that resists more one way
    known("viscous_friction", 0.02, 12.0, sized(rig, "damper_nm_s")),
    # sledge that the yoke pushes: inertia by the square of the arm
    known("inertia", 1e-3, 0.08, sized(rig, "sledge_kgm2")),
    # chain of which the less lies on the floor, the higher the arm is
    known("gravity_load", 0.01, 3.0, sized(rig, "load_nm", load_rad=(-1.2, 1.2))),
    # more cylinders, with their volume, on a stronger spring; friction and mass as before
    known("stiffness", 0.02, 0.7, sized(rig, "stiff")),
    # clearance whose spring is weak and leans on one flank
    known("backlash", 0.01, 5.0, sized(reading, "play_deg", 2.0, play_lean_s=(4.0, 12.0))),
    # stack of disc springs
    known("end_stop", 4.0, 44.0, stops(rig)),
    # excitation whose reference warms up
    known("sensor_gain", 1e-3, 0.25, sized(reading, "gain", gain_warms_s=(3.0, 9.0))),
    known("sensor_offset", 0.03, 8.0, sized(reading, "offset_deg")),
    # as the root of time
    known("sensor_drift", 0.2, 40.0, sized(reading, "drift_deg_min")),
    # track that is joined of two
    known("sensor_nonlinearity", 0.1, 12.0, sized(reading, "bend_deg", bend_at_deg=(-15.0, 15.0))),
    # one pole that is slower one way
    known("sensor_lag", 1e-3, 0.2, sized(reading, "lag_s", lag_uneven=(-0.3, 0.3))),
    # wound track whose wiper bridges two turns
    known("quantisation", 0.12, 10.0, sized(reading, "step_deg", step_bridge=(0.1, 0.35))),
    # motor's, swelling with its slip
    known("mains_hum", 0.02, 4.0, sized(reading, "hum_deg", hum_hz=[50.0, 60.0], hum_slip_hz=(0.8, 3.0))),
    # partly the track's grain
    known("sensor_noise", 0.02, 4.0, sized(reading, "noise_deg", noise_grain=(0.2, 0.7))),
    # wiper off its track: one end or the other
    known("sensor_dropout", 1e-4, 0.2, sized(reading, "dropout", dropout_longest=[1.0, 3.0, 5.0])),
))  # fmt: skip

FOREIGN: Final[dict[str, EffectLaw]] = {
    "extrapolating_gateway": EffectLaw("timing", "s", 0.01, 0.35, False, sized(timing, "gateway_s")),
    "pitot_tap": EffectLaw("valve", "MPa", 2e-3, 2.0, False, sized(rig, "pitot_mpa")),
    "weeping_pilot": EffectLaw("valve", "MPa/s", 0.01, 1.6, False, _weeping),
    "blocked_vent": EffectLaw("muscle", "s", 1e-3, 1.0, False, sized(rig, "vent_s", vent_cylinder=[0.0, 1.0])),
    "rolling_ball": EffectLaw("joint", "N m", 0.01, 2.5, False, sized(rig, "ball_nm", ball_rad=(-0.3, 0.3))),
    "solenoid_pickup": EffectLaw("sensor", "deg s/MPa", 0.03, 15.0, True, sized(reading, "pickup_deg")),
    "wandering_excitation": EffectLaw(
        "sensor", "relative", 1e-3, 0.3, False, sized(reading, "wander", wander_s=(1.5, 6.0))),
}  # fmt: skip
"""Effects that no library has, of every stage; none of them is one of the other families'."""

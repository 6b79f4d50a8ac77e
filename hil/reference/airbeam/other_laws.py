"""Every effect of the library by this family's own laws, and effects that no library has.

An entry turns one signed size into disturbance parameters; chance details that are no size (which beam, which phase)
are drawn. The comment at each entry says the law here; `hil.reference.fluidic.other_laws` says those of
fluidic, McKibben and the library.
"""

from typing import Final

from numpy.random import Generator

from hil.reference.airbeam.disturbance import HEALTHY
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
    return rig(far_1=0.5 * size, far_2=-0.5 * size)


def _overshoot(size: float, _: Generator) -> Disturbance:
    return reading(ring_hz=1.0 / size)


OTHER_LAWS: Final[dict[str, EffectLaw]] = dict((
    # telegrams that collide and back off, ever longer
    known("delay", 1e-3, 0.15, sized(timing, "delay_s", delay_collide=(0.1, 0.4))),
    # clock whose oven switches on and off
    known("clock_drift", 5e-5, 0.02, sized(timing, "clock_rate", clock_oven_s=(4.0, 9.0))),
    # outages of any length (Pareto)
    known("lost_samples", 0.01, 0.85, sized(timing, "lost_share", lost_tail=(1.1, 2.0), lost_all=[0.0, 1.0])),
    # bridge of the sensor in the loop, out of balance
    known("valve_gain", 2e-3, 0.25, uneven_gains(rig)),
    known("valve_offset", 2e-4, 0.04, one_offset(rig)),
    # mean of the last set-points in the regulator's program
    known("valve_lag", 1e-3, 0.3, sized(rig, "mean_s")),
    # spool whose stroke is limited: an orifice, behind loops as before
    known("valve_slew", 0.04, 1.5, sized(rig, "stroke_mpa_s")),
    # felt with a small space before it
    known("fill_exhaust_asymmetry", 0.05, 60.0, by_sign(rig, "felt_out", "felt_in")),
    # sensor in the loop that sends by exception
    known("valve_dead_band", 1e-3, 0.06, sized(rig, "exception_mpa")),
    # limiting valve that closes the inlet by degrees
    known("pressure_ceiling", 0.16, 0.42, sized(rig, "limiter_mpa")),
    # compressor that delivers the less, the higher it works, before a bottle
    known("supply_droop", 5.0, 1500.0, sized(rig, "bottle"), "percent"),
    known("co_contraction", 5e-4, 0.08, both_offsets(rig)),
    # beams sewn on nearer to the hinge, and further: torque and volume
    known("muscle_mismatch", 1e-3, 0.25, _mismatch),
    # pores in a crease, which open as it is folded
    known("leak", 1e-3, 0.6, one_leak(rig, ("leak_1", "leak_2"), 4.0)),
    # springs that give way beyond a threshold (Krejci and Kuhnen)
    known("creep", 0.003, 3.0, sized(rig, "creep")),
    # heat that soaks in, as the root of the time
    known("thermal_drift", 0.005, 0.5, sized(rig, "heat", heat_s=(12.0, 35.0))),
    # reset integrator that holds the firmer, the longer it rested
    known("coulomb_friction", 0.01, 5.0, sized(rig, "dry_nm")),
    # oil that its own shear warms
    known("viscous_friction", 0.02, 12.0, sized(rig, "oil_nm_s")),
    # water before a paddle, with its drag
    known("inertia", 1e-3, 0.15, sized(rig, "paddle_kgm2")),
    # weight at the end of a leaf that bends
    known("gravity_load", 0.01, 3.0, sized(rig, "load_nm", load_rad=(-1.2, 1.2))),
    # more beams, with their volume, on a stronger bush; friction and mass as before
    known("stiffness", 0.02, 0.7, sized(rig, "stiff")),
    # shaft that is shaken to and fro in its clearance
    known("backlash", 0.01, 5.0, sized(reading, "play_deg", 2.0, play_shake=(0.02, 0.12))),
    # rubber block (neo-Hookean)
    known("end_stop", 4.0, 44.0, stops(rig)),
    # one winding's amplitude, ahead of the arc tangent
    known("sensor_gain", 1e-3, 0.25, sized(reading, "gain", gain_rad=(-0.3, 0.3))),
    known("sensor_offset", 0.03, 8.0, sized(reading, "offset_deg")),
    # clamp that holds, then slides
    known("sensor_drift", 0.2, 40.0, sized(reading, "drift_deg_min", drift_from=(0.1, 0.4))),
    # short rod before the resolver
    known("sensor_nonlinearity", 0.1, 12.0, sized(reading, "bend_deg", bend_rad=(-0.5, 0.5))),
    # long cable, resistance and capacitance all along it
    known("sensor_lag", 1e-3, 0.2, sized(reading, "lag_s")),
    # two converters that take turns and do not agree
    known("quantisation", 0.12, 10.0, sized(reading, "step_deg", step_apart=(0.1, 0.5))),
    # generating set whose speed hunts
    known("mains_hum", 0.02, 4.0, sized(reading, "hum_deg", hum_hz=[50.0, 60.0], hum_hunt_s=(2.0, 5.0))),
    # rings
    known("sensor_noise", 0.02, 4.0, sized(reading, "noise_deg")),
    # false null of the tracking
    known("sensor_dropout", 1e-4, 0.2,
          sized(reading, "dropout", dropout_run=(1.0, 4.0), dropout_deg=[180.0, -180.0])),
))  # fmt: skip

FOREIGN: Final[dict[str, EffectLaw]] = {
    "sparse_waypoints": EffectLaw("timing", "s", 0.01, 0.6, False, sized(timing, "waypoint_s")),
    "shared_ground": EffectLaw("valve", "MPa", 1e-3, 0.08, False, sized(rig, "ground_mpa")),
    "bridged_beams": EffectLaw("muscle", "1/(MPa s)", 0.2, 60.0, False, sized(rig, "bridge")),
    "pinched_crease": EffectLaw("muscle", "s", 5e-3, 1.0, False, sized(rig, "pinch_s", pinch_beam=[0.0, 1.0])),
    "magnetic_catch": EffectLaw("joint", "N m", 0.02, 4.0, False, sized(rig, "catch_nm", catch_rad=(-0.35, 0.35))),
    "overshooting_tracking": EffectLaw("sensor", "s", 0.03, 0.8, False, _overshoot),
    "echoed_buffer": EffectLaw("sensor", "share", 2e-3, 0.5, False, sized(reading, "echo", echo_s=(0.15, 0.6))),
}  # fmt: skip
"""Effects that no library has, of every stage; none of them is one of the other families'."""

"""Every effect of the library by this family's own laws, and effects that no library has.

An entry turns one signed size into disturbance parameters; chance details that are no size (which muscle, which phase)
are drawn. The comment at each entry says the law here; `hil.reference.fluidic.other_laws` says those of
fluidic, McKibben and the library.
"""

from typing import Final

from numpy.random import Generator

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
from hil.reference.sleeve.disturbance import HEALTHY

timing, rig, reading = (setter(HEALTHY, place) for place in ("timing", "rig", "reading"))


def _mismatch(size: float, _: Generator) -> Disturbance:
    return rig(wide_1=0.5 * size, wide_2=-0.5 * size)


OTHER_LAWS: Final[dict[str, EffectLaw]] = dict((
    # telegrams that are now and then sent twice
    known("delay", 1e-3, 0.15, sized(timing, "delay_s", delay_retry=(0.05, 0.4))),
    # over the parabola of a crystal that warms up
    known("clock_drift", 5e-5, 0.02, sized(timing, "clock_rate")),
    # busy spells in which one of several comes through
    known("lost_samples", 0.01, 0.85, sized(timing, "lost_share", lost_keep=[3, 5, 8], lost_all=[0.0, 1.0])),
    # force motor whose span bends by the cube of its current
    known("valve_gain", 2e-3, 0.25, uneven_gains(rig)),
    known("valve_offset", 2e-4, 0.04, one_offset(rig)),
    # diffusion of flux into a solid core
    known("valve_lag", 1e-3, 0.3, sized(rig, "eddy_s")),
    # stepping motor
    known("valve_slew", 0.04, 1.5, sized(rig, "motor_mpa_s")),
    # second orifice in series with the port
    known("fill_exhaust_asymmetry", 0.05, 20.0, by_sign(rig, "soaked_exhaust", "soaked_fill")),
    # air saver that closes both ports a while after the error is small
    known("valve_dead_band", 1e-3, 0.06, sized(rig, "saver_mpa")),
    # relief valve that pops and reseats
    known("pressure_ceiling", 0.16, 0.42, sized(rig, "pop_mpa")),
    # receiver that a critical nozzle refills
    known("supply_droop", 20.0, 1000.0, sized(rig, "receiver"), "percent"),
    known("co_contraction", 5e-4, 0.08, both_offsets(rig)),
    # sleeves of another radius: force, volume and rubber
    known("muscle_mismatch", 1e-3, 0.25, _mismatch),
    # crimp that gapes under pressure
    known("leak", 1e-3, 0.6, one_leak(rig, ("leak_1", "leak_2"), 4.0)),
    # rubber that flows by the cube of its stress (Bergstrom and Boyce)
    known("creep", 0.003, 6.0, sized(rig, "creep")),
    # frame that grows by the heat of the regulators' coils, and tightens the flexures
    known("thermal_drift", 0.005, 0.5, sized(rig, "heat", heat_s=(12.0, 35.0))),
    # generalised Maxwell slip with Stribeck's fall
    known("coulomb_friction", 0.01, 5.0, sized(rig, "dry_nm")),
    # eddy-current brake, which gives way at speed
    known("viscous_friction", 0.02, 12.0, sized(rig, "brake_nm_s")),
    # flywheel behind a gear with losses
    known("inertia", 1e-3, 0.08, sized(rig, "wheel_kgm2")),
    # half-filled vessel
    known("gravity_load", 0.01, 3.0, sized(rig, "load_nm", load_rad=(-1.2, 1.2))),
    # more sleeves, with their volume, on stronger flexures; friction and mass as before
    known("stiffness", 0.02, 0.7, sized(rig, "stiff")),
    # loose magnet that jumps when it is pushed
    known("backlash", 0.01, 5.0, sized(reading, "play_deg", 2.0, play_jump=(0.05, 0.2))),
    # leaf spring that lays itself along a block
    known("end_stop", 4.0, 44.0, stops(rig)),
    # strength of the magnet, ahead of the arc sine
    known("sensor_gain", 1e-3, 0.25, sized(reading, "gain")),
    known("sensor_offset", 0.03, 8.0, sized(reading, "offset_deg")),
    # random walk about its slope
    known("sensor_drift", 0.2, 40.0, sized(reading, "drift_deg_min", drift_walk=(0.02, 0.12))),
    # element that saturates, about a field of its own
    known("sensor_nonlinearity", 0.1, 12.0, sized(reading, "bend_deg", bend_bias=(-0.4, 0.4))),
    # Bessel's filter of fourth order
    known("sensor_lag", 1e-3, 0.2, sized(reading, "lag_s")),
    # coarse codes of the field, ahead of the arc sine
    known("quantisation", 0.12, 10.0, sized(reading, "step_deg")),
    # half waves cut by a dimmer
    known("mains_hum", 0.02, 4.0, sized(reading, "hum_deg", hum_hz=[50.0, 60.0], hum_fire=(0.1, 0.5))),
    # shot noise
    known("sensor_noise", 0.02, 4.0, sized(reading, "noise_deg")),
    # restarts, always for as long
    known("sensor_dropout", 1e-4, 0.2,
          sized(reading, "dropout", dropout_run=[1, 2, 4], dropout_deg=[0.0, 90.0, -90.0])),
))  # fmt: skip

FOREIGN: Final[dict[str, EffectLaw]] = {
    "slow_task": EffectLaw("timing", "s", 5e-3, 0.4, False, sized(timing, "task_s")),
    "icing_exhaust": EffectLaw("valve", "ratio", 0.2, 60.0, False, sized(rig, "ice")),
    "restarting_trim": EffectLaw("valve", "MPa", 5e-4, 0.03, False,
                                 sized(rig, "beam_mpa", restart_s=(1.5, 4.0), restart_valve=[0.0, 1.0])),
    "virgin_rubber": EffectLaw("muscle", "ratio", 0.03, 8.0, False, sized(rig, "virgin")),
    "guard_plate": EffectLaw("muscle", "N/mm", 0.5, 300.0, False,
                             sized(rig, "guard_n_mm", guard_mm=(5.6, 6.6), guard_muscle=[0.0, 1.0])),
    "jumping_tendon": EffectLaw("joint", "mm", 0.03, 8.0, False, sized(rig, "groove_mm", groove_rad=(-0.1, 0.3))),
    "stray_field": EffectLaw("sensor", "deg s/MPa", 0.1, 20.0, False, sized(reading, "stray_deg_s")),
    "zero_tracking": EffectLaw("sensor", "1/s", 3e-3, 4.0, False, sized(reading, "tracking_per_s")),
    "wrong_knot": EffectLaw("sensor", "deg", 0.1, 15.0, False, sized(reading, "knot_deg", knot_at_deg=(-20.0, 20.0))),
}  # fmt: skip
"""Effects that no library has, of every stage; none of them is one of the other families'."""

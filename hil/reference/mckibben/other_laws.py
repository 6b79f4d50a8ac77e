"""Every effect of the library as another law: what the blind check switches on in the physics plant.

An entry turns one signed size into the plant's disturbance parameters; chance details that are no size (which valve,
which phase, how uneven) are drawn. The comment at each entry says which law stands here against which one in the
library.
"""

import math
from typing import Any, Final

from numpy.random import Generator

from hil.reference.effect_law import EffectLaw
from hil.reference.mckibben.disturbance import CommandLaw, Disturbance, RigLaw, SensorLaw


def rig(**parameters: float) -> Disturbance:
    return Disturbance(rig=RigLaw(**parameters))


def command(**parameters: float) -> Disturbance:
    return Disturbance(command=CommandLaw(**parameters))


def sensor(**parameters: float) -> Disturbance:
    return Disturbance(sensor=SensorLaw(**parameters))


def one_of(random: Generator, *choices: Any) -> Any:
    return choices[int(random.integers(len(choices)))]


def _delay(size: float, random: Generator) -> Disturbance:
    return command(delay_s=size, delay_spread=float(random.uniform(0.05, 0.2)))


def _lost(size: float, random: Generator) -> Disturbance:
    return command(repeat=size, repeat_run=float(random.uniform(1.0, 4.0)), repeat_all=float(random.integers(2)))


def _valve_gain(size: float, random: Generator) -> Disturbance:
    return rig(gain_1=size, gain_2=size * float(random.uniform(0.8, 1.2)), gain_bend=float(random.uniform(-0.15, 0.15)))


def _valve_offset(size: float, random: Generator) -> Disturbance:
    first = bool(random.integers(2))
    return rig(offset_1_mpa=size if first else 0.0, offset_2_mpa=0.0 if first else size)


def _slew(size: float, random: Generator) -> Disturbance:
    return rig(orifice_fill=size, orifice_exhaust=size, keep_bandwidth=1.0)


def _asymmetry(size: float, random: Generator) -> Disturbance:
    clogged = 1.0 / (1.0 + abs(size))
    return rig(orifice_exhaust=clogged) if size > 0.0 else rig(orifice_fill=clogged)


def _leak(size: float, random: Generator) -> Disturbance:
    name = one_of(random, "leak_1_s", "leak_2_s", "tap_1", "tap_2")
    return rig(**{name: size * (22.0 if name.startswith("leak") else 1.0)})


def _mismatch(size: float, random: Generator) -> Disturbance:
    return rig(braid_1=-0.25 * size, braid_2=0.25 * size)


def _co_contraction(size: float, random: Generator) -> Disturbance:
    uneven = float(random.uniform(-0.03, 0.03))
    return rig(offset_1_mpa=size * (1.0 + uneven), offset_2_mpa=size * (1.0 - uneven))


def _warm_up(size: float, random: Generator) -> Disturbance:
    return rig(warm_up=size, warm_up_s=float(random.uniform(20.0, 45.0)))


def _gravity(size: float, random: Generator) -> Disturbance:
    return rig(gravity_nm=size, gravity_rad=float(random.uniform(-1.2, 1.2)))


def _play(size: float, random: Generator) -> Disturbance:
    return sensor(play_deg=2.0 * size, play_spread=float(random.uniform(0.0, 0.3)))


def _end_stop(size: float, random: Generator) -> Disturbance:
    limit = math.radians(size)
    either = rig(stop_high_rad=limit), rig(stop_low_rad=-limit), rig(stop_high_rad=limit, stop_low_rad=-limit)
    return one_of(random, *either)  # type: ignore[no-any-return]


def _sensor_gain(size: float, random: Generator) -> Disturbance:
    return sensor(gain=size, gain_bend=float(random.uniform(-0.1, 0.1)))


def _sensor_drift(size: float, random: Generator) -> Disturbance:
    tau_s = float(random.uniform(20.0, 60.0))
    return sensor(drift_deg=size / 60.0 * 20.0 / (1.0 - math.exp(-20.0 / tau_s)), drift_s=tau_s)


def _nonlinearity(size: float, random: Generator) -> Disturbance:
    return sensor(bend_deg=size, bend_rad=float(random.uniform(0.0, 2.0 * math.pi)))


def _sensor_lag(size: float, random: Generator) -> Disturbance:
    return sensor(lag_s=size, lag_poles=float(one_of(random, 2, 3)))


def _quantisation(size: float, random: Generator) -> Disturbance:
    return sensor(step_deg=size, step_uneven=float(random.uniform(0.05, 0.2)))


def _hum(size: float, random: Generator) -> Disturbance:
    return sensor(hum_deg=size, hum_hz=float(one_of(random, 50.0, 60.0)))


def _dropout(size: float, random: Generator) -> Disturbance:
    return sensor(
        dropout=size, dropout_run=float(random.uniform(1.0, 4.0)), dropout_deg=float(one_of(random, 0.0, -172.5))
    )


OTHER_LAWS: Final[dict[str, EffectLaw]] = {
    # jittering queue | fixed delay
    "delay": EffectLaw("timing", "s", 1e-3, 0.15, False, _delay, "delay_s"),
    # drift that settles as the clock warms up | constant rate
    "clock_drift": EffectLaw("timing", "relative", 5e-5, 0.02, True, lambda size, _: command(clock_rate=size), "drift"),
    # bursts of repeated packets, whole or angle only | independent repeats
    "lost_samples": EffectLaw("timing", "probability", 0.01, 0.85, False, _lost),
    # bent, uneven pressure sensors inside the control loop | gain on the set-point
    "valve_gain": EffectLaw("valve", "relative", 2e-3, 0.25, True, _valve_gain, "gain"),
    "valve_offset": EffectLaw("valve", "MPa", 2e-4, 0.04, True, _valve_offset, "offset_mpa"),
    # laminar filling of a pilot chamber | linear first order
    "valve_lag": EffectLaw("valve", "s", 1e-3, 0.3, False, lambda size, _: rig(pilot_s=size), "tau_s"),
    # choked orifice behind a spool of unchanged bandwidth | limit of dp/dt
    "valve_slew": EffectLaw("valve", "orifice", 0.03, 0.9, False, _slew, falling=True),
    # one of two orifices clogged | two time constants
    "fill_exhaust_asymmetry": EffectLaw("valve", "ratio - 1", 0.05, 12.0, True, _asymmetry),
    # spool overlap: opens late, closes late (hysteretic hold) | dead-band
    "valve_dead_band": EffectLaw("valve", "MPa", 1e-3, 0.06, False, lambda size, _: rig(overlap_mpa=size), "width_mpa"),
    # relief valve that yields to the regulator | sharp ceiling
    "pressure_ceiling": EffectLaw("valve", "MPa", 0.16, 0.40, False, lambda size, _: rig(relief_mpa=size),
    "ceiling_mpa", falling=True),
    # tank refilled through a restriction | sag in proportion to the flow, at once
    "supply_droop": EffectLaw("valve", "ratio", 0.5, 60.0, False, lambda size, _: rig(tank=size)),
    "co_contraction": EffectLaw("muscle", "MPa", 5e-4, 0.08, True, _co_contraction, "shift_mpa"),
    # braid angle: strength with another force law | factor on the pressure
    "muscle_mismatch": EffectLaw("muscle", "relative", 1e-3, 0.25, True, _mismatch),
    # choked leak against the regulator, or tap with a quadratic drop behind the monitor | share of the pressure
    "leak": EffectLaw("muscle", "relative", 1e-3, 0.2, False, _leak),
    # four relaxing springs, 0.3 to 30 s | one low pass
    "creep": EffectLaw("muscle", "relative", 0.003, 0.9, False, lambda size, _: rig(relaxing=size)),
    # warming towards an end, rubber softens and force sinks | straight line
    "thermal_drift": EffectLaw("muscle", "relative", 0.005, 0.35, True, _warm_up),
    # LuGre with Stribeck | play of fixed width
    "coulomb_friction": EffectLaw("joint", "N m", 0.01, 8.0, False, lambda size, _: rig(lugre_nm=size)),
    # shear-thinning grease | proportional to speed
    "viscous_friction": EffectLaw("joint", "N m s/rad", 0.03, 12.0, False, lambda size, _: rig(grease_nm_s=size)),
    # mass inside the non-linear joint | linear second order
    "inertia": EffectLaw("joint", "kg m2", 1e-3, 1.2, False, lambda size, _: rig(inertia_kgm2=size)),
    "gravity_load": EffectLaw("joint", "N m", 0.02, 10.0, True, _gravity),
    # worn coupling that pulls softly, wider where worn | play operator
    "backlash": EffectLaw("joint", "deg", 0.01, 6.0, False, _play, "width_deg"),
    # Hunt-Crossley buffer | clipped angle
    "end_stop": EffectLaw("joint", "deg", 6.0, 44.0, False, _end_stop, falling=True),
    "sensor_gain": EffectLaw("sensor", "relative", 1e-3, 0.25, True, _sensor_gain, "gain"),
    "sensor_offset": EffectLaw("sensor", "deg", 0.03, 8.0, True, lambda size, _: sensor(offset_deg=size), "offset_deg"),
    # drift that settles | straight line
    "sensor_drift": EffectLaw("sensor", "deg/min", 0.2, 40.0, True, _sensor_drift, "rate_deg_min"),
    # eccentric disc | square and cube
    "sensor_nonlinearity": EffectLaw("sensor", "deg", 0.1, 12.0, True, _nonlinearity),
    # two or three poles | one pole
    "sensor_lag": EffectLaw("sensor", "s", 1e-3, 0.2, False, _sensor_lag, "tau_s"),
    # uneven converter | even rounding
    "quantisation": EffectLaw("sensor", "deg", 0.12, 10.0, False, _quantisation, "step_deg"),
    # swelling line with third harmonic | sine
    "mains_hum": EffectLaw("sensor", "deg", 0.02, 4.0, False, _hum),
    # heavy tails, stronger when moving | white and normal
    "sensor_noise": EffectLaw("sensor", "deg", 0.02, 4.0, False, lambda size, _: sensor(noise_deg=size), "std_deg"),
    # bursts (Gilbert) that fall to one value and come back within a few samples | independent samples
    "sensor_dropout": EffectLaw("sensor", "probability", 1e-4, 0.2, False, _dropout, "probability"),
}  # fmt: skip


def _stall(size: float, random: Generator) -> Disturbance:
    return command(stall_s=size, stall_every_s=float(random.uniform(1.5, 4.0)))


def _hose(size: float, random: Generator) -> Disturbance:
    return rig(hose_hz=3.0 / size, hose_damping=float(random.uniform(0.08, 0.15)))


def _hunting(size: float, random: Generator) -> Disturbance:
    return rig(hunt_mpa=size, hunt_hz=float(random.uniform(1.3, 4.5)))


def _notch(size: float, random: Generator) -> Disturbance:
    return rig(
        notch=size, notch_rad=float(random.uniform(-0.25, 0.25)), notch_width_rad=float(random.uniform(0.05, 0.09))
    )


def _cogging(size: float, random: Generator) -> Disturbance:
    return rig(cog_nm=size, cog_per_rad=2.0 * math.pi / math.radians(float(random.uniform(9.0, 16.0))))


def _jam(size: float, random: Generator) -> Disturbance:
    return rig(
        jam_nm=25.0, jam_length_s=size, jam_every_s=float(random.uniform(2.5, 6.0)),
        jam_start_s=float(random.uniform(0.5, 2.5))
    )  # fmt: skip


def _push(size: float, random: Generator) -> Disturbance:
    return rig(push_nm=size, push_hz=float(random.uniform(1.1, 3.7)))


def _dead_spot(size: float, random: Generator) -> Disturbance:
    middle = float(random.uniform(-12.0, 12.0))
    return sensor(dead_low_deg=middle - 0.5 * size, dead_high_deg=middle + 0.5 * size)


FOREIGN: Final[dict[str, EffectLaw]] = {
    "command_stall": EffectLaw("timing", "s", 0.01, 0.8, False, _stall),
    "hose_ringing": EffectLaw("valve", "3 Hz / f", 0.12, 2.2, False, _hose),
    "valve_hunting": EffectLaw("valve", "MPa", 5e-4, 0.05, False, _hunting),
    "bladder_threshold": EffectLaw("muscle", "MPa", 1e-3, 0.09, False, lambda size, _: rig(threshold_mpa=size)),
    "bladder_kink": EffectLaw("muscle", "share", 0.005, 0.5, True, _notch),
    "cogging": EffectLaw("joint", "N m", 0.03, 3.0, False, _cogging),
    "brake_grabs": EffectLaw("joint", "s", 0.015, 1.5, False, _jam),
    "foreign_push": EffectLaw("joint", "N m", 0.02, 6.0, False, _push),
    "worn_track": EffectLaw("sensor", "deg", 0.4, 25.0, False, _dead_spot),
}
"""Effects that no library has, of every stage."""

"""The table of effect stages: key -> function, slot, size of its state, parameters with unit, bounds and neutral value.

Slots are those of the chain: timing, valve (both before the pressure monitors), muscle (before the hysteresis), joint,
sensor.
"""

from typing import Final

from rig.model.effect_stages import joint, limits, muscle, sensor, timing, valve
from rig.model.effect_stages.stage import WHOLE_SESSION, EffectParameter, EffectStage
from rig.model.equations.joint_balance import (
    LOOP_RADII_DEG,
    MOST_SOFTER_PER_DEG,
    MOST_SOFTER_PER_DEG2,
    PRESLIDING_DEG,
    STATE_SIZE,
)
from rig.model.slots import Slot, StageFunction

FORMER_NAMES: Final = {"drag_s": "viscous_time_s", "sway_s": "inertia_time_s"}
"""What models of before may still call a parameter."""
_P = EffectParameter
_BALANCE = _P("balance", "1", -2.0, 2.0, 0.0, "0 both valves, 1 valve 1 alone, -1 valve 2 alone, +-2 opposite signs")
_MUSCLE = _P("muscle", "1", 1.0, 2.0, 1.0, "which muscle: 1 or 2")
_LOSS = (
    _P("loss", "1", 0.0, 0.8, 0.0, "share of the pressure lost"),
    _MUSCLE,
    _P("absolute", "1", 0.0, 1.0, 0.0, "1 of the absolute pressure, as by a choked leak, 0 of the gauge pressure"),
)
"""What a leak ahead of the monitor and one behind it share."""
_P0 = _P("p0_mpa", "MPa", 0.02, 0.6, 0.2, "mean pressure at which the size holds", "the rig's")
_TAU0 = _P("tau0_s", "s", 0.0, 1.0, 0.0, "time constant of the nominal regulator", "the valves'; 0 if they have none")
_INTEGRAL = _P(
    "integral_s", "s", 0.0, 10.0, 0.0, "integral time of regulators that go on when a limit is over; 0: they do not"
)
_TURBULENT = _P(
    "turbulent_mpa_s",
    "MPa/s",
    0.01,
    valve.LAMINAR_MPA_S,
    valve.LAMINAR_MPA_S,
    "flow from which the drop goes with its square",
)
_BALANCED = (
    _P(
        "width_deg",
        "deg",
        -30.0,
        30.0,
        0.0,
        "dry friction over stiffness: half the band that does not move; below 0 less",
    ),
    _P("tau_s", "s", -0.5, 2.0, 0.0, "viscous friction over stiffness; below 0 less"),
    _P("time_s", "s", -0.5, 0.5, 0.0, "square root of inertia over stiffness; below 0 less"),
    _P("load_deg", "deg", -60.0, 60.0, 0.0, "torque of the weight over stiffness"),
    _P("phase_deg", "deg", -180.0, 180.0, 0.0, "angle of the weight at 0 degrees"),
    _P0,
    _P("viscous_time_s", "s", 0.0, 2.0, 0.0, "viscous friction of the nominal joint over stiffness"),
    _P("inertia_time_s", "s", 0.0, 0.5, 0.0, "square root of the nominal inertia over stiffness"),
    *(
        _P(f"loop_{j + 1}", "1", 0.0, 50.0, 0.0, f"nominal dry friction that slips after about {r:g} degrees")
        for j, r in enumerate(LOOP_RADII_DEG)
    ),
    _P(
        "softer",
        "1/deg",
        -MOST_SOFTER_PER_DEG,
        MOST_SOFTER_PER_DEG,
        0.0,
        "how much softer the nominal joint is towards greater angles",
    ),
    _P(
        "softer_out",
        "1/deg^2",
        -MOST_SOFTER_PER_DEG2,
        MOST_SOFTER_PER_DEG2,
        0.0,
        "how much softer it is towards both ends",
    ),
    _P("presliding_deg", "deg", 0.01, 20.0, PRESLIDING_DEG, "how far added dry friction gives before it slips"),
)
"""What the effects of the joint's balance share; each is the one number that is not neutral."""
_SEED = _P("seed", "1", 0.0, 1e6, 0.0, "seed of the random numbers")


def _entry(
    effect: str,
    place: str,
    function: StageFunction,
    state_size: int,
    *numbers: EffectParameter,
    exact: bool = False,
    late: tuple[float, float] = (0.0, 0.0),
    at_an_angle: bool = False,
    in_samples: bool = False,
) -> EffectStage:
    """`place` is "stage" or "stage@slot", with "<" for ahead of the slot's nominal stage. The size is the first
    number."""
    lies_in, _, at = place.rstrip("<").partition("@")
    slot, size, before = Slot(at or lies_in), numbers[0].name, place.endswith("<")
    return EffectStage(
        effect, lies_in, slot, function, state_size, numbers, size, before, exact, late, at_an_angle, in_samples
    )


def _balanced(effect: str, size: str) -> EffectStage:
    return EffectStage(effect, "joint", Slot.JOINT, joint.balance_again, STATE_SIZE, _BALANCED, size)


OWN_STAGES: dict[str, EffectStage] = {
    "delay": _entry("delay", "timing", timing.delay, timing.PACE_STATE,
        _P("delay_s", "s", 0.0, 1.0, 0.0, "dead time"), exact=True, late=(1.0, 0.0)),
    "clock_drift": _entry("clock_drift", "timing", timing.clock_drift, timing.PACE_STATE,
        _P("drift", "1", -0.05, 0.05, 0.0, "how much the rig's clock is fast; below 0 it falls behind its commands"),
        WHOLE_SESSION, exact=True, late=(0.0, -1.0)),
    "lost_samples": _entry("lost_samples", "timing@sensor", timing.lost_samples, 3,
        _P("probability", "1", 0.0, 0.9, 0.0, "share of repeated samples"), _SEED, in_samples=True),
    "valve_gain": _entry("valve_gain", "valve", valve.valve_gain, 1,
        _P("gain", "1", -0.5, 0.5, 0.0, "relative error of the gain"), _BALANCE, exact=True),
    "valve_offset": _entry("valve_offset", "valve", valve.valve_offset, 1,
        _P("offset_mpa", "MPa", -0.15, 0.15, 0.0, "error of the zero"), _BALANCE, exact=True),
    "valve_lag": _entry("valve_lag", "valve", valve.valve_lag, 5,
        _P("tau_s", "s", -0.5, 1.0, 0.0, "further time constant; negative is quicker"), _BALANCE, _TAU0),
    "valve_filter": _entry("valve_lag", "valve", valve.valve_filter, 1 + 4 * valve.VALVE_POLES,
        _P("tau_s", "s", 0.0, 1.0, 0.0, "sum of the filter's time constants"), _BALANCE,
        _P("poles", "1", 1.0, valve.VALVE_POLES, 1.0, "equal poles that it has"), _TURBULENT, exact=True),
    "valve_slew": _entry("valve_slew", "valve", limits.valve_slew, limits.MORE,
        _P("fill_mpa_s", "MPa/s", 0.01, limits.UNLIMITED_MPA_S, limits.UNLIMITED_MPA_S, "limit while filling"),
        _P("exhaust_mpa_s", "MPa/s", 0.01, limits.UNLIMITED_MPA_S, limits.UNLIMITED_MPA_S, "limit while exhausting"),
        _BALANCE, _TAU0,
        _P("choked", "1", 0.0, 1.0, 0.0, "1: exhausting slows down as the pressure falls, as through an orifice"),
        _P("soft", "1", 0.0, 1.0, 0.0, "1: a resistance in series, that takes half of the flow at the limit"),
        _INTEGRAL),
    "set_point_ramp": _entry("valve_slew", "valve@timing", limits.set_point_ramp, limits.HELD,
        _P("rate_mpa_s", "MPa/s", 0.01, limits.UNLIMITED_MPA_S, limits.UNLIMITED_MPA_S, "limit of a set-point")),
    "fill_exhaust_asymmetry": _entry("fill_exhaust_asymmetry", "valve", valve.fill_exhaust_asymmetry, 5,
        _P("ratio", "1", 0.02, 50.0, 1.0, "exhaust over fill time constant"),
        _P("fill_share", "1", 0.0, 1.0, 0.0, "0 exhausting changed, 1 filling changed"), _BALANCE, _TAU0),
    "one_way_line": _entry("fill_exhaust_asymmetry", "valve@muscle<", valve.one_way_line, 3,
        _P("tau_s", "s", 0.0, 1.0, 0.0, "time constant of the line in its slow direction"),
        _P("fill_share", "1", 0.0, 1.0, 0.0, "0 slow in exhausting, 1 in filling"), _BALANCE,
        _TURBULENT),
    "valve_dead_band": _entry("valve_dead_band", "valve", valve.valve_dead_band, 7,
        _P("width_mpa", "MPa", 0.0, 0.2, 0.0, "change of set-point without reaction"),
        _P("edge", "1", 0.0, 1.0, 1.0,
            "1 stops at the edge of the band; below 1 it goes on until this share of the width is left"),
        _BALANCE, _TAU0,
        _P("one_way", "1", -1.0, 1.0, 0.0, "by how much wider it is to fill than to exhaust: times 1 + and 1 - this")),
    "numb_regulator": _entry("valve_dead_band", "valve", limits.numb_regulator, limits.NUMB_STATE,
        _P("width_mpa", "MPa", 0.0, 0.2, 0.0, "error that a regulator does not see, which goes on as before then"),
        _P("integral_s", "s", 0.0, 10.0, 0.0, "its integral time"), _BALANCE, _TAU0),
    "overlapped_valve": _entry("valve_dead_band", "valve", limits.overlapped_valve, limits.NUMB_STATE,
        _P("overlap_mpa", "MPa", 0.0, 0.2, 0.0, "error at which the valve of a regulator begins to open"),
        _P("integral_s", "s", 0.0, 10.0, 0.0, "the regulator's integral time"), _BALANCE, _TAU0),
    "pressure_ceiling": _entry("pressure_ceiling", "valve", limits.pressure_ceiling, limits.MORE,
        _P("ceiling_mpa", "MPa", 0.02, 2.0, 2.0, "highest pressure"), _TAU0, _INTEGRAL),
    "low_supply": _entry("pressure_ceiling", "valve", limits.low_supply, limits.MORE,
        _P("supply_mpa", "MPa", 0.02, 2.0, 2.0, "pressure of the main"), _TAU0, _INTEGRAL),
    "supply_droop": _entry("supply_droop", "valve", limits.supply_droop, limits.MORE + 3,
        _P("droop_s", "s", 0.0, 2.0, 0.0, "sag in MPa for each MPa/s of filling"),
        _P("supply_mpa", "MPa", 0.0, 2.0, 0.0, "pressure of the supply without flow; 0: sags at every pressure"), _TAU0,
        _P("refill_s", "s", 0.0, 5.0, 0.0,
            "time constant in which a tank ahead of the regulators is refilled; 0: no tank"),
        _INTEGRAL),
    "clogged_line": _entry("supply_droop", "valve", limits.clogged_line, limits.MORE + 2,
        _P("fill_mpa_s", "MPa/s", 0.01, limits.UNLIMITED_MPA_S, limits.UNLIMITED_MPA_S,
            "filling of both muscles at which the line takes half of the flow"),
        _TAU0, _INTEGRAL),
    "emptied_receiver": _entry("supply_droop", "valve", limits.emptied_receiver, limits.MORE + 1,
        _P("capacity_mpa_s", "MPa/s", 1e-3, limits.UNLIMITED_MPA_S, limits.UNLIMITED_MPA_S,
            "filling of both muscles that the supply keeps up with"),
        _P("fall", "1", 0.0, 20.0, 1.0,
            "fall of the receiver's pressure by what both muscles are filled with beyond that"),
        _TAU0, _INTEGRAL),
    "co_contraction": _entry("co_contraction", "muscle@valve", valve.co_contraction, 1,
        _P("shift_mpa", "MPa", -0.2, 0.2, 0.0, "shift of P0 of both muscles"), exact=True),
    "leak_ahead": _entry("leak", "muscle@valve", muscle.leak, 1, *_LOSS, exact=True),
    "fed_leak": _entry("leak", "muscle@valve", limits.fed_leak, limits.MORE,
        _P("loss", "1", 0.0, 0.8, 0.0, "what the leak takes of the absolute pressure, where filling has no limit"),
        _MUSCLE, _TAU0,
        _P("supply_mpa", "MPa", 0.02, 2.0, 2.0, "pressure of the supply"),
        _P("fill_mpa_s", "MPa/s", 0.01, limits.UNLIMITED_MPA_S, limits.UNLIMITED_MPA_S, "choked filling from it")),
    "leak": _entry("leak", "muscle<", muscle.leak, 1, *_LOSS),
    "muscle_mismatch": _entry("muscle_mismatch", "muscle<", muscle.muscle_mismatch, 1,
        _P("mismatch", "1", -0.6, 0.6, 0.0, "muscle 1 over muscle 2, less one"),
        _P("balance", "1", -1.0, 1.0, 0.0, "0 half of it in each, 1 all of it in muscle 1, -1 in muscle 2")),
    "creep": _entry("creep", "muscle@joint", muscle.creep, 1 + 2 * muscle.CREEP_TIMES,
        _P("share", "1", -0.6, 0.8, 0.0, "share of the angle that comes late"),
        _P("tau_s", "s", 0.1, 60.0, 2.0, "time constant"),
        _P("relaxed", "1", 0.0, 1.0, 0.0, "1 keeps the final angle, 0 the quick response"),
        _P("decades", "1", 0.0, 4.0, 0.0, "over how many its times spread; 0: one time constant")),
    "thermal_drift": _entry("thermal_drift", "muscle@joint", muscle.thermal_drift, 1,
        _P("rate_per_min", "1/min", -2.0, 2.0, 0.0, "change of strength a minute"),
        _P("about_deg", "deg", -360.0, 360.0, 0.0, "angle that stays where it is"), WHOLE_SESSION),
    "heated_muscles": _entry("thermal_drift", "muscle<", muscle.heated_muscles, 5,
        _P("rate_per_min", "1/min", -2.0, 2.0, 0.0,
            f"change of strength a minute while a pressure moves by {muscle.HEATING_MPA_S:g} MPa/s"),
        _P("heat_s", "s", 1.0, 1000.0, 30.0, "time constant in which the heat goes again"),
        _P("balance", "1", -2.0, 2.0, 0.0, "0 both muscles, 1 muscle 1 alone, -1 muscle 2 alone")),
    "one_muscle_warms": _entry("thermal_drift", "muscle<", muscle.one_muscle_warms, 1,
        _P("rate_per_min", "1/min", -2.0, 2.0, 0.0, "change of that muscle's strength a minute"), _MUSCLE,
        WHOLE_SESSION),
    "coulomb_friction": _balanced("coulomb_friction", "width_deg"),
    "viscous_friction": _balanced("viscous_friction", "tau_s"),
    "inertia": _balanced("inertia", "time_s"),
    "gravity_load": _balanced("gravity_load", "load_deg"),
    "stiffness": EffectStage(
        "stiffness",
        "joint",
        Slot.JOINT,
        joint.stiffness,
        STATE_SIZE + 2,
        (
            *_BALANCED,
            _P("stiffness", "1", -0.8, 4.0, 0.0, "relative change of what holds the joint at its angle"),
            _P("spring", "1", 0.0, 1.0, 0.0, "1 by a spring beside the joint, 0 by what sends it to its angles"),
            _P("rise_per_min", "1/min", -2.0, 8.0, 0.0, "how fast that changes through a record"),
            _P("relax_s", "s", 0.0, 1000.0, 0.0, "time in which the spring comes to rest; 0: it never does"),
        ),
        "stiffness",
    ),
    "backlash": _entry("backlash", "joint", joint.backlash, 2, _P("width_deg", "deg", 0.0, 30.0, 0.0, "half the play")),
    "end_stop": _entry("end_stop", "joint", joint.end_stop, 1,
        _P("high_deg", "deg", -360.0, 360.0, 360.0, "upper stop"),
        _P("low_deg", "deg", -360.0, 360.0, -360.0, "lower stop"),
        _P("give", "1", 0.0, 0.9, 0.0, "share of the push that the stop gives way"), at_an_angle=True),
    "sensor_gain": _entry("sensor_gain", "sensor", sensor.sensor_gain, 1,
        _P("gain", "1", -0.6, 0.6, 0.0, "relative error of the gain")),
    "sensor_offset": _entry("sensor_offset", "sensor", sensor.sensor_offset, 1,
        _P("offset_deg", "deg", -90.0, 90.0, 0.0, "error of the zero")),
    "sensor_drift": _entry("sensor_drift", "sensor", sensor.sensor_drift, 1,
        _P("rate_deg_min", "deg/min", -300.0, 300.0, 0.0, "wandering of the zero"), WHOLE_SESSION),
    "slipping_sensor": _entry("sensor_drift", "sensor", sensor.slipping_sensor, 3,
        _P("share", "1", -0.2, 0.2, 0.0, "of the way that the joint goes, either way, by which the zero wanders")),
    "sensor_nonlinearity": _entry("sensor_nonlinearity", "sensor", sensor.sensor_nonlinearity, 1,
        _P("square", "1", -0.6, 0.6, 0.0, "square term at scale_deg, relative"),
        _P("cube", "1", -0.6, 0.6, 0.0, "cube term at scale_deg, relative"),
        _P("scale_deg", "deg", 1.0, 360.0, 30.0, "angle at which the terms hold"),
        _P("slope", "1", -0.3, 0.3, 0.0, "gain that comes with the bend, relative")),
    "sensor_lag": _entry("sensor_lag", "sensor", sensor.sensor_lag, 1 + 2 * sensor.SENSOR_POLES,
        _P("tau_s", "s", 0.0, 2.0, 0.0, "sum of the filter's time constants"),
        _P("poles", "1", 1.0, sensor.SENSOR_POLES, 1.0, "equal poles that it has")),
    "quantisation": _entry("quantisation", "sensor", sensor.quantisation, 1,
        _P("step_deg", "deg", 1e-6, 20.0, 1e-6, "step of the converter"),
        _P("code", "1", 0.0, 2.0, 0.0, "0 the nearest code, 1 the next lower one, 2 the next one towards zero"),
        in_samples=True),
    "mains_hum": _entry("mains_hum", "sensor", sensor.mains_hum, 1,
        _P("amplitude_deg", "deg", 0.0, 20.0, 0.0, "amplitude"),
        _P("frequency_hz", "Hz", 1.0, 1000.0, 50.0, "frequency"),
        _P("phase_deg", "deg", -180.0, 180.0, 0.0, "phase at the start"), in_samples=True),
    "sensor_noise": _entry("sensor_noise", "sensor", sensor.sensor_noise, 2,
        _P("std_deg", "deg", 0.0, 20.0, 0.0, "standard deviation"), _SEED, in_samples=True),
    "sensor_dropout": _entry("sensor_dropout", "sensor", sensor.sensor_dropout, 3,
        _P("probability", "1", 0.0, 0.9, 0.0, "share of samples at the rail"),
        _P("rail_deg", "deg", -360.0, 360.0, 0.0, "what a sample reads that falls"),
        _P("burst", "1", 1.0, 200.0, 1.0, "samples that fall in a row, in the mean"), _SEED, in_samples=True),
}  # fmt: skip

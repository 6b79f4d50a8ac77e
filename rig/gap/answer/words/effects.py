"""Each effect of the library for somebody at the rig: its sentence with size and sign, likely reasons, and what to look at.

A sentence that ends in `{than}` compares with the reference ("later than the simulator says"); one without it is something that the
reference does not have. Effects of other packages have no line here and are told by their `looks_like`.
"""

# ruff: noqa: E501 (one line an effect reads best as a table)
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from rig.gap.answer.result import Interval
from rig.gap.answer.settings import SOFT_STOP
from rig.gap.answer.words.sizes import percent, share, size
from rig.gap.raw_tests.converter_codes import CUT_OFF, ConverterCode
from rig.model.effect_stages import WHOLE_SESSION

Numbers = Mapping[str, Interval]
EffectSentence = Callable[[Numbers], str]


@dataclass(frozen=True)
class EffectWords:
    """An effect in the words of the rig."""

    noun: str
    """What it is called in a list of what it may also be."""
    sentence: EffectSentence
    """Fitted numbers -> its sentence, without a full stop; `{than}` where it compares with the reference."""
    reasons: str
    look_at: str


def value(numbers: Numbers, name: str, usual: float = 0.0) -> float:
    """A number of a law, or what it is where the law does not have it."""
    return numbers[name].value if name in numbers else usual


def _more(numbers: Numbers, name: str, more: str, less: str) -> str:
    return more if value(numbers, name) >= 0.0 else less


def _way(numbers: Numbers, name: str) -> str:
    return _more(numbers, name, "upwards", "downwards")


def _valves(numbers: Numbers, both: str, single: str) -> str:
    """Whom an effect of the two valves, or muscles, concerns, by its balance."""
    balance = value(numbers, "balance")
    if abs(balance) < 0.5 or abs(balance) > 1.5:
        return both
    return single.format(1 if balance > 0.0 else 2)


def _valve_offset(numbers: Numbers) -> str:
    by, up = size(numbers["offset_mpa"]), _more(numbers, "offset_mpa", "higher", "lower")
    if abs(value(numbers, "balance")) > 1.5:
        return f"The pressure of valve 1 is {by} {up} {{than}}, that of valve 2 as much the other way"
    return f"{_valves(numbers, 'Both pressures are', 'The pressure of valve {} is')} {by} {up} {{than}}"


def _valve_slew(numbers: Numbers) -> str:
    if "rate_mpa_s" in numbers:
        return f"The regulators move their set-points by no more than {size(numbers['rate_mpa_s'])}, as with a ramp set in them"
    fill, empty = numbers["fill_mpa_s"], numbers.get("exhaust_mpa_s")
    whose = _valves(numbers, "the regulators", "regulator {}")
    if empty is None or empty.value == fill.value:
        return f"The pressures change by no more than {size(fill)}, which is as fast as {whose} can"
    return f"The pressures rise by no more than {size(fill)} and fall by no more than {size(empty)}, which is as fast as {whose} can"


def _one_way(numbers: Numbers) -> str:
    if "tau_s" in numbers:
        does, other = ("fill", "emptying") if value(numbers, "fill_share") > 0.5 else ("empty", "filling")
        return f"Behind the pressure monitors the muscles {does} {size(numbers['tau_s'])} later than these say; {other} is as quick as ever"
    if "ratio" not in numbers:
        name, does = ("exhaust_mpa_s", "empty") if "exhaust_mpa_s" in numbers else ("fill_mpa_s", "fill")
        if value(numbers, "soft") > 0.5:
            return f"Something narrows the air's way: the muscles {does} the more slowly the faster they should, half as fast at {size(numbers[name])}; the other way they are as fast as ever"
        return f"The muscles {does} by no more than {size(numbers[name])}; the other way they are as fast as ever"
    slow, fast = ("Emptying", "filling") if numbers["ratio"].value >= 1.0 else ("Filling", "emptying")
    return f"{slow} a muscle takes {_times(numbers['ratio'])} as long as {fast} it"


def _times(ratio: Interval) -> str:
    """How many times as long the slower way takes; at least so many where the ratio stands at the end of its law."""
    at_end = ratio.low < ratio.high and ratio.value in (ratio.low, ratio.high)
    return f"{'at least ' if at_end else ''}{max(ratio.value, 1.0 / max(ratio.value, 1e-6)):.2g} times"


def _ceiling(numbers: Numbers) -> str:
    if "supply_mpa" in numbers:
        return f"The supply stands at {size(numbers['supply_mpa'])} only, and the closer the pressures come to it the more slowly the muscles fill"
    level = numbers["ceiling_mpa"].value  # read off the cut peaks; the interval is that of a law's share of the level
    return f"The pressures do not rise above {size(Interval(level, level, level, 'MPa'))}"


def _supply_droop(numbers: Numbers) -> str:
    if "capacity_mpa_s" in numbers:
        return f"The supply keeps up with no more than {size(numbers['capacity_mpa_s'])} of filling: with more its receiver empties, and the muscles fill late"
    if "fill_mpa_s" in numbers:
        return f"The line ahead of both regulators is narrow: it takes half of the flow where the muscles should fill by {size(numbers['fill_mpa_s'])}"
    if "droop_s" in numbers:
        return f"The supply sags while the muscles fill, by {value(numbers, 'droop_s'):.2g} MPa for each MPa/s"
    return f"The supply sags while the muscles fill: filling takes {_times(numbers['ratio'])} as long as emptying"


def _dead_band(n: Numbers) -> str:
    if "overlap_mpa" in n:
        return f"The valves of the regulators do not open before the pressure is {size(n['overlap_mpa'])} off, until the regulators' integral action has made up for it"
    who, by, more = _valves(n, "The regulators do", "Regulator {} does"), size(n["width_mpa"]), value(n, "one_way")
    if "integral_s" in n:
        return f"{who} not see errors below {by}, and the pressure goes on as before meanwhile"
    way = "" if more == 0.0 else f", {'less' if more > 0.0 else 'more'} to exhaust than to fill"
    return f"{who} not react while the set-point changes by less than {by}{way}"


def _and_after(during: EffectSentence) -> EffectSentence:
    """A limit's sentence, with what regulators that integrate do once it is over."""

    def sentence(numbers: Numbers) -> str:
        late = value(numbers, "integral_s") > 0.0
        return during(numbers) + ("; afterwards they come back late, since the regulators integrate" if late else "")

    return sentence


def _mismatch(numbers: Numbers) -> str:
    if "offset_deg" in numbers:
        return f"The muscles pull unequally: the joint stands {size(numbers['offset_deg'])} {_more(numbers, 'offset_deg', 'higher', 'lower')} {{than}}"
    whose = _valves(numbers, "Muscle 1, against muscle 2,", "Muscle {}")
    more, less = ("less", "more") if whose == "Muscle 2" else ("more", "less")
    return f"{whose} pulls {size(numbers['mismatch'])} {_more(numbers, 'mismatch', more, less)} {{than}}"


def _leak(numbers: Numbers) -> str:
    if "supply_mpa" in numbers:
        return f"{_muscle(numbers)} leaks more than its regulator can feed: its pressure falls short the more, the closer it comes to {size(numbers['supply_mpa'])}"
    return f"{_muscle(numbers)} loses {size(numbers['loss'])} of its pressure"


def _muscle(numbers: Numbers) -> str:
    return f"Muscle {2 if value(numbers, 'muscle', 1.0) > 1.5 else 1}"


def _creep(numbers: Numbers) -> str:
    if "relax_s" in numbers:
        firmer = _more(numbers, "stiffness", "stiffer", "softer")
        return f"Quick motion meets a joint that is {size(numbers['stiffness'])} {firmer}, which gives way over about {size(numbers['relax_s'])}"
    on = _more(numbers, "share", "goes on", "comes back")
    return f"Once the pressures have settled the angle still {on} by {size(numbers['share'])}, over about {size(numbers['tau_s'])}"


def _inertia(numbers: Numbers) -> str:
    own = f"(the root of inertia over stiffness is {size(numbers['time_s'])}, which alone rings at {_rings(numbers)})"
    return f"The joint overshoots and rings like one with {_more(numbers, 'time_s', 'more', 'less')} mass {own}"


def _rings(numbers: Numbers) -> str:
    """Natural frequency of an inertia time."""
    time = numbers["time_s"]
    ends = [1.0 / (2.0 * math.pi * max(abs(end), 1e-4)) for end in (time.value, time.low, time.high)]
    return size(Interval(ends[0], min(ends), max(ends), "Hz"))


def _load(numbers: Numbers) -> str:
    return f"A weight (or spring) turns the joint by up to {size(numbers['load_deg'])}"


def through(numbers: Numbers) -> str:
    """How long what changes with time goes on, where that is longer than a record."""
    return ", through the whole session" if value(numbers, WHOLE_SESSION.name) > 0.5 else ""


def _warming(numbers: Numbers) -> str:
    if "share" in numbers:
        return f"Muscles that warm unequally as they work move the joint {_way(numbers, 'share')}, by {size(numbers['share'])} of its travel"
    if "rate_deg_min" in numbers:
        return f"Muscles that warm unequally move the joint by {size(numbers['rate_deg_min'])} {_way(numbers, 'rate_deg_min')}"
    if "muscle" in numbers:
        stronger = _more(numbers, "rate_per_min", "stronger", "weaker")
        return f"{_muscle(numbers)} gets {stronger} by {size(numbers['rate_per_min'])}{through(numbers)}"
    if "heat_s" in numbers:
        stronger = _more(numbers, "rate_per_min", "stronger", "weaker")
        return f"The muscles get {stronger} by their own heat, by {size(numbers['rate_per_min'])} of brisk work"
    if "rate_per_min" in numbers:
        grows = _more(numbers, "rate_per_min", "grows", "shrinks")
        about = f" about {size(numbers['about_deg'], signed=True)}" if "about_deg" in numbers else ""
        return f"The motion {grows} by {size(numbers['rate_per_min'])}{about}{through(numbers)}"
    firmer = _more(numbers, "rise_per_min", "stiffer", "softer")
    return f"The muscles hold the joint ever {firmer}, by {size(numbers['rise_per_min'])}"


def _sensor_drift(numbers: Numbers) -> str:
    if "share" in numbers:
        return f"The sensor's zero wanders {_way(numbers, 'share')} as the joint moves, by {size(numbers['share'])} of its travel"
    return f"The sensor's zero wanders by {size(numbers['rate_deg_min'])} {_way(numbers, 'rate_deg_min')}{through(numbers)}"


def _stiffness(numbers: Numbers) -> str:
    firmer, less = (_more(numbers, "stiffness", *words) for words in (("stiffer", "softer"), ("less", "more")))
    what = "friction, mass and weight move" if value(numbers, "spring") < 0.5 else "muscles, mass and weight turn"
    return f"The joint is held {size(numbers['stiffness'])} {firmer} {{than}}, so that {what} it {less}"


def _end_stop(numbers: Numbers) -> str:
    names = [name for name in ("low_deg", "high_deg") if name in numbers and abs(value(numbers, name)) < 180.0]
    places = " and ".join(f"where it reads {size(numbers[name], signed=True)}" for name in names)
    gives = value(numbers, "give")
    soft = f"; it gives way there by {percent(gives)} of what the joint would go on" if gives >= SOFT_STOP else ""
    return f"The angle meets a stop {places}{soft}"


def _bent(numbers: Numbers) -> str:
    parts = [
        f"{size(numbers[name])} ({word})"
        for name, word in (("square", "one end against the other"), ("cube", "both ends alike"))
        if value(numbers, name)
    ]
    return f"The sensor's reading is bent, by {' and '.join(parts) or 'a little'}"


def _twice(number: Interval) -> Interval:
    return Interval(2.0 * number.value, 2.0 * number.low, 2.0 * number.high, number.unit)


EFFECT_WORDS: Mapping[str, EffectWords] = {
    "delay": EffectWords("a dead time", lambda n: f"The rig does everything {size(n['delay_s'])} {_more(n, 'delay_s', 'later', 'earlier')} {{than}}",
        "samples or commands wait in a buffer; another program or bus stands between; long hoses", "the time stamps of commands and readings; the controller's buffers; the length of the hoses"),
    "clock_drift": EffectWords("a clock that runs off", lambda n: f"The rig's clock runs {size(n['drift'])} {_more(n, 'drift', 'fast', 'slow')}{through(n)}",
        "the converter and the controller have clocks of their own", "the sample rate that the converter really has, over a long record"),
    "lost_samples": EffectWords("lost samples", lambda n: f"{share(n['probability'])} of the samples are lost and repeat the one before",
        "an overloaded bus or controller; a loose connector", "the counters of the bus; the load of the controller"),
    "valve_gain": EffectWords("another gain of the valves", lambda n: f"{_valves(n, 'Both pressures come', 'The pressure of valve {} comes')} out {size(n['gain'])} {_more(n, 'gain', 'higher', 'lower')} {{than}}",
        "the regulators' or the output's scaling; a regulator that ages", "the regulators against a reference gauge (pamrig devices calibrate pressures)"),
    "valve_offset": EffectWords("another zero of the valves", _valve_offset,
        "the regulator's zero; the zero of the analogue output or of the monitor", "both monitors with the air vented: they should read 0"),
    "valve_lag": EffectWords("slower or quicker regulators", lambda n: f"{_valves(n, 'The regulators answer', 'Regulator {} answers')} {size(n['tau_s'])} {_more(n, 'tau_s', 'later', 'sooner')} {{than}}",
        "later: a low supply pressure, long or thin hoses, larger muscles, a clogged filter or silencer; sooner: a higher supply pressure, shorter or wider hoses, a filter or silencer that was cleaned", "the supply while the rig moves; hoses, filters and silencers; a step of the set-point"),
    "valve_slew": EffectWords("a limited flow", _and_after(_valve_slew),
        "too small a valve, nozzle or hose; a throttle; a low supply; a ramp set in the regulator or the controller", "throttles, nozzles and silencers; a large step of the set-point"),
    "fill_exhaust_asymmetry": EffectWords("filling and emptying at different speeds", _and_after(_one_way),
        "a clogged silencer or throttle on one way, also in the tube of a muscle; the supply close to the pressure asked for", "the exhaust's silencer; throttles and check valves in the tubes; the supply pressure; a step up and a step down"),
    "valve_dead_band": EffectWords("a dead band of the valves", _dead_band,
        "dry friction, or overlap, of the spool; a dead band set in the regulator", "the regulator's settings; a slow ramp of the set-point"),
    "pressure_ceiling": EffectWords("a ceiling of the pressure", _and_after(_ceiling),
        "the supply is lower than what is asked for; a limit set in the regulator or the output", "the supply's gauge; the regulator's range"),
    "supply_droop": EffectWords("a supply that sags", _and_after(_supply_droop),
        "a small compressor or tank; a thin or long supply line; others on the same line", "the supply's gauge while the rig moves fast"),
    "co_contraction": EffectWords("another rest pressure", lambda n: f"Both muscles rest at a pressure {size(n['shift_mpa'])} {_more(n, 'shift_mpa', 'higher', 'lower')} {{than}}",
        "another P0 was set; both zeros are off alike", "the set P0; both monitors with the air vented"),
    "muscle_mismatch": EffectWords("muscles of unequal strength", _mismatch,
        "one muscle was changed, has aged, or is mounted at another length or lever", "lengths, levers and mounting of both muscles; exchange them and record again"),
    "leak": EffectWords("a leak", _leak,
        "a fitting, a hose or the bladder leaks", "fittings and hoses with leak spray; hold a pressure and watch the regulator's outlet"),
    "creep": EffectWords("creep", _creep,
        "rubber and mesh of the muscles relax; new, cold or hot muscles", "a long hold at one pressure; whether it fades once the muscles are warm"),
    "thermal_drift": EffectWords("a rig that changes as it warms", _warming,
        "the muscles warm up; the room's temperature", "a long record from cold; the muscles' temperature"),
    "coulomb_friction": EffectWords("dry friction", lambda n: f"Dry friction holds the joint back by {size(n['width_deg'])} {_more(n, 'width_deg', 'more', 'less')} {{than}}",
        "more: a dry, tight or dirty bearing, a cable or hose that rubs, muscles that touch; less: a bearing that was greased or has run in, less preload", "the bearing by hand without air; cables and hoses that touch; preload and tension"),
    "viscous_friction": EffectWords("friction that grows with speed", lambda n: f"Friction that grows with speed holds the joint back by {size(n['tau_s'])} {_more(n, 'tau_s', 'more', 'less')} {{than}}",
        "more: stiff grease, a damper, cold; less: thinner or warmer grease", "the bearing's grease; temperature"),
    "inertia": EffectWords("inertia", _inertia,
        "a load or tool was mounted, or taken off; the simulator was identified with another one", "what is mounted on the joint; a fast sweep of 2 to 4 Hz"),
    "stiffness": EffectWords("another stiffness or loop gain", _stiffness,
        "another gain of the position loop; a spring, a belt or a stiff cable at the joint; other muscles", "the loop's gain; how far the joint gives way to a known weight"),
    "gravity_load": EffectWords("a weight on the joint", _load,
        "a load or tool was mounted; the rig stands tilted; a cable pulls", "what hangs on the joint; a level"),
    "backlash": EffectWords("play", lambda n: f"There are {size(_twice(n['width_deg']))} of play between joint and sensor or load",
        "a loose coupling, set screw, gear or bearing", "coupling and set screws: turn by hand with the muscles under pressure"),
    "end_stop": EffectWords("a stop", _end_stop,
        "the joint or a muscle's fitting touches the frame; the sensor's range ends", "what the joint touches there; the sensor's range"),
    "sensor_gain": EffectWords("another gain of the sensor", lambda n: f"The sensor reads {size(n['gain'])} {_more(n, 'gain', 'more', 'less')} {{than}}",
        "the sensor's scaling; its supply voltage; another sensor or gear; or the joint itself: a spring or a stiff cable makes every angle smaller alike", "two known angles: if they are read right, springs and cables at the joint; the sensor's supply voltage"),
    "sensor_offset": EffectWords("another zero of the sensor", lambda n: f"The sensor's zero is {size(n['offset_deg'])} {_more(n, 'offset_deg', 'higher', 'lower')} {{than}}",
        "the sensor was mounted anew or slipped; its zero was not set", "the reading at the mechanical zero"),
    "sensor_drift": EffectWords("a sensor that drifts", _sensor_drift,
        "the sensor or its amplifier warms up; it slips on its shaft, or loses counts, as the joint moves", "a record without any motion; the reading at the mechanical zero before and after; the grub screw of the coupling"),
    "sensor_nonlinearity": EffectWords("a bent reading of the sensor", _bent,
        "a magnet or potentiometer off its centre; the end of the sensor's range", "readings at several known angles; the centring of the magnet"),
    "sensor_lag": EffectWords("a slow sensor", lambda n: f"The sensor's reading follows {size(n['tau_s'])} {_more(n, 'tau_s', 'later', 'sooner')} {{than}}",
        "a filter in the sensor, amplifier or converter", "the filters' settings"),
    "quantisation": EffectWords("a coarse reading", lambda n: f"The angle is read in steps of {size(n['step_deg'])}" + CUT_OFF[ConverterCode(int(value(n, "code")))],
        "a coarse encoder or converter; too large a range; rounding in a file", "the converter's range and bits"),
    "mains_hum": EffectWords("mains hum", lambda n: f"Hum of {size(n['amplitude_deg'])} lies on the angle",
        "a ground loop; an unshielded line; a power supply", "grounding and shields; the power supply"),
    "sensor_noise": EffectWords("noise of the sensor", lambda n: f"The angle carries noise of {size(n['std_deg'])}",
        "a loose contact; a weak signal; a drive close by", "connectors, shields, the sensor's supply"),
    "sensor_dropout": EffectWords("drop-outs of the sensor", lambda n: f"{share(n['probability']) if 'probability' in n else 'Some'} of the angle's samples fall to zero or to a rail",
        "a loose connector; a sensor that loses its signal", "connectors and cables while they are moved by hand"),
}  # fmt: skip
"""Effect -> its words."""


def capital(clause: str) -> str:
    """A clause as it begins a sentence; names in it stay as they are."""
    return f"{clause[:1].upper()}{clause[1:]}"


def noun_of(effect: str) -> str:
    """What an effect is called, with its name where that is another; of one of another package its name."""
    noun = EFFECT_WORDS[effect].noun if effect in EFFECT_WORDS else effect
    return noun if noun.removeprefix("a ") == effect else f"{noun} ({effect})"

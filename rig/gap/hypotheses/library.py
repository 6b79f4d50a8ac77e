"""The library of effects as the diagnosis knows them: laws to fit, what each looks like, and what it may be confused with.

The stages themselves (functions, numbers, bounds, units) are in `rig.model.effect_stages`; here stands, for each, which numbers are
fitted from which starting grid, and the classes that cannot be told apart from the angle alone and with pressures, stated beforehand.
Adding an effect: a stage, a line here (docs/how-to/add_an_effect.md).
"""

# ruff: noqa: E501 (one line a law reads best as a table)
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from typing import Any, Literal, get_args

from rig.errors import ConfigError
from rig.gap.priors import Prior
from rig.model.effect_stages import EFFECT_STAGES, WHOLE_SESSION, goes_on
from rig.model.effect_stages.valve import LAMINAR_MPA_S
from rig.model.slots import AHEAD
from rig.plugins import EFFECTS, Registered

NONE, UNKNOWN = "none", "unknown"
"""What an answer may name beside the effects: nothing at all, and something that is not here."""
BOTH_SIGNS = (-1.0, 1.0)
FINE = (0.005, 0.01, 0.02, 0.04, 0.08, 0.16)
FAR = (*FINE, 0.3, 0.6)
"""Up to the worst that can happen, where the way there bends: from 0.16 no descent reaches half a muscle."""


Scale = Literal[
    "one", "span_deg", "high_deg", "low_deg", "top_mpa", "swing_mpa", "rate_mpa_s", "regulator_s", "filling_mpa_s"
]
"""What a law's sizes count in (`rig.gap.hypotheses.scales`): nothing; half the angle's range, its highest and its
lowest; the highest pressure, the range of the pressures, their fastest change; the regulators' mean time constant; what
both muscles are filled with, over the record's length."""


@dataclass(frozen=True)
class Law:
    """One way an effect may act: the stage, the numbers that are fitted, and where the search starts."""

    stage: str
    free: tuple[str, ...]
    """Fitted numbers, the size first."""
    grid: tuple[float, ...]
    """Sizes to start from, in units of `scale`."""
    scale: Scale = "one"
    """What those sizes count in."""
    signs: tuple[float, ...] = (1.0,)
    shapes: tuple[Mapping[str, float], ...] = ({},)
    """Values of other numbers to scan; those that are free go on from there."""
    tied: Mapping[str, str] = field(default_factory=dict)
    """Number -> the free number that it equals."""
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Tighter bounds than the stage's: flexible forms are held to what they are meant for. Those of the size are in units of `scale`, those
    of a number that is `counted` in its own."""

    counted: Mapping[str, Scale] = field(default_factory=dict)
    """Other number of a shape -> the scale in which it counts."""
    like: str = ""
    """Effect whose laws' usual error this form has, where it acts as that one does; else its own effect's."""

    def __post_init__(self) -> None:
        for scale in (self.scale, *self.counted.values()):
            if scale not in get_args(Scale):
                raise ConfigError(
                    f"law of {self.stage}: unknown scale {scale!r}; allowed: {', '.join(get_args(Scale))}"
                )

    @property
    def whole_session(self) -> bool:
        """It goes on from record to record: of records that say when they began."""
        return any(map(goes_on, self.shapes))

    def shapes_in(self, scales: Mapping[str, float]) -> Iterator[dict[str, float]]:
        """Its shapes, each number in its own unit."""
        for shape in self.shapes:
            units = {name: scales[self.counted[name]] if name in self.counted else 1.0 for name in shape}
            yield {name: value * units[name] for name, value in shape.items()}

    def range_of(self, name: str, scales: Mapping[str, float]) -> tuple[float, float]:
        """Bounds of a free number in its own unit, its stage's where there are no tighter ones."""
        number = next(number for number in EFFECT_STAGES[self.stage].numbers if number.name == name)
        unit = scales[self.scale if name == self.free[0] else self.counted.get(name, "one")]
        low, high = sorted(end * unit for end in self.bounds.get(name, (-inf, inf)))
        return max(low, number.low), min(high, number.high)

    def with_tied(self, numbers: Mapping[str, float]) -> dict[str, float]:
        """These numbers, and those that are tied to one of them."""
        return dict(numbers) | {name: numbers[owner] for name, owner in self.tied.items()}

    def agrees(self, numbers: Mapping[str, float]) -> int:
        """With how many fixed numbers of one of its shapes these agree, all of that shape; -1 where they do with none
        of its shapes, or say something that it leaves alone."""
        stage_numbers = {number.name: number for number in EFFECT_STAGES[self.stage].numbers if not number.own}
        changed = {
            name for name, value in numbers.items() if name in stage_numbers and value != stage_numbers[name].neutral
        }
        if not changed <= {*self.free, *self.tied, *(name for shape in self.shapes for name in shape)}:
            return -1
        fixed = [{name: value for name, value in shape.items() if name not in self.free} for shape in self.shapes]
        return max((len(one) for one in fixed if one.items() <= numbers.items()), default=-1)


@dataclass(frozen=True)
class Allowed:
    """A figure of a data sheet, in the unit of the effect's size: beside it a detectable one is read."""

    size: float
    what: str


@dataclass(frozen=True)
class Effect:
    """A cause that the diagnosis can name."""

    name: str
    laws: tuple[Law, ...]
    looks_like: str
    angle_class: str
    """Effects with the same word look alike to the angle alone."""
    pressure_class: str
    """Effects with the same word look alike even with pressures."""
    misfit: float = 0.1
    """Its laws' usual error where none was fitted (`Prior.laws`): what the best of them leaves of its own change, as a share of the rms."""
    two_muscles: bool = False
    """Of two pressures against each other: a rig without valves has nothing that could be unequal."""
    as_another_p0: bool = False
    """Commands about another mean pressure than the reference's look like it: where there were some, its name is half as sure."""
    allowed: Allowed | None = None
    """What a data sheet of the paper's parts says of this very effect (docs/reference/devices.md); None where it says nothing."""
    absorbed: bool = False
    """A fit of the simulator's own parameters absorbs it: the muscles' curve and loop are free in it. Declared before any blind check,
    whose scoring alone reads it."""
    also_right: tuple[str, ...] = ()
    """Other stages at which it shows and which the scoring of the blind check, which alone reads it, counts as right."""

    @property
    def signature(self) -> bool:
        """Found by its signature in the raw samples, not by least squares."""
        return EFFECT_STAGES[self.laws[0].stage].in_samples

    @property
    def stage(self) -> str:
        """Where the report says it lies."""
        return EFFECT_STAGES[self.laws[0].stage].lies_in

    def roughness(self, prior: Prior, law: Law) -> float:
        """How rough a `law` of it usually is, as a share of what it changes."""
        return prior.rho_scale * prior.laws.get(law.like or self.name, self.misfit)

    def law_of(self, stage: str, numbers: Mapping[str, float]) -> Law:
        """The law by which it was found as this stage with these numbers (all of them): the one with the most fixed
        shapes that fits."""
        return max((law for law in self.laws if law.stage == stage), key=lambda law: law.agrees(numbers))

    @property
    def upstream(self) -> bool:
        """It shows in the pressures."""
        return EFFECT_STAGES[self.laws[0].stage].slot in AHEAD


def _both(*more: Mapping[str, float]) -> tuple[Mapping[str, float], ...]:
    return ({"balance": 0.0}, *more)


def _winding(law: Law) -> tuple[Law, Law]:
    """A limit of a regulator that does not integrate, and of one that does."""
    shapes = tuple({**shape, "integral_s": 0.7} for shape in law.shapes)
    return law, replace(
        law, free=(*law.free, "integral_s"), shapes=shapes, bounds={**law.bounds, "integral_s": (0.1, 10.0)}
    )


ONE_VALVE = ({"balance": 1.0}, {"balance": -1.0})
HOLDS = tuple(0.012 * 1.28**k for k in range(18))
"""A hold is discontinuous in its width: a close grid, up to one that leaves a fifth of the swing."""
RESONANCES = tuple(0.01 * 1.25**k for k in range(16))
"""A mass on a lightly damped joint fits within a tenth of its resonance only: a close grid, too."""
FREE_JOINT = dict.fromkeys(("viscous_time_s", "inertia_time_s", *(f"loop_{k}" for k in range(1, 6))), 0.0)
"""A joint without friction of its own: the hysteresis is that of the muscles, as a Bouc-Wen model has it, and what
acts on the joint stands behind it. Dry friction is then what a play is, viscous friction what a sensor's lag is."""
HARDLY_DAMPED = (FREE_JOINT | {"tau_s": 0.012},)
DAMPED = {"time_s": (0.01, 0.5), "tau_s": (0.0, 0.01)}
"""A mass on a joint with friction of its own may damp it more, as what holds it does, and rings below 16 Hz: above,
nothing is seen of it."""
RINGS = {"time_s": (0.02, 0.5), "tau_s": (0.0, 0.012)}
"""A mass on a free joint rings for a while, and by how much it is damped is found with it: one that is damped more, or
so small that it would ring above 8 Hz, is told from viscous friction by nothing."""
GIVES = tuple({"presliding_deg": share} for share in (0.05, 0.2))
GIVES_UP_TO = {"presliding_deg": (0.002, 0.5)}
"""Friction by bristles, a band or rubber gives before it slips: by a share of half the angle's range, up to a half of
that; what gives further is a spring."""
CREEPS = {"share": (-0.5, 0.5), "tau_s": (0.4, 40.0)}
"""Half of an angle at most comes late: a creep that takes more within seconds is any slow joint (muscles creep by a tenth)."""
CHOKED = tuple({"exhaust_mpa_s": exhaust, "choked": 1.0} for exhaust in (0.15, 0.3, 0.6, 1.2))
UNCHOKED = tuple({"exhaust_mpa_s": exhaust} for exhaust in (0.15, 0.3, 0.6))
ALL_SESSION = {WHOLE_SESSION.name: 1.0}
SLOWLY = (0.002, 0.01, 0.04, 0.15)
"""A minute, of what goes on through a session of several."""
EITHER_MUSCLE = ({"muscle": 1.0}, {"muscle": 2.0})
ABOUT = ({"about_deg": 1.0}, {"about_deg": -1.0})
"""Where muscles that warm unequally leave the joint, in halves of the angle's range; much farther off nothing tells it
from a sensor that drifts."""
CHOKED_LEAK = ({"muscle": 1.0, "absolute": 1.0}, {"muscle": 2.0, "absolute": 1.0})
BOTH_STOPS = tuple({"low_deg": -36.0 * 0.92**k} for k in range(16))
"""A stop that is a little too near costs more than none, and one out of reach has no slope: a close grid."""
WIDTHS = (0.01, 0.03, 0.1, 0.3, 0.6, 1.0)
"""Of a friction or a play, in halves of the angle's range: up to one that hardly lets the joint move, which no descent
finds from smaller ones."""
TIMES = (0.004, 0.008, 0.016, 0.03, 0.06, 0.12, 0.25)
ITV_SPAN_MPA = 0.5
WDD35D8_SPAN_DEG = 345.0
SHIFTED = Law("sensor_offset", ("offset_deg",), (0.005, 0.02, 0.1, 0.4), "span_deg", BOTH_SIGNS)
DRIFTS = Law("sensor_drift", ("rate_deg_min",), (0.02, 0.1, 0.5), "span_deg", BOTH_SIGNS)
SLIPS = Law("slipping_sensor", ("share",), (3e-4, 1e-3, 3e-3, 1e-2), signs=BOTH_SIGNS)
"""What a sensor does to the angle, and muscles of some classes do as well: a constant, a steady drift, a drift by the joint's travel
(docs/decisions/0671)."""
REPEATABILITY = Allowed(0.005 * ITV_SPAN_MPA, "SMC ITV: repeatability 0.5 % of full scale")

_LIBRARY: tuple[Effect, ...] = (
    Effect("delay", (Law("delay", ("delay_s",), TIMES),), "everything late by the same time; grows with frequency, keeps shapes", "late", "delay"),
    Effect("clock_drift", (
        Law("clock_drift", ("drift",), (1e-4, 3e-4, 1e-3, 3e-3, 1e-2), signs=BOTH_SIGNS),
        Law("clock_drift", ("drift",), (3e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3), signs=BOTH_SIGNS, shapes=(ALL_SESSION,)),
    ), "a delay that grows steadily through each record, or through all of them", "clock", "clock"),
    Effect("lost_samples", (Law("lost_samples", ("probability",), (0.01,)),), "values repeat exactly, then jump", "lost", "lost"),
    Effect("valve_gain", (
        Law("valve_gain", ("gain",), FINE, signs=BOTH_SIGNS),
        Law("valve_gain", ("gain", "balance"), FINE, signs=BOTH_SIGNS, shapes=({"balance": 0.1}, {"balance": -0.1})),
        Law("valve_gain", ("gain",), FINE, shapes=ONE_VALVE),
    ), "pressures in proportion to their set-points, off by a share", "gain", "valve_gain",
           allowed=Allowed(0.01, "SMC ITV: linearity 1 % of full scale")),
    Effect("valve_offset", (
        Law("valve_offset", ("offset_mpa",), FINE[:5], signs=BOTH_SIGNS, shapes=(*ONE_VALVE, {"balance": 2.0})),
    ), "one pressure (or the difference) off by a constant", "offset", "valve_offset", allowed=REPEATABILITY),
    Effect("valve_lag", (Law("valve_lag", ("tau_s",), TIMES, shapes=_both(*ONE_VALVE)),
                         *(Law("valve_filter", ("tau_s",), TIMES, shapes=({"poles": poles},)) for poles in (1.0, 2.0, 3.0)),
                         Law("valve_filter", ("tau_s",), TIMES, shapes=({"turbulent_mpa_s": 0.3}, {"turbulent_mpa_s": 0.03})),
                         Law("valve_filter", ("tau_s",), TIMES, shapes=ONE_VALVE),
                         Law("valve_lag", ("tau_s",), (-0.1, -0.35, -0.7), "regulator_s", shapes=_both(), bounds={"tau_s": (-1.0, 0.0)})),
           "pressures follow more slowly, filling and exhausting alike", "late", "valve_lag"),
    Effect("valve_slew", (
        *_winding(Law("valve_slew", ("fill_mpa_s",), (0.95, 0.85, 0.7, 0.5, 0.3, 0.15), "rate_mpa_s", tied={"exhaust_mpa_s": "fill_mpa_s"})),
        Law("valve_slew", ("fill_mpa_s",), (0.95, 0.8, 0.6, 0.35), "rate_mpa_s", tied={"exhaust_mpa_s": "fill_mpa_s"}, shapes=ONE_VALVE),
        *_winding(Law("valve_slew", ("fill_mpa_s", "exhaust_mpa_s"), (3.0, 1.3, 0.9, 0.6, 0.35), "rate_mpa_s", shapes=CHOKED)),
        Law("valve_slew", ("fill_mpa_s", "exhaust_mpa_s"), (1.3, 0.8, 0.4), "rate_mpa_s", shapes=UNCHOKED),
        Law("set_point_ramp", ("rate_mpa_s",), (0.95, 0.85, 0.7, 0.5, 0.3, 0.15), "rate_mpa_s"),
    ), "fast changes of pressure become ramps, slow ones are untouched", "slew", "slew"),
    Effect("fill_exhaust_asymmetry", (
        Law("fill_exhaust_asymmetry", ("ratio",), (0.3, 0.5, 0.7, 0.85, 1.15, 1.5, 2.0, 3.0, 5.0), shapes=({"fill_share": 0.0},)),
        Law("fill_exhaust_asymmetry", ("ratio",), (0.15, 0.3, 0.5, 0.7, 0.85, 1.2, 2.0), shapes=({"fill_share": 1.0},)),
        *_winding(Law("valve_slew", ("exhaust_mpa_s",), (0.95, 0.85, 0.7, 0.5, 0.3), "rate_mpa_s")),
        *_winding(Law("valve_slew", ("fill_mpa_s",), (0.95, 0.85, 0.7, 0.5, 0.3), "rate_mpa_s")),
        *_winding(Law("valve_slew", ("exhaust_mpa_s",), (10.0, 4.0, 2.0, 1.0, 0.5), "rate_mpa_s", shapes=({"soft": 1.0},))),
        *_winding(Law("valve_slew", ("fill_mpa_s",), (10.0, 4.0, 2.0, 1.0, 0.5), "rate_mpa_s", shapes=({"soft": 1.0},))),
        Law("one_way_line", ("tau_s",), TIMES, shapes=tuple({"fill_share": fill, "turbulent_mpa_s": flow} for fill in (0.0, 1.0) for flow in (LAMINAR_MPA_S, 0.3))),
    ), "pressures late in one direction only, so their mean moves with speed", "one_way", "one_way"),
    Effect("valve_dead_band", (
        Law("valve_dead_band", ("width_mpa",), FAR, "swing_mpa", shapes=({"edge": 1.0},)),
        Law("valve_dead_band", ("width_mpa", "one_way"), FAR, "swing_mpa", shapes=({"edge": 1.0, "one_way": 0.5}, {"edge": 1.0, "one_way": -0.5})),
        Law("numb_regulator", ("width_mpa", "integral_s"), FAR, "swing_mpa", shapes=({"integral_s": 0.1}, {"integral_s": 0.4}, {"integral_s": 1.0}),
            bounds={"integral_s": (0.05, 10.0)}),
        Law("overlapped_valve", ("overlap_mpa", "integral_s"), FAR, "swing_mpa", shapes=({"integral_s": 0.1}, {"integral_s": 0.4}, {"integral_s": 1.0}),
            bounds={"integral_s": (0.05, 10.0)}),
        Law("valve_dead_band", ("width_mpa",), HOLDS, "swing_mpa", shapes=tuple({"edge": edge} for edge in (0.1, 0.2, 0.3, 0.4, 0.6))),
        Law("valve_dead_band", ("width_mpa",), FAR, "swing_mpa", shapes=tuple({"edge": 1.0} | one for one in ONE_VALVE)),
    ), "pressures stand still at turning points and stay short of the set-point", "play", "dead_band",
           allowed=Allowed(0.002 * ITV_SPAN_MPA, "SMC ITV: sensitivity 0.2 % of full scale")),
    Effect("pressure_ceiling", (
        *_winding(Law("pressure_ceiling", ("ceiling_mpa",), (0.99, 0.97, 0.94, 0.9, 0.85, 0.78, 0.7, 0.55, 0.4, 0.2), "top_mpa")),
        *_winding(Law("low_supply", ("supply_mpa",), (1.4, 1.25, 1.15, 1.08, 1.03, 1.0, 0.95, 0.9, 0.8, 0.7, 0.55, 0.4, 0.2), "top_mpa")),
    ),
           "peaks of pressure cut off at one height", "cut", "ceiling"),
    Effect("supply_droop", (
        *_winding(Law("supply_droop", ("droop_s",), (0.03, 0.1, 0.3, 0.9), shapes=tuple({"refill_s": refill} for refill in (0.0, 0.05, 0.15, 0.5)))),
        *_winding(Law("supply_droop", ("droop_s", "supply_mpa"), (0.1, 0.3, 0.9), shapes=({"supply_mpa": 1.02}, {"supply_mpa": 1.15}, {"supply_mpa": 1.4}),
                      counted={"supply_mpa": "top_mpa"}, bounds={"droop_s": (0.03, 2.0)})),
        *_winding(Law("clogged_line", ("fill_mpa_s",), (10.0, 4.0, 2.0, 1.0, 0.5), "rate_mpa_s")),
        *_winding(Law("emptied_receiver", ("capacity_mpa_s", "fall"), (0.95, 0.85, 0.7, 0.5), "filling_mpa_s", shapes=({"fall": 0.3}, {"fall": 1.0}, {"fall": 3.0}))),
        Law("fill_exhaust_asymmetry", ("ratio",), (0.15, 0.3, 0.5, 0.7, 0.85), shapes=({"fill_share": 0.0}, {"fill_share": 1.0}),
            bounds={"ratio": (0.02, 1.0)}),
    ), "filling falls behind, exhausting does not", "one_way", "one_way"),
    Effect("co_contraction", (Law("co_contraction", ("shift_mpa",), FINE, signs=BOTH_SIGNS),),
           "both pressures off by the same constant; the angle's gain changes against it", "gain", "co_contraction",
           two_muscles=True, as_another_p0=True, allowed=REPEATABILITY, also_right=("valve",)),
    Effect("muscle_mismatch", (Law("muscle_mismatch", ("mismatch",), FAR, signs=BOTH_SIGNS, shapes=_both(*ONE_VALVE)),
                               SHIFTED),
           "the angle is off, and its gain a little, as if one pressure counted more", "offset", "mismatch", two_muscles=True, absorbed=True),
    Effect("leak", (
        Law("leak", ("loss",), FAR, shapes=(*EITHER_MUSCLE, *CHOKED_LEAK)),
        Law("leak_ahead", ("loss",), FAR, shapes=(*EITHER_MUSCLE, *CHOKED_LEAK)),
        Law("fed_leak", ("loss", "supply_mpa", "fill_mpa_s"), (0.02, 0.05, 0.12), counted={"supply_mpa": "top_mpa", "fill_mpa_s": "rate_mpa_s"},
            shapes=tuple(one | {"supply_mpa": supply, "fill_mpa_s": fill} for one in EITHER_MUSCLE for supply in (0.9, 1.3) for fill in (1.5, 4.0)),
            bounds={"supply_mpa": (0.6, 3.0)}),
    ), "one pressure lower by a share; behind the monitor only the angle shows it", "offset", "mismatch", two_muscles=True, also_right=("valve",)),
    Effect("creep", (
        Law("creep", ("share", "tau_s"), (0.02, 0.1), signs=BOTH_SIGNS, shapes=tuple({"tau_s": t, "relaxed": 0.0} for t in (0.7, 3.0, 12.0)),
            bounds=CREEPS),
        Law("creep", ("share", "tau_s"), (0.02, 0.1), signs=BOTH_SIGNS, shapes=tuple({"tau_s": t, "relaxed": 1.0} for t in (0.7, 2.0, 8.0)),
            bounds=CREEPS),
        Law("creep", ("share", "tau_s"), (0.05, 0.2), signs=BOTH_SIGNS, shapes=tuple({"tau_s": 3.0, "relaxed": r, "decades": 2.0} for r in (0.0, 1.0)),
            bounds=CREEPS),
        Law("stiffness", ("stiffness", "relax_s"), (0.1, 0.4, 1.2), signs=BOTH_SIGNS, bounds={"relax_s": (0.4, 40.0)},
            shapes=tuple({"spring": 1.0, "relax_s": t} for t in (1.0, 4.0, 15.0))),
    ), "the angle keeps moving slowly after the pressure has settled; loops wider at low frequency", "creep", "creep"),
    Effect("thermal_drift", (Law("thermal_drift", ("rate_per_min",), (0.01, 0.05, 0.2, 0.6), signs=BOTH_SIGNS),
                             Law("thermal_drift", ("rate_per_min", "about_deg"), (0.01, 0.05, 0.2), signs=BOTH_SIGNS, shapes=ABOUT, counted={"about_deg": "span_deg"}, bounds={"about_deg": (-2.0, 2.0)}),
                             Law("stiffness", ("rise_per_min",), (0.3, 1.0, 3.0)), Law("stiffness", ("rise_per_min",), (-0.2, -0.6, -1.5)),
                             Law("heated_muscles", ("rate_per_min", "balance"), (0.05, 0.2, 0.6), signs=BOTH_SIGNS, shapes=({"heat_s": 30.0},), bounds={"balance": (-1.0, 1.0)}),
                             Law("one_muscle_warms", ("rate_per_min",), (0.01, 0.05, 0.2, 0.6), signs=BOTH_SIGNS, shapes=EITHER_MUSCLE),
                             DRIFTS,
                             SLIPS,
                             Law("thermal_drift", ("rate_per_min",), SLOWLY, signs=BOTH_SIGNS, shapes=(ALL_SESSION,)),
                             Law("one_muscle_warms", ("rate_per_min",), SLOWLY, signs=BOTH_SIGNS, shapes=tuple(one | ALL_SESSION for one in EITHER_MUSCLE))),
           "the amplitude grows or shrinks through each record or through the session, and the angle wanders where one muscle warms more", "drift", "thermal"),
    Effect("coulomb_friction", (Law("coulomb_friction", ("width_deg",), WIDTHS, "span_deg"),
                                Law("coulomb_friction", ("width_deg", "presliding_deg"), WIDTHS, "span_deg", shapes=GIVES, counted={"presliding_deg": "span_deg"}, bounds=GIVES_UP_TO),
                                Law("coulomb_friction", ("width_deg",), (0.003, *WIDTHS), "span_deg", shapes=(FREE_JOINT,), like="backlash"),
                                Law("coulomb_friction", ("width_deg",), (-0.01, -0.03, -0.1), "span_deg")),
           "the loop is wider, or narrower, at every speed, with corners at turning points", "play", "play", absorbed=True),
    Effect("viscous_friction", (Law("viscous_friction", ("tau_s",), (0.01, 0.03, 0.1, 0.3)),
                                Law("viscous_friction", ("tau_s",), TIMES, shapes=(FREE_JOINT,), like="sensor_lag"),
                                Law("viscous_friction", ("tau_s",), (-0.01, -0.03))),
           "the angle lags in proportion to speed", "late", "lag"),
    Effect("inertia", (Law("inertia", ("time_s", "tau_s"), RESONANCES, bounds=DAMPED),
                       Law("inertia", ("time_s", "tau_s"), RESONANCES, shapes=HARDLY_DAMPED, bounds=RINGS),
                       Law("inertia", ("time_s",), (-0.015, -0.03, -0.06), bounds={"time_s": (-0.5, -0.01)})),
           "fast parts of the angle overshoot and ring", "late", "inertia"),
    Effect("gravity_load", (
        Law("gravity_load", ("load_deg",), (0.01, 0.05, 0.2, 0.6), "span_deg", BOTH_SIGNS),
        Law("gravity_load", ("load_deg", "phase_deg"), (0.05, 0.2), "span_deg", BOTH_SIGNS, shapes=({"phase_deg": 30.0}, {"phase_deg": -30.0}),
            bounds={"phase_deg": (-45.0, 45.0)}),
        Law("gravity_load", ("load_deg", "phase_deg"), (0.01, 0.05, 0.2), "span_deg", BOTH_SIGNS, bounds={"phase_deg": (-45.0, 45.0)},
            shapes=tuple(FREE_JOINT | {"phase_deg": phase} for phase in (-30.0, 0.0, 30.0)), like="sensor_nonlinearity"),
    ), "gain and offset change together, bent like a sine of the angle", "offset", "gravity", absorbed=True),
    Effect("stiffness", (
        Law("stiffness", ("stiffness",), (0.15, 0.4, 1.0), signs=BOTH_SIGNS),
        Law("stiffness", ("stiffness",), (0.02, 0.06, 0.2), signs=BOTH_SIGNS, shapes=({"spring": 1.0},)),
        Law("stiffness", ("stiffness", "load_deg"), (0.15, 0.4, 1.0), signs=BOTH_SIGNS, shapes=({"load_deg": 5.0}, {"load_deg": -5.0})),
    ), "friction, mass and weight all count less, or more, by the same share", "stiffness", "stiffness"),
    Effect("backlash", (Law("backlash", ("width_deg",), (0.003, *WIDTHS), "span_deg"),),
           "the angle stands still after each turning point, then moves on short by the play", "play", "play", absorbed=True),
    Effect("end_stop", (
        Law("end_stop", ("high_deg", "give"), (0.97, 0.9, 0.8, 0.65, 0.45), "high_deg", bounds={"give": (0.0, 0.6)}),
        Law("end_stop", ("low_deg", "give"), (0.97, 0.9, 0.8, 0.65, 0.45), "low_deg", bounds={"give": (0.0, 0.6)}),
        Law("end_stop", ("high_deg", "low_deg", "give"), (0.97, 0.92, 0.86, 0.8, 0.72, 0.65, 0.55, 0.45), "high_deg", bounds={"give": (0.0, 0.6)}, shapes=BOTH_STOPS),
    ), "the angle is cut off at one height while the pressures go on", "cut", "stop"),
    Effect("sensor_gain", (Law("sensor_gain", ("gain",), FINE, signs=BOTH_SIGNS),), "the angle is off in proportion to itself", "gain", "sensor_gain", absorbed=True),
    Effect("sensor_offset", (SHIFTED,), "the angle is off by a constant", "offset", "sensor_offset", absorbed=True),
    Effect("sensor_drift", (DRIFTS,
                            SLIPS,
                            Law("sensor_drift", ("rate_deg_min",), SLOWLY, "span_deg", BOTH_SIGNS, shapes=(ALL_SESSION,))),
           "the angle wanders steadily through each record or through the session, or by as much as the joint moves", "drift", "drift"),
    Effect("sensor_nonlinearity", (
        Law("sensor_nonlinearity", ("square", "cube"), (0.02, 0.1), signs=BOTH_SIGNS, shapes=({"cube": 0.0},)),
        Law("sensor_nonlinearity", ("cube", "square"), (0.02, 0.1), signs=BOTH_SIGNS, shapes=({"square": 0.0},)),
        Law("sensor_nonlinearity", ("cube", "square", "slope"), (0.05, 0.2), signs=BOTH_SIGNS, shapes=({"square": 0.0},)),
    ), "the angle is bent: even and odd harmonics without delay", "bent", "bent", absorbed=True,
           allowed=Allowed(0.01, "WDD35D8: linearity 1 %, the widest grade")),
    Effect("sensor_lag", tuple(Law("sensor_lag", ("tau_s",), TIMES, shapes=({"poles": poles},)) for poles in (1.0, 2.0, 4.0, 8.0)), "the angle is late and its corners are rounded", "late", "lag"),
    Effect("quantisation", (Law("quantisation", ("step_deg",), (0.1,)),), "the angle takes only multiples of one step", "steps", "steps",
           allowed=Allowed(WDD35D8_SPAN_DEG / 2**12, "myRIO, connectors A and B: 12 bits over the potentiometer's span")),
    Effect("mains_hum", (Law("mains_hum", ("amplitude_deg",), (0.1,)),), "a line at 50 or 60 Hz", "hum", "hum"),
    Effect("sensor_noise", (Law("sensor_noise", ("std_deg",), (0.1,)),), "more noise at all frequencies", "noise", "noise"),
    Effect("sensor_dropout", (Law("sensor_dropout", ("probability",), (0.01,)),), "samples fall to zero or to the end of the range and come back", "dropout", "dropout"),
)  # fmt: skip


def _from_outside(_key: str, module: Any) -> Effect | None:
    """The effect of a package that registers one; None for a stage that the diagnosis shall not name."""
    made: Effect | None = module.library() if hasattr(module, "library") else None
    return made


LIBRARY: Mapping[str, Effect] = Registered({effect.name: effect for effect in _LIBRARY}, EFFECTS, _from_outside)
"""Name -> effect, in the order of the chain; those of other packages after ours."""


def effect_class(name: str, pressures: bool) -> str:
    """The class of effects that look alike to what was measured."""
    effect = LIBRARY[name]
    return effect.pressure_class if pressures else effect.angle_class


def alike(name: str, pressures: bool) -> list[str]:
    """The other effects of the same class."""
    word = effect_class(name, pressures)
    return [other for other in LIBRARY if other != name and effect_class(other, pressures) == word]


def chosen(library: Sequence[str] | None) -> list[Effect]:
    """The effects of a library given by names; all of them for None."""
    return list(LIBRARY.values()) if library is None else [LIBRARY[name] for name in library]

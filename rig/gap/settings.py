"""Every number that decides in the likelihood and in what an answer keeps of it: with its unit, its source, and what
moves if it moves. The numbers of records, raw-data tests, plans and words stand in the `settings.py` of those rooms.

What is a choice stands here. What can be fitted stands in `priors.yaml` beside this file, written by the commands of
docs/how-to/refit_the_priors.md, each part with its provenance; `Fitted` below is that file as data.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np

from rig.columns import NORMAL_95
from rig.config import read_yaml, structure
from rig.gap.provenance import EVERYTHING, FitProvenance
from rig.record import Column

TOP_HZ = 6.0
"""Highest frequency compared, Hz: muscles and regulators answer below it. Higher: more lines of noise, the same
evidence."""
ENVELOPE_HZ = 0.5
"""Width over which a response's power is blurred for the residual's variance, Hz. Narrower: single lines decide."""
LOUDER_BELOW = 3.0
"""A monitor's noise below TOP_HZ has at most this many times the power of that in the octave above. More: what a
description misses of a rig is taken for noise where there is little; less: noise that falls with frequency stays, and
filters fit better than delays by smoothing it."""
ENVELOPE_EVEN = 0.1
"""Share of that power that is spread evenly over all lines. Less: effects between the excited lines count for more."""
SESSION_S = 140.0
"""Length of the sessions (seven records of 20 s) for which `Prior.effective` lines are independent; shorter ones have
fewer. Longer: short records are believed less."""
LEAST_EFFECTIVE = 20.0
"""Independent lines that a single short record has at least; as surely a rig's own records say how much its simulator
misses. Fewer: nothing is seen in one record of some seconds, and a simulator that misses several times as much as it
does of its own records lacks nothing."""
UNKNOWN_EVEN = 0.3
"""Share of the power of something unknown that is spread evenly over all lines, as ENVELOPE_EVEN is for the residual.
Less: what is unknown must lie where the gap is largest."""
UNEVEN_CODES = 1.3
"""What rounding leaves is larger than an even converter's by this factor: codes differ in width (development: 1.1 to
1.3)."""
MEAN_DOUBT = 0.3
"""What is not known of the law of the mean pressure where that is another than expected: standard deviation of its
exponent, which lies between 0 and 1. Healthy days never show it, so no fit of theirs can say it. Less: a stiffness is
named beside every cause that shifts both pressures."""
FRICTION_DOUBT = 0.5
"""The same of the joint's friction over its stiffness: friction of the bearing stays while the stiffness rises (an
exponent of -1), a braid's rises with it (0). Less: as there."""
VOLUME_DOUBT = 0.3
"""Relative change of a muscle's volume over the joint's span (a McKibben muscle that contracts by a fifth grows by
about as much; Chou and Hannaford, IEEE Trans. Robot. Autom. 12, 1996): a joint that moves otherwise than expected
pushes air back to its regulators. Less: a change of the joint is called something unknown of the valves as well."""
SPEED_DOUBT = 1.0
"""Standard deviation of the relative change of a regulator's time constants, over that of the absolute pressure that it
holds: choked, the pace at which air leaves goes with the pressure, that at which it comes not at all (ISO 6358). Less:
a lag or uneven filling of some milliseconds is named beside every cause that shifts the pressures. More: regulators
that are slower as well are not, where the pressures are off."""
PATTERN_DEGREES = 2.0
"""Degrees of freedom that the population's spread of a pattern is worth beside a rig's own days, each of which brings
one. More: the own days count for less."""
RIG_DEGREES = 4.0
"""Degrees of freedom with which it is known beside one earlier day by how much the days of this rig differ more or less
than those of others (by 1.4 times either way), each further day bringing one; from development cases
(docs/decisions/0560). Fewer: a gap of many floors passes for a rig of unlike days. More: such a rig is given a
cause."""
LINE_DEGREES = 6.0
"""The same for the variance of a line, once the rig's own level is known."""
DAY_DEGREES = 20.0
"""Degrees of freedom of the level of one further day beside the days of the same rig: healthy days of a rig are alike
(on three plant families their mean chi-square a line stays within a factor 1.5 of its median). Fewer: something unknown
is sooner taken for a noisy day."""
CREDIBLE = 0.95
"""Mass that the reported set of names holds."""
WIDTH_SHARES = (3.0, 0.05)
"""A law's further numbers are flat over this many times their value, at least over this share of their bounds. Wider:
laws with more numbers lose."""
FIT_STEPS = 6
"""Gauss-Newton steps of a law from the best point of its grid; more change no name on the development cases."""
UNSEEN_MEAN_LAW = 0.5
"""Standard deviation of the exponent of the mean pressure at mean pressures that a reference never saw. Published
muscles and the plants here lie between 0 (only the difference counts) and 1 (the difference over the mean). Smaller:
another P0 looks like another gain."""
ZERO_BY_HAND = 0.05
"""Standard deviation, as a share of the angle's span, of where the zero of another rig of the build lies, which is set
when the sensor is mounted, to some degrees. Smaller: every sister's simulator lacks an offset."""
ZERO_AT_REST = 1.0
"""The same of each record's where the loop took the angle at rest for zero: wherever a joint may come to rest. Smaller:
what turns the joint at rest brings a second cause; larger changes nothing."""
GAIN_BY_DAY = 0.0024
"""Standard deviation of a regulator's gain between two days of which no third tells more: the ITV's 0.12 % of full
scale a kelvin, over the two kelvins that a room's days differ by. Smaller: a warmer day is another gain of the valves;
larger: gains of half a percent are no finding."""
MOST_MISSED, MISSED_STEPS = 2.0, 21
"""Logarithm of the largest share of the usual by which a simulator's class may miss a build, and how many are tried up
to there. Less: a build that is missed by more is given a cause."""
MOST_ROUGH = 0.6
"""A law that leaves more of its own change than this says nothing: no law counts as rougher. More: a rough law stands
for whatever nobody knows."""
STILL_LIKELY = 0.02
"""Hypotheses ahead of the monitors of at least this probability are judged by the angle as well: what a valve does
reaches the joint, what a monitor misreads does not. Less: one angle more to judge, seldom another name."""
FAINT = 1e-4
"""Hypotheses ahead of the monitors down to this probability are judged by the angle as well, if they imply another
monitor offset than the likeliest: an effect costs some nats beforehand, and the angle may say more than that."""
MOST_FAINT = 3
"""Of those, the likeliest so many. More: slower."""
POSSIBLE = 1e-3
"""Effects behind the monitors of at least this probability go into that trial."""
ANOTHER_RIG = 0.3
"""A model that misses the earlier days by this share of the angle's spread is no simulator of this rig."""
UNSURE_ROUNDS = 4
"""How often what is unsure of a simulator is taken anew beside a cause at most; once or twice is usual."""
UNSURE_STANDS = 0.1
"""The patterns of the simulator's unsure numbers are taken anew (linearised) until their relative sizes change by less
than this; where they never do, those without a change are kept."""
FASTEST_REGULATOR = 0.1
"""Of the simulator's, the least time constant that is tried: no rig of a build is ten times as fast as another."""
FIRST_LAW_SHARE = 0.3
"""How rough the first cause's law is taken to be, in its usual error."""
LAG_SAID = 0.5
"""Unsure lags of more than this share of the simulator's step are said."""
RUNS_OFF = 1.0
"""A simulator that is off by more than so many times what the joint moves (rms) says less than the mean angle does."""
OUTSIDE_SEEN = 0.1
"""Share of the drive's span by which records may leave what the fingerprint has seen before it is said."""
USUAL_HZ = 0.8
"""Fastest excitation of the usual session, on which levels are fitted: a slower session makes no record a fast one.
Lower: usual records after a slow session are doubted."""
EXCITED_POWER = 0.95
"""Share of a command's power below the frequency that counts as its fastest. More: harmonics of triangles count."""
BEYOND_DAYS = (3.0, 10.0, 30.0, 100.0)
"""Factors by which the patterns that may differ without being a gap are enlarged, as one form of something unknown."""
EVEN_CHANCE = 0.5
"""Probability of none below which there is something."""
FIRSTS_TRIED = 3
"""Likeliest single effects that are tried as the first of two. More: slower, and a pair whose parts both look like a
third effect is found more often."""
ABOVE_FLOOR = 1.2
"""A gap counts as above the floor from this ratio on; below it, what is explained is counted from zero, and something
unknown, by itself or beside a name, is a note. More: less is said to be unknown, or only partly explained."""
FAR = 3.0
"""Floors from which on a gap is large, whatever is found: what closes nothing of one does not explain it; beside a
simulator nothing is no answer to one, and a name that leaves one is not all there is; a model that misses the healthy
rig by as much is worth a line. More: a valve's fault passes for all that is wrong, and what nobody knows for what
simulators miss."""
EITHER_CHANCE = 0.5
"""Probability that is left of a name where something that is no hypothesis may have done the same. More: a clipped
sensor or another P0 takes less off a confidence."""
LEAST_CLOSED = 0.02
"""Share of its own factor's gap that a named effect closes at least: less reads as "loses 0 % of its pressure", and
something unknown is there."""
LEAST_EXPLAINED = 0.5
"""Share of the degrees (rms) by which a gap stands above the floor that causes close at least where they are said to
explain it; with less something unknown makes up the larger part. More: rough laws explain nothing."""
BEHIND_CLOSES = 0.5
"""Share of the gap beside the measured pressures (mean square) that an effect behind the monitors closes at least where
it stands whatever the simulator says of it under the commands. More: it falls to a rough law of the valves; less: it
stays where the simulator is worse with it."""
SPOILT = 1.02
"""A cause that leaves more than this share of the rms in the simulator is not added to it."""
FALSE_ALARM_RATE = 0.01
"""How often something is said of a rig with nothing wrong: by a whole diagnosis, at the sizes that a rig can tell; by
the changes of a history, all its series together. Less: larger sizes, later and larger changes only."""
PRIORS = Path(__file__).with_name("priors.yaml")


@dataclass(frozen=True)
class FactorLevels:
    """How surely a reference knows one factor: standard deviations of what may differ without being a gap."""

    patterns: Mapping[str, float]
    """Of each pattern by its name, see `rig.gap.reference.patterns`."""
    share: float
    """Of what the response misses, as a share of its own motion."""
    even: float
    """The same on every line alike, as a share of the span."""
    floor: float
    """Rms by which healthy days differ from what is expected, as a share of the span."""

    def wider(self, name: str, by: float) -> "FactorLevels":
        """The same where a pattern may differ further without being a gap, by this standard deviation."""
        return replace(self, patterns={**self.patterns, name: math.hypot(self.patterns[name], by)})


@dataclass(frozen=True)
class BuildSpread:
    """By how much more or less a simulator's class misses of one build than of the others: Student's distribution of
    the logarithm of the rms, about the level; fitted by `pamrig gap calibrate` (docs/decisions/0593)."""

    spread: float
    """Its scale. Less: healthy rigs of a build unlike those that the levels are fitted on are given a cause. More: what
    nobody knows is taken for what the class misses."""
    degrees: float
    """Degrees of freedom: builds that it is known from."""

    def log_chance(self, log_times: Column) -> Column:
        """ln of how likely a build is that is missed by exp(`log_times`) as much, against one at the level; element by
        element, without unit."""
        out: Column = -0.5 * (self.degrees + 1.0) * np.log1p((log_times / self.spread) ** 2 / self.degrees)
        return out


@dataclass(frozen=True)
class UsualSizes:
    """How much of an effect a simulator's class usually lacks of a healthy rig, by what that does to the angle, in
    floors: half of a normal distribution; fitted by `pamrig gap study usual` (docs/decisions/0638)."""

    scales: Mapping[str, float] = field(hash=False)
    """Effect -> scale. Less: a healthy rig that has a little more of it is given a cause. More: as much is no gap.
    Effects that are not here are a gap at any size."""

    def log_density(self, effect: str, floors: float) -> float:
        """Of the logarithm of a size."""
        ratio = floors / self.scales[effect]
        return math.log(ratio) + 0.5 * math.log(2.0 / math.pi) - 0.5 * ratio**2


@dataclass(frozen=True)
class UsualNoise:
    """Broadband noise of the angle that healthy rigs usually have; fitted by `pamrig gap study noise`
    (docs/decisions/0645)."""

    share: float
    """Its standard deviation, as a share of the span of the angle: the median of builds. Less: a healthy rig's noise is
    something that its simulator lacks."""
    span_deg: float
    """The span that those had. Records that move less are read by no quieter sensor: it counts as well for them. Less:
    the noise of records that hardly move is something that a simulator lacks."""
    spread: float
    """Standard deviation of its logarithm, of a build that it was not fitted on. More: only louder noise is."""

    def level_deg(self, span_deg: float) -> float:
        """Of records over such a span."""
        return self.share * max(span_deg, self.span_deg)


@dataclass(frozen=True)
class Odds:
    """What is thought beforehand of each factor beside a reference, against each single effect, in nats."""

    none: float = 6.0
    """Nothing; fitted on cases of development, by `pamrig gap study odds`. Less: more false alarms, smaller effects
    seen."""
    unknown: float = -4.0
    """Something that is not in the library. Less: what nobody knows is called by a name."""
    together: float = 0.0
    """By how much anything ahead of the monitors is likelier where something acts on the joint as well: faults come
    together. Fitted with the odds of nothing. More: a second name for what lies within the days' differences."""
    healthy: float = 0.0
    """By how much nothing on the joint is likelier where nothing acts ahead of the monitors: beside a cause there
    `none` has to stand up to what its law leaves, on a healthy rig it has not. Fitted with the others. Less: more false
    alarms; shifts that lie a few times beyond what days differ in are seen."""


@dataclass(frozen=True)
class Levels:
    """Both factors' levels. Fitted on healthy days (of the same rig, or of rigs of one build) by maximum likelihood."""

    pressures: FactorLevels
    angle: FactorLevels
    """Of the angle under the measured pressures."""
    commanded_floor: float
    """As `floor`, of the angle under the commands."""
    monitors: float = 0.0
    """Of the variance of the offsets that monitors show, the share that is their own error, to which the muscles do not
    answer. 0: what the pressures show tells nothing of the monitors."""
    odds: Odds = Odds()
    builds: BuildSpread | None = None
    """Of what a simulator's class misses of the pressures; None: as much of every build."""
    usual: UsualSizes | None = None
    """What a simulator's class lacks of healthy rigs; None: nothing."""


@dataclass(frozen=True)
class Prior:
    """What is thought of hypotheses before the records are seen, and how far the likelihood is trusted."""

    share: float
    """Middle of what an effect changes, as a share of what moves anyhow (rms). Smaller: small effects are named
    sooner."""
    share_spread: float
    """Standard deviation of its logarithm."""
    laws: Mapping[str, float] = field(hash=False)
    """Effect -> its laws' usual error: what the best of them leaves of its own change (rms) where a rig acts by another
    law, beside what days differ in; fitted by `pamrig gap study laws` (docs/decisions/0582). Larger: the effect is
    named where it fits less well, and something unknown is sooner taken for it."""
    law_shares: tuple[float, ...]
    """How rough a law is on another build, over its usual error: points of that distribution, each as likely as the
    others; fitted by `pamrig gap study laws`, each family beside the others (docs/decisions/0585). Larger: an effect
    whose law fits badly is named in place of something unknown, or of one whose law is usually rough."""
    answer: float
    """By how many times the share by which a description of the rig misses the angles that it was made from it may as
    well miss what other pressures change in the angle; as likely as not. Fitted by `pamrig gap study laws`
    (docs/decisions/0672). Larger: behind a valve's fault something unknown is seldom said, and a second cause is seldom
    found."""
    rho_scale: float
    """Factor on every law's usual error. Larger: rough and exact laws come closer."""
    rho_lines: float
    """How much of that error is independent from line to line as well, beside the whole of it as coherent patterns.
    Larger: laws forgive more."""
    effective: float
    """Independent lines of one factor in a session of SESSION_S: neighbours and records share causes. More: surer, and
    more false alarms."""
    degrees: float
    """Degrees of freedom with which the level of a residual is known. Fewer: heavier tails."""
    log_beside: float
    """Prior odds of something unknown beside an effect, against that effect alone, nats."""
    temperature: float
    """By what the log odds between effects are divided before they are told (`rig.gap.prior_fitting.temperature`);
    fitted on cases of development, by `pamrig gap study temperature`. More: names are less sure, sets larger, and
    another experiment is recommended sooner."""

    def log_density(self, share: float) -> float:
        """Of the logarithm of what an effect changes, as a share of what moves anyhow (rms)."""
        off = (math.log(share) - math.log(self.share)) / self.share_spread
        return -0.5 * off**2 - math.log(self.share_spread * math.sqrt(2.0 * math.pi))


@dataclass(frozen=True)
class Spread:
    """How unsure it is what is left of a gap on further records (`rig.gap.answer.how_far.prediction_interval`); fitted
    on cases of development, by `pamrig gap study intervals`."""

    floor: float
    """Share of the floor's mean square. More: wider where gaps are small."""
    law: float
    """Share of a law's usual error (`Prior.laws`), of what it closes. More: wider for rough laws."""
    below: float
    above: float
    """Ends of the interval, in standard deviations."""
    cases: int
    """On how many cases."""


@dataclass(frozen=True)
class Reach:
    """How far a fitted size may be off (`rig.gap.answer.how_far.size_intervals`); fitted on cases of development, by
    `pamrig gap study intervals`."""

    law: float = 0.0
    """Share of a law's usual error (`Prior.laws`) that a size may miss. More: wider for rough laws."""
    deviations: float = NORMAL_95
    """End of the 95 % interval, in standard deviations; as fitted here, where the likelihood were right."""
    cases: int = 0
    """On how many cases."""


@dataclass(frozen=True)
class Fitted:
    """The file `priors.yaml`."""

    provenance: FitProvenance
    levels: dict[str, Levels]
    """By reference: session, fingerprint, uncorrected (a fingerprint without its regulators' corrections), simulator,
    and sister: a simulator made for another rig of the build."""
    prior: Prior
    prediction: Spread
    reaches: dict[str, Reach] = field(default_factory=dict)
    """By what stands for the rig: described (by days or a fingerprint), simulated (by nothing but a simulator)."""
    noise: UsualNoise | None = None
    """Of healthy rigs, beside a simulator, which tells of none; None: any noise may be usual."""

    def reach_of(self, reference: str) -> Reach:
        """How far sizes beside a reference may be off; where nothing was fitted, what the likelihood says."""
        return self.reaches.get(reference, Reach())


@cache
def fitted(path: Path = PRIORS) -> Fitted:
    """The fitted numbers; ConfigError when the file is not one. What is thought of hypotheses and does not stand in an
    older file is as shipped."""
    raw = _present_form(read_yaml(path))
    if path != PRIORS and isinstance(raw, dict) and isinstance(raw.get("prior"), dict):
        shipped = read_yaml(PRIORS)
        assert isinstance(shipped, dict)
        raw["prior"] = shipped["prior"] | raw["prior"]
    return structure(raw, Fitted, str(path))


def _present_form(raw: object) -> object:
    """A file in the form of today: before, its provenance was one command in words for all parts, and the prediction
    interval was called `further`."""
    if not isinstance(raw, dict):
        return raw
    found = {"prediction" if key == "further" else key: value for key, value in raw.items()}
    provenance = found.get("provenance")
    if isinstance(provenance, dict) and "command" in provenance:
        others = {key: value for key, value in provenance.items() if key != "command"}
        found["provenance"] = {**others, "parts": {EVERYTHING: {"command": provenance["command"]}}}
    return found

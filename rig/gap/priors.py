"""What `priors.yaml` beside this file holds: all that is fitted of the likelihood, with the provenance of each part.

Written by the commands of docs/how-to/refit_the_priors.md; what is a choice stands in `rig.gap.settings`.
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

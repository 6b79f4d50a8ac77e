"""One hypothesis fitted: an effect's laws, each from its grid of starts to the likeliest numbers, with the evidence for
it.

What an effect changes is propagated through the frozen response of the healthy rig (`rig.gap.response.propagate`);
how residuals are judged is the factor's (`rig.gap.reference.expectation`).
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import itemgetter

import numpy as np

from rig.gap.hypotheses.changes import Change
from rig.gap.hypotheses.descent import Nearest, nearest
from rig.gap.hypotheses.law_errors import log_densities, with_law
from rig.gap.hypotheses.library import Effect, Law
from rig.gap.likelihood.gaussian import Gaussian
from rig.gap.priors import Odds, Prior, UsualSizes
from rig.gap.reference.expectation import Factor
from rig.gap.response.causes import Applied, ready
from rig.gap.settings import FIT_STEPS, MOST_ROUGH, UNSURE_ROUNDS, UNSURE_STANDS, WIDTH_SHARES
from rig.model.effect_stages import EFFECT_STAGES
from rig.model.response.model import ResponseModel
from rig.record import Column

EXACT = 0.0
"""Share of a law's usual error where a rig acts by that very law, as a simulated one does: as likely as each of the
others."""
RUNS_AWAY = 1e6
"""A change beyond this, in deg or MPa, is none that a rig can show."""


def runs_away(change: Column) -> bool:
    """Whether a change is beyond that anywhere, or not finite."""
    return not bool(np.max(np.abs(change)) < RUNS_AWAY)


@dataclass(frozen=True)
class ForwardModel:
    """A factor with what it takes to say what a cause changes in it."""

    factor: Factor
    change: Change
    response: ResponseModel
    scales: Mapping[str, float]
    """Units in which the laws' grids count."""
    moving: float
    """Rms of what the factor's columns do without any cause: sizes of changes are seen against it."""
    prior: Prior
    odds: Odds
    at_joint: Callable[[Column], float]
    """What a change of the factor's columns (n,) does to the angle: rms, in floors of the angle under the commands."""
    usual: UsualSizes | None = None
    """What a simulator lacks of healthy rigs."""
    unsure: "UncertainParameters | None" = None
    """What is unsure of the reference and may be far off."""
    nonlinear: "Column | float" = 0.0
    """(n,) what the unsure numbers change beyond their linear patterns, where these were taken; off the gap already."""
    at: "Column | float" = 0.0
    """(k,) the sizes at which that was taken."""

    def beside(self, cause: Applied | None, residual: Column) -> "ForwardModel":
        """The same with what is unsure taken anew where it is likeliest by what a cause leaves (lines, of this
        model),
        and through the cause."""
        if self.unsure is None:
            return self
        unsure, factor = self.unsure, self.factor
        sizes = self._likeliest(residual)
        with np.errstate(invalid="ignore", over="ignore"):
            moved = unsure.at(sizes, cause)
        if runs_away(moved.patterns) or runs_away(moved.nonlinear):
            return self
        patterns = factor.healthy.patterns.copy()
        patterns[:, unsure.which] = factor.lines.of(moved.patterns) * unsure.spread * unsure.times[:, None]
        gap = factor.gap + self.nonlinear - moved.nonlinear
        judged = replace(factor, gap=gap, healthy=replace(factor.healthy, patterns=patterns))
        return replace(
            self, factor=judged, change=moved.change, response=moved.response, nonlinear=moved.nonlinear, at=sizes
        )

    def is_settled(self, residual: Column) -> bool:
        """Whether what is unsure is likeliest where it was taken, by what a cause leaves (lines)."""
        return self.unsure is None or bool(np.max(np.abs(self._likeliest(residual) - self.at)) < UNSURE_STANDS)

    def _likeliest(self, residual: Column) -> Column:
        """(k,) sizes of what is unsure."""
        assert self.unsure is not None
        likeliest: Column = self.factor.healthy.sizes(residual)[self.unsure.which] * self.unsure.spread
        return likeliest

    def changed_by(self, cause: Applied) -> Column:
        """(n,) what one cause changes in the factor's columns; not finite, or beyond RUNS_AWAY, where a law runs away
        under these records."""
        with np.errstate(invalid="ignore", over="ignore"):
            return self.change(ready([cause], self.response))

    def share_of(self, change: Column) -> float:
        """Rms of what is changed (n,), as a share of what moves without any cause."""
        return max(self.factor.rms(change) / self.moving, 1e-9)

    def floors_of(self, change: Column) -> float:
        """What a change (n,) does to the angle, in floors (rms)."""
        return max(self.at_joint(change), 1e-9)


@dataclass(frozen=True)
class Relinearised:
    """A reference whose unsure numbers are others."""

    response: ResponseModel
    change: Change
    """What causes change beside it."""
    patterns: Column
    """(n, k) what a size of 1 more of each number changes, through the cause."""
    nonlinear: Column
    """(n,) what these numbers change beyond that in proportion to their sizes."""


@dataclass(frozen=True)
class UncertainParameters:
    """Numbers of the reference that may be far off: patterns of a factor, taken anew where they likeliest are."""

    which: list[int]
    """(k,) their places among the factor's patterns."""
    spread: Column
    """(k,) their standard deviations."""
    times: Column
    """(l,) by how many times each line is known less surely."""
    at: Callable[[Column, Applied | None], Relinearised]
    """The reference with sizes (k,), beside a cause."""


@dataclass(frozen=True)
class Fit:
    """One effect with its likeliest law."""

    effect: Effect
    law: Law
    applied: Applied
    sizes: Column
    """(k,) the law's free numbers."""
    spread: Column
    """(k,) their standard deviations."""
    log_evidence: float
    log_law: float
    """ln p of what it leaves, over how rough its law may be."""
    change: Column
    """(n,) what it changes."""
    slopes: Column
    """(l, k) of that by the law's free numbers, as lines."""
    forward: ForwardModel
    """On which it was judged."""
    roughness: float = 0.0
    """Share of what it changes by which its law is likely wrong, by what it leaves: root mean square."""

    @property
    def share(self) -> float:
        """What it changes, as a share of what moves without any cause (rms)."""
        return self.forward.share_of(self.change)

    @property
    def floors(self) -> float:
        """What it does to the angle, in floors (rms)."""
        return self.forward.floors_of(self.change)

    @property
    def fixed(self) -> dict[str, float]:
        """The law's numbers that are not fitted."""
        law = self.law
        return {
            name: value for name, value in self.applied.numbers.items() if name not in law.free and name not in law.tied
        }


def fit_effect(
    effect: Effect,
    forward: ForwardModel,
    shows: Callable[[Law], bool],
    screening: ForwardModel | None,
    identifiable: Callable[[Law], bool] | None = None,
) -> Fit | None:
    """The likeliest law of one effect; None where none acts on this factor or none gives a finite response. Each law is
    as likely beforehand as each of those that are `identifiable` from these records, on this factor or another: an
    effect that acts on both is no likelier for that."""
    found = [fit_law(effect, law, forward, screening or forward) for law in effect.laws if shows(law)]
    fits = sorted((one for one in found if one is not None), key=lambda one: one.log_evidence)
    if not fits:
        return None
    fits[-1] = best = _as_rough(fits[-1])
    total = float(np.logaddexp.reduce([one.log_evidence for one in fits]))
    return replace(best, log_evidence=total - float(np.log(sum(map(identifiable or shows, effect.laws)))))


def fit_law(effect: Effect, law: Law, forward: ForwardModel, screening: ForwardModel) -> Fit | None:
    """Scan the law's grid on few records (`screening`), go on from its best point on the whole one."""
    whole = _Trial(law, forward)
    first = whole if screening is forward else _Trial(law, screening)
    unit = forward.scales[law.scale]
    tried: list[tuple[Column, dict[str, float]]] = []
    for shape in law.shapes_in(forward.scales):
        fixed = {name: value for name, value in shape.items() if name not in law.free}
        shapes = [shape.get(name, first.neutral(name)) for name in law.free[1:]]
        sizes = (sign * size * unit for sign in law.signs for size in law.grid)
        tried += [(np.array([size, *shapes]), fixed) for size in sizes if first.low[0] <= size <= first.high[0]]
    weighed = zip(first.costs(tried), tried, strict=True)
    best = min((one for one in weighed if np.isfinite(one[0])), key=itemgetter(0), default=None)
    if best is None:
        return None
    start, fixed = best[1]
    fit = whole.nearest(start, fixed)
    if not np.isfinite(fit.chi_square):
        return None
    whole, fit = _taken_anew(whole, fit, fixed)
    moved = whole.moved(fit.x, fixed)
    if leaves_more_than_it_changes(whole.forward, moved, whole.gap - moved):
        return None
    return whole.judged(effect, fit, fixed)


def _as_rough(fit: Fit) -> Fit:
    """The law once more from where it stands, its numbers by what so rough a law leaves, where that is likelier: where
    one record shows it far above the noise, the least squares of the noise alone let that record decide, and another
    that shows it a little is left unexplained."""
    trial, fixed = _Trial(fit.law, fit.forward), fit.fixed
    factor, prior = fit.forward.factor, fit.forward.prior
    moved = trial.known(fit.sizes, fixed, fit.change)
    rough = with_law(factor.healthy, factor.lines, moved, fit.roughness, prior)
    found = trial.nearest(fit.sizes, fixed, fit.slopes, rough)
    if not np.isfinite(found.chi_square) or np.array_equal(found.x, fit.sizes):
        return fit
    residual = trial.gap - trial.moved(found.x, fixed)
    again = trial.judged(fit.effect, replace(found, chi_square=factor.healthy.chi_square(residual)), fixed)
    return max(fit, again, key=lambda one: one.log_evidence)


def leaves_more_than_it_changes(forward: ForwardModel, moved: Column, residual: Column) -> bool:
    """Whether a law leaves more (lines, (l,)) than it changes, beside the regulators of a simulator, which follow no
    rig's exactly; what may differ without being a gap and the noise aside. Then how rough the law may be would stand
    for all that the simulator misses, by its spectrum and not by its course (docs/decisions/0591)."""
    if forward.unsure is None:
        return False
    healthy = forward.factor.healthy
    return float(np.sum(healthy.beyond(residual) ** 2) - np.sum(healthy.variance)) > float(np.sum(moved**2))


def _taken_anew(whole: "_Trial", fit: Nearest, fixed: Mapping[str, float]) -> tuple["_Trial", Nearest]:
    """A trial and its fit once what is unsure of the reference stands still beside it; as they were where it does
    not."""
    here, found = whole, fit
    for _ in range(UNSURE_ROUNDS):
        residual = here.gap - here.moved(found.x, fixed)
        if here.forward.is_settled(residual):
            return here, found
        here = _Trial(whole.law, here.forward.beside(here.applied(found.x, fixed), residual))
        found = here.nearest(found.x, fixed)
        if not np.isfinite(found.chi_square):
            break
    return whole, fit


def settled(forward: ForwardModel) -> ForwardModel:
    """The model with what is unsure of its reference where it is likeliest without any cause; as it was where that does
    not stand still."""
    here = forward
    for _ in range(UNSURE_ROUNDS):
        residual = here.factor.gap_lines
        if here.is_settled(residual):
            return here
        here = here.beside(None, residual)
    return forward


def refit(fit: Fit, forward: ForwardModel) -> Applied:
    """The same law and shapes, fitted by another forward model from where they stand."""
    trial = _Trial(fit.law, forward)
    fixed = fit.fixed
    found = trial.nearest(fit.sizes, fixed)
    return trial.applied(found.x if np.isfinite(found.chi_square) else fit.sizes, fixed)


class _Trial:
    """One law by one forward model: what it changes with numbers, and with which it leaves least."""

    def __init__(self, law: Law, forward: ForwardModel) -> None:
        self.law, self.forward = law, forward
        self._numbers = {number.name: number for number in EFFECT_STAGES[law.stage].numbers}
        bounds = [law.range_of(name, forward.scales) for name in law.free]
        self.low, self.high = np.array([pair[0] for pair in bounds]), np.array([pair[1] for pair in bounds])
        self.gap = forward.factor.gap_lines
        self._computed: dict[tuple[object, ...], tuple[Column, Column]] = {}

    def neutral(self, name: str) -> float:
        return self._numbers[name].neutral

    def applied(self, x: Column, fixed: Mapping[str, float]) -> Applied:
        values = dict(fixed) | {name: float(value) for name, value in zip(self.law.free, x, strict=True)}
        return Applied(self.law.stage, self.law.with_tied(values))

    def changed(self, x: Column, fixed: Mapping[str, float]) -> tuple[Column, Column]:
        """(n,) what the law changes and (l,) its lines, these not finite where it runs away; computed once for each
        numbers: a descent comes back to where it was, and is judged there."""
        asked = (*x, *fixed.items())
        if asked not in self._computed:
            change = self.forward.changed_by(self.applied(x, fixed))
            gone = runs_away(change)
            moved = np.full_like(self.gap, np.nan) if gone else self.forward.factor.lines.of(change)
            self._computed[asked] = change, moved
        return self._computed[asked]

    def known(self, x: Column, fixed: Mapping[str, float], change: Column) -> Column:
        """(l,) lines of what it is known already to change with these numbers, (n,)."""
        moved = self.forward.factor.lines.of(change)
        self._computed[*x, *fixed.items()] = change, moved
        return moved

    def moved(self, x: Column, fixed: Mapping[str, float]) -> Column:
        """(l,) the lines alone."""
        return self.changed(x, fixed)[1]

    def nearest(
        self, start: Column, fixed: Mapping[str, float], slopes: Column | None = None, by: Gaussian | None = None
    ) -> Nearest:
        """The numbers that leave least, by what is expected of a healthy rig or `by` something else."""
        by = by or self.forward.factor.healthy
        return nearest(lambda x: self.moved(x, fixed), self.gap, by, start, (self.low, self.high), FIT_STEPS, slopes)

    def costs(self, tried: Sequence[tuple[Column, Mapping[str, float]]]) -> list[float]:
        """Chi-square of what the law leaves with each of these free and fixed numbers, not finite where it runs away:
        what it changes becomes lines in one go."""
        changes = [self.forward.changed_by(self.applied(x, fixed)) for x, fixed in tried]
        stays = [not runs_away(change) for change in changes]
        if not any(stays):
            return [np.inf] * len(tried)
        columns = np.column_stack([change for change, stay in zip(changes, stays, strict=True) if stay])
        moved = iter(self.forward.factor.lines.of(columns).T)
        healthy = self.forward.factor.healthy
        return [healthy.chi_square(self.gap - next(moved)) if stay else np.inf for stay in stays]

    def judged(self, effect: Effect, fit: Nearest, fixed: Mapping[str, float]) -> Fit:
        """Laplace's evidence at the optimum, the law's usual error included."""
        x = fit.x
        healthy, lines, prior = self.forward.factor.healthy, self.forward.factor.lines, self.forward.prior
        change, moved = self.changed(x, fixed)
        residual = self.gap - moved
        rho = effect.roughness(prior, self.law)
        rough = Counter(min(share * rho, MOST_ROUGH) for share in (EXACT, *prior.law_shares))
        log_shares = np.log(np.array(list(rough.values())) / rough.total())
        logs = log_shares + log_densities(healthy, lines, moved, residual, list(rough), prior)
        log_density = float(np.logaddexp.reduce(logs))
        roughness = float(np.sqrt(np.exp(logs - log_density) @ np.square(list(rough))))
        stiff = (healthy.degrees + healthy.effective) / (healthy.degrees + fit.chi_square)
        hessian = stiff * healthy.normal(fit.slopes, residual)[0]
        log_prior, precision = self._log_prior(x, change)
        hessian = hessian + np.diag(precision)
        sign, log_det = np.linalg.slogdet(hessian)
        spread = np.sqrt(np.maximum(np.diag(np.linalg.pinv(hessian)), 0.0))
        laplace = 0.5 * len(x) * np.log(2 * np.pi) - 0.5 * log_det if sign > 0 else 0.0
        evidence = log_density + log_prior + laplace
        return Fit(
            effect, self.law, self.applied(x, fixed), x, spread, float(evidence), log_density, change, fit.slopes,
            self.forward, roughness,
        )  # fmt: skip

    def _log_prior(self, x: Column, change: Column) -> tuple[float, Column]:
        """Log-normal in what the effect does, flat in its shapes; and the precision that holds each number within its
        range."""
        prior = self.forward.prior
        size = max(abs(float(x[0])), 1e-9)
        log_size = prior.log_density(self.forward.share_of(change))
        total = log_size - np.log(size) - np.log(len(self.law.signs))
        widths = _widths(x[1:], (self.high - self.low)[1:])
        total -= float(np.sum(np.log(widths))) + np.log(len(self.law.shapes))
        precision = np.concatenate([[1.0 / (prior.share_spread * size) ** 2], 12.0 / widths**2])
        return total, precision


def number_spreads(fit: Fit, prior: Prior) -> Column:
    """(k,) how far a law's numbers may be from where they are likeliest, by what is thought of them beforehand:
    standard deviations."""
    bounds = [fit.law.range_of(name, fit.forward.scales) for name in fit.law.free[1:]]
    widths = _widths(fit.sizes[1:], np.array([high - low for low, high in bounds]))
    return np.concatenate([[prior.share_spread * abs(float(fit.sizes[0]))], widths / np.sqrt(12.0)])


def _widths(values: Column, bounds: Column) -> Column:
    """(k,) range over which a law's further numbers are flat."""
    out: Column = np.minimum(bounds, np.maximum(WIDTH_SHARES[0] * np.abs(values), WIDTH_SHARES[1] * bounds))
    return out

"""The identification of a model: searches from several seeds, polish, the check over the sweep range, and what is known
of the result."""

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from rig.excite.signals import Signal
from rig.identify.provenance import provenance
from rig.identify.records.data import Prepared, RecordOptions, commands_known, doubts, prepare
from rig.identify.response.fingerprint import make_fingerprint
from rig.identify.response.mean_law import hold, is_free
from rig.identify.response.valves import ValveFit, identify_valves
from rig.identify.search.objective import ChainObjective, make_objective, predict
from rig.identify.search.one_search import Budget, Found, search
from rig.identify.search.optimizers import Optimizer, Table, make_optimizer, polish
from rig.identify.search.space import Space
from rig.identify.search.stability import StabilityTerm, StabilityVerdict, SweepRange, check_bounded
from rig.identify.search.swarm import SwarmSettings
from rig.identify.search.uncertainty import Uncertainty, local_uncertainty
from rig.identify.validate import Score, angle_limit, excited_hz, score
from rig.model.compiled.swarm import cores
from rig.model.parameters import AddedEffect, Input, Model, StageKind, ValidRange
from rig.record import Record

_POOR = 0.05
"""Share of the angle's range: a modified Bouc-Wen model that misses the records it was fitted to by more (rms) lacks
something. It misses healthy rigs by 1 to 3 %. Less: sound models are called poor."""
_TERM_SHARE = 0.8
"""The search keeps within this share of the verdict's limit, so that what lies between its few excitations fits in
too."""
_POLISH_ROUNDS = 100
"""Iterations of a polish at most, by which its share of the budget is told."""
_POLISH_ROWS = 4000
"""About how many rows a polish looks at: neighbours 5 ms apart say the same of a joint that takes 0.1 s to move."""
_AGAIN_EVALUATIONS = 12_000
"""Evaluations of the search after excitations were added: a fifth of the first one's. More: slower."""
_MOST_FAILING = 8
"""Of the excitations that failed, those that are added in one round: each costs the search a simulation for every
point."""
_ROUNDS = 3
"""How often excitations that the dense check found failing are put into the search's term."""


@dataclass(frozen=True)
class SearchSettings:
    """How the free parameters are searched: optimiser, seeds, budget, and whether the model must stay bounded."""

    optimizer: str = "pso"
    seeds: tuple[int, ...] = (1, 2, 3)
    swarm: SwarmSettings = field(default_factory=SwarmSettings)
    patience: int | None = None
    """Early stop after so many rounds without gain; None: the whole budget of Table II."""
    polish: bool = True
    bounded: bool = True
    """Keep the model bounded over the sweep range, by a term in the score."""
    sweep: SweepRange = field(default_factory=SweepRange)
    workers: int = field(default_factory=cores)


@dataclass(frozen=True)
class Identified:
    """A model and how it came about."""

    model: Model
    rmse_deg: float
    """Over all identification records together."""
    search_rmse_deg: float
    """The same before the polish: what the optimiser alone reached."""
    evaluations: int
    seconds: float
    verdict: StabilityVerdict
    unbounded_rmse_deg: float | None
    """What the same search reaches when it need not stay bounded; None when that was not asked for."""
    seeds: dict[int, Found]
    """Seed -> its search before the polish; the points of several seeds show how well the swarm agrees with itself."""
    space: Space
    uncertainty: Uncertainty
    scores: list[Score]
    """One for each identification record."""
    valves: ValveFit | None
    warnings: list[str]
    choices: list[str] = field(default_factory=list)
    """What was chosen for the caller, and why."""

    def seed_spread(self) -> dict[str, float]:
        """Standard deviation over the seeds of each parameter as the search left it, in its own unit."""
        points = np.array([found.point for found in self.seeds.values()])
        spread = np.std(points, axis=0, ddof=1) if len(points) > 1 else np.full(len(self.space), np.nan)
        return dict(zip(self.space.names, (spread * (self.space.high - self.space.low)).tolist(), strict=True))


T = TypeVar("T")
Report = Callable[[str, float, float], None]
"""Called with the step at hand, the share of its budget that is spent, and the best RMSE so far."""


def identify(
    records: Sequence[Record],
    start: Model,
    settings: SearchSettings,
    options: RecordOptions | None = None,
    report: Report | None = None,
) -> Identified:
    """Fit the free parameters of `start` to `records`.

    Raises RecordError for records that cannot be used, ModelError for a start that cannot be searched.
    """
    begun = time.perf_counter()
    data = [prepare(record, start, options) for record in records]
    valves = _valves([each.grid for each in data], start)
    if valves is not None:
        start = _with_regulators(start, valves)
    done = _search_and_polish(_Task(data, hold(start, data), settings, report), start)
    objective = done.task.objective(None)
    uncertainty = local_uncertainty(objective, done.task.space, done.point)
    rmse = float(objective.scores(done.point[np.newaxis])[0])
    verdict = done.task.verdict(done.point)
    model, scores = _model_and_scores(done, uncertainty, rmse, verdict, data, settings, start)
    best = min(done.found.values(), key=lambda each: each.score)
    return Identified(
        model,
        rmse,
        float(objective.scores(best.point[np.newaxis])[0]),
        done.evaluations,
        time.perf_counter() - begun,
        verdict,
        None if done.free_rmse is None else min(done.free_rmse, rmse),
        done.found,
        done.task.space,
        uncertainty,
        scores,
        valves,
        _warnings(data, valves, model) + _undetermined(done.task.space, uncertainty) + _poor(data, scores, rmse),
    )


def _with_regulators(start: Model, valves: ValveFit) -> Model:
    """The start with its regulators as they were identified."""
    late = [AddedEffect("delay", {"delay_s": valves.dead_time_s})] if valves.dead_time_s else []
    return replace(start, valve=valves.stage, effects=start.effects + late)


@dataclass(frozen=True)
class _Searched:
    """Where the searches ended."""

    task: "_Task"
    point: Table
    found: dict[int, Found]
    """By seed, before the polish."""
    free_rmse: float | None
    """What is reached when the model need not stay bounded."""
    evaluations: int


def _search_and_polish(task: "_Task", start: Model) -> _Searched:
    """Every seed's search, the best of them polished; once more with all that is free, where something was held."""
    found, unbounded = task.search_all()
    point, spent = task.refine(list(found.values()))
    free_rmse, free_spent = (None, 0) if unbounded is None else task.without_bound(unbounded, point)
    if is_free(start):
        wider = task.widened(start)
        found = {seed: replace(each, point=wider.taken_over(task, each.point)) for seed, each in found.items()}
        point, more = wider.polish_once_more(wider.taken_over(task, point))
        task, spent = wider, spent + more
    evaluations = sum(each.evaluations for each in found.values()) + spent + free_spent
    return _Searched(task, point, found, free_rmse, evaluations)


def _model_and_scores(
    done: _Searched,
    uncertainty: Uncertainty,
    rmse: float,
    verdict: StabilityVerdict,
    data: Sequence[Prepared],
    settings: SearchSettings,
    start: Model,
) -> tuple[Model, list[Score]]:
    """The model with what belongs into its file, and its score on every record."""
    model = done.task.space.model(done.point, uncertainty.std)
    scores = [
        score(str(each.record.source or each.record.name), each.angle_deg, predict(model, each), each.skip)
        for each in data
    ]
    search = (settings.optimizer, settings.seeds[0], done.evaluations)
    model = replace(
        model,
        valid=_valid(data, settings, verdict, start),
        provenance=provenance(data, scores, rmse, search),
        fingerprint=None,
    )
    return replace(model, fingerprint=make_fingerprint(data, model)), scores


def _warnings(data: Sequence[Prepared], valves: ValveFit | None, model: Model) -> list[str]:
    found = doubts(data) + ([] if valves is None else valves.notes)
    if model.fingerprint is None:
        found.append("no fingerprint: the records are too short for one, or their commands have gaps")
    return found


def _undetermined(space: Space, uncertainty: Uncertainty) -> list[str]:
    """A line that names the parameters that the records do not determine; empty where they determine all."""
    names = ", ".join(np.array(space.names)[np.isinf(uncertainty.std)])
    return [f"not determined by these records, other values within their bounds fit as well: {names}"] if names else []


def _poor(data: Sequence[Prepared], scores: Sequence[Score], rmse_deg: float) -> list[str]:
    """A line where the model misses its own records by far more than one of its kind does; empty where it does not."""
    reach = max(float(np.max(each.angle_deg)) for each in data) - min(float(np.min(each.angle_deg)) for each in data)
    if rmse_deg <= _POOR * reach:
        return []
    worst = max(scores, key=lambda row: row.rmse_deg)
    return [
        f"the model misses its own records by {rmse_deg:.2g} deg rms, {100.0 * rmse_deg / reach:.2g} % of how far the "
        f"angle goes, where 1 to 3 % are usual: it lacks something, or a column is not what it seems; most in "
        f"{Path(worst.log).name} ({worst.rmse_deg:.2g} deg), and --figures draws it"
    ]


class _Task:
    """The searches over one set of records."""

    def __init__(self, data: Sequence[Prepared], start: Model, settings: SearchSettings, report: Report | None) -> None:
        self._data, self._start, self._settings, self._report = data, start, settings, report
        self._given_up = False
        self.space = Space(start)
        self._limit = angle_limit(data, settings.sweep)
        self._failing: list[Signal] = []
        self._thin = max(1, sum(len(each.angle_deg) for each in data) // _POLISH_ROWS)

    def objective(self, term: StabilityTerm | None, thin: int = 1) -> ChainObjective:
        return make_objective(self._start, self.space, self._data, term, thin)

    def search_all(self) -> tuple[dict[int, Found], Found | None]:
        """One search from every seed, and one more from the first that need not stay bounded where the others do; as
        many at once as there are cores."""
        seeds, bounded = self._settings.seeds, self._settings.bounded
        asked = [(seed, bounded) for seed in seeds] + ([(seeds[0], False)] if bounded else [])
        found = self._at_once(lambda each: self._search_from(*each), asked)
        return dict(zip(seeds, found, strict=False)), found[-1] if bounded else None

    def refine(self, found: Sequence[Found]) -> tuple[Table, int]:
        """The best point after a polish of every search, kept bounded under the dense check; with the evaluations that
        took.

        The error has long curved valleys in which a search ends early, so the best one before need not be the best one
        after.
        """
        bounded = self._settings.bounded
        point, spent = self._best_polished([each.point for each in found], bounded)
        for _ in range(_ROUNDS if bounded else 0):
            failing = self.verdict(point).failing
            if not failing:
                break
            self._failing += [signal for signal in failing if signal not in self._failing][:_MOST_FAILING]
            again = self._search_again()
            point, more = self._best_polished([point, again.point], bounded)
            spent += more + again.evaluations
        return point, spent

    def without_bound(self, found: Found, bounded_best: Table) -> tuple[float, int]:
        """RMSE (deg) that is reached when the model need not stay bounded, and the evaluations that took. Polished are
        the point where the search without that bound ended (`found`) and the best bounded one."""
        point, spent = self._best_polished([found.point, bounded_best], False)
        return float(self.objective(None).scores(point[np.newaxis])[0]), spent + found.evaluations

    def widened(self, start: Model) -> "_Task":
        """The same task with more parameters free."""
        wider = _Task(self._data, start, self._settings, self._report)
        wider._failing = self._failing
        return wider

    def taken_over(self, narrow: "_Task", point: Table) -> Table:
        """A point of a task with fewer free parameters, in this one's space."""
        return self.space.point(narrow.space.model(point))

    def polish_once_more(self, point: Table) -> tuple[Table, int]:
        """The point polished, unless it is bounded and no longer so afterwards; with the evaluations that took."""
        bounded = self._settings.bounded
        better, spent = self._best_polished([point], bounded)
        lost = bounded and self.verdict(point).bounded and not self.verdict(better).bounded
        return (point if lost else better), spent

    def verdict(self, point: Table) -> StabilityVerdict:
        return check_bounded(self.space.model(point), self._settings.sweep, self._limit)

    def _search_again(self) -> Found:
        """A short search with the excitations that were added: by CMA-ES, which leaves the region that the swarm has
        found more easily than the swarm does."""
        made = make_optimizer("cma-es", len(self.space), self._settings.seeds[0], self._settings.swarm)
        return self._run("once more", made, True, _AGAIN_EVALUATIONS)

    def _search_from(self, seed: int, bounded: bool) -> Found:
        name = self._settings.optimizer
        made = make_optimizer(name, len(self.space), seed, self._settings.swarm)
        swarm = self._settings.swarm
        return self._run(f"{name}, seed {seed}", made, bounded, swarm.particles * swarm.iterations)

    def _best_polished(self, points: Sequence[Table], bounded: bool) -> tuple[Table, int]:
        """Every point polished; the best by the score over all rows, and the evaluations that took."""
        polished: list[Found] = []
        if self._settings.polish:
            budget = _POLISH_ROUNDS * (2 * len(self.space) + 1)
            polished = self._at_once(
                lambda point: self._run("polish", polish(point, _POLISH_ROUNDS), bounded, budget, self._thin), points
            )
        ends = np.array([*points, *(each.point for each in polished)])
        scores = self.objective(self._term(bounded)).scores(ends)
        return ends[int(np.argmin(scores))], sum(each.evaluations for each in polished) + len(ends)

    def _at_once(self, work: Callable[[T], Found], items: Sequence[T]) -> list[Found]:
        with ThreadPoolExecutor(max(1, min(self._settings.workers, len(items)))) as pool:
            try:
                return list(pool.map(work, items))
            except BaseException:
                self._given_up = True  # Ctrl-C: the pool waits for its threads, which would search to their ends
                raise

    def _run(self, title: str, made: Optimizer, bounded: bool, evaluations: int, thin: int = 1) -> Found:
        def report(done: int, best: float) -> None:
            if self._given_up:
                raise InterruptedError("the search was given up")
            if self._report is not None:
                self._report(title, done / evaluations, best)

        objective = self.objective(self._term(bounded), thin)
        return search(objective, made, Budget(evaluations, self._settings.patience), report)

    def _term(self, bounded: bool) -> StabilityTerm | None:
        if not bounded or self._start.muscle.kind == StageKind.BW_CONTINUOUS:
            return None  # model (1) is bounded wherever psi > |gamma|, and the dense check judges it
        return StabilityTerm(self._settings.sweep, self._start, _TERM_SHARE * self._limit, self._failing)


def _valves(records: Sequence[Record], start: Model) -> ValveFit | None:
    """The regulators, where the model has them as a stage and the records show them."""
    if start.muscle.input is not Input.PRESSURE or not all(record.has_pressures for record in records):
        return None
    if start.valve.kind != StageKind.DIRECT or not all(map(commands_known, records)):
        return None
    return identify_valves(records, start.sample_time_s, start.p0_mpa)


def _valid(data: Sequence[Prepared], settings: SearchSettings, verdict: StabilityVerdict, start: Model) -> ValidRange:
    """The sweep range where the model is bounded over it, else only what the records excite."""
    if verdict.bounded:
        sweep = settings.sweep
        return ValidRange((sweep.low_hz, sweep.high_hz), sweep.amplitude_mpa, True)
    excited = [excited_hz(each.p1_mpa - each.p2_mpa, start.sample_time_s) for each in data]
    return ValidRange(
        (min(low for low, _ in excited), max(high for _, high in excited)), max(each.amplitude_mpa for each in data)
    )

"""What `pamrig gap study sensitivity` does: each number that decides in the likelihood halved and doubled, and what of
the answers to development cases moves.

The numbers are the constants of `rig.gap.settings` and what is fitted in `rig/gap/priors.yaml`; a pattern's size is
moved in every reference at once.
"""

import ast
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, Final

from hil.reference.cases import Case, DrawnKind, Purpose, bench_of, draw_sheet, realise
from rig import gap
from rig.blind_check.generate import nominal_model, without_fingerprint
from rig.blind_check.source import records_of
from rig.errors import RigError
from rig.gap import settings
from rig.gap.answer.facts import Verdict
from rig.gap.diagnosis import diagnose_with_grounds
from rig.gap.priors import BuildSpread, FactorLevels, Fitted, Levels, Odds, Prior, UsualNoise, UsualSizes, fitted
from rig.model.parameters import Model
from rig.parallel import each, executor
from rig.record import Record

FACTORS: Final = (0.5, 2.0)
"""By which each number is multiplied."""
WAYS: Final = ("session", "fingerprint", "simulator")
"""How the cases are asked, in turn."""
OF_SHARE: Final = {"CREDIBLE", "EXCITED_POWER"}
"""Numbers near 1 of which the distance from 1 is moved."""
PRIORS, CONSTANTS = "priors.yaml", "settings.py"


@dataclass(frozen=True)
class DecidingNumber:
    """A number that decides: a constant (with a place in its tuple), or what stands under a name in priors.yaml."""

    where: str
    name: str
    value: float
    place: int | None = None

    @property
    def shown(self) -> str:
        """As the table has it."""
        return self.name if self.place is None else f"{self.name}[{self.place}]"


@dataclass(frozen=True)
class DevelopmentCases:
    """The development cases."""

    families: tuple[str, ...]
    seed: int
    cases: int
    """Of each family."""


@dataclass(frozen=True)
class ComparedAnswer:
    """One answer, as far as it is compared."""

    verdict: Verdict | None
    """None where the case cannot be judged."""
    named: tuple[str, ...]
    right: bool
    """No finding on a healthy rig, the effect first, both of a pair named, or something unknown said of a foreign
    one."""


@dataclass(frozen=True)
class Moved:
    """What a number moved by a factor does to the answers."""

    number: DecidingNumber
    factor: float
    verdicts: int
    names: int
    """Answers with another verdict; with other names."""
    right: int
    """Right answers with it."""


def numbers() -> list[DecidingNumber]:
    """Every number, constants first."""
    return [*_constants(), *_priors()]


def _constants() -> Iterator[DecidingNumber]:
    for name, value in vars(settings).items():
        if not name.isupper() or isinstance(value, (str, Path)):
            continue
        parts = enumerate(value) if isinstance(value, tuple) else [(None, value)]
        yield from (DecidingNumber(CONSTANTS, name, float(one), place) for place, one in parts)


def _priors() -> Iterator[DecidingNumber]:
    priors = fitted()
    for field in fields(Prior):
        value = getattr(priors.prior, field.name)
        if not isinstance(value, (Mapping, tuple)):  # the laws' errors are moved together, by `rho_scale`
            yield DecidingNumber(PRIORS, f"prior.{field.name}", float(value))
    odds = next(iter(priors.levels.values())).odds
    yield from (
        DecidingNumber(PRIORS, f"odds.{field.name}", float(getattr(odds, field.name))) for field in fields(Odds)
    )
    for factor in ("pressures", "angle"):
        levels: FactorLevels = getattr(next(iter(priors.levels.values())), factor)
        yield from (DecidingNumber(PRIORS, f"{factor}.{name}", size) for name, size in levels.patterns.items())
        yield from (
            DecidingNumber(PRIORS, f"{factor}.{name}", getattr(levels, name)) for name in ("share", "even", "floor")
        )
    builds = next(levels.builds for levels in priors.levels.values() if levels.builds is not None)
    yield from (
        DecidingNumber(PRIORS, f"builds.{field.name}", getattr(builds, field.name)) for field in fields(BuildSpread)
    )
    usual = next(levels.usual for levels in priors.levels.values() if levels.usual is not None)
    yield from (DecidingNumber(PRIORS, f"usual.{effect}", scale) for effect, scale in usual.scales.items())
    yield DecidingNumber(PRIORS, "commanded_floor", next(iter(priors.levels.values())).commanded_floor)
    if priors.noise is not None:
        yield from (
            DecidingNumber(PRIORS, f"noise.{field.name}", getattr(priors.noise, field.name))
            for field in fields(UsualNoise)
        )


def answered(
    asked: DevelopmentCases, number: DecidingNumber | None = None, factor: float = 1.0
) -> list[ComparedAnswer]:
    """The answers to the cases with one number moved."""
    at_hand = moved_priors(fitted(), number, factor) if number and number.where == PRIORS else fitted()
    with _constant(number, factor):
        return [answer_to(case, WAYS[k % len(WAYS)], at_hand) for k, case in enumerate(cases_of(asked))]


def sensitivity(
    asked: DevelopmentCases, workers: int | None = None, report: Callable[[int], None] = lambda done: None
) -> tuple[list[ComparedAnswer], list[Moved]]:
    """The answers as they are, and what each number does to them."""
    base = answered(asked)
    work = [(number, factor) for number in numbers() for factor in FACTORS]
    with executor(None, workers) as pool:
        return base, list(each(pool, partial(_moved, asked, tuple(base)), work, report))


def _moved(asked: DevelopmentCases, base: Sequence[ComparedAnswer], work: tuple[DecidingNumber, float]) -> Moved:
    number, factor = work
    answers = answered(asked, number, factor)
    verdicts = sum(one.verdict != other.verdict for one, other in zip(answers, base, strict=True))
    names = sum(one.named != other.named for one, other in zip(answers, base, strict=True))
    return Moved(number, factor, verdicts, names, sum(one.right for one in answers))


def moved_priors(priors: Fitted, number: DecidingNumber, factor: float) -> Fitted:
    """The fitted numbers with one of them moved, a level in every reference."""
    part, _, name = number.name.partition(".")
    if part == "prior":
        value = getattr(priors.prior, name)
        return replace(priors, prior=replace(priors.prior, **{name: type(value)(value * factor)}))
    if part == "noise":
        was = priors.noise
        return priors if was is None else replace(priors, noise=replace(was, **{name: getattr(was, name) * factor}))
    return replace(priors, levels={key: _moved_levels(one, part, name, factor) for key, one in priors.levels.items()})


def _moved_levels(levels: Levels, part: str, name: str, factor: float) -> Levels:
    if part == "commanded_floor":
        return replace(levels, commanded_floor=levels.commanded_floor * factor)
    if part == "builds":
        was = levels.builds
        return levels if was is None else replace(levels, builds=replace(was, **{name: getattr(was, name) * factor}))
    if part == "usual":
        scales = {} if levels.usual is None else levels.usual.scales
        return (
            levels if name not in scales else replace(levels, usual=UsualSizes({**scales, name: scales[name] * factor}))
        )
    if part == "odds":
        return replace(levels, odds=replace(levels.odds, **{name: getattr(levels.odds, name) * factor}))
    mine: FactorLevels = getattr(levels, part)
    if name in mine.patterns:
        changed = replace(mine, patterns={**mine.patterns, name: mine.patterns[name] * factor})
    else:
        changed = replace(mine, **{name: getattr(mine, name) * factor})
    return replace(levels, pressures=changed) if part == "pressures" else replace(levels, angle=changed)


@contextmanager
def _constant(number: DecidingNumber | None, factor: float) -> Iterator[None]:
    """A constant moved in every module that reads it, and put back."""
    if number is None or number.where != CONSTANTS:
        yield
        return
    was = getattr(settings, number.name)
    now = _scaled(number, was, factor)
    places = [
        module
        for name, module in list(sys.modules.items())
        if name.startswith("rig.gap") and getattr(module, number.name, None) is was
    ]
    for module in places:
        setattr(module, number.name, now)
    try:
        yield
    finally:
        for module in places:
            setattr(module, number.name, was)


def _scaled(number: DecidingNumber, was: Any, factor: float) -> Any:
    if number.name in OF_SHARE:
        return 1.0 - (1.0 - was) * factor
    if number.place is None:
        return type(was)(was * factor)
    return tuple(one * factor if k == number.place else one for k, one in enumerate(was))


@lru_cache(maxsize=2)
def cases_of(asked: DevelopmentCases) -> tuple[Case, ...]:
    """The development cases, the families in turn."""
    sheets = [draw_sheet(Purpose.DEVELOPMENT, asked.seed, asked.cases, name) for name in asked.families]
    return tuple(case for some in zip(*sheets, strict=True) for case in some)


@lru_cache(maxsize=64)
def _read(case: Case) -> tuple[list[Record], list[Record], Model]:
    """The case's records, its first earlier day, and the model that was identified on that day."""
    bench = bench_of(case)
    healthy = records_of(bench.baselines[0])
    return records_of(realise(case, bench).records), healthy, _model(healthy, bench.excitations[0].p0_mpa, case)


_models: dict[tuple[str, int, int], Model] = {}
"""By family, seed and unit: ten cases share one."""


def _model(healthy: Sequence[Record], p0_mpa: float, case: Case) -> Model:
    key = (case.family, case.seed, case.unit)
    if key not in _models:
        _models[key] = nominal_model(healthy, p0_mpa)
    return _models[key]


def answer_to(case: Case, way: str, at_hand: Fitted) -> ComparedAnswer:
    """What the diagnosis says of a case asked in one of WAYS, by these levels."""
    records, day, model = _read(case)
    simulator = {"session": None, "simulator": without_fingerprint(model)}.get(way, model)
    try:
        found, _ = diagnose_with_grounds(simulator, records, [day] if way == "session" else [], settings=at_hand)
    except RigError:
        return ComparedAnswer(None, (), False)
    named = tuple(cause.effect for cause in found.causes if cause.is_named)
    return ComparedAnswer(found.verdict, named, _right(case, found.verdict, named))


def _right(case: Case, verdict: Verdict, named: Sequence[str]) -> bool:
    if case.kind is DrawnKind.NONE:
        return verdict is Verdict.NONE
    if case.kind is DrawnKind.FOREIGN:
        return verdict in (Verdict.UNKNOWN, Verdict.PARTLY_EXPLAINED)
    return set(case.effects) <= set(named[: len(case.effects)])


def deciding(folder: Path | None = None) -> Mapping[str, tuple[int, int]]:
    """File -> (constants, numbers in them): every number under a name in capitals in the room of the diagnosis."""
    root = folder or Path(gap.__file__).parent
    found = {str(path.relative_to(root)): _numbers_of(path) for path in sorted(root.rglob("*.py"))}
    return {name: counts for name, counts in found.items() if counts[1]}


def _numbers_of(path: Path) -> tuple[int, int]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    counts = [
        sum(isinstance(part, ast.Constant) and isinstance(part.value, (int, float)) and not isinstance(part.value, bool)
            for part in ast.walk(value))
        for target, value in _assigned(tree)
        if target.strip("_").isupper()
    ]  # fmt: skip
    return sum(count > 0 for count in counts), sum(counts)


def _assigned(tree: ast.Module) -> Iterator[tuple[str, ast.expr]]:
    for node in tree.body:
        if isinstance(node, ast.Assign):
            names = [part.id for target in node.targets for part in ast.walk(target) if isinstance(part, ast.Name)]
            yield from ((name, node.value) for name in names[:1])
        elif isinstance(node, ast.AnnAssign) and node.value is not None and isinstance(node.target, ast.Name):
            yield node.target.id, node.value

"""The table of `pamrig gap study sensitivity` for people: what each number moves, the most sensitive first, and how
many numbers decide at all."""

from collections.abc import Mapping, Sequence
from datetime import date

from rig.app.gap.study.sensitivity import FACTORS, PRIORS, ComparedAnswer, DecidingNumber, DevelopmentCases, Moved

LIBRARY = "hypotheses/library.py"
"""Bounds and grids of the effects: physics, not judgement; counted apart."""


def as_markdown(
    asked: DevelopmentCases,
    base: Sequence[ComparedAnswer],
    moved: Sequence[Moved],
    counted: Mapping[str, tuple[int, int]],
) -> str:
    """The page."""
    right, total = sum(one.right for one in base), len(base)
    lines = [
        "# What moves when a number moves", "",
        f"Written by `pamrig gap study sensitivity --cases {asked.cases} --seed {asked.seed}` on {date.today()}: each "
        f"number of `rig/gap/settings.py` and `rig/gap/priors.yaml` halved and doubled, {total} development cases of "
        f"{', '.join(asked.families)} asked by one day, fingerprint and simulator in turn. As they are, {right} of "
        f"{total} answers are right (no finding on a healthy rig, the effect first, both of a pair, something unknown "
        "said of a foreign one). Beside each factor: answers with another verdict, with other names, and right ones. "
        f"With {total} cases a change of one or two right ones is chance; what counts is which numbers move much.", "",
        _counts(counted, {one.number for one in moved}), "",
        "| number | is | halved: verdicts, names, right | doubled: verdicts, names, right |", "|---|---|---|---|",
    ]  # fmt: skip
    by_number: dict[DecidingNumber, dict[float, Moved]] = {}
    for one in moved:
        by_number.setdefault(one.number, {})[one.factor] = one
    order = sorted(by_number, key=lambda number: -sum(one.names for one in by_number[number].values()))
    lines += [_row(number, by_number[number]) for number in order]
    return "\n".join(lines) + "\n"


def _row(number: DecidingNumber, found: Mapping[float, Moved]) -> str:
    cells = [f"{found[factor].verdicts}, {found[factor].names}, {found[factor].right}" for factor in FACTORS]
    return f"| `{number.shown}` | {number.value:.4g} | {' | '.join(cells)} |"


def _counts(counted: Mapping[str, tuple[int, int]], moved: set[DecidingNumber]) -> str:
    library = counted.get(LIBRARY, (0, 0))
    constants, all_numbers = (sum(counts[k] for counts in counted.values()) for k in (0, 1))
    fitted = sum(number.where == PRIORS for number in moved)
    return (
        f"How many numbers decide: {all_numbers} in {constants} constants of `rig/gap`, of which {library[1]} in "
        f"{library[0]} are the bounds and grids of the effects (`{LIBRARY}`); the likelihood itself has "
        f"{len(moved)} that are moved here, {fitted} of them in `{PRIORS}` (each pattern once; every reference has its "
        "own size)."
    )

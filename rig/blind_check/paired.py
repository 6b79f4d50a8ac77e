"""Two checks of the same cases beside each other: of two methods, or of two sessions of records.

Case by case one is right where the other is not; an exact sign test on those says whether they differ (McNemar 1947).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from rig.blind_check.folder import CheckFolder
from rig.blind_check.generate import open_labels
from rig.blind_check.rates import Rate
from rig.blind_check.row import CLEAR_GAP, CaseKind, Row, Scored, read_scored
from rig.errors import RecordError

Pair = tuple[Row, Row]


def _nameable(row: Row) -> bool:
    return row.is_nameable


FIGURES: Final[Mapping[str, tuple[Callable[[Row], bool], Callable[[Row], object]]]] = {
    "healthy days left alone": (lambda row: not row.has_cause, lambda row: not row.detected),
    "detected, 1 to 3 floors": (lambda row: row.has_cause and 1.0 <= row.ratio < CLEAR_GAP, lambda row: row.detected),
    "detected, from 3 floors": (lambda row: row.has_cause and row.is_clear, lambda row: row.detected),
    "exact name first": (_nameable, lambda row: row.exact),
    "truth in the set": (_nameable, lambda row: row.in_set),
    "one name left": (_nameable, lambda row: len(row.names) == 1),
    "pairs, both right": (lambda row: row.is_clear and row.is_sized_pair, lambda row: row.both),
    "unknown flagged": (lambda row: row.kind is CaseKind.FOREIGN and row.is_clear, lambda row: row.flagged),
}
"""Figure -> (which cases count, what is right)."""


@dataclass(frozen=True)
class Beside:
    """One figure by both checks, on the same cases."""

    first: Rate
    other: Rate
    only_first: int
    only_other: int
    """Cases that one alone has right."""

    @property
    def p_value(self) -> float:
        """Of their difference, by an exact sign test on those cases."""
        from scipy.stats import binomtest  # two thirds of a second to import

        alone = self.only_first + self.only_other
        return float(binomtest(self.only_first, alone).pvalue) if alone else 1.0

    def to_json(self) -> dict[str, Any]:
        return {
            "first": self.first.to_json(), "other": self.other.to_json(), "only_first": self.only_first,
            "only_other": self.only_other, "p_value": self.p_value,
        }  # fmt: skip


@dataclass(frozen=True)
class Compared:
    """Two checks of the same cases."""

    first: str
    other: str
    """Names of their folders."""
    cases: int
    modes: Mapping[str, Mapping[str, Beside]]
    """Way of asking -> words of a figure -> by both."""

    def to_json(self) -> dict[str, Any]:
        """The JSON of the command."""
        modes = {mode: {words: one.to_json() for words, one in some.items()} for mode, some in self.modes.items()}
        return {"first": self.first, "other": self.other, "cases": self.cases, "modes": modes}


def compared(first: CheckFolder, other: CheckFolder) -> Compared:
    """Mode by mode and figure by figure: right by each, by one of them alone, and the p-value of their difference.
    RecordError when they are not checks of the same cases."""
    cases = [_by_case(folder) for folder in (first, other)]
    if cases[0].keys() != cases[1].keys():
        raise RecordError(f"{other.root}: other cases than in {first.root}; compare checks of one seed and size")
    scored = [(cases[0][key].rows, cases[1][key].rows) for key in cases[0]]
    modes = list(dict.fromkeys(mode for rows, others in scored for mode in rows if mode in others))
    figures = {mode: _figures([(a[mode], b[mode]) for a, b in scored if mode in a and mode in b]) for mode in modes}
    return Compared(first.root.name, other.root.name, len(scored), figures)


def _by_case(folder: CheckFolder) -> dict[tuple[Any, ...], Scored]:
    """Scored cases by what chance decided of them."""
    labels, seed = open_labels(folder)
    keys = ("family", "against", "number")
    missing = [token for token in labels if not folder.score(token).exists()]
    if missing:
        raise RecordError(f"{folder.root}: {len(missing)} of {len(labels)} cases are not scored; run the check again")
    return {
        (seed, *(label.get(key) for key in keys)): read_scored(folder.score(token)) for token, label in labels.items()
    }


def _figures(pairs: Sequence[Pair]) -> dict[str, Beside]:
    return {
        words: _figure([pair for pair in pairs if all(map(counts, pair))], right)
        for words, (counts, right) in FIGURES.items()
    }


def _figure(pairs: Sequence[Pair], right: Callable[[Row], object]) -> Beside:
    both = [(bool(right(a)), bool(right(b))) for a, b in pairs]
    return Beside(
        Rate.of(a for a, _ in both),
        Rate.of(b for _, b in both),
        sum(a and not b for a, b in both),
        sum(b and not a for a, b in both),
    )

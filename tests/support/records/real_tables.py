"""What the diagnosis said of real sets, counted: the tables of docs/reference/real_records.md."""

import datetime
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from typing import Any


@dataclass(frozen=True)
class Trial:
    """One question and its answer."""

    what: str
    earlier: str
    now: str
    verdict: str
    ratio: float | None
    """In floors; None where the records pair with nothing, as with `confidence`."""
    causes: tuple[str, ...]
    size: float | None
    unit: str
    ambiguous: tuple[str, ...]
    confidence: float | None


@dataclass(frozen=True)
class RealSet:
    """One view of a public set, as its answers are counted."""

    title: str
    turned: tuple[str, ...]
    """Effects that are what was turned, in the library's words; the first word of the table's row."""
    dial: Callable[[str, str], float | None]
    """By how much the dial was turned from one mounting to another; None where that is not known."""


def told(real: RealSet, trials: Sequence[Trial]) -> dict[str, Any]:
    """A set's answers, and its tables as the page shows them."""
    return {
        "title": real.title,
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "summary": summary(real, trials),
        "head": ["earlier", "now", "in floors", "verdict", "named", "size of the first", "alike"],
        "rows": [row(one) for one in trials if one.what == "change"],
        "trials": [asdict(one) for one in trials],
    }


def summary(real: RealSet, trials: Sequence[Trial]) -> dict[str, str]:
    """What is counted of a set."""
    repeats = [one for one in trials if one.what == "repeat"]
    first = [one for one in repeats if one.now.endswith("cycle 1")]
    later = [one for one in repeats if one not in first]
    changes = [one for one in trials if one.what == "change"]
    paired = [one for one in changes if one.ratio is not None]
    found = [one for one in paired if one.verdict != "none"]
    named = [one for one in found if set(one.causes) & set(real.turned)]
    held = [one for one in found if (set(one.causes) | set(one.ambiguous)) & set(real.turned)]
    other = [one for one in found if one not in held and set(one.causes) - {"unknown"}]
    return {
        "false alarms among repeats, cycle 2 or 3 against the others": share(alarms(later), later),
        "false alarms, cycle 1 against cycles 2 and 3": share(alarms(first), first),
        "changes that pair": share(paired, changes),
        "detected of those": share(found, paired),
        "what was turned is among the names": f"{share(named, found)} ({' or '.join(words(real.turned))})",
        "named, or in the set of what it may be": share(held, found),
        "names of another kind only": share(other, found),
        "pairs of sizes in the order of the dial": in_order(real, named),
    }


def alarms(repeats: Sequence[Trial]) -> list[Trial]:
    """Repeats that were taken for a gap."""
    return [one for one in repeats if one.verdict != "none"]


def share(some: Sequence[Trial], of: Sequence[Trial]) -> str:
    """k/n."""
    return f"{len(some)}/{len(of)}" if of else ""


def in_order(real: RealSet, named: Sequence[Trial]) -> str:
    """Of all pairs of changes that name the same effect first, in how many the size follows the dial."""
    known = [
        (real.dial(one.earlier, one.now), one) for one in named if one.size is not None and one.causes[0] in real.turned
    ]
    pairs = [
        (by, one, more, other)
        for (by, one), (more, other) in combinations(known, 2)
        if by is not None and more is not None and by != more and one.causes[0] == other.causes[0]
    ]
    right = [(more - by) * (other.size - one.size) > 0 for by, one, more, other in pairs]  # type: ignore[operator]
    return f"{sum(right)}/{len(right)}" if right else "too few names of one kind"


def words(names: Sequence[str]) -> list[str]:
    """Names as a table shows them."""
    return [name.replace("_", " ") for name in names]


def row(trial: Trial) -> list[str]:
    """A row of the table."""
    size = "" if trial.size is None else f"{trial.size:.3g}{'' if trial.unit == '1' else f' {trial.unit}'}"
    floors = "" if trial.ratio is None else f"{trial.ratio:.1f}"
    return [
        trial.earlier.replace("_", " "), trial.now.replace("_", " "), floors,
        trial.verdict.replace("_", " "), ", ".join(words(trial.causes)), size, ", ".join(words(trial.ambiguous)),
    ]  # fmt: skip

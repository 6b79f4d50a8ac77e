"""Is a benchmark slower than it was? The ratios of one run beside those of an earlier one.

A ratio to a peer of the same run carries from machine to machine; a time does not, and is not judged. Shares of cases
are judged by their own interval. What was measured once has no spread, and is not judged either, but for figures that a
seed fixes.
"""

import json
from collections.abc import Collection, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from rig.errors import ConfigError
from rig.qualify.figures.rounds import Figures, Row

STILL: Final = 0.02
"""A ratio that has moved by less, relatively, has not moved: a seeded figure's last digits differ with a library."""
NOT_FIGURES: Final = ("machine", "against")
Results = Mapping[str, Figures]
"""Benchmark -> its figures; NOT_FIGURES stand beside them in the same file."""


@dataclass(frozen=True)
class FigureSpan:
    """What is judged of a figure, and between what it lay."""

    middle: float
    low: float
    high: float
    scale: float
    """What a move is relative to: the ratio itself, or all cases."""


@dataclass(frozen=True)
class Move:
    """One figure, then and now; `by` beyond `spread`, both relative to what it was."""

    benchmark: str
    figure: str
    was: float
    now: float
    by: float
    """Above 0 is worse."""
    spread: float

    @property
    def worse(self) -> bool:
        """Whether it is worse by more than both runs' rounds lay apart."""
        return self.by > self.spread

    @property
    def better(self) -> bool:
        """The same the other way."""
        return -self.by > self.spread


@dataclass(frozen=True)
class FigureComparison:
    """Two runs beside each other."""

    moves: tuple[Move, ...]
    unjudged: tuple[str, ...]
    """Figures of both runs that have no ratio, or no spread."""
    gone: tuple[str, ...]
    """Figures that the earlier run had, of benchmarks that were run again."""

    @property
    def worse(self) -> list[Move]:
        """What is a regression."""
        return [move for move in self.moves if move.worse]

    def to_json(self) -> dict[str, Any]:
        """How many were judged, and all that moved."""
        return {
            "judged": len(self.moves),
            "worse": [asdict(move) for move in self.worse],
            "better": [asdict(move) for move in self.moves if move.better],
            "unjudged": list(self.unjudged),
            "gone": list(self.gone),
        }


def earlier(path: Path, option: str = "--against") -> dict[str, Any]:
    """The results of an earlier run, which that option names; ConfigError when the file is none."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ConfigError(f"{option} {path}: {error}") from None
    if not isinstance(found, dict) or "machine" not in found or not all(map(_is_figures, figures_of(found).values())):
        raise ConfigError(f"{option} {path}: these are no figures of `pamrig bench --json`")
    return found


def joined(path: Path, machine: dict[str, Any], anew: Collection[str]) -> dict[str, Any]:
    """What `path` holds, if it is there, without the benchmarks that are measured `anew`; its load is the larger of
    both runs. ConfigError when another machine measured it, or the same one on another day."""
    found = earlier(path, "--add") if path.exists() else {"machine": machine}
    was = found["machine"]
    if other := [key for key in ("date", "cpu", "cores", "system", "python") if was.get(key) != machine.get(key)]:
        raise ConfigError(f"--add {path}: {other[0]} is {was.get(other[0])!r} there and {machine.get(other[0])!r} here")
    load = max(float(was.get("load", 0.0)), float(machine.get("load", 0.0)))
    return {"machine": machine | {"load": load}} | {
        name: figures for name, figures in figures_of(found).items() if name not in anew
    }


def _is_figures(found: object) -> bool:
    return isinstance(found, dict) and all(isinstance(row, dict) and "value" in row for row in found.values())


def figures_of(results: Mapping[str, Any]) -> Results:
    """The benchmarks of a file, without what stands beside them."""
    return {name: figures for name, figures in results.items() if name not in NOT_FIGURES}


def compared(before: Results, after: Results, where: str) -> FigureComparison:
    """Every figure that both have; ConfigError when nothing of `where` can be judged, which would pass whatever
    happened."""
    pairs = list(_pairs(before, after))
    moves, unjudged = [], []
    for benchmark, name, was, now in pairs:
        move = moved(benchmark, name, was, now)
        if move is None:
            unjudged.append(f"{benchmark}: {name}")
        else:
            moves.append(move)
    if not moves:
        raise ConfigError(f"--against {where}: it has no ratio of the benchmarks {', '.join(figures_of(after))}")
    return FigureComparison(tuple(moves), tuple(unjudged), tuple(_gone(before, after)))


def moved(benchmark: str, name: str, was: Row, now: Row) -> Move | None:
    """How far one figure has moved; None when it cannot be judged."""
    first, second = span_of(was), span_of(now)
    if first is None or second is None or first.scale == 0.0:
        return None
    by = (second.middle - first.middle) / first.scale * (-1.0 if now.get("better") == "higher" else 1.0)
    spread = (first.high - first.low + second.high - second.low) / first.scale
    return Move(benchmark, name, first.middle, second.middle, by, max(spread, STILL))


def span_of(row: Row) -> FigureSpan | None:
    """What of a row can be judged: the ratio with the extremes of its rounds, or a share with its interval."""
    if row.get("ratio") is not None:
        fixed = row["ratio"] if row.get("seeded") else None
        low, high = row.get("ratio_low", fixed), row.get("ratio_high", fixed)
        return None if low is None or high is None else FigureSpan(row["ratio"], low, high, abs(row["ratio"]))
    if row.get("low") is not None:
        return FigureSpan(row["value"], row["low"], row["high"], 100.0)
    return None


def _pairs(before: Results, after: Results) -> Iterator[tuple[str, str, Row, Row]]:
    for benchmark, figures in figures_of(after).items():
        earlier_ones = before.get(benchmark, {})
        yield from ((benchmark, name, earlier_ones[name], row) for name, row in figures.items() if name in earlier_ones)


def _gone(before: Results, after: Results) -> Iterator[str]:
    for benchmark, figures in figures_of(after).items():
        yield from (f"{benchmark}: {name}" for name in before.get(benchmark, {}) if name not in figures)

"""Counts with their uncertainty: k of n with the Wilson score interval at 95 %."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from rig.columns import NORMAL_95


@dataclass(frozen=True)
class Rate:
    """k of n."""

    k: int
    n: int

    @classmethod
    def of(cls, outcomes: Iterable[bool]) -> "Rate":
        seen = list(outcomes)
        return cls(sum(seen), len(seen))

    @property
    def value(self) -> float:
        """k / n; not a number for n = 0."""
        return self.k / self.n if self.n else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson 95 %: all of 0..1 for n = 0."""
        if self.n == 0:
            return 0.0, 1.0
        share, z2 = self.k / self.n, NORMAL_95 * NORMAL_95
        middle = (share + z2 / (2 * self.n)) / (1 + z2 / self.n)
        half = NORMAL_95 / (1 + z2 / self.n) * math.sqrt(share * (1 - share) / self.n + z2 / (4 * self.n * self.n))
        return middle - half if self.k else 0.0, middle + half if self.k < self.n else 1.0

    def to_json(self) -> dict[str, Any]:
        low, high = self.interval
        return {"k": self.k, "n": self.n, "rate": self.value if self.n else None, "low": low, "high": high}

    def __str__(self) -> str:
        if not self.n:
            return "no cases"
        low, high = self.interval
        return f"{self.k}/{self.n} = {100 * self.value:.1f} % ({100 * low:.1f} .. {100 * high:.1f})"

"""What the plots show: every tick beside the simulator's answer to the same set-points, thinned out and kept for ten
minutes.

Fine rows are every so manieth tick. Coarse rows keep of each stretch of fine ones the two with the smallest and the
largest angle, so that no peak is lost.
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Final

from rig.channels import PNEUMATIC, Channels
from rig.model.chain import Chain

FINE_S: Final = 0.02
"""From one row of the fine curve to the next, s: 50 rows a second."""
FINE_KEPT_S: Final = 60.0
"""How long fine rows are kept, s."""
STRETCH: Final = 10
"""Fine rows of which the coarse curve keeps the ends."""
COARSE_KEPT_S: Final = 600.0
"""How long coarse rows are kept, s."""
COLUMNS: Final = ("t_s", "input", "output", "simulated", "residual", "p1_cmd_mpa", "p2_cmd_mpa", "p1_mpa", "p2_mpa")
"""Of a row; input, output and what the simulator says are in the rig's own units. Pressures where the rig has them."""
_OUTPUT: Final = COLUMNS.index("output")
_DIGITS: Final = 6
_MOST_STEPS: Final = 400
"""Ticks without a sample that the simulator bridges; after a longer hole it begins anew."""
_ZEROED: Final = ("ramp_in", "sweep", "ramp_out")
"""Phases in which the rig's angle counts from its zero, as the simulator's does."""

Row = list[float | None]


@dataclass
class News:
    """Rows since the last time."""

    fine: list[Row] = field(default_factory=list)
    coarse: list[Row] = field(default_factory=list)
    begins: bool = False
    """Another session: what was before is not on the same time axis."""


class Feed:
    """Takes in the samples of each status; give it those of one daemon only."""

    def __init__(
        self, period_s: float, chain: Chain | None, sample_time_s: float = 0.0, own: Channels = PNEUMATIC
    ) -> None:
        """`chain`: the simulator, which is advanced by its own `sample_time_s`; `own`: what input and output are."""
        self._period_s, self._chain, self._own = period_s, chain, own
        self._steps = max(round(period_s / sample_time_s), 1) if sample_time_s else 1
        self.simulates = chain is not None
        self._every = max(round(FINE_S / period_s), 1)
        fine_s = self._every * period_s
        self.fine: deque[Row] = deque(maxlen=round(FINE_KEPT_S / fine_s))
        self.coarse: deque[Row] = deque(maxlen=2 * round(COARSE_KEPT_S / (fine_s * STRETCH)))
        self._stretch: list[Row] = []
        self._tick: int | None = None
        self._command: tuple[float, float] = (0.0, 0.0)
        self._simulated: float | None = None

    def add(self, samples: dict[str, list[Any]]) -> News:
        """The columns of one event. Ticks that were here before are passed over."""
        news = News()
        names = ("tick", "p1_cmd_mpa", "p2_cmd_mpa", "p1_mpa", "p2_mpa", "angle_deg", "phase")
        for tick, p1_cmd, p2_cmd, *measured, phase in zip(*(samples[name] for name in names), strict=True):
            if self._tick is not None and tick <= self._tick:
                if tick > self._tick - len(samples["tick"]) - _MOST_STEPS:
                    continue
                self._begin_anew()
                news = News(begins=True)
            self._simulate(tick, p1_cmd, p2_cmd)
            if tick % self._every == 0:
                self._keep(self._row(tick, p1_cmd, p2_cmd, measured, phase), news)
        return news

    def _begin_anew(self) -> None:
        self.fine.clear()
        self.coarse.clear()
        self._stretch.clear()
        self._tick = None

    def _simulate(self, tick: int, p1_cmd: float | None, p2_cmd: float | None) -> None:
        since, self._tick = self._tick, tick
        if self._chain is None or p1_cmd is None or p2_cmd is None:
            return
        if since is None or tick - since > _MOST_STEPS:
            self._chain.reset(p1_cmd, p2_cmd)
            since = tick - 1
        for _ in range((tick - since) * self._steps):
            self._simulated = self._chain.step(p1_cmd, p2_cmd)[2]

    def _row(self, tick: int, p1_cmd: float, p2_cmd: float, measured: list[float | None], phase: str) -> Row:
        angle, simulated, own = measured[2], self._simulated, self._own
        residual = None
        if angle is not None and simulated is not None and phase in _ZEROED:
            residual = own.output_per_deg * (angle - simulated)
        angles = [None if value is None else own.own_output(value) for value in (angle, simulated)]
        pressures = (p1_cmd, p2_cmd, *measured[:2]) if own.has_valves else (None,) * 4
        row = (tick * self._period_s, own.own_input(p1_cmd - p2_cmd), *angles, residual, *pressures)
        return [None if value is None else round(value, _DIGITS) for value in row]

    def _keep(self, row: Row, news: News) -> None:
        self.fine.append(row)
        news.fine.append(row)
        self._stretch.append(row)
        if len(self._stretch) == STRETCH:
            ends = list(_ends(self._stretch))
            self._stretch.clear()
            self.coarse.extend(ends)
            news.coarse += ends


def _ends(rows: list[Row]) -> Iterator[Row]:
    """The rows with the smallest and the largest output, in their order; the first and the last where no angle was
    measured."""
    known = [(output, index) for index, row in enumerate(rows) if (output := row[_OUTPUT]) is not None]
    chosen = {min(known)[1], max(known)[1]} if known else {0, len(rows) - 1}
    return (rows[index] for index in sorted(chosen))

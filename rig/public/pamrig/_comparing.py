"""Two records or two sets of them beside each other."""

from typing import Any

from pamrig._picture import Picture, Table, Tabled, shown
from pamrig._places import Logs, records_of
from rig.errors import CheckFailed
from rig.log import compare as log_compare


class Comparison(Tabled):
    """Records A and B, pair by pair: aligned by their commands, B minus A.

    >>> found = pamrig.compare("first", "first")
    >>> found.max_deg, found.only_a
    (0.0, [])
    """

    def __init__(self, comparison: log_compare.Comparison) -> None:
        self._comparison = comparison

    @property
    def pairs(self) -> list[log_compare.ComparedPair]:
        """Each pair with both records over their common time and the difference of every column."""
        return self._comparison.pairs

    @property
    def only_a(self) -> list[str]:
        """Records of A without a counterpart."""
        return self._comparison.only_a

    @property
    def only_b(self) -> list[str]:
        """Records of B without a counterpart."""
        return self._comparison.only_b

    @property
    def rmse_deg(self) -> float:
        """Rms of the angles' difference over all pairs; of a rig with a channel map, of the working values."""
        return self._comparison.rmse_deg

    @property
    def max_deg(self) -> float:
        """The largest difference of any angle."""
        return self._comparison.max_deg

    def require_within(self, most: float) -> None:
        """CheckFailed when any angle differs by more than that (deg, or the unit of the rig's own output), or a record
        has no counterpart."""
        if departures := self._comparison.departures(most):
            raise CheckFailed("; ".join(departures))

    def to_json(self) -> dict[str, Any]:
        """What `pamrig log compare --json` writes."""
        return self._comparison.to_json()

    def plot(self) -> Picture:
        """The pair that differs most: angles over time, their difference, both loops; in the rig's own units."""
        from rig.report.log_figures import pair_figure

        return Picture(pair_figure(max(self.pairs, key=lambda pair: pair.angle.rms)))

    def _table(self) -> Table:
        own = self._comparison.channels
        off = {pair.name: pair.angle.times(own.output_per_deg) for pair in self.pairs}
        rows = [
            (pair.name, *map(shown, (pair.shift_s, off[pair.name].rms, off[pair.name].max, off[pair.name].mean)))
            for pair in self.pairs
        ]
        unit = own.output.unit
        return Table(("record", "shift [s]", f"RMS [{unit}]", f"max [{unit}]", f"mean [{unit}]"), rows)


def compare(a: Logs, b: Logs) -> Comparison:
    """Records, logs or folders A and B beside each other, by name and repeat; one record beside one whatever it is
    called.

    RecordError when nothing goes together.

    >>> simulated = pamrig.simulate("simulated", "first")
    >>> pamrig.compare("first", simulated).rmse_deg < 3.0
    True
    """
    return Comparison(log_compare.compare(records_of(a), records_of(b)))

"""What a generator of cases must offer, as a protocol: the check knows no plant, the command line brings one.

Columns are numpy arrays of one record by name (t_s, p1_cmd_mpa, p2_cmd_mpa, dp_cmd_mpa, p1_mpa, p2_mpa, angle_deg, and
angle_zero_deg where the record took its own zero).
A source must survive pickling: it is sent to the processes that make and score cases.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from rig.record import ZERO_FACT, Column, Record

Columns = Mapping[str, Column]
Named = Mapping[str, Columns]
"""Record name -> its columns."""
Commands = Mapping[str, tuple[Column, Column, float]]
"""Record name -> set-points of valve 1 and 2 (MPa) and the period (s)."""
Label = dict[str, Any]
"""What chance decided, as plain data. The check reads: kind (none, single, pair, foreign), effects, baselines (how
many), family, and against (days or sisters: what its gap was measured by)."""


class BenchData(Protocol):
    """A healthy unit: its baseline days, and as many days under excitations that no diagnosis is given."""

    @property
    def p0_mpa(self) -> float:
        """The pressure that it is recorded about."""

    @property
    def baselines(self) -> Sequence[Named]:
        """Earlier days."""

    @property
    def untouched(self) -> Sequence[Named]:
        """As many under other excitations."""

    @property
    def sister(self) -> Named:
        """A healthy day of another rig of the build, under the same commands."""


class CaseData(Protocol):
    """One case carried out."""

    @property
    def records(self) -> Named:
        """What the diagnosis is given."""

    @property
    def untouched(self) -> Named:
        """What it is not."""

    @property
    def facts(self) -> dict[str, Any]:
        """effects (name -> stage, size, unit, library_parameter, ratio), ratio_angle, ratio_sisters, ratio_pressure."""


class Source(Protocol):
    """Cases and their records; the same label gives the same data, on any machine."""

    @property
    def recorded_under(self) -> str:
        """Names the session that every day is recorded under; empty where each unit has its own."""

    @property
    def can_repeat(self) -> bool:
        """Recommended experiments can be carried out."""

    def sheet(self, seed: int, cases: int) -> list[Label]:
        """Labels of `cases` cases, in an order that tells nothing."""

    def bench_key(self, label: Label) -> str:
        """Names the unit; cases with the same key share their baselines."""

    def bench(self, label: Label) -> BenchData:
        """The unit's healthy records."""

    def case(self, label: Label) -> CaseData:
        """The case's records."""

    def repeat(self, label: Label, facts: Mapping[str, Any], commands: Commands, number: int) -> Named:
        """Other commands on the same rig with the case's effects; `number`: which time it is asked."""


def records_of(named: Named) -> list[Record]:
    """Columns as records."""
    return [_record(name, columns) for name, columns in named.items()]


def _record(name: str, columns: Columns) -> Record:
    given: dict[str, Any] = {column: values for column, values in columns.items() if column != ZERO_FACT}
    if ZERO_FACT in columns:
        given["facts"] = {**given.get("facts", {}), ZERO_FACT: float(columns[ZERO_FACT][0])}
    return Record(name=name, **given)

"""A record as columns over time: the one form in which identification, diagnosis and figures see data.

It says nothing about files; `rig.log.reader` makes records from them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from rig.channels import Channels, channels_of

Column = NDArray[np.float64]
MOST_ROWS = 20_000_000
"""Of a record on a regular grid, more than a day at 5 ms: a time stamp that is wrong asks for more, and would take all
the memory."""
AGED = ("p1", "p2", "angle")
"""Measurements whose age a record has in seconds (p1_age_s) and a sample in nanoseconds (p1_age_ns)."""
ZERO_FACT = "angle_zero_deg"
"""Fact of a record by pamrig's own loop: what the sensor showed at rest, and was taken for zero; 0 where it was not."""


@dataclass(frozen=True, eq=False)
class Record:
    """One excitation of the rig, from the start of the sweep to its end. All columns have the shape (n,).

    A column that was not measured is None, a value missing within a measured column is NaN.
    Time is seconds from the first row and may be irregular; nothing here resamples.
    """

    name: str
    """Short and unique within its session, for example sine_0.5hz_0.20mpa: what pairs a record with its baseline."""
    t_s: Column
    dp_cmd_mpa: Column
    angle_deg: Column | None = None
    p1_cmd_mpa: Column | None = None
    p2_cmd_mpa: Column | None = None
    p1_mpa: Column | None = None
    p2_mpa: Column | None = None
    extra: Mapping[str, Column] = field(default_factory=dict)
    """Other columns by name, the unit in the name (p1_raw, lateness_us, missed)."""
    facts: Mapping[str, Any] = field(default_factory=dict)
    """What is known of the run: session, p0_mpa, signal, frequency_hz, amplitude_mpa, seed, versions, valid."""
    source: Path | None = None

    def __len__(self) -> int:
        return len(self.t_s)

    @cached_property
    def period_s(self) -> float:
        """The usual distance between rows: the median; not a number for a single row."""
        return float(np.median(np.diff(self.t_s))) if len(self) > 1 else float("nan")

    @cached_property
    def channels(self) -> Channels:
        """What its input and its output are; `dp_cmd_mpa` and `angle_deg` are their working values."""
        return channels_of(self.facts, self.name)

    @property
    def zeroed(self) -> bool:
        """The angle at rest was taken for zero at its start."""
        return bool(self.facts.get(ZERO_FACT))

    @property
    def has_pressures(self) -> bool:
        """Both muscles' pressures were measured."""
        return not self.unmeasured

    @property
    def unmeasured(self) -> list[str]:
        """The pressures that were not measured, by their columns' names."""
        return [name for name, column in (("p1_mpa", self.p1_mpa), ("p2_mpa", self.p2_mpa)) if column is None]

    @property
    def dp_mpa(self) -> Column:
        """(n,) measured differential pressure p1 - p2; ValueError where the pressures were not measured."""
        if self.p1_mpa is None or self.p2_mpa is None:
            raise ValueError(f"{self.name}: the pressures were not measured")
        return self.p1_mpa - self.p2_mpa

    def columns(self) -> dict[str, Column]:
        """Every column (n,) that is there, by its name, which ends with its unit."""
        main = {name: getattr(self, name) for name in MAIN_COLUMNS}
        return {name: column for name, column in main.items() if column is not None} | dict(self.extra)

    def own_columns(self) -> dict[str, Column]:
        """Every column as a person reads it: with a channel map input and output under their own names and in their own
        units (set_point_mm), in place of the working values and of pressures that such a rig does not have."""
        columns, own = self.columns(), self.channels
        if own.has_valves:
            return columns
        shown = {"t_s": self.t_s, own.input.column: own.own_input(self.dp_cmd_mpa)}
        if self.angle_deg is not None:
            shown[own.output.column] = own.own_output(self.angle_deg)
        return shown | {name: column for name, column in self.extra.items() if name not in shown}

    def rows(self, chosen: slice | NDArray[np.bool_] | NDArray[np.intp]) -> Self:
        """The same record with only some rows, by a slice, by (n,) which of them, or by (m,) their numbers; time keeps
        its zero."""
        cut: dict[str, Any] = {name: column[chosen] for name, column in self.columns().items()}
        extra = {name: cut.pop(name) for name in self.extra}
        return replace(self, **cut, extra=extra)


MEASURED_COLUMNS = ("p1_mpa", "p2_mpa", "angle_deg")
"""The columns that come from sensors; each may be missing."""
MAIN_COLUMNS = ("t_s", "dp_cmd_mpa", "p1_cmd_mpa", "p2_cmd_mpa", *MEASURED_COLUMNS)
"""The columns of every record, beside the further ones in `extra`."""

"""Records for a notebook: columns over time as numpy, pandas and xarray have them."""

from collections.abc import Iterable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self, SupportsIndex

import numpy as np
from numpy.typing import NDArray

import rig.record
from pamrig._picture import Picture, Table, shown
from pamrig._places import place_of, require_one_of
from rig.errors import RecordError
from rig.log import reader
from rig.number_text import counted

if TYPE_CHECKING:
    import pandas
    import xarray


class Record(rig.record.Record):
    """One excitation of the rig: columns over time (n,), None where nothing was measured, NaN where a value is missing.

    `t_s`, `dp_cmd_mpa`, `angle_deg`, `p1_cmd_mpa`, `p2_cmd_mpa`, `p1_mpa`, `p2_mpa` are numpy arrays, `extra` holds
    further ones by name, `facts` what is known of the run. Units stand in the names. Of a rig with a channel map these
    are working values; tables, frames and pictures have its own columns (`own_columns()`: set_point_mm, position_mm).

    >>> (record,) = pamrig.read("first")
    >>> record.name, len(record), round(record.period_s, 6)
    ('sine_0.5hz_0.20mpa', 1200, 0.005)
    """

    @classmethod
    def of(cls, record: rig.record.Record) -> Self:
        """The same record with what a notebook wants of it."""
        return cls(**{field.name: getattr(record, field.name) for field in fields(record)})

    def to_numpy(self) -> NDArray[Any]:
        """A structured array (n,) with a field of float64 for each column.

        >>> table = pamrig.read("first")[0].to_numpy()
        >>> f"{table['dp_cmd_mpa'].max():.2f} MPa"
        '0.20 MPa'
        """
        columns = self.own_columns()
        table = np.empty(len(self), dtype=[(name, np.float64) for name in columns])
        for name, column in columns.items():
            table[name] = column
        return table

    def to_pandas(self) -> "pandas.DataFrame":
        """A data frame with `t_s` as its index and the facts in `attrs`; needs pandas.

        >>> frame = pamrig.read("first")[0].to_pandas()
        >>> frame.index.name, "angle_deg" in frame
        ('t_s', True)
        """
        try:
            import pandas
        except ImportError:
            raise RecordError("to_pandas needs the package pandas: pip install 'pamrig[frames]'") from None
        columns = self.own_columns()
        frame = pandas.DataFrame(columns, index=pandas.Index(columns.pop("t_s"), name="t_s"))
        frame.attrs = {"name": self.name, **self.facts}
        return frame

    def to_xarray(self) -> "xarray.Dataset":
        """A dataset over the coordinate `t_s`, a variable for each column with its unit in `attrs`; needs xarray.

        >>> data = pamrig.read("first")[0].to_xarray()
        >>> data["angle_deg"].attrs["units"]
        'deg'
        """
        try:
            import xarray
        except ImportError:
            raise RecordError("to_xarray needs the package xarray: pip install 'pamrig[frames]'") from None
        columns = self.own_columns()
        time_s = xarray.Variable("t_s", columns.pop("t_s"), {"units": "s"})
        own = {one.column: {"units": one.unit} for one in (self.channels.input, self.channels.output)}
        variables = {
            name: xarray.Variable("t_s", column, own.get(name) or _unit(name)) for name, column in columns.items()
        }
        return xarray.Dataset(variables, {"t_s": time_s}, {"name": self.name, **self.facts})

    def plot(self) -> Picture:
        """Command, pressures and angle over time, and the hysteresis loop."""
        from rig.report.log_figures import run_figure

        return Picture(run_figure(self))

    def _repr_html_(self) -> str:
        rows = [
            (name, shown(float(np.nanmin(column))), shown(float(np.nanmax(column))))
            for name, column in self.own_columns().items()
            if name not in self.extra and np.isfinite(column).any()
        ]
        return Table(("column", "lowest", "highest"), rows, self._title()).to_html()

    def __repr__(self) -> str:
        return f"Record({self._title()}: {', '.join(self.own_columns())})"

    def _title(self) -> str:
        every = f", every {1e3 * self.period_s:.3g} ms" if len(self) > 1 else ""
        return f"{self.name}: {counted(len(self), 'row')}{every}"


class Records(Sequence[Record]):
    """Records in the order of their session, name and repeat; a sequence, and a picture of all their loops.

    >>> records = pamrig.read("first")
    >>> [record.name for record in records]
    ['sine_0.5hz_0.20mpa']
    """

    def __init__(self, records: Iterable[rig.record.Record]) -> None:
        self._records = tuple(each if isinstance(each, Record) else Record.of(each) for each in records)

    def __len__(self) -> int:
        return len(self._records)

    def __getitem__(self, index: SupportsIndex | slice) -> Any:
        return Records(self._records[index]) if isinstance(index, slice) else self._records[index]

    def __repr__(self) -> str:
        return f"Records({', '.join(record.name for record in self)})"

    def plot(self) -> Picture:
        """One record as `Record.plot` shows it; several as loops in one picture."""
        from rig.report.fit_figures import loops_figure

        return self._records[0].plot() if len(self) == 1 else Picture(loops_figure(f"{len(self)} records", self))

    def _repr_html_(self) -> str:
        rows = [
            (record.facts.get("session", ""), record.name, len(record), shown(float(record.t_s[-1]))) for record in self
        ]
        return Table(("session", "record", "rows", "seconds"), rows).to_html()


def read(*places: str | Path, phases: Literal["sweep", "all"] = "sweep") -> Records:
    """The records of logs (.mcap, .csv, .csv.gz, .tdms) or folders of them.

    `phases`: the sweep of each run, or all of it with settle, zero and ramps. RecordError for a file that cannot be
    read.

    >>> len(pamrig.read("first", phases="all")[0]) > len(pamrig.read("first")[0])
    True
    """
    if not places:
        raise RecordError("read: name at least one log, or a folder of them")
    require_one_of(phases, ("sweep", "all"), "phases")
    wanted = None if phases == "all" else reader.SWEEP_ONLY
    return Records(record for place in places for record in reader.read(place_of(place, "read"), wanted))


def _unit(column: str) -> dict[str, str]:
    from rig.log.exchange import unit_of

    unit = unit_of(column)
    return {} if unit is None else {"units": unit}

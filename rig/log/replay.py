"""A recording as a program for the loop, and a replay beside its recording.

The program sends the set-points of the recording's sweep by tick index. What leads up to it (settle, zero, ramp in) and
away from it is made anew, as in any run, of the lengths that were recorded. Carrying it out is up to the command line.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rig.columns import rms
from rig.errors import RecordError
from rig.excite.setpoints import around
from rig.excite.sweep import Timing
from rig.log.mcap.columns import Samples
from rig.number_text import counted
from rig.realtime.program import Program
from rig.record import MOST_ROWS, Column
from rig.sample import Phase

PERIOD_TOLERANCE: Final = 0.01
"""Share by which a rig's period may differ from a recording's."""


@dataclass(frozen=True)
class Timeline:
    """The sweep of a recording by tick: rows of the samples, and the index of each from the first tick of the sweep."""

    rows: NDArray[np.intp]
    index: NDArray[np.int64]


def timeline(samples: Samples, where: str) -> Timeline:
    """The sweep in `samples`; RecordError when there is none, or its ticks do not rise."""
    rows = np.flatnonzero(samples["phase"] == Phase.SWEEP)
    if not len(rows):
        raise RecordError(f"{where}: holds no sweep to replay")
    index = samples["tick"][rows].astype(np.int64) - int(samples["tick"][rows[0]])
    if (np.diff(index) <= 0).any():
        raise RecordError(f"{where}: its ticks do not rise; see `pamrig log check`")
    return Timeline(rows, index)


def program_of(samples: Samples, period_ns: int, p0_mpa: float | None, where: str) -> Program:
    """The recorded set-points, tick by tick; a tick missed in the recording holds the set-point before it.

    `p0_mpa` splits a command that was recorded only as a difference, and is where the rig rests if the recording does
    not say. RecordError when the recording does not fit the period, or lacks what it takes.
    """
    sweep = timeline(samples, where)
    _require_period(samples, sweep, period_ns, where)
    p1, p2 = _setpoints(samples, sweep.rows, p0_mpa, where)
    lengths = _phase_ticks(samples, period_ns, where)
    if (ticks := int(sweep.index[-1]) + 1 + sum(lengths)) > MOST_ROWS:
        raise RecordError(
            f"{where}: {len(samples)} rows would become {ticks:.3g} ticks; allowed: {MOST_ROWS}; is a tick wrong?"
        )
    held = np.searchsorted(sweep.index, np.arange(sweep.index[-1] + 1), side="right") - 1
    rest = _rest(samples, p0_mpa)
    if rest is None:
        raise RecordError(f"{where}: does not say at which pressures the rig rested; give --p0")
    settle, zero, ramp_in, ramp_out = lengths
    return Program(1, *rest, p1[held].tolist(), p2[held].tolist(), settle, zero, ramp_in, ramp_out)


def onto_period(samples: Samples, period_ns: int) -> Samples:
    """The sweep's samples renumbered on a grid of `period_ns`, for a recording made at another one; rows are kept,
    ticks move.

    RecordError is for `program_of` to raise; a row that falls on the tick of the row before it is left out.
    """
    ticks = np.rint((samples["scheduled_ns"] - samples["scheduled_ns"][0]) / period_ns).astype(np.int64)
    kept = samples.rows(np.concatenate(([True], np.diff(ticks) > 0)))
    ticks = np.rint((kept["scheduled_ns"] - kept["scheduled_ns"][0]) / period_ns).astype(np.int64)
    return Samples(
        kept.fields | {"tick": ticks.astype(np.uint32), "scheduled_ns": ticks * period_ns},
        kept.log_time_ns,
        kept.sequence,
    )


@dataclass(frozen=True)
class ReplayComparison:
    """A replay beside its recording, over the ticks of the sweep that both have. Columns have the shape (n,)."""

    tick: NDArray[np.uint32]
    recorded_tick: NDArray[np.uint32]
    log_time_ns: NDArray[np.int64]
    t_s: Column
    recorded_deg: Column
    replayed_deg: Column
    recorded_dp_mpa: Column
    replayed_dp_mpa: Column
    missed_s: tuple[float, ...]
    """When the replay missed ticks."""
    command_difference_mpa: float
    """Largest difference of a set-point as written: what the guard, or missed ticks, changed."""

    @property
    def residual_deg(self) -> Column:
        """(n,) replay minus recording, deg."""
        return self.replayed_deg - self.recorded_deg

    def facts(self) -> dict[str, Any]:
        """The comparison in numbers."""
        residual = self.residual_deg[np.isfinite(self.residual_deg)]
        return {
            "rmse_deg": rms(residual),
            "max_deg": float(np.abs(residual).max()) if len(residual) else math.nan,
            "mean_deg": float(residual.mean()) if len(residual) else math.nan,
            "compared_ticks": len(self.tick),
            "command_difference_mpa": self.command_difference_mpa,
        }


def compare(recorded: Samples, replayed: Samples, where: str) -> ReplayComparison:
    """Put both side by side by the index of the tick within the sweep."""
    before, now = timeline(recorded, where), timeline(replayed, f"the replay of {where}")
    _, old, new = np.intersect1d(before.index, now.index, return_indices=True)
    a, b = before.rows[old], now.rows[new]
    differences = [np.abs(replayed[name][b] - recorded[name][a]) for name in ("p1_cmd_mpa", "p2_cmd_mpa")]
    known = [d[np.isfinite(d)] for d in differences]
    time_s = (replayed["scheduled_ns"][b] - replayed["scheduled_ns"][b[0]]) / 1e9
    return ReplayComparison(
        tick=replayed["tick"][b],
        recorded_tick=recorded["tick"][a],
        log_time_ns=replayed.log_time_ns[b],
        t_s=time_s,
        recorded_deg=recorded["angle_deg"][a],
        replayed_deg=replayed["angle_deg"][b],
        recorded_dp_mpa=recorded["dp_cmd_mpa"][a],
        replayed_dp_mpa=replayed["dp_cmd_mpa"][b],
        missed_s=tuple(time_s[replayed["missed"][b] > 0].tolist()),
        command_difference_mpa=max((float(d.max()) for d in known if len(d)), default=math.nan),
    )


def departures(reference: Samples, replayed: Samples, tolerances: Mapping[str, float]) -> list[str]:
    """The gate: for each field that moved by more than its tolerance, the first tick and the difference. Every phase
    counts.

    `tolerances`: field of a sample -> the largest difference allowed, in its unit. Ticks are counted from the first of
    each; NaN in both is equal.
    """
    if len(reference) != len(replayed):
        return [f"{counted(len(replayed), 'tick')}, the reference has {len(reference)}"]
    out = []
    for name, tolerance in tolerances.items():
        old, new = _relative(reference, name), _relative(replayed, name)
        moved = ~((np.abs(new - old) <= tolerance) | (np.isnan(old) & np.isnan(new)))
        if moved.any():
            row = int(np.argmax(moved))
            largest = float(np.nanmax(np.abs(new - old))) if np.isfinite(new - old).any() else math.nan
            what = (
                f"{name} at tick {row}: {new[row]:.9g}, the reference has {old[row]:.9g}, a difference of "
                f"{new[row] - old[row]:.3g}"
            )
            ticks = counted(int(moved.sum()), "tick differs", "ticks differ")
            out.append(f"{what} (allowed {tolerance:g}; {ticks}, by up to {largest:.3g})")
    return out


def _relative(samples: Samples, name: str) -> Column:
    """A field as numbers; ticks and times from the first of the log, for where a log begins is no output."""
    column = samples[name]
    if name in ("tick", "scheduled_ns", "woken_ns", "read_ns", "written_ns") and len(column):
        start = samples["tick" if name == "tick" else "scheduled_ns"][0]
        return (column.astype(np.int64) - int(start)).astype(np.float64)
    return column.astype(np.float64)


def _require_period(samples: Samples, sweep: Timeline, period_ns: int, where: str) -> None:
    recorded_ns = _recorded_ns(samples, sweep, where)
    if abs(recorded_ns - period_ns) > PERIOD_TOLERANCE * period_ns:
        hint = "--resample holds each command on the rig's grid"
        raise RecordError(
            f"{where}: recorded every {recorded_ns / 1e6:g} ms, the rig ticks every {period_ns / 1e6:g} ms; {hint}"
        )


def recorded_period_ns(samples: Samples, where: str) -> int:
    """How far the ticks of the sweep lie apart, ns; RecordError when there are not two."""
    return round(_recorded_ns(samples, timeline(samples, where), where))


def _recorded_ns(samples: Samples, sweep: Timeline, where: str) -> float:
    if len(sweep.rows) < 2:
        raise RecordError(f"{where}: one tick is no sweep")
    return float(np.median(np.diff(samples["scheduled_ns"][sweep.rows]) / np.diff(sweep.index)))


def _setpoints(samples: Samples, rows: NDArray[np.intp], p0_mpa: float | None, where: str) -> tuple[Column, Column]:
    p1, p2, dp = (samples[name][rows] for name in ("p1_cmd_mpa", "p2_cmd_mpa", "dp_cmd_mpa"))
    if not np.isfinite(p1 + p2).all():
        if p0_mpa is None:
            raise RecordError(
                f"{where}: only the difference of the commands was recorded; give the rest pressure with --p0"
            )
        p1, p2 = around(p0_mpa, dp)
    if not np.isfinite(p1 + p2).all():
        raise RecordError(f"{where}: row {int(rows[np.argmin(np.isfinite(p1 + p2))])} has no command")
    return p1, p2


def _rest(samples: Samples, p0_mpa: float | None) -> tuple[float, float] | None:
    """Where the set-points stood while the angle was zeroed, or P0 for both."""
    still = np.flatnonzero(samples["phase"] == Phase.ZERO)
    if len(still):
        return float(samples["p1_cmd_mpa"][still[-1]]), float(samples["p2_cmd_mpa"][still[-1]])
    return (p0_mpa, p0_mpa) if p0_mpa is not None else None


def _phase_ticks(samples: Samples, period_ns: int, where: str) -> tuple[int, int, int, int]:
    """Lengths of settle, zero, ramp in and ramp out: as recorded, or the usual ones where the recording has none.
    RecordError when the ticks of one do not rise: of a length below nothing the sweep would begin in its middle."""
    usual = Timing()
    defaults = {
        Phase.SETTLE: usual.settle_s,
        Phase.ZERO: usual.zero_s,
        Phase.RAMP_IN: usual.ramp_in_s,
        Phase.RAMP_OUT: usual.ramp_out_s,
    }
    counts = []
    has_phases = bool((samples["phase"] == Phase.SETTLE).any())
    for phase, seconds in defaults.items():
        rows = np.flatnonzero(samples["phase"] == phase)
        recorded = int(samples["tick"][rows[-1]]) - int(samples["tick"][rows[0]]) + 1 if len(rows) else 0
        if recorded < len(rows):
            raise RecordError(f"{where}: its ticks do not rise; see `pamrig log check`")
        counts.append(recorded if has_phases else round(seconds * 1e9 / period_ns))
    return counts[0], counts[1], counts[2], counts[3]

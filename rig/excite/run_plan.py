"""The list of runs that a sweep stands for, on the grid of a rig: every record at every rest pressure, again for each
repeat.

The experiment follows the paper: both muscles to P0 and wait (settle), take that angle as zero (zero), move dp to where
the signal starts (ramp in), the signal itself (sweep), and back to P0 (ramp out). p1 = P0 + dp/2, p2 = P0 - dp/2.
Whether a run fits the rig is envelope.py; carrying it out tick by tick is rig.realtime.
"""

import itertools
import os
from array import array
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, TypeAlias, cast

from rig.config import shown
from rig.errors import ConfigError
from rig.excite.reference import AngleReference, Tracking, tracking
from rig.excite.signals import Signal, amount, sampled
from rig.excite.sweep import Entry, Sweep

TICKS_PER_CYCLE = 4
"""A frequency that gets fewer ticks than this in a cycle is refused: the rig would see another signal."""
LEAST_ZERO_TICKS = 10
"""Of a run that closes the loop: its error counts from the zero that is taken there."""
MOST_SWEEP_TICKS = 20_000_000
"""Of all different waveforms of a sweep together: a day at 5 ms and some more, 160 MB."""
MOST_NAME_BYTES = 200
"""Of a record: 255 are what a disk takes, and a file that is being written or was stopped adds to its name."""

Waves: TypeAlias = "dict[tuple[Signal, int], array[float]]"
"""Waveforms of dp (MPa) on one grid, by their signal and how many ticks they last."""


@dataclass(frozen=True)
class RunPlan:
    """One record to be made: what the loop needs to know of it, in ticks of its own period."""

    name: str
    """Unique within the sweep and the same in every session, for example sine_0.5hz_0.20mpa_r2."""
    p0_mpa: float
    dp_mpa: "array[float]"
    """dp of each tick of the sweep."""
    settle_ticks: int
    zero_ticks: int
    ramp_in_ticks: int
    ramp_out_ticks: int
    facts: Mapping[str, Any] = field(default_factory=dict)
    """What the log says of it: signal and its parameters, P0, repeat."""
    tracking: Tracking | None = None
    """The reference of a run that closes the loop; then `dp_mpa` is its feed-forward."""

    @property
    def ticks(self) -> int:
        """Length of the whole run."""
        return self.settle_ticks + self.zero_ticks + self.ramp_in_ticks + len(self.dp_mpa) + self.ramp_out_ticks


def expand(sweep: Sweep, period_ns: int, made: "Waves | None" = None) -> list[RunPlan]:
    """Every run of the sweep on a grid of `period_ns`, in order. ConfigError when the grid is too coarse for a signal.

    Also when all its waveforms together would be more than MOST_SWEEP_TICKS, before one is made. `made`: waveforms of
    other sweeps on this grid, which need not be made again; it is added to.
    """
    lengths = {(entry.signal, _ticks(entry.timing.duration_s, period_ns, 1)) for entry in sweep.entries}
    total = sum(ticks for _, ticks in lengths)
    if total > MOST_SWEEP_TICKS:
        hours = total * period_ns / 3.6e12
        raise ConfigError(
            f"{sweep.name}: its waveforms last {hours:.1f} h together, {total} ticks; at most {MOST_SWEEP_TICKS} ticks"
        )
    for entry in sweep.entries:
        _check_grid(sweep.name, entry.signal, period_ns)
    waves = {} if made is None else made
    for signal, ticks in lengths:  # repeats share theirs
        if not isinstance(signal, AngleReference) and (signal, ticks) not in waves:
            waves[signal, ticks] = sampled(signal, ticks, period_ns)
    plans = [
        _plan(entry, p0, sweep, repeat, period_ns, waves)
        for repeat in range(1, sweep.repeats + 1)
        for entry, p0 in _in_order(sweep)
    ]
    return _checked_names(_told_apart(plans), sweep.name)


def _in_order(sweep: Sweep) -> list[tuple[Entry, float]]:
    """Every record at every rest pressure: the programme at the sweep's first, then at its next; records with rest
    pressures of their own stand where they are written, in the first round."""
    order: list[tuple[Entry, float]] = []
    for number, rest in enumerate(sweep.p0_mpa):
        for entry in sweep.entries:
            if not entry.p0_mpa:
                order.append((entry, rest))
            elif number == 0:
                order.extend((entry, own) for own in entry.p0_mpa)
    return order


def _ticks(length_s: float, period_ns: int, least: int = 0) -> int:
    return max(round(length_s * 1e9 / period_ns), least)


def _check_grid(sweep: str, signal: Signal, period_ns: int) -> None:
    if signal.highest_hz * period_ns * 1e-9 * TICKS_PER_CYCLE > 1:
        most = 1e9 / period_ns / TICKS_PER_CYCLE
        has = f"{sweep}: {signal.label} holds {signal.highest_hz:g} Hz"
        raise ConfigError(f"{has}; a period of {period_ns / 1e6:g} ms allows {most:g} Hz")


def _plan(
    entry: Entry,
    p0_mpa: float,
    sweep: Sweep,
    repeat: int,
    period_ns: int,
    waves: Waves,
) -> RunPlan:
    signal, timing = entry.signal, entry.timing
    ticks = _ticks(timing.duration_s, period_ns, 1)
    lead, zero = _ticks(timing.ramp_in_s, period_ns), _ticks(timing.zero_s, period_ns)
    followed = None
    if isinstance(signal, AngleReference):
        if zero < LEAST_ZERO_TICKS:
            least = LEAST_ZERO_TICKS * period_ns * 1e-9
            raise ConfigError(f"{sweep.name}: zero_s: {timing.zero_s:g} s; to close the loop at least {least:g} s")
        followed = tracking(signal, lead, ticks, period_ns, sweep.closed_loop)
    several = (f"_p0_{amount(p0_mpa)}mpa" if len(sweep.rests_mpa) > 1 else "") + (
        f"_r{repeat}" if sweep.repeats > 1 else ""
    )
    return RunPlan(
        name=signal.label + several,
        p0_mpa=p0_mpa,
        dp_mpa=waves[signal, ticks] if followed is None else followed.feedforward_mpa[lead:],
        settle_ticks=_ticks(timing.settle_s, period_ns),
        zero_ticks=zero,
        ramp_in_ticks=lead,
        ramp_out_ticks=_ticks(timing.ramp_out_s, period_ns),
        facts=_parameters(signal) | {"p0_mpa": p0_mpa, "repeat": repeat, "sweep": sweep.name},
        tracking=followed,
    )


def _parameters(signal: Signal) -> dict[str, Any]:
    if isinstance(signal, AngleReference):
        shape = {name: value for name, value in _parameters(signal.signal).items() if name != "amplitude_mpa"}
        return shape | signal.parameters()
    values = {f.name: getattr(signal, f.name) for f in fields(cast(Any, signal))}
    plain = {name: str(value) if isinstance(value, Path) else value for name, value in values.items()}
    return {"signal": type(signal).__name__.lower()} | plain


def _told_apart(plans: list[RunPlan]) -> list[RunPlan]:
    """Plans that differ only in what a name does not show get a number, so that no file is written twice; one that
    another plan is called by itself is passed over. A disk may take capitals for small letters."""
    own = {plan.name.lower() for plan in plans}
    seen: set[str] = set()
    numbers: dict[str, Iterator[str]] = {}
    out = []
    for plan in plans:
        if plan.name.lower() not in seen:
            seen.add(plan.name.lower())
            out.append(plan)
            continue
        numbered = numbers.setdefault(plan.name, _numbered(plan.name))
        free = next(name for name in numbered if name.lower() not in own and name.lower() not in seen)
        seen.add(free.lower())
        out.append(replace(plan, name=free))
    return out


def _checked_names(plans: list[RunPlan], sweep: str) -> list[RunPlan]:
    """The plans; ConfigError for one whose file no disk would take, before anything moves."""
    for plan in plans:
        if (count := len(os.fsencode(plan.name))) > MOST_NAME_BYTES:
            raise ConfigError(
                f"{sweep}: a record would be called {shown(plan.name)}, {count} bytes; at most {MOST_NAME_BYTES}: "
                "give the file of its table a shorter name"
            )
    return plans


def _numbered(name: str) -> Iterator[str]:
    return (f"{name}_{number}" for number in itertools.count(2))

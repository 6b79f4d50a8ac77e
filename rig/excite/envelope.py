"""The check of a whole run against the rig's envelope, before anything moves. The guard repeats it tick by tick."""

import itertools
import math
import operator
from collections.abc import Iterable, Iterator, Sequence
from typing import Protocol

from rig.errors import EnvelopeError
from rig.excite.run_plan import RunPlan
from rig.excite.setpoints import around

NO_GAINS = "an angle to follow, without gains in closed_loop; `pamrig tune` finds some, `pamrig track` as well"
ROUNDING_MPA = 1e-9
"""Set-points closer than this to a limit count as on it."""
_SURELY_MPA = 1e-12
"""So far within a limit no rounding of a set-point brings it beyond."""


class Envelope(Protocol):
    """What the rig allows its set-points; rig.realtime.guard.Limits is one."""

    @property
    def pressure_mpa(self) -> tuple[float, float]:
        """Lowest and highest set-point."""

    @property
    def slew_mpa_s(self) -> float:
        """Fastest change of a set-point."""


class WholeEnvelope(Envelope, Protocol):
    """What it allows its joint besides."""

    @property
    def angle_deg(self) -> tuple[float, float]:
        """Where the joint may be."""


def check_run(plan: RunPlan, envelope: WholeEnvelope, period_ns: int) -> None:
    """`check`, and for a run that closes the loop: EnvelopeError without gains, and when its reference leaves the
    angles."""
    if plan.tracking is not None:
        if plan.tracking.gains is None:
            raise EnvelopeError(f"{plan.name}: {NO_GAINS}")
        check_angles(plan, plan.tracking.reference_deg, envelope.angle_deg, period_ns)
    check(plan, envelope, period_ns)


def check(plan: RunPlan, envelope: Envelope, period_ns: int) -> None:
    """EnvelopeError with record, set-point, time and value when some tick of `plan` would leave the envelope.

    The settle phase starts wherever the pressures are, which only the loop knows: there the guard limits the slew.
    """
    parts = _parts(plan)
    if not _surely_inside(plan.p0_mpa, list(itertools.chain(*parts.values())), envelope, period_ns):
        check_setpoints(plan.name, _setpoints(plan, parts), (plan.p0_mpa, plan.p0_mpa), envelope, period_ns)


def _surely_inside(p0_mpa: float, dp_mpa: Sequence[float], envelope: Envelope, period_ns: int) -> bool:
    """Whether differences from P0 on, one a tick, leave nothing to look at tick by tick: both set-points are as far
    from P0 as half of each, and change by half of its change."""
    if not math.isfinite(sum(dp_mpa)):
        return False
    (low, high), step = envelope.pressure_mpa, envelope.slew_mpa_s * period_ns * 1e-9
    far = 0.5 * max(max(dp_mpa), -min(dp_mpa)) + _SURELY_MPA
    changed = 0.5 * max(map(abs, map(operator.sub, dp_mpa, itertools.chain((0.0,), dp_mpa)))) + _SURELY_MPA
    return low <= p0_mpa - far and p0_mpa + far <= high and changed <= step


def check_angles(
    plan: RunPlan, reference_deg: Iterable[float], limits_deg: tuple[float, float], period_ns: int
) -> None:
    """EnvelopeError when a reference over ramp in and sweep would bring the joint where it may not be."""
    low, high = limits_deg
    for tick, angle_deg in enumerate(reference_deg):
        if not low <= angle_deg <= high:
            lead = plan.ramp_in_ticks
            part, since = ("sweep", tick - lead) if tick >= lead else ("ramp in", tick)
            raise EnvelopeError(
                f"{plan.name}: reference would be {angle_deg:.4g} deg; allowed is {low:g} .. {high:g} deg ({part}, at "
                f"{since * period_ns * 1e-9:.3f} s)"
            )


def check_setpoints(
    name: str,
    setpoints: Iterable[tuple[str, float, float]],
    start: tuple[float, float],
    envelope: Envelope,
    period_ns: int,
) -> None:
    """The same for any sequence of (part of the run, p1, p2), one a tick, that begins at the set-points `start`."""
    (low, high), step = envelope.pressure_mpa, envelope.slew_mpa_s * period_ns * 1e-9
    least, most, widest = low - ROUNDING_MPA, high + ROUNDING_MPA, step + ROUNDING_MPA
    before, part, first = start, "", 0
    for tick, (here, *now) in enumerate(setpoints):
        if here != part:
            part, first = here, tick
        for valve in (0, 1):
            changed = abs(now[valve] - before[valve])
            if least <= now[valve] <= most and not changed > widest:
                continue
            signal, where = f"{name}: set-point p{valve + 1}", f"({part}, at {(tick - first) * period_ns * 1e-9:.3f} s)"
            if not least <= now[valve] <= most:
                raise EnvelopeError(
                    f"{signal} would be {now[valve]:.4g} MPa; allowed is {low:g} .. {high:g} MPa {where}"
                )
            rate = changed / (period_ns * 1e-9)
            raise EnvelopeError(
                f"{signal} would change by {rate:.4g} MPa/s; allowed is {envelope.slew_mpa_s:g} {where}"
            )
        before = now[0], now[1]


def _parts(plan: RunPlan) -> dict[str, Sequence[float]]:
    """dp of every tick from P0 through ramp in, sweep and ramp out back to P0, by the part of the run."""
    first, last = plan.dp_mpa[0], plan.dp_mpa[-1]
    ramp_in: Sequence[float] = [first * tick / plan.ramp_in_ticks for tick in range(plan.ramp_in_ticks)]
    if plan.tracking is not None:
        ramp_in = plan.tracking.feedforward_mpa[: plan.ramp_in_ticks]
    ramp_out = [last * (1 - (tick + 1) / plan.ramp_out_ticks) for tick in range(plan.ramp_out_ticks)]
    return {"ramp in": ramp_in, "sweep": plan.dp_mpa, "ramp out": [*ramp_out, 0.0]}


def _setpoints(plan: RunPlan, parts: dict[str, Sequence[float]]) -> Iterator[tuple[str, float, float]]:
    """Part, p1, p2 of every tick."""
    for part, dps in parts.items():
        for dp in dps:
            yield part, *around(plan.p0_mpa, dp)

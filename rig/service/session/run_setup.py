"""From a plan to what the loop follows and what the recorder is told: shared by `pamrig run` and the daemon."""

import platform
import time
from array import array
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.errors import ConfigError
from rig.excite.envelope import NO_GAINS
from rig.excite.run_plan import RunPlan
from rig.excite.setpoints import around
from rig.realtime.closed_loop import TrackingProgram
from rig.realtime.program import Program
from rig.rig_config import RigConfig
from rig.service.records.recorder_messages import RunOrder

if TYPE_CHECKING:
    from rig.service.session.session import Session


def program_of(plan: RunPlan, run: int) -> Program:
    """What the loop follows: the set-points of a plan, or its reference with the feed-forward's.

    ConfigError for a reference without gains.
    """
    p1, p2 = _set_points(plan.p0_mpa, plan.dp_mpa)
    common: dict[str, Any] = {
        "run": run, "rest_p1_mpa": plan.p0_mpa, "rest_p2_mpa": plan.p0_mpa, "p1_cmd_mpa": p1, "p2_cmd_mpa": p2,
        "settle_ticks": plan.settle_ticks, "zero_ticks": plan.zero_ticks, "ramp_in_ticks": plan.ramp_in_ticks,
        "ramp_out_ticks": plan.ramp_out_ticks,
    }  # fmt: skip
    followed = plan.tracking
    if followed is None:
        return Program(**common)
    if followed.gains is None:
        raise ConfigError(f"{plan.name}: {NO_GAINS}")
    lead1, lead2 = _set_points(plan.p0_mpa, followed.feedforward_mpa[: plan.ramp_in_ticks])
    return TrackingProgram(
        **common, lead_p1_mpa=lead1, lead_p2_mpa=lead2, reference_deg=followed.reference_deg,
        settings=followed.gains, period_s=followed.period_ns * 1e-9,
    )  # fmt: skip


def _set_points(p0_mpa: float, dp_mpa: "array[float]") -> "tuple[array[float], array[float]]":
    both = [around(p0_mpa, dp) for dp in dp_mpa]
    return array("d", (p1 for p1, _ in both)), array("d", (p2 for _, p2 in both))


def session_facts(session: "Session", rig: RigConfig) -> dict[str, Any]:
    """What every record of a session says of rig, machine and software."""
    from importlib.metadata import version  # it brings email and zipfile, and who only plans runs says nothing of these

    return {
        "session": f"{session.id:016x}",
        "rig": rig.name,
        "period_ns": rig.period_ns,
        "clock": "virtual" if session.virtual else "real",
        "started_ns": time.time_ns(),
        "device": session.facts["device"],
        "realtime": session.facts["realtime"],
        "pamrig": version("pamrig"),
        "python": platform.python_version(),
        "host": f"{platform.node()} {platform.machine()} {platform.system()} {platform.release()}",
        **rig.own_facts,
    }


def order_of(
    session: "Session",
    run: int,
    sweep_ticks: int,
    path: Path,
    facts: Mapping[str, Any],
    attachments: Mapping[str, bytes],
) -> RunOrder:
    """What the recorder is told of one run."""
    return RunOrder(run, path, facts, attachments, sweep_ticks, _wall_offset_ns(session))


def _wall_offset_ns(session: "Session") -> int:
    """Wall clock minus the loop's clock, as of now and not as of the session's start: a session may be months old, and
    older than the setting of this machine's clock by the network."""
    if session.virtual:
        return int(session.facts["wall_offset_ns"])
    return time.time_ns() - time.monotonic_ns()

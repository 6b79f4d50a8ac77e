"""From a plan to what the loop follows and what the recorder is told: shared by `pamrig run` and the daemon."""

import platform
import time
from array import array
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

from rig.excite.experiment import RunPlan
from rig.excite.setpoints import around
from rig.realtime.program import Program
from rig.rig_config import RigConfig
from rig.service.recorder import RunOrder
from rig.service.session import Session


def program_of(plan: RunPlan, run: int) -> Program:
    """The set-points of a plan: p1 = P0 + dp/2, p2 = P0 - dp/2."""
    p0 = plan.p0_mpa
    return Program(
        run=run,
        rest_p1_mpa=p0,
        rest_p2_mpa=p0,
        p1_cmd_mpa=array("d", (around(p0, dp)[0] for dp in plan.dp_mpa)),
        p2_cmd_mpa=array("d", (around(p0, dp)[1] for dp in plan.dp_mpa)),
        settle_ticks=plan.settle_ticks,
        zero_ticks=plan.zero_ticks,
        ramp_in_ticks=plan.ramp_in_ticks,
        ramp_out_ticks=plan.ramp_out_ticks,
    )


def session_facts(session: Session, rig: RigConfig) -> dict[str, Any]:
    """What every record of a session says of rig, machine and software."""
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
    }


def order_of(
    session: Session, run: int, sweep_ticks: int, path: Path, facts: Mapping[str, Any], attachments: Mapping[str, bytes]
) -> RunOrder:
    """What the recorder is told of one run."""
    return RunOrder(run, path, facts, attachments, sweep_ticks, session.facts["wall_offset_ns"])

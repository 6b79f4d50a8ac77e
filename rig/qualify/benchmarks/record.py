"""`pamrig bench record`: what recording costs: bytes a record, CPU of the two processes, and the speed of the virtual
clock."""

import os
import time
from multiprocessing.process import BaseProcess
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rig.app import compose, shipped
from rig.app.loop_process import loop_process
from rig.excite.run_plan import RunPlan, expand
from rig.excite.sweep import load_sweep
from rig.qualify.benchmarks import figure
from rig.qualify.benchmarks.record_limits import alone, peers_of
from rig.rig_config import RigConfig
from rig.service.records.recorder_messages import RunOrder, RunResult
from rig.service.session.run_setup import program_of
from rig.service.session.session import Session

SWEEP = "paper"
_OURS = "processor time of the two processes, which nothing else does"


def bench_record() -> dict[str, Any]:
    """The paper's programme in virtual time, and one record of it in real time."""
    rig = compose.load(None)
    plans = expand(load_sweep(shipped.configs() / "sweeps" / f"{SWEEP}.yaml"), rig.period_ns)
    virtual = _carried_out(rig, plans, virtual=True)
    real = _carried_out(rig, plans[:1], virtual=False)
    rig_s = virtual["ticks"] * rig.period_ns / 1e9
    period_us = rig.period_ns / 1e3
    return {
        "bytes a record, real clock": figure(
            real["bytes"] / real["ticks"],
            "B",
            "mcap Writer, chunks of 1 MB",
            real["mcap_bytes"],
            goal=60.0,
            limit="entropy of each field",
            limit_value=real["entropy_bytes"],
        ),
        "bytes a record, virtual clock": figure(
            virtual["bytes"] / virtual["ticks"], "B", "real clock", real["bytes"] / real["ticks"]
        ),
        "virtual clock, times real time": figure(
            rig_s / virtual["wall_s"],
            "x",
            better="higher",
            goal=500.0,
            limit="the loop alone",
            limit_value=alone(rig, [program_of(plan, n) for n, plan in enumerate(plans, 1)]),
        ),
        "virtual clock, a tick": figure(virtual["wall_s"] / virtual["ticks"] * 1e6, "us", why=_OURS),
        "CPU of the loop, real clock": figure(real["loop_cpu_s"] / real["wall_s"] * 100, "% of a core", why=_OURS),
        "CPU of the recorder, real clock": figure(
            real["recorder_cpu_s"] / real["wall_s"] * 100, "% of a core", why=_OURS
        ),
        "CPU of the loop a tick": figure(
            real["loop_cpu_s"] / real["ticks"] * 1e6, "us", limit="the period", limit_value=period_us
        ),
    }


def _carried_out(rig: RigConfig, plans: list[RunPlan], *, virtual: bool) -> dict[str, float]:
    programs = [program_of(plan, number) for number, plan in enumerate(plans, 1)]
    with (
        TemporaryDirectory(prefix="pamrig-bench-") as folder,
        Session(loop_process, rig, virtual=virtual) as session,
    ):
        session.open(programs, scripted=True)
        for plan, program in zip(plans, programs, strict=True):
            path = Path(folder) / f"{plan.name}.mcap"
            session.recording.expect(
                RunOrder(program.run, path, {}, {}, len(plan.dp_mpa), session.facts["wall_offset_ns"])
            )
        before = _cpu_s(session.loop), _cpu_s(session.recorder)
        start = time.perf_counter()
        session.go()
        cpu = before
        results: list[RunResult] = []
        while session.loop_alive:
            session.beat()
            results += session.recording.results()
            cpu = _cpu_s(session.loop) or cpu[0], _cpu_s(session.recorder)
            time.sleep(0.02)
        wall_s = time.perf_counter() - start
        results += session.close()
        return {
            "wall_s": wall_s,
            "ticks": sum(r.ticks for r in results),
            "bytes": sum(r.file.stat().st_size for r in results),
            "loop_cpu_s": cpu[0] - before[0],
            "recorder_cpu_s": cpu[1] - before[1],
            **({} if virtual else peers_of(results[0].file)),
        }


def _cpu_s(process: BaseProcess | None) -> float:
    """User and system time of a living process (Linux, proc(5)); 0 when it is gone."""

    try:
        fields = (
            Path(f"/proc/{process.pid if process else 0}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
        )
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

"""The stages compiled by numba, and whole records run through the chain.

The compiled stages are the functions of `rig.model.stages` and `rig.model.effect_stages` themselves, so simulated rig, simulator
and diagnosis share one implementation. Many parameter sets at once are in `rig.model.swarm_kernel`.
"""

from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from typing import Any

import numba
import numpy as np

from rig.errors import ModelError, RecordError
from rig.model.chain import lay_out
from rig.model.parameters import Input, Model
from rig.model.resample import held_commands, is_regular, on_grid
from rig.model.slots import Placed, Slot, StageFunction
from rig.record import Column, Record

DIVERGED_DEG = 1e4
"""An angle beyond this is no angle: the parameter set diverges under that input."""


@cache
def compiled(stage: StageFunction) -> Any:
    """The stage compiled for numpy columns; the machine code is kept beside the source between runs of the program."""
    return numba.njit(cache=True, nogil=True)(stage)


def run_stages(
    placed: Iterable[Placed], p1_mpa: Column, p2_mpa: Column, angle_deg: Column, dt_s: float, start_deg: float = 0.0
) -> None:
    """Run stages over columns of equal length in place. A Bouc-Wen muscle starts at `start_deg`."""
    for stage in placed:
        state = np.zeros(max(stage.n_state, 1))
        params = np.array(stage.params or (0.0,))
        if stage.name in ("mbw", "bw"):
            state[2] = start_deg / params[10]
        compiled(stage.stage)(p1_mpa, p2_mpa, angle_deg, state, params, dt_s)


def simulate(model: Model, record: Record, *, drive: Input = Input.COMMAND, start_deg: float | None = None) -> Record:
    """What `model` says under the commands of `record`: its times, with p1_mpa, p2_mpa and angle_deg simulated.

    drive=PRESSURE runs muscles, joint and sensor from the measured pressures instead. The angle starts at `start_deg`; None: at
    the first measured angle, or 0 without one. A record off the model's sample time is simulated on its grid and read back
    at its own times. A model driven by the command says nothing of pressures: they are None then.
    Raises ModelError when the model diverges, RecordError when the record lacks what drives it.
    """
    dt_s = model.sample_time_s
    grid = record if is_regular(record, dt_s) else on_grid(record, dt_s)
    p1, p2 = _driving(grid, drive, model.p0_mpa)
    angle = np.zeros(len(grid))
    placed = lay_out(model)
    split = [stage.slot in (Slot.TIMING, Slot.VALVE) for stage in placed].count(True)
    if drive is Input.COMMAND:
        run_stages(placed[:split], p1, p2, angle, dt_s)
    monitor1, monitor2 = p1.copy(), p2.copy()
    run_stages(placed[split:], p1, p2, angle, dt_s, _start(grid) if start_deg is None else start_deg)
    if not np.all(np.abs(angle) < DIVERGED_DEG):
        first = int(np.argmin(np.abs(angle) < DIVERGED_DEG))
        at = f"{record.name}: the model diverges under this input at {grid.t_s[first]:.2f} s"
        raise ModelError(f"{at}; identify it over this range or use it inside its own")
    if grid is not record:
        angle, monitor1, monitor2 = (np.interp(record.t_s, grid.t_s, column) for column in (angle, monitor1, monitor2))
    silent = model.muscle.input is Input.COMMAND and drive is Input.COMMAND
    return replace(record, angle_deg=angle, p1_mpa=None if silent else monitor1, p2_mpa=None if silent else monitor2, extra={})


def _driving(grid: Record, drive: Input, p0_mpa: float) -> tuple[Column, Column]:
    """The pressures at the head of the chain as columns of their own."""
    if drive is Input.COMMAND:
        return held_commands(grid, p0_mpa)
    if grid.p1_mpa is None or grid.p2_mpa is None:
        raise RecordError(f"{grid.name}: the pressures were not measured; drive the model by the command instead")
    return grid.p1_mpa.copy(), grid.p2_mpa.copy()


def _start(record: Record) -> float:
    """The first angle that was measured, 0 without one."""
    if record.angle_deg is None:
        return 0.0
    known = record.angle_deg[np.isfinite(record.angle_deg)]
    return float(known[0]) if len(known) else 0.0

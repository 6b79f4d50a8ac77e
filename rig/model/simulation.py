"""A model over whole records: its chain of compiled stages, from the commands or the measured pressures of a record to
the angle.

`rig.model.chain` runs the same stages tick by tick; `rig.model.compiled.swarm` runs the muscles of many parameter sets
at once.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from rig.errors import ModelError
from rig.model.chain import check_lateness, lay_out
from rig.model.compiled.stages import compiled
from rig.model.driving import driving_pressures
from rig.model.external.simulator import External
from rig.model.parameters import KINDS, Input, Model, StageKind
from rig.model.resample import on_clock
from rig.model.slots import Placed, Slot
from rig.record import Column, Record

DIVERGED_DEG = 1e4
"""An angle beyond this is no angle: the parameter set diverges under that input."""
_Y_UNIT = KINDS[Slot.MUSCLE][StageKind.MBW].index("y_unit_deg")
"""Where `lay_out` puts it of either kind: the one without second terms runs as the other."""


def run_stages(
    placed: Iterable[Placed],
    p1_mpa: Column,
    p2_mpa: Column,
    angle_deg: Column,
    dt_s: float,
    start_deg: float = 0.0,
    begun_s: float = 0.0,
) -> None:
    """Run stages over columns of equal length in place. A muscle starts at `start_deg`, the record `begun_s` after its
    session."""
    for stage in placed:
        state = np.zeros(max(stage.n_state, 1))
        params = np.array(stage.params or (0.0,))
        if stage.name in (StageKind.MBW, StageKind.BW):
            state[2] = start_deg / params[_Y_UNIT]
        if isinstance(stage.stage, External):
            state[0] = start_deg
        if stage.whole_session:
            state[0] = begun_s
        run: Any = stage.stage if isinstance(stage.stage, External) else compiled(stage.stage)
        run(p1_mpa, p2_mpa, angle_deg, state, params, dt_s)


def simulate(
    model: Model,
    record: Record,
    *,
    drive: Input = Input.COMMAND,
    start_deg: float | None = None,
    begun_s: float = 0.0,
) -> Record:
    """What `model` says under the commands of `record`: its times, with p1_mpa, p2_mpa and angle_deg simulated.

    drive=PRESSURE runs muscles, joint and sensor from the measured pressures instead, without their monitors' noise.
    The sensor reads `start_deg` first; None: the first measured angle, or that of a joint at rest without one. The
    record begins `begun_s` after its session, which counts for what goes on from record to record. A record off the
    model's sample time is simulated on its grid and read back at its own times. A model driven by the command says
    nothing of pressures: they are None then. Raises ModelError when the model diverges, or is later than its stages can
    hold; RecordError when the record lacks what drives it.
    """
    dt_s = model.sample_time_s
    grid = on_clock(record, dt_s)
    p1, p2 = driving_pressures(grid, drive, model.p0_mpa)
    angle = np.zeros(len(grid))
    placed = lay_out(model)
    split = [stage.slot in (Slot.TIMING, Slot.VALVE) for stage in placed].count(True)
    if drive is Input.COMMAND:
        check_lateness(placed, dt_s, len(grid), begun_s)
        run_stages(placed[:split], p1, p2, angle, dt_s, begun_s=begun_s)
    monitor1, monitor2 = p1.copy(), p2.copy()
    read_deg = _first_read(grid) if start_deg is None else start_deg
    joint_deg = 0.0 if read_deg is None else before_sensor(model, read_deg)
    run_stages(placed[split:], p1, p2, angle, dt_s, joint_deg, begun_s)
    if not np.all(np.abs(angle) < DIVERGED_DEG):
        first = int(np.argmin(np.abs(angle) < DIVERGED_DEG))
        at = f"{record.name}: the model diverges under this input at {grid.t_s[first]:.2f} s"
        raise ModelError(f"{at}; identify it over this range or use it inside its own")
    if grid is not record:
        angle, monitor1, monitor2 = (np.interp(record.t_s, grid.t_s, column) for column in (angle, monitor1, monitor2))
    silent = model.muscle.input is Input.COMMAND and drive is Input.COMMAND
    return replace(
        record, angle_deg=angle, p1_mpa=None if silent else monitor1, p2_mpa=None if silent else monitor2, extra={}
    )


def before_sensor(model: Model, read_deg: float) -> float:
    """The joint's angle (deg) of which an affine sensor reads so much: where muscles start."""
    if model.sensor.kind != StageKind.AFFINE or model.sensor.value("gain") == 0.0:
        return read_deg
    return (read_deg - model.sensor.value("offset_deg")) / model.sensor.value("gain")


def read_at_rest(model: Model) -> float:
    """What the sensor reads (deg) of a joint at its rest: its zero."""
    return model.sensor.value("offset_deg") if model.sensor.kind == StageKind.AFFINE else 0.0


def _first_read(record: Record) -> float | None:
    """The first angle that was measured, None without one."""
    if record.angle_deg is None:
        return None
    known = record.angle_deg[np.isfinite(record.angle_deg)]
    return float(known[0]) if len(known) else None

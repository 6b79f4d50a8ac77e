"""The stages compiled by numba, and whole records run through the chain.

The compiled stages are the functions of `rig.model.stages` and `rig.model.effect_stages` themselves, so simulated rig,
simulator and diagnosis share one implementation. Many parameter sets at once are in `rig.model.swarm_kernel`.
"""

import importlib
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any, cast

import numpy as np
from numba.np import linalg as numba_linalg
from numpy.typing import NDArray

from rig.errors import ModelError
from rig.model.chain import check_lateness, lay_out
from rig.model.drive import drives
from rig.model.driving import driving_pressures
from rig.model.external import External
from rig.model.joint_balance import NOTHING_ADDED, STATE_SIZE, balanced_angles
from rig.model.machine_code import kept
from rig.model.parameters import Input, Model, StageKind
from rig.model.resample import on_clock
from rig.model.slots import Placed, Row, Slot, StageFunction
from rig.record import Column, Record

INLINED = True
"""A stage is cut into functions of one idea each; left to LLVM, calling them takes longer than what they do
(docs/decisions/0583)."""
DIVERGED_DEG = 1e4
"""An angle beyond this is no angle: the parameter set diverges under that input."""


def _load_numba() -> None:
    """What numba loads with its first kernel, but for SciPy's linear algebra: a quarter of that time, imported there
    only to see whether it can be. No kernel here calls it, and numba asks again for one that does (decision 0209)."""
    asks: Any = getattr(numba_linalg, "ensure_blas", None)
    numba_linalg.ensure_blas = lambda: None
    try:
        importlib.import_module("numba.np.arraymath")
    finally:
        numba_linalg.ensure_blas = asks


_load_numba()


@cache
def compiled(function: StageFunction | FunctionType) -> Any:
    """The stage compiled for numpy columns; the machine code is kept beside the source between runs of the program.

    numba calls only what is compiled itself: the functions that this one names are compiled with it.
    """
    plain = cast(FunctionType, function)
    named = {name: plain.__globals__.get(name) for name in plain.__code__.co_names}
    called = {name: compiled(one) for name, one in named.items() if isinstance(one, FunctionType)}
    rows = {name: np.array(one) for name, one in named.items() if isinstance(one, Row)}
    copy = FunctionType(plain.__code__, plain.__globals__ | called | rows, plain.__name__, plain.__defaults__)
    copy.__qualname__, copy.__module__ = plain.__qualname__, plain.__module__
    return kept(copy, nogil=True, forceinline=INLINED)


def is_machine_code_kept() -> bool:
    """Whether an earlier run of the program has compiled stages on this machine and kept what came of it."""
    return any(Path(compiled(drives).stats.cache_path).glob("*.nbi"))


def run(p1: Column, p2: Column, y: Column, state: Column, params: Column, dt_s: float) -> None:
    """Stands in `each_record` for the stage that `over_records` puts there."""


def each_record(
    first: Column, second: Column, third: Column, ends: NDArray[np.intp], state: Column, params: Column, dt_s: Column
) -> None:
    """`run`, which is a stage or the like, over records that stand one after the other in the columns (n,): `ends` (r,)
    are the rows after their last ones, dt_s (r,) their periods."""
    at = 0
    for k in range(len(ends)):
        to = ends[k]
        state[:] = 0.0
        run(first[at:to], second[at:to], third[at:to], state, params, dt_s[k])
        at = to


@cache
def over_records(function: StageFunction | FunctionType) -> Any:
    """`each_record` of a stage, compiled: one call for all records, in which no thread waits for another."""
    plain = FunctionType(each_record.__code__, {**each_record.__globals__, "run": function}, "each_record")
    plain.__module__ = each_record.__module__
    return compiled(plain)


def drive(p1_mpa: Column, p2_mpa: Column, p0_mpa: float, exponent: float) -> Column:
    """The drive d = (p1 - p2) (2 P0 / (p1 + p2))^exponent of every row (n,), MPa; see `rig.model.drive`."""
    out = np.empty(len(p1_mpa))
    compiled(drives)(p1_mpa, p2_mpa, p0_mpa, exponent, out)
    return out


def balanced(
    angle_deg: Column,
    offset_deg: Column,
    friction: Column,
    viscous_s: float,
    inertia_s: float,
    weights: Column,
    dt_s: float | Column,
    ends: NDArray[np.intp] | None = None,
) -> Column:
    """The joint's angle (n,) when the muscles pull `offset_deg` further and its friction counts `friction` times (both
    (n,)); of several records where their `ends` and dt_s are given, as in `each_record`.

    viscous_s, inertia_s and the Maxwell-slip weights (5,) are those of the nominal joint; see
    `rig.model.joint_balance`.
    """
    out = angle_deg.copy()
    params = np.array([*NOTHING_ADDED, 0.0, viscous_s, inertia_s, *weights])
    ends = np.array([len(out)]) if ends is None else ends
    state, each_dt_s = np.zeros(STATE_SIZE), np.full(len(ends), dt_s)
    over_records(balanced_angles)(out, offset_deg, friction, ends, state, params, each_dt_s)
    return out


def run_stages(
    placed: Iterable[Placed], p1_mpa: Column, p2_mpa: Column, angle_deg: Column, dt_s: float, start_deg: float = 0.0
) -> None:
    """Run stages over columns of equal length in place. A muscle starts at `start_deg`."""
    for stage in placed:
        state = np.zeros(max(stage.n_state, 1))
        params = np.array(stage.params or (0.0,))
        if stage.name in (StageKind.MBW, StageKind.BW):
            state[2] = start_deg / params[10]
        if isinstance(stage.stage, External):
            state[0] = start_deg
        run: Any = stage.stage if isinstance(stage.stage, External) else compiled(stage.stage)
        run(p1_mpa, p2_mpa, angle_deg, state, params, dt_s)


def simulate(model: Model, record: Record, *, drive: Input = Input.COMMAND, start_deg: float | None = None) -> Record:
    """What `model` says under the commands of `record`: its times, with p1_mpa, p2_mpa and angle_deg simulated.

    drive=PRESSURE runs muscles, joint and sensor from the measured pressures instead, without their monitors' noise.
    The angle starts at `start_deg`; None: at the first measured angle, or 0 without one. A record off the model's
    sample time is simulated on its grid and read back at its own times. A model driven by the command says nothing of
    pressures: they are None then. Raises ModelError when the model diverges, or is later than its stages can hold;
    RecordError when the record lacks what drives it.
    """
    dt_s = model.sample_time_s
    grid = on_clock(record, dt_s)
    p1, p2 = driving_pressures(grid, drive, model.p0_mpa)
    angle = np.zeros(len(grid))
    placed = lay_out(model)
    split = [stage.slot in (Slot.TIMING, Slot.VALVE) for stage in placed].count(True)
    if drive is Input.COMMAND:
        check_lateness(placed, dt_s, len(grid))
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
    return replace(
        record, angle_deg=angle, p1_mpa=None if silent else monitor1, p2_mpa=None if silent else monitor2, extra={}
    )


def before_sensor(model: Model, read_deg: float) -> float:
    """The joint's angle (deg) of which an affine sensor reads so much: where muscles start."""
    if model.sensor.kind != StageKind.AFFINE or model.sensor.value("gain") == 0.0:
        return read_deg
    return (read_deg - model.sensor.value("offset_deg")) / model.sensor.value("gain")


def _start(record: Record) -> float:
    """The first angle that was measured, 0 without one."""
    if record.angle_deg is None:
        return 0.0
    known = record.angle_deg[np.isfinite(record.angle_deg)]
    return float(known[0]) if len(known) else 0.0

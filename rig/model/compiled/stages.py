"""Stages compiled by numba, one record or many in a call.

The compiled stages are the functions of `rig.model.equations.stages` and `rig.model.effect_stages` themselves, so
simulated rig, simulator and diagnosis share one implementation.
"""

import importlib
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any, cast

import numpy as np
from numba.np import linalg as numba_linalg
from numpy.typing import NDArray

from rig.model.compiled.machine_code import kept
from rig.model.equations.drive import drives
from rig.model.slots import StageFunction, StageNumbers
from rig.record import Column

INLINED = True
"""A stage is cut into functions of one idea each; left to LLVM, calling them takes longer than what they do
(docs/decisions/0583)."""
DIVIDES_AS = "numpy"
"""By zero to infinity, as numpy's columns do. Where each division may raise, none is taken out of the loop: the joint's
balance takes half as long again (docs/decisions/0636)."""


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
    rows = {name: np.array(one) for name, one in named.items() if isinstance(one, StageNumbers)}
    copy = FunctionType(plain.__code__, plain.__globals__ | called | rows, plain.__name__, plain.__defaults__)
    copy.__qualname__, copy.__module__ = plain.__qualname__, plain.__module__
    return kept(copy, nogil=True, forceinline=INLINED, error_model=DIVIDES_AS)


def is_machine_code_kept() -> bool:
    """Whether an earlier run of the program has compiled stages on this machine and kept what came of it."""
    return any(Path(compiled(drives).stats.cache_path).glob("*.nbi"))


def run(p1: Column, p2: Column, y: Column, state: Column, params: Column, dt_s: float) -> None:
    """Stands in `each_record` for the stage that `over_records` puts there: pressures p1, p2 (n,) in MPa and angle y
    (n,) in deg of one record, changed in place."""


def each_record(
    first: Column,
    second: Column,
    third: Column,
    ends: NDArray[np.intp],
    state: Column,
    params: Column,
    dt_s: Column,
    begun_s: Column,
) -> None:
    """`run`, which is a stage or the like, over records that stand one after the other in the columns (n,): `ends` (r,)
    are the rows after their last ones, dt_s (r,) their periods, and begun_s (r,) what the first place of the state is
    when they begin."""
    at = 0
    for k in range(len(ends)):
        to = ends[k]
        state[:] = 0.0
        state[0] = begun_s[k]
        run(first[at:to], second[at:to], third[at:to], state, params, dt_s[k])
        at = to


@cache
def over_records(function: StageFunction | FunctionType) -> Any:
    """`each_record` of a stage, compiled: one call for all records, in which no thread waits for another."""
    plain = FunctionType(each_record.__code__, {**each_record.__globals__, "run": function}, "each_record")
    plain.__module__ = each_record.__module__
    return compiled(plain)

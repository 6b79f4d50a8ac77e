"""How the plants' equations are compiled, so that they read as plain Python and are typed as such."""

from collections.abc import Callable, MutableSequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from rig.model.compiled.machine_code import kernel

Array = NDArray[np.float64]
State = MutableSequence[float]
"""A float array as the compiled equations see it: read and written number by number."""
F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Compile at the first call and keep the result on the disk: `rig.model.compiled.machine_code`. What it calls is
    inlined, as in a stage: a rig's numbers, some fifty, are handed on at each call (docs/decisions/0747)."""
    return kernel(error_model="numpy", forceinline=True)(function)

"""The one place that names the compiler, so that the plant's equations read as plain Python and are typed as such."""

from collections.abc import Callable, MutableSequence
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
State = MutableSequence[float]
"""A float array as the compiled equations see it: read and written number by number."""
F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Compile at the first call and keep the result on disk."""
    return cast(F, numba.njit(cache=True, error_model="numpy")(function))

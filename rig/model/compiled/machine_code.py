"""The one place that names the compiler: machine code is kept on the disk, under a name that says what it was made of.

numba takes what it kept for current as long as the one file that the function stands in is. A kernel that calls a
function of another file, or names a number of one, would go on as before when that file changes (decision 0722).
"""

import builtins
import sys
from collections.abc import Callable, Iterator
from dis import get_instructions
from functools import cache
from hashlib import blake2b
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any, Final, TypeVar, cast

import numba
import numpy as np
from numba.core.dispatcher import Dispatcher
from numba.core.extending import _Intrinsic

F = TypeVar("F", bound=Callable[..., Any])
CALLED_BY_KERNELS: Final[dict[str, object]] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def kernel(**options: object) -> Callable[[F], F]:
    """A function compiled by numba with these options of `numba.njit`, at its first call; kept on the disk.

    Whatever it names stands above it or is imported: NameError otherwise, since what is not there yet cannot be seen.
    """

    def made(function: F) -> F:
        return cast(F, kept(cast(FunctionType, function), **options))

    return made


def kept(function: FunctionType, **options: object) -> Any:
    """The same of a function whose names all have their meaning already; the function itself stays as it is.

    Kernels that call it are made of another compilation of it, which Python cannot call: what takes a Python call's
    arguments apart and makes its result is then neither compiled nor kept (docs/decisions/0760)."""
    whole = _compiling(function, options)
    within = cache(lambda: _compiling(function, options | CALLED_BY_KERNELS))
    whole.get_call_template = lambda args, kws: within().get_call_template(args, kws)
    whole.get_overload = lambda sig: within().get_overload(sig)
    return whole


def _compiling(function: FunctionType, options: dict[str, object]) -> Any:
    copy = FunctionType(
        function.__code__, function.__globals__, function.__name__, function.__defaults__, function.__closure__
    )
    copy.__qualname__ = f"{function.__qualname__}.{made_of(function, repr(sorted(options.items())))}"
    copy.__module__, copy.__doc__ = function.__module__, function.__doc__
    copy.__annotations__ = function.__annotations__
    compiling: Any = numba.njit
    return compiling(copy, cache=True, **options)


@cache
def made_of(function: FunctionType, options: str = "") -> str:
    """What a function's machine code depends on, as a word: its own code, the numbers that it names, the functions
    that it calls and the order of the fields in the tuples that it takes."""
    parts: list[object] = [options, function.__defaults__, *_code(function.__code__, function.__doc__)]
    for name in sorted(set(_global_names(function.__code__))):
        if name in function.__globals__:
            parts.append(f"{name}={_word(function.__globals__[name])}")
        elif not hasattr(builtins, name):
            raise NameError(f"{function.__module__}.{function.__qualname__}: {name} is not defined above this kernel")
    parts += [kind._fields for kind in function.__annotations__.values() if hasattr(kind, "_fields")]
    return blake2b(repr(parts).encode(), digest_size=6).hexdigest()


def _code(code: CodeType, doc: str | None) -> Iterator[object]:
    """The code and its constants, those of functions within it too; not its text."""
    yield code.co_code
    yield code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _code(constant, None)
        elif constant != doc:
            yield constant


def _global_names(code: CodeType) -> Iterator[str]:
    yield from (one.argval for one in get_instructions(code) if one.opname == "LOAD_GLOBAL")
    for within in code.co_consts:
        if isinstance(within, CodeType):
            yield from _global_names(within)


def _word(value: object) -> object:
    """What a kernel sees of something that it names; of what belongs to Python, numpy or numba, that it is there."""
    if isinstance(value, Dispatcher):
        return made_of(value.py_func)
    if isinstance(value, FunctionType):
        return made_of(value)
    if isinstance(value, _Intrinsic):  # writes the machine's instructions itself, with whatever helps it in its file
        return blake2b(Path(sys.modules[value.__module__].__file__ or "").read_bytes(), digest_size=6).hexdigest()
    if isinstance(value, np.ndarray):
        return value.tolist()
    return repr(value) if isinstance(value, (bool, int, float, complex, str, tuple)) else ""

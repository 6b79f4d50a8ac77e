"""A simulator that is not ours: a Python function or an FMU that answers set-points with an angle.

    python:MODULE:FUNCTION      function(time_s, p1_cmd_mpa, p2_cmd_mpa) -> angle_deg, all of shape (n,)
    PLANT.fmu                   FMI 2 or 3 for co-simulation, see rig.model.external.fmu

It stands where the muscles stand in the chain of a model; effects are added before it, behind it and at the sensor.
"""

import hashlib
import importlib
import inspect
import os
import signal
import sys
import threading
import traceback
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Final, cast

from rig.config import suggest
from rig.errors import ModelError
from rig.model.slots import Values

KIND: Final = "external"
"""Of the muscle of such a model."""
PYTHON: Final = "python:"
PATIENCE_S: Final = 60.0
"""A record that takes longer than this is refused, unless the model's file allows more."""
_KEPT: Final = 64
"""Answers that are remembered: an effect behind the simulator does not change what it is asked."""

Answer = Callable[[Any, Any, Any, float], Any]
"""answer(time_s, p1_cmd_mpa, p2_cmd_mpa, start_deg) -> angle_deg; columns of shape (n,)."""


def is_external(place: str | Path) -> bool:
    """Whether `--model` names a simulator that is not ours."""
    return str(place).startswith(PYTHON) or str(place).endswith(".fmu")


@dataclass(frozen=True)
class External:
    """Such a simulator as a stage of the chain: from the pressures it is given to the angle, whole records only."""

    source: str
    names: Mapping[str, str] = field(default_factory=dict)
    patience_s: float = PATIENCE_S

    def __call__(self, p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
        """Write the angle (deg) into `y`. `state[0]` is the angle at the start; ModelError, one line, for an answer
        that is none."""
        import numpy as np

        time_s = dt_s * np.arange(len(p1))
        asked = (time_s, np.array(p1), np.array(p2), float(state[0]))
        y[:] = _remembered((self.source, tuple(sorted(self.names.items()))), asked, lambda: self._ask(*asked))

    def _ask(self, time_s: Any, p1_mpa: Any, p2_mpa: Any, start_deg: float) -> Any:
        answer = _loaded(self.source, tuple(sorted(self.names.items())))
        with _patience(self.patience_s, self.source, float(time_s[-1])):
            try:
                angle = answer(time_s, p1_mpa.copy(), p2_mpa.copy(), start_deg)
            except ModelError:
                raise
            except (Exception, SystemExit) as error:  # noqa: BLE001  # somebody else's code: told in one line
                raise ModelError(f"{self.source}: raised {_told(error)}") from None
        return _checked(angle, time_s, self.source)


def load(source: str, names: Mapping[str, str]) -> None:
    """ModelError, one line, when the simulator cannot be had: no such module, function, file, platform."""
    _loaded(source, tuple(sorted(names.items())))


@cache
def _loaded(source: str, names: tuple[tuple[str, str], ...]) -> Answer:
    if source.startswith(PYTHON):
        return _python(source)
    from rig.model.external.fmu import load_fmu

    return load_fmu(Path(source), dict(names))


def _python(source: str) -> Answer:
    parts = source.removeprefix(PYTHON).split(":")
    if len(parts) != 2 or not all(parts):
        raise ModelError(f"{source}: expected python:MODULE:FUNCTION, for example python:plant:simulate")
    function = _function(source, *parts)
    starts = "start_deg" in inspect.signature(function).parameters
    return lambda time_s, p1, p2, start_deg: function(time_s, p1, p2, **({"start_deg": start_deg} if starts else {}))


def _function(source: str, module: str, name: str) -> Callable[..., Any]:
    if os.getcwd() not in sys.path:  # as `python -m` has it: the caller's module lies where the command was called
        sys.path.insert(0, os.getcwd())
    try:
        found = importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise ModelError(
            f"{source}: no module {error.name!r}; looked for in {os.getcwd()} and where Python looks"
        ) from None
    except (Exception, SystemExit) as error:  # noqa: BLE001  # somebody else's module, or a script that ends
        raise ModelError(f"{source}: importing {module} raised {_told(error)}") from None
    function = getattr(found, name, None)
    if not callable(function):
        known = [key for key, value in vars(found).items() if callable(value) and not key.startswith("_")]
        what = "is no function" if function is not None else f"no function of that name; {suggest(name, known)}"
        raise ModelError(f"{source}: {name!r} {what}" if function is not None else f"{source}: {what}")
    return cast(Callable[..., Any], function)


def _checked(answer: Any, time_s: Any, source: str) -> Any:
    """The answer as a column of its own; ModelError when it is not one."""
    import numpy as np

    try:
        angle = np.array(answer, dtype=np.float64)
    except (TypeError, ValueError):
        raise ModelError(
            f"{source}: answered with {type(answer).__name__}; expected {len(time_s)} numbers, the angle in deg"
        ) from None
    if angle.shape != time_s.shape:
        raise ModelError(
            f"{source}: answered with the shape {angle.shape}; expected ({len(time_s)},), an angle for each row"
        )
    if not np.isfinite(angle).all():
        row = int(np.argmin(np.isfinite(angle)))
        raise ModelError(f"{source}: the angle is {angle[row]} at {time_s[row]:.3f} s; it must be a number")
    return angle


def _told(error: BaseException) -> str:
    """An error of somebody else's code, for one line: what, and where in it."""
    where = traceback.extract_tb(error.__traceback__)[-1]
    text = " ".join(str(error).split())[:200]
    return f"{type(error).__name__}: {text} ({Path(where.filename).name}, line {where.lineno})"


@contextmanager
def _patience(seconds: float, source: str, length_s: float) -> Iterator[None]:
    """ModelError when what is done meanwhile takes longer; in the main thread, where a timer can interrupt it."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def over(*_: object) -> None:
        raise ModelError(
            f"{source}: no answer within {seconds:g} s for a record of {length_s:.3g} s; muscle.patience_s in a "
            "MODEL.yaml allows more"
        )

    before = signal.signal(signal.SIGALRM, over)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


_ANSWERS: OrderedDict[tuple[Any, ...], Any] = OrderedDict()
_LOCK = threading.Lock()


def _remembered(who: tuple[Any, ...], asked: tuple[Any, ...], ask: Callable[[], Any]) -> Any:
    """The answer, from memory where the same was asked before."""
    digest = hashlib.sha256(b"".join(column.tobytes() for column in asked[:3])).digest()
    key = (*who, digest, asked[3])
    with _LOCK:
        if key in _ANSWERS:
            _ANSWERS.move_to_end(key)
            return _ANSWERS[key]
    answer = ask()
    with _LOCK:
        _ANSWERS[key] = answer
        while len(_ANSWERS) > _KEPT:
            _ANSWERS.popitem(last=False)
    return answer

"""Machine code that is kept goes with all that it was made of, in whatever file that stands."""

import os
import re
import subprocess
import sys
from pathlib import Path
from types import FunctionType
from typing import NamedTuple

import numpy as np
import pytest
from conftest import ROOT

from rig.model.compiled import lanes
from rig.model.compiled.machine_code import kept, kernel, made_of
from rig.model.effect_stages.joint import stiffness


def with_globals(function: FunctionType, **others: object) -> FunctionType:
    """The function where some of the names in it mean something else."""
    return FunctionType(function.__code__, function.__globals__ | others, function.__name__)


def helper_now(x: float) -> float:
    return 2.0 * x


def helper_then(x: float) -> float:
    return 3.0 * x


FACTOR = 2.0


def plain(x: float) -> float:
    return FACTOR * helper_now(x)


def test_the_same_function_is_the_same() -> None:
    assert made_of(plain) == made_of(with_globals(plain))
    assert made_of(stiffness) == made_of(with_globals(stiffness))


def test_another_number_or_another_function_in_another_file_is_another_function() -> None:
    known = {made_of(plain), made_of(with_globals(plain, FACTOR=2.5))}
    known.add(made_of(with_globals(plain, FACTOR=np.array([2.0]))))
    known.add(made_of(with_globals(plain, helper_now=helper_then)))
    known.add(made_of(with_globals(plain, helper_now=lanes.fused)))
    assert len(known) == 5
    assert made_of(stiffness) != made_of(with_globals(stiffness, STATE_SIZE=99))


def test_a_compiled_function_counts_as_what_it_was_made_of() -> None:
    compiled = {made_of(with_globals(plain, helper_now=kept(one))) for one in (helper_now, helper_then)}
    assert len(compiled) == 2


def test_fields_in_another_order_are_another_tuple() -> None:
    class Before(NamedTuple):
        slope: float
        offset: float

    class After(NamedTuple):
        offset: float
        slope: float

    def taking(law: type) -> FunctionType:
        function = with_globals(plain)
        function.__annotations__ = {"x": law}
        return function

    assert made_of(taking(Before)) != made_of(taking(After))


def test_a_kernel_above_what_it_calls_is_refused() -> None:
    with pytest.raises(NameError, match="plain: helper_now is not defined above this kernel"):
        kernel()(FunctionType(plain.__code__, {"__name__": "here", "FACTOR": 1.0}, "plain"))


CALLS = "import caller; print(caller.answer(1.0))"
CALLER = """
from rig.model.compiled.machine_code import kernel
from called import FACTOR, called
@kernel()
def answer(x):
    return FACTOR * called(x)
"""
CALLED = """
from rig.model.compiled.machine_code import kernel
FACTOR = 2.0
@kernel()
def called(x):
    return x + 1.0
"""


def answered(folder: Path, program: str = CALLS) -> str:
    """What a new process says of the two files."""
    path = os.pathsep.join((str(folder), str(ROOT)))
    bare = os.environ | {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run([sys.executable, "-c", program], env=bare, check=True, capture_output=True, text=True)
    return done.stdout.strip()


@pytest.fixture
def caller(tmp_path: Path) -> Path:
    (tmp_path / "caller.py").write_text(CALLER)
    (tmp_path / "called.py").write_text(CALLED)
    return tmp_path


def test_after_an_update_of_another_file_nothing_old_is_computed(caller: Path) -> None:
    assert answered(caller) == "4.0"
    assert list((caller / "__pycache__").glob("caller.answer*.nbi")), "it was kept"
    (caller / "called.py").write_text(CALLED.replace("+ 1.0", "+ 3.0"))
    assert answered(caller) == "8.0"
    (caller / "called.py").write_text(CALLED.replace("2.0", "5.0"))
    assert answered(caller) == "10.0"


def test_what_kernels_call_is_kept_without_what_only_python_needs_and_python_may_call_it_too(caller: Path) -> None:
    kept_files = (caller / "__pycache__").glob
    assert answered(caller) == "4.0"
    (within,) = kept_files("called.called*.nbc")
    both = f"{CALLS}; import called; print(called.called(2.0))"
    for _ in range(2):  # compiled, and read again
        assert answered(caller, both).split() == ["4.0", "3.0"]
    (whole,) = set(kept_files("called.called*.nbc")) - {within}
    assert within.stat().st_size < whole.stat().st_size


def test_nothing_else_is_kept_by_numba() -> None:
    files = [file for room in ("rig", "hil", "drivers") for file in (ROOT / room).rglob("*.py")]
    keeping = {file.name for file in files if re.search(r"cache\s*=\s*True", file.read_text(encoding="utf-8"))}
    assert keeping == {"machine_code.py"}

"""Machine code that is kept goes with all that it was made of, in whatever file that stands."""

from types import FunctionType

from rig.model.effect_stages.joint import stiffness
from rig.model.kernels import made_of


def with_globals(function: FunctionType, **others: object) -> FunctionType:
    """The function where some of the names in it mean something else."""
    return FunctionType(function.__code__, function.__globals__ | others, function.__name__)


def helper_now(x: float) -> float:
    return 2.0 * x


def helper_then(x: float) -> float:
    return 3.0 * x


FACTOR = 2.0


def kernel(x: float) -> float:
    return FACTOR * helper_now(x)


def test_the_same_function_is_the_same() -> None:
    assert made_of(kernel) == made_of(with_globals(kernel))
    assert made_of(stiffness) == made_of(with_globals(stiffness))


def test_another_number_or_another_function_in_another_file_is_another_function() -> None:
    known = {made_of(kernel), made_of(with_globals(kernel, FACTOR=2.5))}
    known.add(made_of(with_globals(kernel, helper_now=helper_then)))
    assert len(known) == 3
    assert made_of(stiffness) != made_of(with_globals(stiffness, STATE_SIZE=99))

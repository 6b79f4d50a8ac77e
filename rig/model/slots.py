"""Where a stage may stand in the simulator's chain, and what every stage looks like. No stage itself lives here.

The chain runs command -> timing -> valve -> (monitors are read here) -> muscle -> joint -> sensor -> angle.
"""

from collections.abc import Callable, MutableSequence, Sequence
from enum import StrEnum
from typing import NamedTuple

Values = MutableSequence[float]
"""A block of n consecutive ticks: a list of length 1 in the simulated rig, a numpy array in compiled use."""


class StageNumbers(tuple[float, ...]):
    """Numbers of a module that a stage asks for by their place. In compiled use an array: a tuple is asked for its k-th
    number by comparisons."""


StageFunction = Callable[[Values, Values, Values, Values, Sequence[float], float], None]
"""stage(p1, p2, y, state, params, dt_s): changes p1 and p2 (MPa) or y (deg) in place, tick by tick.

`state` is what it carries from one block to the next, all zero before the first tick, but for the first place of one
that counts the time of the session; a stage must give the same result however a record is cut into blocks. `params` are
its numbers in the order of its parameters' names. Written in the part of Python that numba compiles: loops, floats and
`math`, no allocation.
"""


class Slot(StrEnum):
    """The five places of the chain, in order.

    An added effect runs behind the nominal stage of its slot, or ahead of it where its table entry says so.
    """

    TIMING = "timing"
    VALVE = "valve"
    MUSCLE = "muscle"
    JOINT = "joint"
    SENSOR = "sensor"


AHEAD = (Slot.TIMING, Slot.VALVE)
"""The slots ahead of the pressure monitors."""


class Placed(NamedTuple):
    """A stage with its numbers, ready to run."""

    name: str
    slot: Slot
    stage: StageFunction
    params: tuple[float, ...]
    n_state: int
    whole_session: bool = False
    """It counts time since the session began, in seconds and in the first place of its state."""

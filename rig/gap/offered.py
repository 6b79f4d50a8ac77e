"""Which effects of the library a rig can have at all: one without valves has none of theirs."""

from collections.abc import Sequence
from itertools import chain as joined
from typing import Final

from rig.channels import Channels, common
from rig.gap.hypotheses.library import LIBRARY
from rig.model.parameters import Model
from rig.record import Record

VALVES: Final = "valve"
TWO_MUSCLES: Final = frozenset({"co_contraction", "muscle_mismatch", "leak"})
"""Effects of two pressures against each other: without them there is nothing to be unequal."""


def channels_of_call(model: Model | None, records: Sequence[Record], baselines: Sequence[Sequence[Record]]) -> Channels:
    """The one channel map of everything in a call; RecordError when simulator and records are of different rigs."""
    shown = [(str(one.source or one.name), one.channels) for one in joined(records, *baselines)]
    return common(([] if model is None else [("the model", model.own_channels)]) + shown)


def offered(library: Sequence[str] | None, channels: Channels) -> Sequence[str] | None:
    """The names of a library without what such a rig cannot have; None, for all, stays None on a pneumatic rig."""
    if channels.has_valves:
        return library
    names = LIBRARY if library is None else library
    return [name for name in names if LIBRARY[name].stage != VALVES and name not in TWO_MUSCLES]

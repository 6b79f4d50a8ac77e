"""Which effects of the library a rig can have at all: one without valves has none of theirs, and its YAML may say more.

What a rig cannot have is neither offered nor missed: it counts for nothing unknown.
"""

from collections.abc import Sequence
from itertools import chain as joined
from typing import Final

from rig.channels import EFFECTS_FACT, Channels, common
from rig.config import suggest
from rig.errors import ConfigError
from rig.gap.hypotheses.library import LIBRARY
from rig.model.external.simulator import KIND as EXTERNAL
from rig.model.parameters import Model
from rig.record import Record

VALVES: Final = "valve"


def channels_of_call(model: Model | None, records: Sequence[Record], baselines: Sequence[Sequence[Record]]) -> Channels:
    """The one channel map of everything in a call; RecordError when simulator and records are of different rigs."""
    shown = [(str(one.source or one.name), one.channels) for one in joined(records, *baselines)]
    own = [] if model is None or model.muscle.kind == EXTERNAL else [("the model", model.own_channels)]
    return common(own + shown)


def possible(
    channels: Channels, records: Sequence[Record], rig_effects: Sequence[str] | None = None, where: str = "effects"
) -> list[str]:
    """The effects that a rig can have: those that it says, by name or by stage (`rig_effects` by its YAML, else the
    records' own facts), without those of valves where it has none. ConfigError for a word that is neither."""
    listed = [(where, rig_effects)] if rig_effects is not None else [
        (f"{one.name}: facts: {EFFECTS_FACT}", one.facts[EFFECTS_FACT]) for one in records if EFFECTS_FACT in one.facts
    ]  # fmt: skip
    wanted = [named_effects(words, place) for place, words in listed]
    return [
        name
        for name, effect in LIBRARY.items()
        if (channels.has_valves or not (effect.stage == VALVES or effect.two_muscles))
        and all(name in names for names in wanted)
    ]


def named_effects(words: object, where: str) -> set[str]:
    """The effects of a list of names and stages; ConfigError for a word that is neither."""
    if not isinstance(words, (list, tuple)):
        raise ConfigError(f"{where}: expected a list of effects or stages")
    stages = {effect.stage for effect in LIBRARY.values()}
    for word in words:
        if word not in LIBRARY and word not in stages:
            raise ConfigError(f"{where}: unknown effect or stage {word!r}; {suggest(str(word), [*LIBRARY, *stages])}")
    return {name for name, effect in LIBRARY.items() if name in words or effect.stage in words}

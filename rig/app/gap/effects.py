"""The library of effects as users name it and read it."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rig.errors import ConfigError

if TYPE_CHECKING:
    from rig.gap.hypotheses.library import Effect
    from rig.model.effect_stages import EffectParameter


def check_effects(names: Sequence[str]) -> None:
    """ConfigError for a name that is not in the library."""
    from rig.config import suggest
    from rig.gap.hypotheses.library import LIBRARY

    for name in names:
        if name not in LIBRARY:
            raise ConfigError(f"--effect: unknown effect {name!r}; {suggest(name, list(LIBRARY))}")


def sizes_of(effect: "Effect") -> "list[EffectParameter]":
    """Those numbers of its first law that a diagnosis finds."""
    stage = effect.laws[0].stage
    free = {name for law in effect.laws if law.stage == stage for name in law.free}
    return [number for number in _numbers(effect) if number.name in free]


def _numbers(effect: "Effect") -> "tuple[EffectParameter, ...]":
    from rig.model.effect_stages import EFFECT_STAGES

    return EFFECT_STAGES[effect.laws[0].stage].numbers


def report_effects() -> dict[str, Any]:
    """The JSON of `pamrig gap effects`."""
    from rig.gap.hypotheses.library import LIBRARY

    return {"effects": {name: _described(effect) for name, effect in LIBRARY.items()}}


def _described(effect: "Effect") -> dict[str, Any]:
    from rig.gap.hypotheses.library import alike

    return {
        "stage": effect.stage,
        "looks_like": effect.looks_like,
        "alike_angle_only": alike(effect.name, False),
        "alike_with_pressures": alike(effect.name, True),
        "parameters": {
            number.name: {
                "unit": number.unit,
                "low": number.low,
                "high": number.high,
                "neutral": number.neutral,
                "meaning": number.meaning,
            }
            for number in _numbers(effect)
        },
    }

"""Every unmodelled effect as a stage of the simulator chain: one table for simulated rig, simulator and diagnosis.

The chain lays the stages into its slots; what an effect looks like and what it is mistaken for is written in
`rig.gap.hypotheses.library`.
"""

from collections.abc import Mapping
from typing import Any, Final

from rig import plugins
from rig.errors import ConfigError
from rig.model.effect_stages.stage import WHOLE_SESSION, EffectParameter, EffectStage, goes_on
from rig.model.effect_stages.table import FORMER_NAMES, OWN_STAGES


def _stage_of(key: str, module: Any) -> EffectStage:
    stage = getattr(module, "STAGE", None)
    if not isinstance(stage, EffectStage):
        raise ConfigError(f"effect {key}: its module has no STAGE of the type rig.model.effect_stages.EffectStage")
    return stage


EFFECT_STAGES: Final[Mapping[str, EffectStage]] = plugins.Registered(OWN_STAGES, plugins.EFFECTS, _stage_of)
"""Key -> stage, of pamrig and of what is installed beside it."""

__all__ = ["EFFECT_STAGES", "FORMER_NAMES", "WHOLE_SESSION", "EffectParameter", "EffectStage", "goes_on"]

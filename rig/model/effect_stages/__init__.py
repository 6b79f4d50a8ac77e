"""Every unmodelled effect as a stage of the simulator chain: one table for simulated rig, simulator and diagnosis.

The chain lays the stages into its slots; what an effect looks like and what it is mistaken for is written in `rig.gap.effects`.
"""

from rig.model.effect_stages.table import EFFECT_STAGES, EffectParameter, EffectStage

__all__ = ["EFFECT_STAGES", "EffectParameter", "EffectStage"]

"""The effects a machine may have and a simulator may lack."""

from axisight.effects.effect import Effect, EffectTuple, core_effects, effect_of_core
from axisight.effects.table import EffectInfo, EffectParameter, effect_info, effect_table

__all__ = [
    "Effect",
    "EffectInfo",
    "EffectParameter",
    "EffectTuple",
    "core_effects",
    "effect_info",
    "effect_of_core",
    "effect_table",
]

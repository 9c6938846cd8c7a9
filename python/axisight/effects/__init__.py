"""The effects a machine may have and a simulator may lack."""

from axisight.effects.effect import Effect, EffectTuple, core_effects, effect_of_core
from axisight.effects.ripple import Harmonic, resolver_ripple, torque_ripple
from axisight.effects.stated import of_rigid_bodies, on_every_machine
from axisight.effects.table import EffectInfo, EffectParameter, effect_info, effect_table
from axisight.effects.words import article, noun, phrase, title

__all__ = [
    "Effect",
    "EffectInfo",
    "EffectParameter",
    "EffectTuple",
    "Harmonic",
    "article",
    "core_effects",
    "effect_info",
    "effect_of_core",
    "effect_table",
    "noun",
    "of_rigid_bodies",
    "on_every_machine",
    "phrase",
    "resolver_ripple",
    "title",
    "torque_ripple",
]

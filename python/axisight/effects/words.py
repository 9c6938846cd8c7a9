"""Effects in sentences: noun, article and capitals, derived from the name of any effect."""

from __future__ import annotations

import re

from axisight.effects.table import effect_info

_WORDS = {"coulomb": "Coulomb", "stribeck": "Stribeck", "com": "centre of mass"}

# Last words of names that take no article: "friction", but "a delay".
_UNCOUNTED = re.compile(
    r"\b(friction|backlash|play|stiffness|damping|inertia|ripple|drag|saturation|compensation"
    r"|hysteresis|compliance|coupling|quantization|eccentricity|motion|geometry|tilt|drift"
    r"|sag|warmup)$"
)


def noun(name: str) -> str:
    """Return a name as words: ``coulomb_friction`` becomes ``Coulomb friction``."""
    words = [_WORDS.get(word, word) for word in name.split("_")]
    return " ".join(words).replace(" dependent", "-dependent").strip()


def title(name: str) -> str:
    """Return a name as words with a capital first letter: ``Input delay``."""
    text = noun(name)
    return text[:1].upper() + text[1:]


def article(name: str) -> str:
    """Return the article before an effect's noun: ``a``, ``an``, ``the machine's`` or nothing.

    ``the machine's`` stands for effects that change a value of every simulator: a link of the arm, or a
    relative change such as stiffness or torque constant. Raises InputError for an unknown effect.
    """
    info = effect_info(name)
    of_a_link = info.scope == "axis" and info.family == "load"
    if of_a_link or info.parameters[0].name.startswith("relative_"):
        return "the machine's"
    words = noun(name)
    if _UNCOUNTED.search(words):
        return ""
    return "an" if words[0].lower() in "aeiou" else "a"


def phrase(name: str) -> str:
    """Return an effect as the missing thing: ``a payload``, ``backlash``, ``an input delay``.

    Raises InputError for an unknown effect.
    """
    return f"{article(name)} {noun(name)}".strip()

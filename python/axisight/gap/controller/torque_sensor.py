"""A torque that is reported too large: what looks like two causes and is one.

Where a drive reports a constant share of its torque, the logs show both gains of the controller off by
that share, and the machine a torque constant off by its inverse. Three numbers that agree are no chance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from axisight.effects import Effect, effect_info
from axisight.effects.stated import OTHER_GAINS, TORQUE_CONSTANT, TORQUE_SENSOR
from axisight.gap.facts.algebraic_cause import AlgebraicCause
from axisight.gap.facts.named_cause import NamedCause
from axisight.gap.facts.settings import Settings

# The gains agree to this share, and the torque constant with their inverse to that.
_SAME_GAINS = 0.008
_INVERSE = 0.02
# Tolerances of an inertia up to which a torque constant may pass for it: three go unseen, five where logs are few.
_EDGE = 5.0
# Gains alone agree to this share of theirs: of two that were set, one in fifty would.
_ALONE = 0.02


def with_torque_sensors(
    causes: Sequence[NamedCause], effects: Sequence[Effect]
) -> tuple[tuple[NamedCause, ...], tuple[Effect, ...]]:
    """Return causes and effects with one in the place of each such pair."""
    kept, acting = list(causes), list(effects)
    for gains in [c for c in causes if c.effect == OTHER_GAINS[0]]:
        found = sensor_of(gains, kept)
        if found is None:
            continue
        one = found[1]
        gone = {(gains.effect, gains.axis), (TORQUE_CONSTANT[0], gains.axis)}
        kept = [one, *(c for c in kept if (c.effect, c.axis) not in gone)]
        value = {TORQUE_SENSOR[1]: one.parameters[TORQUE_SENSOR[1]].value}
        acting = [e for e in acting if (e.name, e.axis) not in gone]
        acting = [Effect(TORQUE_SENSOR[0], gains.axis, value), *acting]
    return tuple(kept), tuple(acting)


def sensor_of(gains: NamedCause, causes: Sequence[NamedCause]) -> tuple[int, NamedCause] | None:
    """Return which of ``causes`` is the torque constant that makes gains those of a torque sensor, and that."""
    for place, cause in enumerate(causes):
        if (cause.effect, cause.axis) == (TORQUE_CONSTANT[0], gains.axis) and _agree(gains, cause):
            return place, _sensor(gains, cause)
    return None


def share_reported(cause: AlgebraicCause) -> float | None:
    """Return the share by which a torque is reported too large, where both gains are off by one; else None."""
    if cause.name != OTHER_GAINS[0] or not cause.values.keys() >= set(OTHER_GAINS[1]):
        return None
    proportional, integral = (cause.values[name].value for name in OTHER_GAINS[1])
    return proportional if abs(proportional - integral) < _SAME_GAINS else None


@dataclass(frozen=True)
class Asked:
    """What the controller's law asks for of the machine: an effect with its value.

    ``share`` by which a drive reports its torque too large.
    """

    effect: Effect
    share: float

    def off(self, found: Effect) -> float:
        """Return by what share the effect that a fit found is off the one asked for [1]."""
        (error,) = found.values()
        return abs((1 + error) * (1 + self.share) - 1)


def asked_of_motion(shown: Sequence[AlgebraicCause]) -> dict[str, Asked]:
    """Return what the machine's motion shows of torques that are reported wrong, by label.

    A drive that reports a share of its torque: of a torque constant the inverse of that.
    """
    out = {}
    for cause in shown:
        share = share_reported(cause)
        if share is not None:
            value = 1 / (1 + share) - 1
            effect = Effect(TORQUE_CONSTANT[0], cause.axis, {TORQUE_CONSTANT[1]: value})
            out[effect.label] = Asked(effect, share)
    return out


def unseen_constant(settings: Settings) -> float:
    """Return up to which share a torque constant may not show."""
    return _EDGE * (settings.tolerances or {}).get("motor_inertia", 0.0)


def either(causes: Sequence[NamedCause], unseen: float) -> tuple[tuple[str, str], ...]:
    """Return the labels of gains that may be a torque sensor's, each with that.

    Both are off by one share, and by so little that a torque constant, which is ``unseen`` up to that
    share, would not show.
    """
    alone = [c for c in causes if c.effect == OTHER_GAINS[0] and _small_and_one(c, unseen)]
    return tuple((c.label, Effect(TORQUE_SENSOR[0], c.axis).label) for c in alone)


def _has_both(gains: NamedCause) -> bool:
    """Whether both gains were found and no other: to positions others are fitted, without a torque sensor."""
    return gains.parameters.keys() == set(OTHER_GAINS[1])


def _small_and_one(gains: NamedCause, unseen: float) -> bool:
    if not _has_both(gains):
        return False
    proportional, integral = (gains.parameters[name].value for name in OTHER_GAINS[1])
    size = max(abs(proportional), abs(integral))
    return abs(proportional - integral) < _ALONE * size < _ALONE * unseen


def _agree(gains: NamedCause, constant: NamedCause) -> bool:
    """Whether both gains are off by one share, and the torque constant by its inverse."""
    if not _has_both(gains):
        return False
    proportional, integral = (gains.parameters[name] for name in OTHER_GAINS[1])
    error = constant.parameters[TORQUE_CONSTANT[1]]
    doubt = max(_INVERSE, error.high - error.value)
    same = abs(proportional.value - integral.value) < _SAME_GAINS
    return same and abs((1 + error.value) * (1 + proportional.value) - 1) < doubt


def _sensor(gains: NamedCause, constant: NamedCause) -> NamedCause:
    info = effect_info(TORQUE_SENSOR[0])
    sure = min(gains.probability, constant.probability)
    return NamedCause(
        info.name,
        gains.axis,
        sure,
        {TORQUE_SENSOR[1]: gains.parameters[OTHER_GAINS[1][0]]},
        {p.name: p.unit for p in info.parameters},
        info.family,
        sure,
    )

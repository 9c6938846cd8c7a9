"""A torque that is reported too large: one cause that looks like two.

If a drive reports its torque too large by a constant share, both gains of the controller seem off by that
share, and the machine's torque constant by the inverse. Three numbers that agree are no coincidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from axisight.effects import Effect, effect_info
from axisight.effects.stated import OTHER_GAINS, TORQUE_CONSTANT, TORQUE_SENSOR
from axisight.gap.facts.algebraic_cause import AlgebraicCause
from axisight.gap.facts.named_cause import NamedCause
from axisight.gap.facts.settings import Settings

# Largest difference of the two gain errors [1].
_SAME_GAINS = 0.008
# Largest difference of the torque constant from the inverse of the gain errors [1].
_INVERSE = 0.02
# Tolerances of the motor inertia by which a torque constant may be off without being seen as a cause. Usually
# three are absorbed by the inertia; with few logs, five.
_EDGE = 5.0
# Largest difference of the two gain errors, relative to them, if no torque constant was found. Two unrelated
# errors agree so well in one of fifty cases.
_ALONE = 0.02


def with_torque_sensors(
    causes: Sequence[NamedCause], effects: Sequence[Effect]
) -> tuple[tuple[NamedCause, ...], tuple[Effect, ...]]:
    """Return causes and effects with each pair of other gains and torque constant replaced by a torque sensor."""
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
    """Return the torque sensor for other gains, and the index in ``causes`` of the torque constant that belongs to it.

    None if no torque constant agrees with the gains.
    """
    for place, cause in enumerate(causes):
        if (cause.effect, cause.axis) == (TORQUE_CONSTANT[0], gains.axis) and _agree(gains, cause):
            return place, _sensor(gains, cause)
    return None


def share_reported(cause: AlgebraicCause) -> float | None:
    """Return the share by which a torque is reported too large; None if the two gains are not off by one share."""
    if cause.name != OTHER_GAINS[0] or not cause.values.keys() >= set(OTHER_GAINS[1]):
        return None
    proportional, integral = (cause.values[name].value for name in OTHER_GAINS[1])
    return proportional if abs(proportional - integral) < _SAME_GAINS else None


@dataclass(frozen=True)
class Asked:
    """The effect, with its value, that the motion must show if a drive reports its torque too large by ``share``."""

    effect: Effect
    share: float

    def off(self, found: Effect) -> float:
        """Return the relative difference between a fitted effect and the expected one [1]."""
        (error,) = found.values()
        return abs((1 + error) * (1 + self.share) - 1)


def asked_of_motion(shown: Sequence[AlgebraicCause]) -> dict[str, Asked]:
    """Return the effects that the motion must show if other gains are a wrong torque sensor, by label.

    A torque reported too large by a share looks like a torque constant off by the inverse.
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
    """Return the largest error of a torque constant [1] that may stay unseen."""
    return _EDGE * (settings.tolerances or {}).get("motor_inertia", 0.0)


def either(causes: Sequence[NamedCause], unseen: float) -> tuple[tuple[str, str], ...]:
    """Return the labels of other gains that may be a wrong torque sensor, each with the label of that sensor.

    Both gains are off by the same share. It is so small that the torque constant of a wrong sensor, ``unseen``
    up to that share, would not show.
    """
    alone = [c for c in causes if c.effect == OTHER_GAINS[0] and _small_and_equal(c, unseen)]
    return tuple((c.label, Effect(TORQUE_SENSOR[0], c.axis).label) for c in alone)


def _has_both(gains: NamedCause) -> bool:
    """Whether exactly the two gains were found.

    Where positions are compared, other gains are fitted. A torque sensor does not show there.
    """
    return gains.parameters.keys() == set(OTHER_GAINS[1])


def _small_and_equal(gains: NamedCause, unseen: float) -> bool:
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

"""Says which law of the library comes nearest to a term of a remainder, and where they differ."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect, effect_info
from axisight.gap.facts.simulator_variant import AS_GIVEN, Variant
from axisight.gap.facts.wording import percent
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.modelled.records import course_of
from axisight.gap.signals.motion import Motion
from axisight.gap.simulator.rigid_torque import predicted_torque
from axisight.gap.views.inverse_dynamics import InverseView
from axisight.remainder import Motion as Course
from axisight.remainder import Remainder, Term
from axisight.remainder.variables import VARIABLES
from axisight.robot import Robot

Array = NDArray[np.float64]

# Size of an effect whose torque is compared; only its shape counts.
_SIZE = 1e-3
# Share of a term's squared torque from which a law is named as the nearest one.
_NEAR = 0.2
# Share by which a law must be nearer than one before it in the library's order, which begins with plain laws.
_CLEARLY = 0.02
# Share above which a term and a law are the same.
_SAME = 0.95


def with_nearest_laws(fitted: Remainder, view: InverseView, model: FittedModel) -> Remainder:
    """Return the remainder with hints that name the nearest law of the library for each term.

    ``model``: a fit of the view, from whose residual the laws get the start values of their shapes.
    """
    courses = _Courses.of(view)
    laws = {
        axis: list(_laws(axis, view, model, courses))
        for axis in sorted({t.axis for t in fitted.terms})
    }
    terms = tuple(replace(t, hint=_hint(t, courses, laws[t.axis])) for t in fitted.terms)
    return replace(fitted, terms=terms)


@dataclass(frozen=True, eq=False)
class _Courses:
    """The motions of the estimation logs, as filtered and as terms see them, with the bare robot's torque."""

    filtered: Sequence[Motion]
    seen: Sequence[Course]
    bare: Robot

    @classmethod
    def of(cls, view: InverseView) -> _Courses:
        bare = view.robot.with_effects([])
        filtered = [view.filtering(log) for log in view.logs]
        loads = [predicted_torque(bare, AS_GIVEN, at) for at in filtered]
        seen = [course_of(view, log, load) for log, load in zip(view.logs, loads, strict=True)]
        return cls(filtered, seen, bare)

    def along(self, effect: Effect, axis: int) -> Array:
        """Return the torque (n,) [Nm] that an effect adds to an axis (from 1) along all motions."""
        variant = Variant({}, (effect,))
        return np.concatenate(
            [
                predicted_torque(self.bare, variant, at)[:, axis - 1]
                - predicted_torque(self.bare, AS_GIVEN, at)[:, axis - 1]
                for at in self.filtered
            ]
        )


@dataclass(frozen=True, eq=False)
class _Law:
    """A law of the library with its torques (n, m) by unit of each amplitude."""

    name: str
    columns: Array


def _laws(axis: int, view: InverseView, model: FittedModel, courses: _Courses) -> Iterator[_Law]:
    for candidate in view.candidates(model, axes=[axis]):
        effect, info = candidate.effect, effect_info(candidate.effect.name)
        if effect.axis != axis:
            continue
        sizes = [p.name for p in info.parameters if p.role == "amplitude" and p.neutral == 0]
        shaped = effect.with_values(dict.fromkeys(sizes, 0.0))
        torques = [courses.along(shaped.with_values({name: _SIZE}), axis) for name in sizes]
        columns = np.stack([t for t in torques if np.any(t)] or [np.zeros(1)], axis=1)
        if len(columns) > 1:
            yield _Law(effect.name, columns)


def _hint(term: Term, courses: _Courses, laws: Sequence[_Law]) -> str:
    torque = np.concatenate([term.torque(course) for course in courses.seen])
    size = float(torque @ torque)
    best, share, left = "", _NEAR, torque
    for law in laws:
        rest = torque - law.columns @ np.linalg.lstsq(law.columns, torque, rcond=None)[0]
        explained = 1 - float(rest @ rest) / max(size, 1e-300)
        if explained > share + _CLEARLY:
            best, share, left = law.name, explained, rest
    if not best:
        return f"{term.hint}; no law of the library comes near"
    near = f"{term.hint}; nearest law: {best}, {percent(share)} of it"
    return near if share > _SAME else f"{near}; differs {_where(term, left, courses)}"


def _where(term: Term, left: Array, courses: _Courses) -> str:
    """Return where most of a difference (n,) lies: the direction of motion or the part of the variable's range."""
    variable = VARIABLES[term.variable]
    x = np.concatenate([variable.read(course, term.of_axis - 1) for course in courses.seen])
    way = np.concatenate([course.velocity_rad_s[:, term.axis - 1] for course in courses.seen])
    parts = {
        "in forward motion": way > 0,
        "in backward motion": way < 0,
    }
    if np.ptp(x) > 0:
        low, high = np.quantile(x, [1 / 3, 2 / 3])
        unit = variable.unit
        parts |= {
            f"where the {variable.words} is below {low:.3g} {unit}": x < low,
            f"where the {variable.words} is above {high:.3g} {unit}": x > high,
            f"where the {variable.words} is from {low:.3g} to {high:.3g} {unit}": (x >= low)
            & (x <= high),
        }
    means = {words: float(np.mean(left[at] ** 2)) for words, at in parts.items() if at.any()}
    return f"most {max(means, key=lambda words: means[words])}"

"""Parts that the code of all projects shares: its head, tables of numbers, names of joints and bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.posterior.randomization.fields import Fields, RandomizedField
from axisight.posterior.result import Posterior
from axisight.posterior.sampling import square_root

Array = NDArray[np.float64]

ON_DRIVE = ("armature", "damping", "frictionloss")
"""Kinds of the joint that a motor drives; with an elastic gear in the model it is one of its own."""
ON_BODY = ("mass", "inertia")
ON_GEAR = ("spring", "gear_stiffness", "gear_damping")
ON_ACTUATOR = ("kp", "kd", "torque", "force_limit")

# Standard deviations within which a joint draw stays.
_REACH = 3.0
_WIDTH = 96


@dataclass(frozen=True)
class Layout:
    """What the code of a project is made from; ``elastic``: whether models have a joint for each elastic gear."""

    title: str
    posterior: Posterior
    fields: Fields
    homeless: Mapping[str, str]
    elastic: bool

    @property
    def mode(self) -> str:
        """When the joint draw happens: at every reset if one of its numbers varies between runs, else once."""
        return mode_of([self.fields.every[i] for i in self.fields.together])

    def head(self) -> str:
        """Return the docstring of the code: origin, units, correlations, numbers without a home."""
        one = self.posterior
        lines = [
            f'"""Parameters of {one.simulated.robot} for {self.title}, from the posterior of {one.name}.',
            "",
            f"Written by axisight {one.version}. All numbers are on the joint side, in SI units; mass, inertia, kp, kd",
            "and torque are factors on the values of the model. A range holds 95 %.",
            "",
            *self._hypotheses(),
            "Numbers, whether they really vary between runs, and what they correlate with beyond 0.5:",
            "",
            *(_row(f) for f in self.fields.every),
            "",
        ]
        if self.homeless:
            lines += [f"No home in {self.title}, so not randomised here:", ""]
            lines += [f"- {name}: {why}." for name, why in self.homeless.items()]
            lines.append("")
        lines[-1] = '"""'
        return "\n".join(line.replace("\\", "\\\\") for line in lines) + "\n"

    def _hypotheses(self) -> list[str]:
        rivals = self.posterior.hypotheses
        if len(rivals) == 1:
            return []
        said = [f"{' + '.join(h.causes) or 'no cause'} ({h.weight:.2f})" for h in rivals]
        return [f"The verdict leaves these open, and every draw takes one: {'; '.join(said)}.", ""]

    def names(self, *, actuators_by_joint: bool = False) -> str:
        """Return the dictionaries of names that users adapt to their model.

        ``actuators_by_joint``: actuators are named by the joint that they drive.
        """
        drive = "motor of {}" if self.elastic else "{}"
        tables = {
            "DRIVES": (ON_DRIVE, drive, "driven joints"),
            "GEARS": (ON_GEAR, "{}", "joints with a spring"),
            "BODIES": (ON_BODY, "link of {}", "bodies, by the joint that moves them"),
            "ACTUATORS": (ON_ACTUATOR, "{}", "actuators, by their joint"),
        }
        if actuators_by_joint:
            tables["ACTUATORS"] = (ON_ACTUATOR, drive, "joints that actuators drive")
        rigid = {a.joint for a in self.posterior.simulated.axes if not a.elastic}
        out = ["# Names in your model, as axisight.to_mujoco writes them: change the right side.\n"]
        for table, (kinds, pattern, words) in tables.items():
            joints = dict.fromkeys(f.joint for f in self.fields.every if f.kind in kinds)
            if joints:
                rows = {
                    j: (j if j in rigid and table != "BODIES" else pattern.format(j))
                    for j in joints
                }
                out.append(f"{table} = {{  # {words}\n{_entries(rows)}}}\n")
        return "".join(out)

    def together(self) -> str:
        """Return the constants of the joint draw; empty if there is none."""
        place = self.fields.together
        if not place:
            return ""
        pick = np.ix_(place, place)
        roots = [square_root(c[pick]) for c in self.fields.covariances]
        used = [self.fields.every[i] for i in place]
        rows = "".join(
            f"    ({f.kind!r}, {f.joint!r}),  # {f.unit}; varies between runs: {f.varies}\n"
            for f in used
        )
        low, high = _limits(self.fields, place)
        return (
            "# Drawn together: (kind, joint), in the order of the columns below.\n"
            f"TOGETHER = [\n{rows}]\n"
            "# One row for each hypothesis; each of ROOTS times its transpose is a covariance.\n"
            f"WEIGHTS = {_literal(self.fields.weights)}\n"
            f"MEANS = {_matrix(self.fields.means[:, place])}\n"
            f"ROOTS = [\n{''.join(f'    {_matrix(r, 4)},{chr(10)}' for r in roots)}]\n"
            f"LOW = {_literal(low)}\n"
            f"HIGH = {_literal(high)}\n"
        )


def mode_of(fields: Sequence[RandomizedField]) -> str:
    """Return the event mode: ``reset`` for what varies between runs, ``startup`` for what is only unknown."""
    return "reset" if any(f.varies == "yes" for f in fields) else "startup"


def plain(value: float) -> str:
    """Return a number with six digits."""
    return repr(float(f"{value:.6g}"))


def _limits(fields: Fields, place: Sequence[int]) -> tuple[Array, Array]:
    """Return three standard deviations to both sides, within the bounds that the ranges keep."""
    low, high = [], []
    for i in place:
        f = fields.every[i]
        cut_low, cut_high = f.low > f.mean - 1.9 * f.std, f.high < f.mean + 1.9 * f.std
        low.append(f.low if cut_low else max(f.mean - _REACH * f.std, 0.0))
        high.append(f.high if cut_high else f.mean + _REACH * f.std)
    return np.array(low), np.array(high)


def _row(f: RandomizedField) -> str:
    unit = "times" if f.unit == "1" else f.unit
    beside = ", ".join(f"{name} ({x:+.2f})" for name, x in f.with_others)
    tied = f"; correlated with {beside}" if beside else ""
    return f"- {f.label}: {f.low:.4g} to {f.high:.4g} {unit}; varies: {f.varies}{tied}; from {', '.join(f.parameters)}."


def _entries(rows: Mapping[str, str]) -> str:
    return "".join(f"    {key!r}: {value!r},\n" for key, value in rows.items())


def _literal(values: Array) -> str:
    return f"[{', '.join(plain(x) for x in values)}]"


def _matrix(rows: Array, indent: int = 0) -> str:
    pad = " " * indent
    return "[\n" + "".join(f"{pad}    {_literal(row)},\n" for row in rows) + f"{pad}]"

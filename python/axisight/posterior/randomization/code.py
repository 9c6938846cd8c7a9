"""Python code with which training environments of a project draw parameters from a posterior."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from axisight.arguments import instance, one_of, path_of, switch
from axisight.display.summary import summarized
from axisight.posterior.randomization.fields import Fields, RandomizedField, fields_of
from axisight.posterior.randomization.homes import Kind, homes
from axisight.posterior.randomization.isaac_lab import isaac_lab
from axisight.posterior.randomization.layout import Layout
from axisight.posterior.randomization.mjlab import mjlab
from axisight.posterior.randomization.playground import playground
from axisight.posterior.result import Posterior
from axisight.storage import write_whole


@dataclass(frozen=True)
class _Project:
    """A project: how it is called, what writes its code, kinds without a range function, kinds without a home."""

    title: str
    write: Callable[[Layout], str]
    no_range: frozenset[Kind]
    no_home: Mapping[Kind, str]


_PROJECTS: Mapping[str, _Project] = {
    # Gains, and the factor on the torque, share the numbers of an actuator.
    "mjlab": _Project(
        "mjlab 1.6", mjlab, frozenset({"inertia", "kp", "kd", "torque", "force_limit"}), {}
    ),
    "playground": _Project("MuJoCo Playground 0.2", playground, frozenset(), {}),
    # `randomize_joint_parameters` would write dry friction into the viscous coefficient, too.
    "isaaclab": _Project(
        "Isaac Lab 2.3",
        isaac_lab,
        frozenset({"damping", "frictionloss", "kp", "kd"}),
        {
            "inertia": "Isaac Lab has no event for the inertia alone",
            "spring": "PhysX has no spring in a joint beside its drive",
            "gear_stiffness": "PhysX has no spring in a joint beside its drive",
            "gear_damping": "PhysX has no spring in a joint beside its drive",
            "torque": "Isaac Lab has no factor on the torque of a motor; scale both gains of a servo by hand",
            "force_limit": "the limit stands in the actuator model (effort_limit), which draws nothing",
        },
    ),
}

PROJECTS: tuple[str, ...] = tuple(_PROJECTS)
"""Names of the projects that `randomization` writes code for."""


@summarized
@dataclass(frozen=True)
class Randomization:
    """Ranges and joint draws for one project.

    - ``fields``: the numbers that are drawn. ``without_home``: parameters that this project has no number for, with
      the reason.
    - ``text``: Python source. It states units, which numbers vary between runs, which are correlated, and
      ``without_home``.
    """

    project: str
    fields: tuple[RandomizedField, ...]
    without_home: Mapping[str, str]
    text: str

    def save(self, path: Path | str) -> Path:
        """Write the source as a file, whole or not at all, and return its path; raises OutputError."""
        target = path_of("path", path)
        write_whole(target, self.text)
        return target

    def _summary(self) -> tuple[str, list[tuple[str, str]]]:
        """Return title and rows of the repr."""
        rows = [
            (f.label, f"{f.low:.4g} to {f.high:.4g} {f.unit}, varies between runs: {f.varies}")
            for f in self.fields
        ]
        rows += [(name, f"no home: {why}") for name, why in self.without_home.items()]
        return f"Randomization for {self.project}", rows


def randomization(
    posterior: Posterior, project: str, *, elastic_gears: bool = False
) -> Randomization:
    """Return ranges and joint draws of the simulator's numbers for one of `PROJECTS`.

    Motor-side values are converted to the joint side: inertia and viscous friction by 1/r^2, dry friction and torque
    limits by 1/r, with r the joint angle over the motor angle. A number that correlates with no other beyond 0.5 has a
    uniform range that holds 95 %. All others are drawn together from the Gaussian, as are all if rivals are open. The
    distribution has the error of formulas and, for parameters that vary, the variation between runs.

    posterior
        Posterior of a diagnosis.
    project
        ``mjlab``, ``playground`` (MuJoCo Playground) or ``isaaclab`` (Isaac Lab).
    elastic_gears
        The model has two joints for each axis with an elastic gear, as `axisight.to_mujoco` writes it. Stiffness and
        damping of gears then have a home in MuJoCo.

    Raises InputError for an unknown project.
    """
    known = instance("posterior", posterior, Posterior)
    chosen = _PROJECTS[one_of("project", project, PROJECTS)]
    elastic = switch("elastic_gears", elastic_gears)
    numbers, homeless = homes(known, elastic_gears=elastic)
    placed = [n for n in numbers if n.kind not in chosen.no_home]
    for number in numbers:
        if number.kind in chosen.no_home:
            homeless |= dict.fromkeys(number.terms, chosen.no_home[number.kind])
    fields: Fields = fields_of(known, placed, no_range=chosen.no_range)
    layout = Layout(chosen.title, known, fields, homeless, elastic)
    return Randomization(project, fields.every, homeless, chosen.write(layout))

"""The three steps of chapter 9 for all axes of an arm together.

Wernholt (2004), section 9.3 for one axis; section 9.6 proposes it for several.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

from axisight.arguments import Lines, did_you_mean, instance, several
from axisight.display import html
from axisight.display.summary import summarized
from axisight.effects import Effect, effect_info
from axisight.errors import InputError
from axisight.fitting import FitOptions, Parameter
from axisight.graybox.multiaxis.elastic_step import ElasticStep, elastic_step
from axisight.graybox.multiaxis.findings import between_steps
from axisight.graybox.multiaxis.joint_step import JointStep, best_joint_step, check_logs
from axisight.graybox.multiaxis.operating_points import OperatingPoint, operating_points
from axisight.graybox.multiaxis.report import report
from axisight.graybox.multiaxis.rigid_step import RigidStep, rigid_step
from axisight.logs import Log
from axisight.robot import Robot

USUAL_PARAMETERS = ("*.stiffness", "*.damping", "*.motor_inertia", "*.viscous_friction")
"""Patterns of the parameters that `identify_robot` fits unless told otherwise."""


@summarized
@dataclass(frozen=True)
class RobotIdentification:
    """Result of :func:`identify_robot`: the values of each step.

    rigid, elastic, joint
        Results of steps 1, 2 and 3.
    logs
        Names of all logs of step 3, slow ones first.
    robot
        The robot with the values of step 3; ``effects`` are those of its model, with Coulomb friction.
    findings
        What to read before using the values.
    """

    rigid: RigidStep
    elastic: ElasticStep
    joint: JointStep
    logs: tuple[str, ...]
    findings: tuple[str, ...]

    @property
    def robot(self) -> Robot:
        """The robot with the values of step 3."""
        return self.joint.robot

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects of the model of step 3, with their fitted values."""
        return self.joint.effects

    @property
    def status(self) -> str:
        """The status of the fit of step 3, as in `axisight.Fitted`."""
        return self.joint.fit.status

    def _repr_html_(self) -> str:
        """Return the values of step 3 and the findings, for notebooks."""
        return self.joint.fit._repr_html_() + html.lines(self.findings)

    def report(self) -> str:
        """Return the values of each step, the fit of each log, and findings as text."""
        return report(self.rigid, self.elastic, self.joint, self.logs, self.findings)


def identify_robot(
    robot: Robot,
    broadband: Sequence[Log],
    *,
    slow: Sequence[Log] = (),
    parameters: Sequence[str | Parameter] = USUAL_PARAMETERS,
    effects: Sequence[Effect] = (),
    coulomb: bool = True,
    bodies: bool = False,
    responses: bool = True,
    period_s: float | None = None,
    lines: Sequence[int] | Lines | None = None,
    drop_periods: int | None = None,
    cutoff_hz: float = 10.0,
    options: FitOptions | None = None,
    seed: int = 0,
) -> RobotIdentification:
    """Identify elastic parameters, motors and friction of all axes from motor-side logs.

    Step 1 finds friction, and with ``bodies`` masses and inertias, from the slow logs by regression. Step 2
    fits the elastic parameters to the frequency responses of the broadband logs, at all operating points
    together. Step 3 fits everything to all logs in the time domain, in closed loop if robot and logs allow it
    (`axisight.fit`), with residuals weighted by their spectrum. Wernholt (2004), section 9.3.

    Joint encoders (``joint_position_rad``) and accelerometers (``acceleration_m_s2``) of the logs are compared
    too. Logs may have different loads.

    Parameters
    ----------
    robot : structure and first values. Its controller is needed for logs with velocity references.
    broadband : periodic logs from rest. A pose and load gives a response if it has as many logs with
        different excitations as the arm has axes.
    slow : slow motions in both directions, for step 1.
    parameters : robot parameters to fit, by name or pattern (``axis*.stiffness``), and
        :class:`axisight.Parameter` for step 3, of the robot or of ``effects``.
    effects : further effects of the model in step 3.
    coulomb : whether the model gets a Coulomb friction on every axis that has no dry friction yet.
    bodies : whether step 1 replaces masses and inertias.
    responses : whether to perform step 2. Without it, step 3 starts from the robot's values.
    period_s, lines, drop_periods : excitation, see :func:`axisight.records.prepare_records`.
    cutoff_hz : low-pass filter of step 1 [Hz].
    options : settings of the fits of step 3.
    seed : seed of the random starts of step 2.

    Raises InputError for misuse and as the three steps do. Non-convergence is a status.

    """
    given = [instance("broadband", log, Log) for log in several("broadband", broadband)]
    calm = [instance("slow", log, Log) for log in several("slow", slow)]
    if not given:
        raise InputError("broadband: expected at least one log, got none")
    check_logs(robot, [*calm, *given])
    names, more = _chosen(robot, parameters)
    logs = [*calm, *given]
    first = rigid_step(robot, calm, given, bodies=bodies, cutoff_hz=cutoff_hz)
    found, lost = (
        operating_points(robot, given, period_s=period_s, lines=lines, drop_periods=drop_periods)
        if responses
        else ([], [])
    )
    second = elastic_step(first.robot, found, names, seed=seed)
    acting = robot.placed(effects)
    if coulomb:
        acting += _missing_friction(robot, acting, first)
    third = best_joint_step(
        [second.robot, *second.others],
        logs,
        names,
        acting,
        more,
        options=options or FitOptions(),
    )
    findings = (
        *first.findings,
        *lost,
        *_of_points(found),
        *second.findings,
        *third.findings,
        *between_steps(second, third, [log.name for log in logs]),
    )
    return RobotIdentification(
        first, second, third, tuple(log.name for log in logs), tuple(dict.fromkeys(findings))
    )


def _of_points(points: Sequence[OperatingPoint]) -> list[str]:
    """Return the findings of the points, each once with the logs that it holds for."""
    logs: dict[str, list[str]] = {}
    for point in points:
        for text in point.findings:
            logs.setdefault(text, []).extend(point.logs)
    return [f"{', '.join(dict.fromkeys(names))}: {text}" for text, names in logs.items()]


def _missing_friction(robot: Robot, given: Sequence[Effect], first: RigidStep) -> list[Effect]:
    """Return the Coulomb frictions of step 1 on axes that have no dry friction."""
    rubbing = {
        e.axis for e in (*robot.effects, *given) if effect_info(e.name).law_of == "dry_friction"
    }
    return [e for e in first.effects if e.axis not in rubbing]


def _chosen(
    robot: Robot, parameters: Sequence[str | Parameter]
) -> tuple[list[str], list[Parameter]]:
    """Return the names that the patterns select, in the order of the robot, and given Parameters."""
    known = robot.parameters()
    wanted: set[str] = set()
    more = []
    for one in several("parameters", parameters):
        if isinstance(one, Parameter):
            more.append(one)
            continue
        pattern = str(one)
        # An axis with a rigid transmission has no stiffness, and a value of zero is no start.
        matched = [n for n in known if fnmatchcase(n, pattern) and (known[n] > 0 or n == pattern)]
        if not matched:
            raise InputError(
                f"parameters: expected names or patterns of {', '.join(known)}, got {pattern!r}"
                f"{did_you_mean(pattern, known)}"
            )
        wanted |= set(matched)
    return [n for n in known if n in wanted], more

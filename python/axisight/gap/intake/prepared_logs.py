"""Simulator and logs that passed the gate, ready for the comparison."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from axisight.errors import InputError
from axisight.fitting.simulation_error import is_closed_loop
from axisight.gap.controller.speed_loop import as_speed_loop
from axisight.gap.facts.compared_quantity import Compared
from axisight.gap.facts.faults import Finding
from axisight.gap.facts.result import Interval, Reproduction
from axisight.gap.facts.settings import Settings
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.gate import pass_gate, pass_gate_by_targets, silent_axes
from axisight.gap.intake import user_simulator
from axisight.gap.intake.start_of_logs import from_rest, loops_of
from axisight.gap.measure.gear_deflections import gears_seen, gears_that_differ
from axisight.gap.modelled.stated import SAYS as LESS_REMAINDER
from axisight.gap.modelled.stated import without_stated
from axisight.gap.prepare.currents import Nominal, in_torques
from axisight.gap.prepare.joint_encoders import without_unlike_encoders
from axisight.gap.prepare.position_targets import Commanded, with_commands
from axisight.gap.prepare.reconstructed_references import SAYS, with_references
from axisight.gap.prepare.start_elsewhere import begins_elsewhere, compared_later
from axisight.gap.prepare.start_elsewhere import said as begins_elsewhere_said
from axisight.gap.prepare.stiff_bristles import with_bristles_followed
from axisight.gap.prepare.torque_clock import TorqueClock, torque_clock, where_they_act
from axisight.gap.simulator.own_parameters import constant_name
from axisight.gap.simulator.start_poses import SAYS as FROM_OWN_POSES
from axisight.gap.simulator.start_poses import at_their_poses
from axisight.gap.views.choice import view_of
from axisight.gap.views.view import View
from axisight.logs import Log
from axisight.mujoco.rollout import SAYS as RUN_IN_MUJOCO
from axisight.mujoco.rollout import runs_in_mujoco
from axisight.robot import Robot


@dataclass(frozen=True)
class PreparedLogs:
    """A simulator and logs that passed the gate, ready for the comparison.

    - ``noted``: findings that were flagged.
    - ``commanded``: the logs with the controller's commands, if they have no torque.
    - ``recovered``: whether the references were reconstructed.
    - ``nominal``: the constants with which currents of unknown torque constants were read.
    - ``simulator``: how well the robot reproduces the user's own simulator, once that has been compared.
    - ``beside``: logs of the user's own simulator, cut like the measured ones.
    - ``in_mujoco``: whether these are runs in MuJoCo that the diagnosis made itself.
    - ``clock``: by how much torques act later than they were logged, where that was corrected.
    - ``less_remainder``: whether the logs are less the remainder that the robot file states.
    - ``silent``: axes (from 0) whose torque carries nothing; they are not judged.
    """

    robot: Robot
    estimation: list[Log]
    validation: list[Log]
    noted: tuple[Finding, ...]
    commanded: Commanded | None
    recovered: bool
    nominal: tuple[Nominal, ...] = ()
    simulator: Reproduction | None = None
    beside: tuple[Log, ...] = ()
    clock: TorqueClock | None = None
    in_mujoco: bool = False
    silent: tuple[int, ...] = ()
    less_remainder: bool = False

    def view(self, settings: Settings) -> View:
        """Return the comparison of simulator and logs."""
        return view_of(
            self.robot, self.estimation, self.validation, settings, self.commanded, self.silent
        )

    def compared(self, settings: Settings) -> tuple[PreparedLogs, View]:
        """Return the prepared logs and their comparison.

        If logs of the user's own simulator are given, the gap is that of this simulator. A remainder that the robot
        states is taken off the logs.
        """
        inputs, view = self, self.view(settings)
        if self.beside:
            inputs = self.against(view, self.beside, settings)
            view = inputs.view(settings)
        if self.robot.remainder is not None:
            logs = [*inputs.estimation, *inputs.validation]
            inputs = inputs.without_remainder(
                without_stated(logs, self.robot.remainder, view, settings)
            )
            view = inputs.view(settings)
        return inputs, view

    def against(self, view: View, simulated: Sequence[Log], settings: Settings) -> PreparedLogs:
        """Return the same with the gap of the user's own simulator, from its logs.

        Where the robot reproduces that simulator well enough, the difference of the two is subtracted from the
        logs.
        """
        logs, n = [*self.estimation, *self.validation], len(self.estimation)
        commanded = self.commanded
        if commanded is None:
            beside = user_simulator.paired(logs, simulated)
        else:
            as_logged = user_simulator.paired(commanded.as_logged(), simulated)
            beside = commanded.of(as_logged)
        off = user_simulator.difference(view, beside, settings)
        found = user_simulator.reproduction(view, logs, beside, off, settings)
        if found.taken_off:
            logs = off.taken_from(logs)
        if commanded is not None:
            # The controller's commands depend on the changed positions.
            commanded = commanded.along(logs)
            logs = list(commanded.logs)
        return replace(
            self,
            estimation=logs[:n],
            validation=logs[n:],
            noted=(*self.noted, *user_simulator.noted(found)),
            commanded=commanded,
            simulator=found,
        )

    def without_remainder(self, logs: Sequence[Log]) -> PreparedLogs:
        """Return the same with estimation and then validation ``logs`` without the robot's remainder."""
        n, robot = len(self.estimation), self.robot.with_remainder(None)
        return replace(
            self,
            robot=robot,
            estimation=list(logs[:n]),
            validation=list(logs[n:]),
            less_remainder=True,
        )

    def compared_later(self, view: View, baseline: FittedModel, settings: Settings) -> PreparedLogs:
        """Return the same with logs that are compared later where the machine begins elsewhere than the simulation.

        ``baseline``: the re-fitted simulator. The logs stay unchanged by inverse dynamics, and where positions or the
        user's own simulator are compared.
        """
        torques = view.mode == "closed_loop" and self.commanded is None and not self.beside
        floor = view.floor.expected[baseline.axis] * baseline.samples
        if not torques or not begins_elsewhere(
            self.robot, self.estimation, baseline, floor, settings
        ):
            return self
        logs = compared_later(loops_of(self.robot), [*self.estimation, *self.validation])
        if logs is None:
            return self
        n = len(self.estimation)
        noted = (*self.noted, begins_elsewhere_said(logs))
        return replace(self, estimation=logs[:n], validation=logs[n:], noted=noted)

    def with_effects_of(self, robot: Robot, why: Sequence[Finding]) -> PreparedLogs:
        """Return the same with a simulator that states its effects differently, and the findings about that."""
        commanded = None if self.commanded is None else replace(self.commanded, robot=robot)
        return replace(self, robot=robot, commanded=commanded, noted=(*self.noted, *why))

    def constants(self, refit: Mapping[str, Interval]) -> list[Finding]:
        """Return the findings about unknown torque constants after the re-fit."""
        return [n.finding(refit[constant_name(self.robot, n.axis)]) for n in self.nominal]

    def says(self, mode: str, compared: Compared) -> tuple[str, ...]:
        """Return sentences about how the logs were prepared."""
        own_poses = any(log.start_rad is not None and log.run_up is None for log in self.estimation)
        said = [
            LESS_REMAINDER if self.less_remainder else "",
            RUN_IN_MUJOCO if self.in_mujoco else "",
            "" if self.simulator is None else user_simulator.said(self.simulator, compared),
            FROM_OWN_POSES if own_poses and mode == "closed_loop" else "",
            SAYS if self.recovered else "",
            "" if self.clock is None else self.clock.says(),
        ]
        return (*filter(None, said), *gears_seen(self.robot, [*self.estimation, *self.validation]))


def behind_gate(
    robot: Robot,
    estimation: Sequence[Log],
    validation: Sequence[Log],
    despite: Collection[str],
    simulated: Sequence[Log] = (),
) -> PreparedLogs:
    """Return simulator and logs that passed the gate, with commands and references added if none were logged.

    ``despite`` as in `Settings`, ``simulated`` and errors as in `diagnose`. Without ``simulated``, an MJCF is run in
    MuJoCo, as far as `runs_in_mujoco` can.
    """
    # Whatever an import leaves out of an MJCF is in its runs in MuJoCo.
    in_mujoco = [] if simulated else runs_in_mujoco(robot, [*estimation, *validation])
    simulated = simulated or in_mujoco
    robot, slowed = with_bristles_followed(robot)
    read = in_torques(robot, estimation, validation)
    if read.nominal and simulated:
        raise InputError(
            'simulated: expected logs of torques beside logs of a simulator, got currents of scale = "unknown"'
        )
    begun = from_rest(robot, read.estimation, read.validation, simulated, despite)
    n = len(estimation)
    logs, aside = without_unlike_encoders(robot, [*begun.estimation, *begun.validation])
    robot = as_speed_loop(robot, logs)
    found, beside = (*slowed, *begun.findings, *aside), begun.simulated
    commanded = with_commands(robot, logs)
    silent: tuple[int, ...] = ()
    if commanded is not None:
        logged = commanded.as_logged()
        noted = pass_gate_by_targets(commanded.robot, logged[:n], logged[n:], despite)
        robot, logs = commanded.robot, list(commanded.logs)
        found, beside = (*found, *commanded.findings()), commanded.taken(beside)
    else:
        logs = at_their_poses(robot, logs)
        noted = pass_gate(robot, logs[:n], logs[n:], despite)
        silent = silent_axes(robot, logs)
    if silent:
        # Closed loop needs the torques of all axes.
        logs = [replace(log, velocity_ref_rad_s=None) for log in logs]
    recovered = None if silent else with_references(robot, logs)
    logs = logs if recovered is None else recovered
    noted = (*found, *noted, *gears_that_differ(robot, logs))
    # Logs of the user's own simulator may hold their commands, too: the difference of both is compared.
    inverse = commanded is None and not beside and not is_closed_loop(robot, logs)
    clock = torque_clock(robot, logs) if inverse else None
    if clock is not None:
        logs = where_they_act(logs, clock)
        # Nothing is wrong with commands that are held; late torques are a matter of the recorder.
        if clock.acts_later_s > 0:
            noted = tuple(f for f in noted if f.name != "time_shifted" or f.axis is not None)
    return PreparedLogs(
        robot,
        logs[:n],
        logs[n:],
        noted,
        commanded,
        recovered is not None,
        read.nominal,
        beside=tuple(beside),
        clock=clock,
        in_mujoco=bool(in_mujoco),
        silent=silent,
    )

"""Says how far gears deflect that have an encoder on either side, beside the simulator's gears."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np

from axisight.gap.facts.faults import Finding
from axisight.gap.facts.settings import Settings
from axisight.gap.facts.simulator_variant import Variant
from axisight.gap.signals.both_encoders import Swing, swings
from axisight.gap.signals.noise import white_std
from axisight.gap.simulator.gear_readings import gear_readings
from axisight.logs import Log
from axisight.robot import Robot


@dataclass(frozen=True)
class GearErrors:
    """Errors of a simulator's gears against what both encoders show on some logs, the axis (from 1) with most.

    ``before``, ``after``: rms of the readings' errors with the re-fitted simulator and with the causes, in standard
    deviations [1].
    """

    axis: int
    before: float
    after: float


def gear_errors(
    robot: Robot, logs: Sequence[Log], model_error: float, refitted: Variant, causes: Variant
) -> GearErrors | None:
    """Return the errors of gears on logs; None if no log shows an elastic gear from both sides."""
    readings = gear_readings(robot, logs, model_error)
    if readings is None:
        return None
    before, after = (readings.residual(v.robot_values, v.effects) for v in (refitted, causes))
    places = readings.axis
    rms = {int(i): float(np.sqrt(np.mean(before[places == i] ** 2))) for i in np.unique(places)}
    worst = max(rms, key=rms.__getitem__)
    left = float(np.sqrt(np.mean(after[places == worst] ** 2)))
    return GearErrors(worst + 1, rms[worst], left)


def gear_check(errors: GearErrors | None, settings: Settings) -> tuple[str, ...]:
    """Return a sentence about a gear whose errors are significant without the causes; else nothing."""
    if errors is None or errors.before <= settings.significance:
        return ()
    return (
        f"Both encoders contradict the gear of axis {errors.axis} by {errors.before:.1f} standard deviations without "
        f"the causes and by {errors.after:.1f} with them, on validation logs.",
    )


def gears_seen(robot: Robot, logs: Sequence[Log]) -> tuple[str, ...]:
    """Return a sentence for each axis whose gear deflection logs show, in the order of the axes."""
    found = _found(robot, logs)
    text = "Both encoders show the gear of axis {3} give way by {0} to either side, the simulator's by {1}{2}."
    return tuple(_said(text, robot, axis, swing) for axis, swing in found.items())


def gears_that_differ(robot: Robot, logs: Sequence[Log]) -> tuple[Finding, ...]:
    """Return a finding for each axis whose gear deflects otherwise than the simulator's.

    That is by more than half of the larger of the two, and by more than the noise of a reading.
    """
    found = _found(robot, logs)
    return tuple(
        Finding(
            "gear_gives_way",
            "flag",
            _said(
                "expected the gear to give way by {1} to either side, got {0}{2}",
                robot,
                axis,
                swing,
            ),
            axis=axis,
            field=f"joint_position_{axis}",
        )
        for axis, swing in found.items()
        if _differs(swing, _noise(robot, logs, axis))
    )


def _found(robot: Robot, logs: Sequence[Log]) -> dict[int, Swing]:
    """Return the swing of the gears by axis (from 1): medians over the logs."""
    each = [swings(log, robot) for log in logs]
    out = {}
    for axis in robot.axis_numbers():
        seen = [swing for row in each if (swing := row[axis - 1]) is not None]
        if seen:
            out[axis] = Swing(*map(float, np.median([astuple(s) for s in seen], axis=0)))
    return out


def _differs(swing: Swing, noise_rad: float) -> bool:
    apart = abs(swing.measured_rad - swing.simulated_rad)
    return apart > max(0.5 * max(abs(swing.measured_rad), swing.simulated_rad), noise_rad)


def _noise(robot: Robot, logs: Sequence[Log], axis: int) -> float:
    """Return the noise of a deflection as it is read [rad, joint side], the largest over the logs."""
    ratio = np.abs(robot.gear_ratio[axis - 1])
    return max(
        float(ratio * white_std(log.position_rad, log.sample_time_s)[axis - 1])
        + float(white_std(log.joint_position_rad, log.sample_time_s)[axis - 1])
        for log in logs
        if log.joint_position_rad is not None
    )


def _said(text: str, robot: Robot, axis: int, swing: Swing) -> str:
    """Return a text with measured and simulated deflection, a clause about play, and the axis in its places 0 to 3."""
    unit = "mm" if robot.axis_is_prismatic[axis - 1] else "mrad"
    measured, simulated, play = (
        f"{1e3 * x:.3g} {unit}" for x in (swing.measured_rad, swing.simulated_rad, swing.play_rad)
    )
    clause = f", as its torque turns round; {play} of it do not grow with the torque, as in play"
    return text.format(measured, simulated, clause, axis)

"""Checks noise and steps of positions against the sensor of the robot file; both raise the floor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight.gap.facts.faults import Finding
from axisight.gap.signals.noise import position_noise_std
from axisight.logs import Log
from axisight.logs.quality import quantization
from axisight.robot import Robot

# Ratio of measured to stated noise that is flagged; sensors of one type differ by less.
_LOUD = 5.0
# Noise of a step, relative to the step. Steps matter from where this noise reaches the stated one.
_STEP_NOISE = 1.0 / np.sqrt(12.0)
# Fewest bits over the range of a position that are not flagged, without a stated noise.
_FEW_BITS = 12.0


def check_noise(robot: Robot, logs: Sequence[Log]) -> list[Finding]:
    """Return flags about positions that are noisier or coarser than the sensor of the robot file."""
    stated = robot.position_noise_std
    out = []
    for log in logs:
        for axis in range(log.n_axes):
            column = f"position_{axis + 1}"
            found = quantization(log.position_rad[:, axis])
            step = 0.0 if found is None else found.step
            coarse = step * _STEP_NOISE > stated if stated > 0 else False
            few = found is not None and stated <= 0 and found.bits < _FEW_BITS
            if coarse or few:
                message = (
                    f"expected noise of {stated:.3g} rad as in the robot file, got steps of {step:.4g} rad. Finer "
                    "motion does not show, and the floor rises. Log the full resolution"
                )
                out.append(
                    Finding("quantized_position", "flag", message, log.name, axis + 1, column)
                )
        if stated <= 0:
            continue
        measured = position_noise_std([log])
        for axis in np.flatnonzero(measured > _LOUD * stated).tolist():
            message = (
                f"expected noise of {stated:.3g} rad as in the robot file, got {measured[axis]:.3g} rad. The "
                "floor rises with it. Look for glitches and a coarse encoder"
            )
            column = f"position_{axis + 1}"
            out.append(Finding("position_noise_large", "flag", message, log.name, axis + 1, column))
    return out

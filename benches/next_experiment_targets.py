"""Pairs of causes that weak logs of a MuJoCo arm leave open, and what a designed trajectory makes of them.

    python benches/next_experiment_targets.py [--targets] [NAME ...]

A vertical arm of two joints, whose position actuators follow joint targets in MuJoCo; what is withheld from the
simulator acts there. Three logs that hardly show it are diagnosed, with the experiment that tells the rivals apart.
Its trajectory is played on the same machine as often as it says, and all logs are diagnosed again. The logs hold
positions and torques (inverse dynamics); with ``--targets`` positions and targets without torques.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight import Diagnosis, Log, Robot, diagnose, load_robot
from axisight.gap import ExperimentLimits
from axisight.logs.log import not_logged

Array = NDArray[np.float64]
Torque = Callable[[Array, Array, Array], Array]

RATE_HZ = 100.0
SECONDS = 6.0
STEP_S = 1e-3
SETTLED_S = 2.0
# Noise of positions.
NOISE_RAD = 1e-5
HOME_RAD = np.array([0.4, 0.6])
# Speed over which dry friction turns its sign [rad/s].
CORNER_RAD_S = 0.005
# What the arm may do in an experiment.
FREE = ExperimentLimits(
    velocity_rad_s=2.5, acceleration_rad_s2=15.0, travel_rad=1.0, torque_nm=[120.0, 45.0]
)


@dataclass(frozen=True)
class Machine:
    """The arm in MuJoCo, SI units, joint side.

    - ``extra``: torque on the joints from angles, speeds and the torque of the actuators, (2,) each;
    - ``constant``: true torque over the reported one;
    - ``load_kg`` at the tip; ``armature``; ``tilt_rad`` of the base.
    """

    extra: Torque | None = None
    constant: tuple[float, float] = (1.0, 1.0)
    load_kg: float = 0.0
    armature: tuple[float, float] = (0.6, 0.2)
    tilt_rad: float = 0.0
    noise_nm: tuple[float, float] = (0.3, 0.1)

    def mjcf(self) -> str:
        """Return the MuJoCo model (MJCF)."""
        load = f'<geom pos="0 0 0.3" size="0.03" mass="{self.load_kg}"/>' if self.load_kg else ""
        pull = 9.81 * np.array([np.sin(self.tilt_rad), 0.0, -np.cos(self.tilt_rad)])
        return f"""<mujoco model="two joints">
  <option timestep="{STEP_S}" integrator="Euler" gravity="{pull[0]} 0 {pull[2]}"/>
  <worldbody>
    <body name="upper" pos="0 0 0.5">
      <joint name="shoulder" axis="0 1 0" damping="1.5" frictionloss="1.0" armature="{self.armature[0]}"/>
      <inertial pos="0 0 0.2" mass="8" diaginertia="0.12 0.12 0.02"/>
      <body name="fore" pos="0 0 0.4">
        <joint name="elbow" axis="0 1 0" damping="0.6" frictionloss="0.4" armature="{self.armature[1]}"/>
        <inertial pos="0 0 0.15" mass="4" diaginertia="0.04 0.04 0.008"/>
        {load}
      </body>
    </body>
  </worldbody>
  <actuator>
    <position joint="shoulder" kp="4000" kv="200"/>
    <position joint="elbow" kp="1500" kv="70"/>
  </actuator>
</mujoco>
"""

    def played(self, targets: Array) -> tuple[Array, Array]:
        """Return positions [rad] (n + 1, 2) and reported torques [Nm] (n, 2) under targets (n, 2) from rest.

        Torques are means from one sample to the next.
        """
        import mujoco  # noqa: PLC0415 - an extra

        model = mujoco.MjModel.from_xml_string(self.mjcf())
        data = mujoco.MjData(model)
        data.qpos[:] = data.ctrl[:] = targets[0]
        for _ in range(round(SETTLED_S / STEP_S)):
            self._step(mujoco, model, data)
        position, torque = np.empty_like(targets), np.empty_like(targets)
        for k, target in enumerate(targets):
            data.ctrl[:] = target
            position[k] = data.qpos
            sum_nm = np.zeros(2)
            for _ in range(round(1 / RATE_HZ / STEP_S)):
                self._step(mujoco, model, data)
                sum_nm += data.qfrc_actuator
            torque[k] = sum_nm * RATE_HZ * STEP_S
        return np.vstack([position, data.qpos]), torque / np.array(self.constant)

    def _step(self, mujoco: Any, model: Any, data: Any) -> None:
        if self.extra is not None:
            data.qfrc_applied[:] = self.extra(data.qpos, data.qvel, data.qfrc_actuator)
        mujoco.mj_step(model, data)

    def log(self, targets: Array, run: int, *, with_targets: bool, cut_s: float = 0.0) -> Log:
        """Return the log of a run: positions and torques, or positions and targets, without ``cut_s`` at both ends."""
        ends, torque = self.played(targets)
        cut = round(cut_s * RATE_HZ)
        kept = slice(cut, len(targets) - cut)
        ends, torque, targets = ends[cut : len(ends) - cut], torque[kept], targets[kept]
        # The mean of a torque over a step belongs to its middle.
        position = ends[:-1] if with_targets else 0.5 * (ends[1:] + ends[:-1])
        rng = np.random.default_rng([7, run])
        noisy = position + NOISE_RAD * rng.standard_normal(position.shape)
        noise = np.array(self.noise_nm) * rng.standard_normal(torque.shape)
        return Log(
            name=f"run{run}",
            source=Path(f"run{run}.parquet"),
            sample_time_s=1 / RATE_HZ,
            time_s=np.arange(len(targets)) / RATE_HZ,
            position_rad=noisy,
            torque_nm=not_logged(position.shape) if with_targets else torque + noise,
            position_ref_rad=targets if with_targets else None,
        )

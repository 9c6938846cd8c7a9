"""A three-joint arm whose actuators get position targets, simulated by MuJoCo."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight import Diagnosis, Log, Robot, load_robot
from axisight.logs.log import not_logged

Array = NDArray[np.float64]

RATE_HZ = 50.0
SECONDS = 20.0
# Of a 15-bit encoder.
NOISE_RAD = 2e-4
HOME_RAD = np.array([0.0, 0.5, 0.9])
REACH_RAD = np.array([0.35, 0.22, 0.3])
SETTLED_S = 4.0


@dataclass(frozen=True)
class ServoArm:
    """Parameters of a machine, SI units, joint side.

    ``limit`` of torque: 0 for none. ``late_s``: delay of targets.
    """

    damping: tuple[float, float, float] = (3.0, 2.0, 0.6)
    dry_friction: tuple[float, float, float] = (0.0, 0.0, 0.0)
    armature: tuple[float, float, float] = (0.8, 0.6, 0.15)
    kp: tuple[float, float, float] = (1800.0, 1800.0, 500.0)
    kd: tuple[float, float, float] = (120.0, 110.0, 25.0)
    limit: tuple[float, float, float] = (0.0, 0.0, 0.0)
    load_kg: float = 0.0
    late_s: float = 0.0
    step_s: float = 5e-4
    rate_hz: float = RATE_HZ
    integrator: str = "implicitfast"

    def with_changed(self, field: str, joint: int, value: float) -> ServoArm:
        """Return the arm with another value of one joint (from 1)."""
        values = list(getattr(self, field))
        values[joint - 1] = value
        return replace(self, **{field: tuple(values)})

    def weaker(self, joint: int, factor: float) -> ServoArm:
        """Return the arm with both gains of a joint (from 1) multiplied by a factor."""
        out = self.with_changed("kp", joint, self.kp[joint - 1] * factor)
        return out.with_changed("kd", joint, self.kd[joint - 1] * factor)

    def mjcf(self) -> str:
        """Return the MuJoCo model (MJCF)."""

        def joint(i: int, axis: str) -> str:
            return (
                f'<joint name="j{i + 1}" axis="{axis}" damping="{self.damping[i]}" '
                f'frictionloss="{self.dry_friction[i]}" armature="{self.armature[i]}"/>'
            )

        def force(limit: float) -> str:
            return f' forcerange="{-limit} {limit}"' if limit else ""

        load = ""
        if self.load_kg:
            load = f'<body pos="0.05 0 0.35"><geom size="0.05" mass="{self.load_kg}"/></body>'
        servos = "\n".join(
            f'    <position joint="j{i + 1}" kp="{self.kp[i]}" kv="{self.kd[i]}"{force(self.limit[i])}/>'
            for i in range(3)
        )
        return f"""<mujoco model="servo arm">
  <option timestep="{self.step_s}" integrator="{self.integrator}"/>
  <worldbody>
    <body name="l1" pos="0 0 0.3">{joint(0, "0 0 1")}
      <inertial pos="0.02 0 0.05" mass="8" diaginertia="0.08 0.08 0.05"/>
      <body name="l2" pos="0.05 0 0.1">{joint(1, "0 1 0")}
        <inertial pos="0 0.01 0.2" mass="6" diaginertia="0.12 0.12 0.02"/>
        <body name="l3" pos="0 0 0.42">{joint(2, "0 1 0")}
          <inertial pos="0.03 0 0.15" mass="3" diaginertia="0.03 0.03 0.006"/>
          {load}
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
{servos}
  </actuator>
</mujoco>
"""

    def log(
        self,
        run: int,
        noise_rad: float = NOISE_RAD,
        home_rad: Array = HOME_RAD,
        speed_noise_rad_s: float | None = None,
    ) -> Log:
        """Return targets and positions of one run from the settled arm; also speeds if these have noise."""
        import mujoco  # noqa: PLC0415 - an extra

        wanted = targets(run, home_rad, self.rate_hz)
        model = mujoco.MjModel.from_xml_string(self.mjcf())
        position, speed = moved(model, wanted, self.rate_hz, self.late_s)
        noise = np.random.default_rng(1000 + run).normal(size=position.shape)
        own = np.random.default_rng(2000 + run).normal(size=position.shape)
        return Log(
            name=f"run{run}",
            sample_time_s=1 / self.rate_hz,
            time_s=np.arange(len(wanted)) / self.rate_hz,
            torque_nm=not_logged(position.shape),
            position_rad=position + noise_rad * noise,
            position_ref_rad=wanted,
            velocity_rad_s=None if speed_noise_rad_s is None else speed + speed_noise_rad_s * own,
            source=Path(f"run{run}.parquet"),
        )


def moved(model: Any, wanted: Array, rate_hz: float, late_s: float = 0.0) -> tuple[Array, Array]:
    """Return angles and speeds (n, 3) of a settled MuJoCo model under targets (n, 3)."""
    import mujoco  # noqa: PLC0415 - an extra

    data, step_s = mujoco.MjData(model), model.opt.timestep
    data.qpos[:] = data.ctrl[:] = wanted[0]
    mujoco.mj_step(model, data, round(SETTLED_S / step_s))
    steps, late = round(1 / rate_hz / step_s), round(late_s / step_s)
    told = np.concatenate([np.repeat(wanted[:1], late, axis=0), np.repeat(wanted, steps, axis=0)])
    position, speed = np.empty_like(wanted), np.empty_like(wanted)
    for k in range(len(wanted)):
        position[k], speed[k] = data.qpos, data.qvel
        for target in told[k * steps : (k + 1) * steps]:
            data.ctrl[:] = target
            mujoco.mj_step(model, data)
    return position, speed


def targets(run: int, home_rad: Array = HOME_RAD, rate_hz: float = RATE_HZ) -> Array:
    """Return sums of sines up to 2.2 Hz (n, 3) [rad] that start and end at home."""
    rng = np.random.default_rng(run)
    t = np.arange(round(SECONDS * rate_hz)) / rate_hz
    fade = np.clip(t / 2, 0, 1) * np.clip(t[-1] - t, 0, 1)
    fade = fade**2 * (3 - 2 * fade)
    out = np.zeros((len(t), 3))
    for axis, reach in enumerate(REACH_RAD):
        for f in rng.uniform(0.1, 2.2, 7):
            wave = np.sin(2 * np.pi * (f * t + rng.uniform()))
            out[:, axis] += reach / np.sqrt(7) * wave / max(f, 0.4) ** 0.7
    return np.asarray(home_rad + out * fade[:, None])


def simulator(folder: Path, arm: ServoArm | None = None) -> Robot:
    """Return the robot of an arm's MJCF, for logs at its rate."""
    path, own = folder / "arm.xml", arm or ServoArm()
    path.write_text(own.mjcf(), "utf-8")
    return load_robot(path, sample_time_s=1 / own.rate_hz)


NOMINAL = ServoArm()
MACHINES: Mapping[str, ServoArm] = {
    "coulomb_friction@1": NOMINAL.with_changed("dry_friction", 1, 2.0),
    "coulomb_friction@2": NOMINAL.with_changed("dry_friction", 2, 2.5),
    "coulomb_friction@3": NOMINAL.with_changed("dry_friction", 3, 0.8),
    "viscous_friction@1": NOMINAL.with_changed("damping", 1, 7.0),
    "viscous_friction@3": NOMINAL.with_changed("damping", 3, 1.6),
    "motor_inertia@2": NOMINAL.with_changed("armature", 2, 1.0),
    "input_delay": replace(NOMINAL, late_s=0.008),
    "payload": replace(NOMINAL, load_kg=0.8),
    "torque_constant@2": NOMINAL.weaker(2, 0.85),
    "controller_gain@3": NOMINAL.with_changed("kp", 3, 420.0),
}
"""Machines by what the simulator lacks."""


def check_unknown_gains(found: Diagnosis, lacks: str | None, changes: Mapping[str, float]) -> None:
    """Assert that gains with a tolerance are found as relative changes, and only dry friction as a cause."""
    assert found.verdict == ("none" if lacks is None else "explained")
    assert [c.label for c in found.causes] == ([lacks] if lacks else [])
    for cause in found.causes:
        # 10 %, as with known gains: the corner of the fitted friction differs from MuJoCo's.
        assert np.isclose(cause.parameters["coulomb_nm"].value, 2.5, rtol=0.1)
    # A common factor on gains, masses and friction leaves the motion the same, so gains are known as well as
    # masses are: 1.5 % each.
    for name, change in changes.items():
        assert np.isclose(1 + found.refit[name].value, 1 + change, rtol=0.03)
        assert found.refit[name].low < change < found.refit[name].high
    assert np.isclose(found.gap.after, found.gap.floor, rtol=0.1)
    assert not found.findings
    assert not any("controller_gain" in c.effect for c in found.ranking)

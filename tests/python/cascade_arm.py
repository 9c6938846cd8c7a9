"""The arm of `servo_arm` with motors under a drive's cascade with position targets, simulated by MuJoCo."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from axisight import Log, Robot, load_robot
from axisight.logs.log import not_logged
from servo_arm import HOME_RAD, MACHINES, NOISE_RAD, NOMINAL, SETTLED_S, ServoArm, targets

Array = NDArray[np.float64]

RATE_HZ = 50.0
SAMPLE_S = 2e-3
STEP_S = 1e-3


@dataclass(frozen=True)
class Cascade:
    """Gains of position [1/s], speed [Nm s/rad] and its integral [Nm/rad].

    ``fed``: targets are interpolated linearly between samples of the log; their rates are fed forward and
    logged.
    """

    kv: tuple[float, float, float] = (14.0, 14.0, 14.0)
    kp: tuple[float, float, float] = (120.0, 110.0, 25.0)
    ki: tuple[float, float, float] = (1500.0, 1500.0, 350.0)
    fed: bool = False

    def toml(self) -> str:
        """Return the drive data."""
        gains = "".join(f"{k} = {list(getattr(self, k))}\n" for k in ("kv", "kp", "ki"))
        fed = str(self.fed).lower()
        return (
            f'sample_time = {SAMPLE_S}\n[controller]\nkind = "cascade_position"\n{gains}'
            f"velocity_feedforward = {fed}\n"
        )


PI = Cascade()
P = Cascade(ki=(0.0, 0.0, 0.0))


def mjcf(arm: ServoArm) -> str:
    """Return an arm with a motor on every joint."""
    text = arm.mjcf().replace("<position ", "<motor ")
    for i in range(3):
        text = text.replace(f' kp="{arm.kp[i]}" kv="{arm.kd[i]}"', "")
    return text.replace(
        f'timestep="{arm.step_s}" integrator="{arm.integrator}"',
        f'timestep="{STEP_S}" integrator="RK4"',
    )


def simulator(folder: Path, arm: ServoArm, law: Cascade) -> Robot:
    """Return the robot of an arm and its drive data."""
    path = folder / "arm.xml"
    path.write_text(mjcf(arm), "utf-8")
    path.with_name("arm.drives.toml").write_text(law.toml(), "utf-8")
    return load_robot(path, sample_time_s=1 / RATE_HZ)


def log_of(arm: ServoArm, law: Cascade, run: int, noise_rad: float = NOISE_RAD) -> Log:
    """Return targets and positions of one run from the settled arm; ``late_s`` delays all targets."""
    import mujoco  # noqa: PLC0415 - an extra

    model = mujoco.MjModel.from_xml_string(mjcf(arm))
    data = mujoco.MjData(model)
    kv, kp, ki = (np.array(x) for x in (law.kv, law.kp, law.ki))
    wanted = targets(run, HOME_RAD, RATE_HZ)
    per_log, per_sample = round(1 / RATE_HZ / SAMPLE_S), round(SAMPLE_S / STEP_S)
    settling = round(SETTLED_S / SAMPLE_S)
    late = round(arm.late_s / SAMPLE_S)
    told = np.concatenate(
        [np.repeat(wanted[:1], settling + late, axis=0), np.repeat(wanted, per_log, axis=0)]
    )
    rates = np.diff(wanted, axis=0, append=wanted[-1:]) * RATE_HZ
    rate = np.zeros_like(told)
    if law.fed:
        rate[settling + late :] = np.repeat(rates, per_log, axis=0)
        told = wanted[0] + (np.cumsum(rate, axis=0) - rate) * SAMPLE_S
    data.qpos[:] = HOME_RAD
    before, summed = data.qpos.copy(), np.zeros(3)
    position = np.empty_like(wanted)
    for k in range(settling + len(wanted) * per_log):
        if k >= settling and (k - settling) % per_log == 0:
            position[(k - settling) // per_log] = data.qpos
        speed = (data.qpos - before) / SAMPLE_S
        before = data.qpos.copy()
        error = rate[k] - speed + kv * (told[k] - data.qpos)
        data.ctrl[:] = kp * error + ki * summed
        summed += error * SAMPLE_S
        mujoco.mj_step(model, data, per_sample)
    noise = np.random.default_rng(1000 + run).normal(size=position.shape)
    return Log(
        name=f"run{run}",
        sample_time_s=1 / RATE_HZ,
        time_s=np.arange(len(wanted)) / RATE_HZ,
        torque_nm=not_logged(position.shape),
        position_rad=position + noise_rad * noise,
        position_ref_rad=wanted,
        velocity_ref_rad_s=rates if law.fed else None,
        source=Path(f"run{run}.parquet"),
    )


# Machines that differ in the drive's gains: factors on kp and ki of one axis' speed loop.
_OTHER_GAINS: Mapping[str, tuple[float, float]] = {
    "torque_constant@2": (0.85, 0.85),
    "controller_gain@3": (0.8, 1.0),
}


def machine_of(lacks: str, law: Cascade) -> tuple[ServoArm, Cascade]:
    """Return a machine of `servo_arm.MACHINES` under a law; NOMINAL for a name that is not there."""
    if lacks not in _OTHER_GAINS:
        return MACHINES.get(lacks, NOMINAL), law
    at = int(lacks[-1]) - 1
    changed = {}
    for name, factor in zip(("kp", "ki"), _OTHER_GAINS[lacks], strict=True):
        values = list(getattr(law, name))
        values[at] *= factor
        changed[name] = tuple(values)
    return NOMINAL, replace(law, **changed)  # type: ignore[arg-type]

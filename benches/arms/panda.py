"""Franka Emika Panda, seven axes: one exciting motion with torques of its joint sensors, 1 kHz.

Run: python benches/arms/panda.py CHECKOUT MODEL --out FOLDER

CHECKOUT: https://github.com/marcocognetti/FrankaEmikaPandaDynModel (GPL 3; Gaz, Cognetti, Oliva, Robuffo Giordano,
De Luca 2019). Stamps, positions, velocities and torques are in matlab/data/Exciting_Traj/Trajectory_1/rbt_log.
MODEL: https://github.com/Gepetto/example-robot-data (BSD 3-clause), robots/panda_description/urdf/panda.urdf.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from public_arm import PublicArm, Recording, main

RATE_HZ = 1000.0
N_AXES = 7
TIP = "panda_link8"


def read(checkout: Path, model: Path) -> PublicArm:
    """Return the arm with its motion in two parts, the last third held out."""
    folder = checkout / "matlab" / "data" / "Exciting_Traj" / "Trajectory_1" / "rbt_log"
    time = np.loadtxt(folder / "exciting_traj_time.txt")
    position, velocity, torque = (
        np.loadtxt(folder / f"exciting_traj_{name}.txt").reshape(-1, N_AXES)
        for name in ("positions", "velocity", "torques")
    )
    cut = 2 * len(time) // 3
    recordings = [
        Recording(name, position[part], torque[part], velocity[part], time[part])
        for name, part in (("first", slice(cut)), ("last", slice(cut, None)))
    ]
    urdf = model / "robots" / "panda_description" / "urdf" / "panda.urdf"
    return PublicArm(urdf, RATE_HZ, recordings, tip=TIP)


if __name__ == "__main__":
    main(read, __doc__ or "", ["model"])

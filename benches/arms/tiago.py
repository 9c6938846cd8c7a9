"""PAL TIAGo, seven axes on a lift: one motion with motor currents, 100 Hz with uneven stamps.

Run: python benches/arms/tiago.py CHECKOUT --out FOLDER

CHECKOUT: https://github.com/thanhndv212/figaroh-examples, which states no licence for the data. All is in
examples/tiago: stamps, positions, velocities and efforts in data/identification/dynamic, the model in
urdf/tiago_no_hand.urdf. Efforts are motor currents [A]; gears and torque constants that turn them into torque on the
joint are those of identification.py. The effort of the lift has no known constant there, and the lift is left out.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from public_arm import PublicArm, Recording, main

RATE_HZ = 100.0
TIP = "arm_tool_link"
BASE = "torso_lift_link"
# Gear times torque constant of each arm axis [Nm on the joint by A].
SCALE = (13.6, 13.6, -8.7, -8.7, -20.6, -20.6, -20.6)


def read(checkout: Path) -> PublicArm:
    """Return the arm with its motion in two parts, the last third held out."""
    folder = checkout / "examples" / "tiago" / "data" / "identification" / "dynamic"
    time, position, velocity, current = (
        np.loadtxt(folder / f"tiago_{name}.csv", delimiter=",", skiprows=1)[:, columns]
        for name, columns in (
            ("position", 0),
            ("position", slice(2, None)),
            ("velocity", slice(2, None)),
            ("effort", slice(2, None)),
        )
    )
    cut = 2 * len(time) // 3
    recordings = [
        Recording(name, position[part], current[part], velocity[part], time[part])
        for name, part in (("first", slice(cut)), ("last", slice(cut, None)))
    ]
    urdf = checkout / "examples" / "tiago" / "urdf" / "tiago_no_hand.urdf"
    return PublicArm(urdf, RATE_HZ, recordings, tip=TIP, base=BASE, scale=SCALE)


if __name__ == "__main__":
    main(read, __doc__ or "")

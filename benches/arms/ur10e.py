"""Universal Robots UR10e, six axes: exciting motions with motor currents, 100 Hz with uneven stamps.

Run: python benches/arms/ur10e.py CHECKOUT --out FOLDER

CHECKOUT: https://github.com/shamilmamedov/dynamic_calibration, which states no licence. Rows of
dataset_ur10e/identification_data hold stamps, positions, velocities and currents; the model is URe/urdf/ur10e.urdf. The
drive gains that turn currents into torque on the joint are those of UR10E_parameters.txt, the authors' own estimate.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from public_arm import PublicArm, Recording, main

RATE_HZ = 100.0
TIP = "tool0"
# Drive gains [Nm on the joint by A].
SCALE = (10.0, 10.6956, 8.4566, 9.0029, 9.48, 10.1232)
RUNS = ("ur-20_02_10-30sec_12harm", "ur-20_02_12-40sec_12harm", "ur-20_02_06-20sec_10harm")


def read(checkout: Path) -> PublicArm:
    """Return the arm with three motions, the last of them held out."""
    folder = checkout / "dataset_ur10e" / "identification_data"
    recordings = []
    for name in RUNS:
        rows = np.loadtxt(folder / f"{name}.csv", delimiter=",")
        parts = (rows[:, 1:7], rows[:, 13:19], rows[:, 7:13])
        recordings.append(Recording(name, *parts, rows[:, 0]))
    urdf = checkout / "URe" / "urdf" / "ur10e.urdf"
    return PublicArm(urdf, RATE_HZ, recordings, tip=TIP, scale=SCALE)


if __name__ == "__main__":
    main(read, __doc__ or "")

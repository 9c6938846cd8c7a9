"""KUKA LBR Med 7 R700, seven axes: one motion with torques of its joint sensors, 100 Hz.

Run: python benches/arms/med7.py CHECKOUT --out FOLDER

CHECKOUT: https://github.com/lbr-stack/dynamic_parameter_identification, which states no licence. Positions and torques
on the joint are in src/test/measurements.csv, the model in urdf/med/med7dock.urdf. The period of 10 ms is that of
src/regression.py, which reads the file.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from public_arm import PublicArm, Recording, main

RATE_HZ = 100.0
# Torques of the log are the loads that the joints carry, not those of the drives: they count the other way round.
SIGN = -1.0


def read(checkout: Path) -> PublicArm:
    """Return the arm with its motion in two parts, the last third held out."""
    table = np.loadtxt(checkout / "src" / "test" / "measurements.csv", delimiter=",", skiprows=1)
    cut = 2 * len(table) // 3
    parts = {"first": table[:cut], "last": table[cut:]}
    urdf = checkout / "urdf" / "med" / "med7dock.urdf"
    recordings = [
        Recording(name, part[:, :7], SIGN * part[:, 7:14]) for name, part in parts.items()
    ]
    return PublicArm(urdf, RATE_HZ, recordings)


if __name__ == "__main__":
    main(read, __doc__ or "")

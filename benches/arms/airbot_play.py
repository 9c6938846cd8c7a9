"""AIRBOT Play, six axes: a small arm with torques from motor currents, 100 Hz.

Run: python benches/arms/airbot_play.py CHECKOUT --out FOLDER

CHECKOUT: https://github.com/liuyurong129/figaroh_kinova, which states no licence for the data; its programs are under
Apache 2.0. All is in examples/airbot_play: positions and torques on the joint in data/identification
(identification_q_real.csv and identification_tau_real.csv of each motion), the model in data/urdf, and the period of
10 ms in config/airbot_play_config.yaml.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from public_arm import PublicArm, Recording, main

RATE_HZ = 100.0


def read(checkout: Path) -> PublicArm:
    """Return the arm with two motions, the trapezoids held out."""
    data = checkout / "examples" / "airbot_play" / "data"

    def recording(name: str) -> Recording:
        position, torque = (
            np.loadtxt(
                data / "identification" / name / f"identification_{x}_real.csv",
                delimiter=",",
                skiprows=1,
            )
            for x in ("q", "tau")
        )
        return Recording(name, position, torque)

    return PublicArm(
        data / "urdf" / "airbot_play_v3_0_gripper.urdf",
        RATE_HZ,
        [recording("chirp_motion"), recording("trapezoidal_motion")],
    )


if __name__ == "__main__":
    main(read, __doc__ or "")

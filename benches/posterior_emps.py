"""Why the band of a posterior holds less than 95 % of the EMPS' held-out force.

    python benches/posterior_emps.py FOLDER_WITH_THE_DATA

The validation run has a pulse of 5 V switched on or off every 0.5 s, which the estimation run has not. Printed: the
share of measured force inside the band, all, within 0.15 s of a switch, and elsewhere; then the same after viscous
friction, dry friction and offset were fitted to the validation run itself.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

import axisight

Array = NDArray[np.float64]

EXAMPLE = Path(__file__).resolve().parents[1] / "examples" / "emps"
NEAR_S = 0.15
# Speed below which the sign of the speed is noise [m/s].
SLOW_M_S = 0.002


def inside(error: Array, reach: Array, where: NDArray[np.bool_]) -> str:
    """Return the share inside the band, and the rms error."""
    share = np.mean(np.abs(error[where]) <= reach[where])
    return f"{100 * share:.1f} % (rms error {np.sqrt(np.mean(error[where] ** 2)):.2f} N)"


def main() -> None:
    """Print the shares."""
    data = Path(sys.argv[1])
    logs = [
        axisight.read_log(data / f"{name}.mat", EXAMPLE / "columns.toml")
        for name in ("DATA_EMPS", "DATA_EMPS_PULSES")
    ]
    found = axisight.diagnose(
        robot=axisight.load_robot(EXAMPLE / "robot.toml"),
        estimation=logs[:1],
        validation=logs[1:],
        posterior=True,
    )
    assert found.posterior is not None
    band = found.posterior.held_out[0].sel(axis=1)
    time = band.time_s.values
    error = (band.measured_torque_nm - band.predicted_torque_nm).values
    reach = (band.high_torque_nm - band.low_torque_nm).values / 2
    pulses = scipy.io.loadmat(data / "DATA_EMPS_PULSES.mat")["pulses_N"].ravel()
    switched = logs[1].time_s[np.flatnonzero(np.diff(pulses))]
    near = np.abs(time[:, None] - switched).min(axis=1) < NEAR_S
    speed = np.interp(time, logs[1].time_s, np.gradient(logs[1].position_rad[:, 0], logs[1].time_s))
    columns = np.stack([speed, np.tanh(speed / SLOW_M_S), np.ones_like(speed)], axis=1)
    friction = np.linalg.lstsq(columns[~near], error[~near], rcond=None)[0]
    everywhere = np.ones_like(near)
    for words, left in (
        ("as predicted", error),
        ("with its own friction", error - columns @ friction),
    ):
        print(f"{words}: {inside(left, reach, everywhere)} of all samples,")
        print(
            f"    {inside(left, reach, near)} near a switch ({100 * near.mean():.0f} % of the time),"
        )
        print(f"    {inside(left, reach, ~near)} elsewhere")
    print(
        f"viscous friction differs by {friction[0]:.1f} N s/m, dry friction by {friction[1]:.2f} N"
    )


if __name__ == "__main__":
    main()

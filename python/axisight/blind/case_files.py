"""Simulated cases as folders: logs, the preset as simulator, and the case file that lists both."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from axisight.storage import write_bytes, write_whole

Array = NDArray[np.float64]


class CaseFolder:
    """A case that is written log by log; `finish` completes it."""

    def __init__(self, folder: Path, name: str) -> None:
        self.folder = folder
        self._toml = ['schema = "axisight.case/1"', f'name = "{name}"', 'robot = "robot.toml"', ""]

    def add(
        self,
        name: str,
        role: str,
        time_s: Array,
        reference: Array | None,
        torque: Array,
        angle: Array,
    ) -> None:
        """Write a log: time (n,) [s]; velocity reference [rad/s], torque [Nm], angle [rad], each (n, n_axes).

        ``reference`` is None for a log without references.
        """
        data = {"time_s": time_s}
        for i in range(torque.shape[1]):
            if reference is not None:
                data[f"velocity_ref_{i + 1}"] = reference[:, i]
            data[f"torque_cmd_{i + 1}"] = torque[:, i]
            data[f"position_{i + 1}"] = angle[:, i]
        path = self.folder / "logs" / f"{name}.parquet"
        write_bytes(path, pd.DataFrame(data).to_parquet(index=False))
        self._toml += ["[[log]]", f'file = "logs/{name}.parquet"', f'role = "{role}"', ""]

    def finish(self, preset: str) -> None:
        """Write a preset as the simulator, and the case file."""
        robot = resources.files("axisight.robot.presets") / f"{preset}.toml"
        write_whole(self.folder / "robot.toml", robot.read_text("utf-8"))
        write_whole(self.folder / "case.toml", "\n".join(self._toml))


def moves(time_s: Array, seconds: float, top_rad_s: Array) -> Array:
    """Return point-to-point moves out and back, with pauses, (n, n_axes) [rad/s]."""
    phase = time_s / seconds
    shape = _bump((phase - 0.05) / 0.35) - _bump((phase - 0.55) / 0.35)
    return np.asarray(shape[:, None] * top_rad_s)


def _bump(s: Array) -> Array:
    """Return a smooth bump from 0 to 1 and back over 0 < s < 1."""
    inside = (s > 0) & (s < 1)
    return np.asarray(np.where(inside, np.sin(np.pi * np.clip(s, 0, 1)) ** 2, 0.0))

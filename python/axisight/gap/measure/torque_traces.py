"""Measured and simulated torque and position of every log, as given and with the causes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.gap.facts.simulator_variant import AS_GIVEN, Variant
from axisight.gap.views.view import View
from axisight.logs import Log

Array = NDArray[np.float64]

SIGNALS = {
    "measured_torque_nm": "measured torque",
    "simulated_before_torque_nm": "torque of the simulator as given",
    "simulated_after_torque_nm": "torque of the re-fitted simulator with the causes",
    "residual_before_torque_nm": "simulated_before less measured",
    "residual_after_torque_nm": "simulated_after less measured",
    "measured_position_rad": "measured motor position",
    "simulated_before_position_rad": "motor position of the simulator as given",
    "simulated_after_position_rad": "motor position of the re-fitted simulator with the causes",
}
"""Signals of every log, with their long names."""


def signals_of(
    view: View,
    held_out: Sequence[Log],
    after: Variant,
    *,
    gap_before: Array,
    logged: bool = True,
) -> tuple[xr.Dataset, ...]:
    """Return the signals of the estimation logs of a view, then those of ``held_out``.

    One Dataset for each log, as described in `Diagnosis.signals`. ``after``: the simulator with the causes;
    ``gap_before`` (n_axes,) [1]: the gap of the simulator as given; ``logged``: whether torques were logged, or are
    what the stated controller commands.
    """
    logs = [*view.logs, *held_out]
    roles = ["estimation"] * len(view.logs) + ["validation"] * len(held_out)
    coords = {
        "axis": np.arange(1, view.robot.n_axes + 1),
        "joint": ("axis", view.robot.axis_names),
        "unit": ("axis", ["N" if p else "Nm" for p in view.robot.axis_is_prismatic]),
        "gap_before": ("axis", gap_before),
    }
    how = _how(view, logged)
    return tuple(
        xr.Dataset(
            {
                name: (("time_s", "axis"), values, {"long_name": SIGNALS[name]})
                for name, values in _arrays(view, log, after).items()
            },
            coords={**coords, "time_s": ("time_s", log.time_s, {"units": "s"})},
            attrs={"log": log.name, "role": role, **how},
        )
        for log, role in zip(logs, roles, strict=True)
    )


def _arrays(view: View, log: Log, after: Variant) -> dict[str, Array]:
    """Return the signals (n, n_axes) of one log; no simulated positions if the simulator uses the measured ones."""
    measured = view.measured(log)
    before, position_before = view.run(AS_GIVEN, log)
    with_causes, position_after = view.run(after, log)
    found = (measured, before, with_causes, before - measured, with_causes - measured)
    positions = (log.position_rad, position_before, position_after)
    named = zip(SIGNALS, (*found, *positions), strict=True)
    return {name: values for name, values in named if values is not None}


def _how(view: View, logged: bool) -> dict[str, str | float]:
    """Return how simulator and logs were compared, as attributes of a Dataset."""
    out: dict[str, str | float] = {
        "mode": view.mode,
        "side": "motor",
        "residual": "simulated less measured",
        "torque": "logged" if logged else "what the controller makes of positions",
    }
    if view.cutoff_hz is not None:
        out["lowpass_hz"] = view.cutoff_hz
    return out

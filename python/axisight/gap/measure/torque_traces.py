"""Measured and simulated torque of every log, as given and with the causes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from axisight.gap.facts.simulator_variant import AS_GIVEN, Variant
from axisight.gap.views.view import View
from axisight.logs import Log

SIGNALS = {
    "measured_torque_nm": "measured torque",
    "simulated_before_torque_nm": "torque of the simulator as given",
    "simulated_after_torque_nm": "torque of the re-fitted simulator with the causes",
    "residual_before_torque_nm": "simulated_before less measured",
    "residual_after_torque_nm": "simulated_after less measured",
}
"""Signals of every log, with their long names."""


def signals_of(
    view: View, held_out: Sequence[Log], after: Variant, *, logged: bool = True
) -> tuple[xr.Dataset, ...]:
    """Return the signals of the estimation logs of a view, then those of ``held_out``.

    One Dataset for each log, as described in `Diagnosis.signals`. ``after``: the simulator with the causes; ``logged``:
    whether torques were logged, or are what the stated controller commands.
    """
    logs = [*view.logs, *held_out]
    roles = ["estimation"] * len(view.logs) + ["validation"] * len(held_out)
    simulated = zip(view.torques(AS_GIVEN, logs), view.torques(after, logs), strict=True)
    out = []
    for log, role, (before, with_causes) in zip(logs, roles, simulated, strict=True):
        measured = view.measured(log)
        arrays = (measured, before, with_causes, before - measured, with_causes - measured)
        out.append(
            xr.Dataset(
                {
                    name: (("time_s", "axis"), values, {"long_name": SIGNALS[name]})
                    for name, values in zip(SIGNALS, arrays, strict=True)
                },
                coords={
                    "time_s": ("time_s", log.time_s, {"units": "s"}),
                    "axis": np.arange(1, log.n_axes + 1),
                    "joint": ("axis", view.robot.axis_names),
                    "unit": (
                        "axis",
                        ["N" if p else "Nm" for p in view.robot.axis_is_prismatic],
                    ),
                },
                attrs={"log": log.name, "role": role, **_how(view, logged)},
            )
        )
    return tuple(out)


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

"""Torque of the validation logs as the posterior predicts it, beside the measured one."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.gap.facts.simulator_variant import Variant
from axisight.gap.views.view import View
from axisight.logs import Log
from axisight.posterior.result import Posterior
from axisight.posterior.sampled_robot import split_values
from axisight.posterior.settings import FIRST_NOISE_RUN, HELD_OUT_DRAWS, HELD_OUT_TIMES
from axisight.statistics.intervals import NORMAL_DEVIATIONS

Array = NDArray[np.float64]


def held_out_torque(
    view: View, logs: Sequence[Log], posterior: Posterior, noise: Array, fitted: Variant
) -> tuple[xr.Dataset, ...]:
    """Return a Dataset over (time_s, axis) for each log, thinned to 2,000 times at most.

    - ``measured_torque_nm``; ``simulated_torque_nm`` (draw, time_s, axis): `HELD_OUT_DRAWS` samples with noise.
    - ``predicted_torque_nm``, ``low_torque_nm``, ``high_torque_nm``: Gaussian band that holds 95 % of measured torque.
      Its variance is that of the simulated samples, plus the noise. The noise is the floor, or what the model leaves
      on the estimation logs if that is more; so the samples are without the error of formulas. They have the
      variation between runs.
    - Attributes: ``log``, ``mode``, ``inside``: share of all measured samples inside the band [1], also by axis
      (``inside_per_axis``); ``diverged``: samples whose simulation broke off, which are left out.

    ``noise`` (n_axes,): factor on the estimated floor. ``fitted``: the simulator of the leading hypothesis.
    """
    variants = _variants(posterior)
    with ThreadPoolExecutor(view.settings.threads) as pool:
        every = list(pool.map(lambda v: view.torques(v, logs), variants))
    left = _left(view, fitted)
    out = []
    for k, log in enumerate(logs):
        drawn = np.array([torques[k] for torques in every])
        whole = np.isfinite(drawn).all(axis=(1, 2))
        own = noise * view.noises([log], FIRST_NOISE_RUN + k)[0]
        out.append(_dataset(view, log, drawn[whole], own, left, int((~whole).sum())))
    return tuple(out)


def _variants(posterior: Posterior) -> list[Variant]:
    # What formulas leave is in the noise already, as measured on the estimation logs. A validation log is another run.
    drawn = posterior.samples(HELD_OUT_DRAWS, formula_error=False, between_runs=True)
    which = drawn.hypothesis.values
    out = []
    for i in range(HELD_OUT_DRAWS):
        values = {name: float(drawn[name].values[i]) for name in posterior.names}
        plain, effects = split_values(posterior, values, int(which[i]))
        out.append(Variant(plain, tuple(effects)))
    return out


def _left(view: View, fitted: Variant) -> Array:
    """Return the variance (n_axes,) of the error that the model leaves on the estimation logs."""
    errors = view.errors(view.torques(fitted, view.logs), view.logs)
    return np.asarray(np.mean([np.mean(e**2, axis=0) for e in errors], axis=0))


def _dataset(
    view: View, log: Log, drawn: Array, own: Array, left: Array, diverged: int
) -> xr.Dataset:
    measured = view.measured(log)
    variance = np.maximum(np.mean(own**2, axis=0), left)
    mean = drawn.mean(axis=0)
    reach = NORMAL_DEVIATIONS * np.sqrt(drawn.var(axis=0, ddof=1) + variance)
    inside = (np.abs(measured - mean) <= reach)[view.counted(log)[:, 0] > 0]
    step = max(1, -(-log.n_samples // HELD_OUT_TIMES))
    rng = np.random.default_rng([view.settings.seed, FIRST_NOISE_RUN, log.n_samples])
    # The noise of one run, shifted in time by sample, and as large as the band has it.
    scale = np.sqrt(variance / np.maximum(np.mean(own**2, axis=0), 1e-300))
    noisy = np.array([x + scale * np.roll(own, int(rng.integers(len(own))), axis=0) for x in drawn])
    by = ("time_s", "axis")
    return xr.Dataset(
        {
            "measured_torque_nm": (by, measured[::step]),
            "simulated_torque_nm": (("draw", *by), noisy[:, ::step].astype(np.float32)),
            "predicted_torque_nm": (by, mean[::step]),
            "low_torque_nm": (by, (mean - reach)[::step]),
            "high_torque_nm": (by, (mean + reach)[::step]),
        },
        coords={
            "time_s": ("time_s", log.time_s[::step], {"units": "s"}),
            "axis": np.arange(1, log.n_axes + 1),
            "draw": np.arange(len(drawn)),
        },
        attrs={
            "log": log.name,
            "mode": view.mode,
            "inside": float(inside.mean()),
            "inside_per_axis": inside.mean(axis=0).tolist(),
            "diverged": diverged,
        },
    )

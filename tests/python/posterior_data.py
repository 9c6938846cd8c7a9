"""A posterior made by hand: two axes, two correlated causes on one of them, and a rival."""

from dataclasses import replace

import numpy as np
import xarray as xr

from axisight import Effect
from axisight.posterior import (
    BetweenRuns,
    DrivenAxis,
    Posterior,
    PosteriorHypothesis,
    PosteriorParameter,
)
from axisight.posterior.parameter import Prior, Simulated

RATIO = 0.01
VISCOUS = "axis1.viscous_friction"
INERTIA = "axis1.motor_inertia"
STIFFNESS = "axis1.stiffness"
MASS = "axis1.mass"
COULOMB = "coulomb_friction@1.coulomb_nm"
OFFSET = "torque_offset@1.offset_nm"


def own(name: str, nominal: float, unit: str, tolerance: float = 0.02) -> PosteriorParameter:
    spread = tolerance * nominal
    return PosteriorParameter(
        name, unit, "own", 1, None, name.rsplit(".", 1)[1], nominal, nominal - 4 * spread,
        nominal + 4 * spread, Prior("normal", nominal, spread),
    )  # fmt: skip


def cause(name: str, unit: str, lower: float, upper: float) -> PosteriorParameter:
    effect, quantity = name.split(".")
    return PosteriorParameter(
        name, unit, "cause", 1, effect.split("@")[0], quantity, 0.0, lower, upper,
        Prior("half_normal", 0.0, 0.5),
    )  # fmt: skip


def leading() -> PosteriorHypothesis:
    std = np.array([3e-4, 2e-4, 1e4, 2.0, 0.02])
    correlation = np.eye(5)
    # Friction that is constant and friction that grows with speed make up for one another.
    correlation[0, 4] = correlation[4, 0] = -0.8
    return PosteriorHypothesis(
        effects=(Effect("coulomb_friction", 1, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.05}),),
        weight=1.0,
        names=(VISCOUS, INERTIA, STIFFNESS, MASS, COULOMB),
        mean=np.array([0.013, 0.0121, 1.46e6, 500.0, 0.5]),
        covariance=correlation * np.outer(std, std),
        formula_std=np.array([0.0, 0.0, 0.0, 0.0, 0.005]),
    )


def log_seen(name: str = "fresh") -> xr.Dataset:
    time = np.arange(40) * 0.01
    measured = np.stack([np.sin(5 * time), np.cos(5 * time)], axis=1)
    by = ("time_s", "axis")
    return xr.Dataset(
        {
            "measured_torque_nm": (by, measured),
            "simulated_torque_nm": (("draw", *by), np.stack([measured, measured + 0.1]).astype("f4")),
            "predicted_torque_nm": (by, measured + 0.05),
            "low_torque_nm": (by, measured - 0.1),
            "high_torque_nm": (by, measured + 0.2),
        },
        coords={"time_s": ("time_s", time, {"units": "s"}), "axis": [1, 2], "draw": [0, 1]},
        attrs={
            "log": name, "mode": "closed_loop", "inside": 0.95, "inside_per_axis": [0.94, 0.96],
            "diverged": 0,
        },
    )  # fmt: skip


def one_hypothesis() -> Posterior:
    nominal = {VISCOUS: 0.013, INERTIA: 0.0121, STIFFNESS: 1.46e6, MASS: 500.0}
    return Posterior(
        name="by hand",
        verdict="explained",
        simulated=Simulated(
            "two-mass axis",
            "pi_velocity",
            (DrivenAxis("axis1", RATIO, False, True), DrivenAxis("axis2", 0.02, False, False)),
            nominal,
        ),
        parameters=(
            own(VISCOUS, 0.013, "Nm s/rad", 0.1),
            own(INERTIA, 0.0121, "kg m^2", 0.1),
            own(STIFFNESS, 1.46e6, "Nm/rad"),
            own(MASS, 500.0, "kg"),
            cause(COULOMB, "Nm", 0.0, 10.0),
        ),
        hypotheses=(leading(),),
        between_runs=(
            BetweenRuns(VISCOUS, 0.0, 0.6, False, (1e-5, -1e-5)),
            BetweenRuns(COULOMB, 0.03, 1e-6, True, (0.03, -0.03)),
            BetweenRuns(MASS, 0.0, None, False, (np.nan, np.nan)),
        ),
        bootstrap_std={VISCOUS: 3.1e-4, COULOMB: 0.021},
        held_out=(log_seen(),),
        seed=3,
        version="0",
    )


def two_hypotheses() -> Posterior:
    """Return the same, with a rival of weight 0.25 that has an offset in place of friction."""
    first = one_hypothesis()
    known = leading()
    rival = PosteriorHypothesis(
        effects=(Effect("torque_offset", 1, {"offset_nm": -0.4}),),
        weight=0.25,
        names=(VISCOUS, OFFSET),
        mean=np.array([0.014, -0.4]),
        covariance=np.diag([1e-8, 1e-4]),
        formula_std=np.zeros(2),
    )
    return replace(
        first,
        verdict="undecidable",
        parameters=(*first.parameters, cause(OFFSET, "Nm", -10.0, 10.0)),
        hypotheses=(replace(known, weight=0.75), rival),
        without_values={"sensor_delay@1": "no log tells it from another"},
    )

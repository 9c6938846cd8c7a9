"""The fit of a posterior goes on to its optimum."""

import numpy as np
import pytest

from axisight import Effect, Settings, diagnose
from axisight.gap.uncertainty import posterior_of as module
from axisight.gap.uncertainty.covariance import inverse, sandwich
from axisight.gap.uncertainty.evaluated import evaluated, least_fall
from axisight.posterior.settings import STEP_LEFT
from gap_data import HELD, PLAN, bare_axis, linear_evidence, logs_of, scattered


def test_the_least_fall_bounds_every_step():
    """No step that promises this fall is longer than 0.1 standard errors, and one is as long."""
    rng = np.random.default_rng(0)
    n = 4000
    x = rng.standard_normal((n, 3)) @ np.array([[1.0, 0.9, 0.0], [0.0, 0.4, 0.3], [0.0, 0.0, 50.0]])
    # Weights say ten times the noise, so estimates scatter far less than the inverse normal equations.
    at = linear_evidence(x, 0.1 * rng.standard_normal(n), np.zeros(n, int))
    normal = np.linalg.inv(inverse(at))
    std = np.sqrt(np.diag(sandwich(at)))
    fall = least_fall(at)
    root = np.linalg.cholesky(np.linalg.inv(normal))
    way = rng.standard_normal((20000, 3))
    steps = np.sqrt(fall) * (way / np.linalg.norm(way, axis=1, keepdims=True)) @ root.T
    assert np.einsum("ni,ij,nj->n", steps, normal, steps) == pytest.approx(fall)
    longest = np.abs(steps / std).max()
    # 20,000 directions come within 1 % of the longest step.
    assert 0.99 * STEP_LEFT < longest <= STEP_LEFT * (1 + 1e-9)


@pytest.fixture(scope="module")
def fitted():
    """Return the fitter and the model of one axis with dry friction at its optimum."""
    kept = {}

    def known(fitter, model):
        kept.setdefault("fitter", fitter)
        return kept.setdefault("at", evaluated(fitter, model))

    robot = bare_axis()
    machine = scattered(robot, 4)
    effect = [Effect("coulomb_friction", 1, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.05})]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "evaluated", known)
        patch.setattr(module, "held_out_torque", lambda *_: ())
        diagnose(
            robot=robot,
            estimation=logs_of(machine, effect, PLAN, seconds=2.0),
            validation=logs_of(machine, effect, HELD, seconds=2.0),
            settings=Settings(bootstrap=50),
            posterior=True,
        )
    return kept["fitter"], kept["at"]


NAMES = ("axis1.damping", "axis1.stiffness", "axis1.motor_inertia")


def test_it_returns_from_steps_that_a_diagnosis_would_leave(fitted):
    """Two standard errors off in four parameters: less than 1e-4 of the loss, which ends an ordinary fit."""
    fitter, at = fitted
    std = dict(zip(at.parameters, np.sqrt(np.diag(sandwich(at))), strict=True))
    off = {name: at.robot_values[name] + 2 * std[None, name] for name in NAMES}
    coulomb = at.effects[0].values()[0] + 2 * std[0, "coulomb_nm"]
    free = [at.free[0].at({"coulomb_nm": coulomb})]
    moved = fitter.fit(free, at, robot_values={**at.robot_values, **off}, max_iterations=0)
    found = evaluated(fitter, moved)
    left = (found.effects[0].values()[0] - at.effects[0].values()[0]) / std[0, "coulomb_nm"]
    assert abs(left) < 2 * STEP_LEFT
    for name in NAMES:
        left = (found.robot_values[name] - at.robot_values[name]) / std[None, name]
        # Both ends are within 0.1 standard errors of the optimum.
        assert abs(left) < 2 * STEP_LEFT, name
    # A tenth of the fall that ends an ordinary fit.
    assert found.total == pytest.approx(at.total, rel=1e-5)

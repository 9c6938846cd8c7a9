"""benches/kuka_forward_motion.py: the prior holds its motions, and the search finds a known motion from torques."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from axisight import load_robot
from axisight.rigid_body import DriveTerms, TorqueModel

Array = NDArray[np.float64]
STEP_S, SAMPLES = 0.1, 200


@pytest.fixture
def bench(repository: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(repository / "benches"))
    return import_module


def motions(count: int) -> Array:
    """Return motions (count, n, 6) [rad] from rest to rest: sums of 6 harmonics, so of 12 shapes."""
    rng = np.random.default_rng(4)
    time = np.linspace(0, 1, SAMPLES)
    window = np.sin(np.pi * time) ** 4
    waves = np.exp(2j * np.pi * np.outer(time, np.arange(1, 7)))
    drawn = rng.normal(size=(count, 6, 6)) + 1j * rng.normal(size=(count, 6, 6))
    return 0.15 * window[:, None] * np.real(waves @ drawn)


def physics(bench: Any, repository: Path) -> Any:
    """Return the KUKA KR300 with nominal links and Coulomb and viscous friction."""
    robot = load_robot(repository / "examples/rigid_body/kuka_kr300.toml").with_sample_time(STEP_S)
    terms = DriveTerms(inertia="motor", offset="motor")
    model = TorqueModel(robot, terms=terms, side="motor")
    friction = np.zeros((6, 6))
    friction[:, 2], friction[:, 5] = 0.5, 1.0
    return bench("kuka_forward_physics").Physics(model, model.nominal, friction)


def test_the_prior_holds_motions_of_its_kind(bench: Any) -> None:
    prior = bench("kuka_forward_motion").MotionPrior.of(motions(40), STEP_S)
    unseen = motions(41)[-1]
    # 12 shapes; the spread of one axis over time is that of the draw, to the error of 40 motions of 6 axes.
    held = prior.shapes[0] @ (prior.shapes[0].T @ unseen)
    assert np.abs(held - unseen).max() < 1e-9
    assert prior.size_rad == pytest.approx(motions(400).std(axis=(0, 1)), rel=0.3)
    drawn = np.stack([prior.motion(prior.draw(np.random.default_rng(k)))[0] for k in range(200)])
    assert drawn.std(axis=(0, 1)) == pytest.approx(prior.size_rad, rel=0.15)


def test_the_search_finds_the_motion_of_exact_torques(bench: Any, repository: Path) -> None:
    motion, search = bench("kuka_forward_motion"), bench("kuka_forward_search")
    measured = bench("kuka_forward_physics").measured
    known = motions(41)
    prior = motion.MotionPrior.of(known[:40], STEP_S)
    robot = physics(bench, repository)
    q, v, a = prior.motion(prior.shapes[0].T @ known[-1])
    torque = measured(robot.torque(q, v, a, motion.SOFT_RAD_S))
    errors = 0.02 * torque.std(axis=0) * np.array([[1.0], [3.0]])
    estimator = motion.MotionEstimator(robot, errors, prior, np.ones(SAMPLES, dtype=bool))
    rng = np.random.default_rng(1)
    # Starts with an error of half the motion.
    starts = [estimator.coefficients(q) + 0.5 * (prior.draw(rng) - prior.mean.T) for _ in range(2)]
    rough = min(search.refined(estimator, torque, c)[0] for c in starts)
    cost, found = search.searched(estimator, torque, starts, 4, np.random.default_rng(2))[0]
    assert cost <= rough
    # Torques without errors: what is left is the pull of the prior, less than the torque error of 2 %.
    error = np.sqrt(np.mean((estimator.position(found) - q) ** 2, axis=0)) / q.std(axis=0)
    assert error.max() < 0.02

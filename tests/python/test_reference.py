"""The core against an independent implementation: numbers and trajectories of the shared robot."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from axisight import _core
from axisight.simulation import Integrator

Array = NDArray[np.float64]
Effects = list[tuple[str, int | None, list[float]]]

# The references were converged to 1e-9; the acceptance bound is 1e-5 of the signal.
BOUND = 1e-5
# Torque ripple (order, amplitude [Nm], phase) and resolver ripple of thesis Table 8.1.
TORQUE_RIPPLE = [(3, 0.06, 1.45), (36, 0.11, 0.90), (72, 0.08, 0.20)]
PROPORTIONAL_RIPPLE = (18, 0.04, 0.0)
# An effect takes five waves: an order of zero switches one off.
NO_WAVE = (0, 0.0, 0.0)
RESOLVER_RIPPLE = [(2, 0.4e-3, -1.84), (10, 0.2e-3, 0.81), (12, 0.22e-3, 2.94), (48, 0.18e-3, 2.94)]


def _terms(*waves: tuple[float, float, float]) -> list[float]:
    """``a sin(n x + phase)`` as order, cosine and sine amplitude."""
    return [x for n, a, p in waves for x in (float(n), a * np.sin(p), a * np.cos(p))]


def _ripple() -> Effects:
    out: Effects = []
    for axis in (1, 2, 3):
        out.append(
            ("torque_ripple", axis, _terms(*TORQUE_RIPPLE, NO_WAVE, NO_WAVE, PROPORTIONAL_RIPPLE))
        )
        out.append(("resolver_ripple", axis, _terms(*RESOLVER_RIPPLE, NO_WAVE)))
    return out


TRAJECTORIES: dict[str, Effects] = {
    "nominal": [],
    "ripple": _ripple(),
    "friction_axis2_cubic_axis1": [
        ("coulomb_friction", 2, [0.5, 0.5, 0.0, 0.0]),
        ("nonlinear_stiffness", 1, [2e11]),
    ],
}


@pytest.fixture(scope="module")
def folder(shared: Path) -> Path:
    path = shared / "robot"
    if not (path / "reference.json").is_file():
        pytest.skip(f"reference numbers not found: no reference.json in {path}")
    return path


@pytest.fixture(scope="module")
def robot(folder: Path) -> Any:
    return _core.Robot.from_toml((folder / "robot.toml").read_text())


@pytest.fixture(scope="module")
def reference(folder: Path) -> Any:
    return json.loads((folder / "reference.json").read_text())


def _relative(got: Array, want: Any) -> float:
    return float(np.abs(got - np.array(want)).max() / np.abs(want).max())


def _complex(pairs: Array) -> NDArray[np.complex128]:
    return pairs[..., 0] + 1j * pairs[..., 1]


@pytest.mark.parametrize("quantity", ["inertia_matrix", "bias", "gravity", "inverse_dynamics"])
def test_rigid_body(robot: Any, reference: Any, quantity: str) -> None:
    states = reference["rigid_body"]
    assert len(states) >= 8
    motion = [np.array([s[name] for s in states]) for name in ("q", "v", "a")]
    count = {"inertia_matrix": 1, "bias": 2, "gravity": 1, "inverse_dynamics": 3}[quantity]
    got = getattr(robot, quantity)(*motion[:count])
    # Both sides agree with Pinocchio to rounding.
    assert _relative(got, [s[quantity] for s in states]) < 1e-13


def test_equilibria(robot: Any, reference: Any) -> None:
    for case in reference["equilibria"]:
        got = robot.equilibrium([], case["driven_joint_angle"])
        for name in ("joint_angle", "motor_angle", "motor_torque"):
            # Absolute: rad and Nm of order one, both iterated to rounding.
            assert np.abs(got[name] - case[name]).max() < 1e-12, name


def test_eigenvalues(robot: Any, reference: Any) -> None:
    for case in reference["equilibria"]:
        values = _complex(robot.modes([], case["driven_joint_angle"])[0])
        want = _complex(np.array(case["eigenvalues"]))
        assert len(values) == len(want)
        nearest = np.abs(values[:, None] - want[None, :]).min(axis=0)
        # Rounding of 1e-16 of the largest entry (1e6 / s^2), times eigenvector conditions of 1e3.
        assert nearest.max() < 1e-6


def test_zero_order_hold_response(robot: Any, reference: Any) -> None:
    for case in reference["equilibria"]:
        flat = robot.zoh_response(case["frequency_hz"], [], case["driven_joint_angle"])
        got = flat[:, :, 0::2] + 1j * flat[:, :, 1::2]
        want = _complex(np.array(case["zoh_response_torque_to_motor_position"]))
        for g, w in zip(got, want, strict=True):
            assert np.abs(g - w).max() < 1e-9 * np.abs(w).max()


def _rms_error(got: Array, want: Array) -> float:
    """Largest over the columns, relative to their variation."""
    variation = np.sqrt(np.mean((want - want.mean(axis=0)) ** 2, axis=0))
    return float((np.sqrt(np.mean((got - want) ** 2, axis=0)) / variation).max())


def _columns(frame: pd.DataFrame, prefix: str, count: int) -> Array:
    return np.ascontiguousarray(frame[[f"{prefix}_{i}" for i in range(1, count + 1)]].to_numpy())


# Integrators with sub-steps and tolerance.
METHODS = [
    ("dopri5", 1, 1e-7),
    ("rk4", 4, 1e-7),
    ("rkn4", 4, 1e-7),
    ("radau5", 1, 1e-7),
    ("rodas4", 1, 1e-7),
    ("auto", 1, 1e-7),
    ("dopri5", 1, 1e-5),
    ("radau5", 1, 1e-5),
    ("rodas4", 1, 1e-5),
]


@pytest.mark.parametrize("name", TRAJECTORIES)
@pytest.mark.parametrize("method", METHODS, ids=lambda m: f"{m[0]}-{m[2]:.0e}")
def test_trajectory(robot: Any, folder: Path, name: str, method: tuple[str, int, float]) -> None:
    frame = pd.read_parquet(folder / f"trajectory_{name}.parquet")
    kind, substeps, tolerance = method
    out = _core.simulate_batch(
        robot,
        TRAJECTORIES[name],
        _columns(frame, "velocity_ref", 3)[None],
        reference=True,
        integrator=Integrator(kind, tolerance, substeps),
    )
    assert out["status"] == ["completed"]
    assert _rms_error(out["torque_cmd_nm"][0], _columns(frame, "torque_cmd", 3)) <= BOUND
    assert _rms_error(out["position_rad"][0], _columns(frame, "position", 3)) <= BOUND
    assert _rms_error(out["joint_position_rad"][0], _columns(frame, "joint", 7)) <= BOUND


def test_effects_matter_in_the_trajectories(robot: Any, folder: Path) -> None:
    """Without its effects the simulation misses each log: the bound above has teeth."""
    for name in ("ripple", "friction_axis2_cubic_axis1"):
        frame = pd.read_parquet(folder / f"trajectory_{name}.parquet")
        reference = _columns(frame, "velocity_ref", 3)[None]
        out = _core.simulate_batch(robot, [], reference, reference=True, integrator=Integrator())
        assert _rms_error(out["torque_cmd_nm"][0], _columns(frame, "torque_cmd", 3)) > 1e3 * BOUND

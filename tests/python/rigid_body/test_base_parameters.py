"""Base parameters: closed forms, Pinocchio's rank, and that nothing is lost."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import axisight.rigid_body.base as base_module
import pinocchio_model
from axisight.errors import AxisightError, InputError
from axisight.rigid_body import USUAL_TERMS, TorqueModel, base_parameters
from rigid_body_data import description, motion, random_chain, robot_of, wrist_arm


def planar(angle_of_gravity: list[float]) -> str:
    """Two links of 0.4 m and 0.3 m that turn about parallel vertical axes."""
    drive = {"gear_ratio": 0.01, "motor_inertia": 1e-3, "viscous_friction": 0.0}
    link = {"mass": 3.0, "com": [0.2, 0.05, 0.1], "inertia": [0.02, 0.03, 0.04, 0.0, 0.0, 0.0]}
    joints = [
        {
            "name": f"axis{i + 1}",
            "kind": "driven",
            "origin": [0.4 * i, 0.0, 0.0],
            "axis": [0.0, 0.0, 1.0],
            "link": link,
            "drive": drive,
        }
        for i in range(2)
    ]
    return description(joints, angle_of_gravity)


def test_closed_form_of_the_planar_arm() -> None:
    """Horizontal: I1 + m2 l^2, m2 c_x, m2 c_y, I2; vertical: the first moment of link 1 too."""
    base = base_parameters(robot_of(planar([0.0, 0.0, -9.81])))
    assert base.combinations == [
        "axis1.inertia_zz + 0.16 axis2.mass",
        "axis2.mass_x",
        "axis2.mass_y",
        "axis2.inertia_zz",
    ]
    assert "axis1.mass" in base.no_effect
    assert "axis2.inertia_xx" in base.no_effect
    base = base_parameters(robot_of(planar([0.0, -9.81, 0.0])))
    assert base.combinations == [
        "axis1.mass_x + 0.4 axis2.mass",
        "axis1.mass_y",
        "axis1.inertia_zz + 0.16 axis2.mass",
        "axis2.mass_x",
        "axis2.mass_y",
        "axis2.inertia_zz",
    ]
    assert base.units[0] == "kg m"


def test_six_axis_arm_has_36() -> None:
    """A 6R arm with a vertical first axis and no parallel wrist axes: 36 (Mayeda et al. 1990)."""
    base = base_parameters(robot_of(wrist_arm()))
    assert len(base) == base.rank == base.rank_qr == 36
    assert base.gap > 1e10
    assert "axis2.mass_z + 1.075 axis3.mass + 1.075 axis4.mass" in base.combinations[2]
    # Rotors: of the first two axes they add to link inertias, of the others they do not.
    base = base_parameters(robot_of(wrist_arm()), terms=USUAL_TERMS)
    assert len(base) == 36 + 4 * 6 - 2
    assert "axis1.motor_inertia" in base.combinations[0]


@pytest.mark.parametrize("seed", range(100, 112))
def test_nothing_is_lost(seed: int) -> None:
    robot = robot_of(random_chain(seed, n_joints=2 + seed % 6))
    model = TorqueModel(robot, terms=USUAL_TERMS)
    base = base_parameters(model)
    q, v, a = motion(robot, 50, seed)
    torque = model.matrix(q, v, a) @ model.nominal
    got = base.regressor(q, v, a) @ base.from_standard(model.nominal)
    # Coefficients come from a random regressor: rounding times its condition, below 1e3.
    np.testing.assert_allclose(got, torque, rtol=0, atol=1e-11 * np.abs(torque).max())
    # Any standard parameters with these base parameters do the same, and the way back is one.
    other = base.to_standard(base.from_standard(model.nominal), prior=np.ones(len(model.names)))
    moved = model.matrix(q, v, a) @ other
    np.testing.assert_allclose(moved, torque, rtol=0, atol=1e-10 * np.abs(torque).max())
    back = base.to_standard(base.from_standard(model.nominal))
    np.testing.assert_allclose(back, model.nominal, rtol=0, atol=1e-10 * np.abs(back).max())
    # What has no effect has none.
    silent = [model.names.index(name) for name in base.no_effect]
    h = model.matrix(q, v, a)
    assert np.abs(h[..., silent]).max(initial=0.0) < 1e-10 * np.abs(h).max()


@pytest.mark.parametrize("seed", range(120, 126))
def test_rank_of_pinocchio_s_regressor(seed: int) -> None:
    text = random_chain(seed, n_joints=6)
    robot = robot_of(text)
    model = pinocchio_model.build(text)
    data = model.createData()
    rows = zip(*motion(robot, 120, seed), strict=True)
    h = np.vstack([pin.computeJointTorqueRegressor(model, data, *row) for row in rows])
    # Pinocchio has columns for massless links as well: leave them out.
    loaded = [i for i, body in enumerate(model.inertias.tolist()[1:]) if body.mass > 0]
    h = h[:, np.concatenate([np.arange(10 * i, 10 * i + 10) for i in loaded])]
    size = np.linalg.norm(h, axis=0)
    h = h[:, size > 1e-10 * size.max()]
    rank = np.linalg.matrix_rank(h / np.linalg.norm(h, axis=0), tol=1e-8)
    assert len(base_parameters(robot)) == rank


def test_a_rank_without_a_gap_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Dependences that hold to a few 1e-6 are taken as such; not if others hold to 1e-4."""
    rng = np.random.default_rng(0)
    factor = rng.normal(size=(20, 20))
    factor[:, 18] = factor[:, 3] + 4e-6 * factor[:, 18]
    monkeypatch.setattr(base_module, "random_factor", lambda *_: factor)
    assert len(base_parameters(robot_of(planar([0.0, 0.0, -9.81])))) == 19
    factor[:, 19] = factor[:, 4] + 1e-4 * factor[:, 19]
    with pytest.raises(AxisightError, match=r"structural rank not clear: 19 .* with a gap of"):
        base_parameters(robot_of(planar([0.0, 0.0, -9.81])))


def test_seed_and_side_change_nothing_but_units_of_rounding() -> None:
    robot = robot_of(wrist_arm())
    base = base_parameters(robot, terms=USUAL_TERMS)
    for other in (
        base_parameters(robot, terms=USUAL_TERMS, seed=11),
        base_parameters(robot, terms=USUAL_TERMS, side="motor"),
    ):
        assert other.names == base.names
        assert other.no_effect == base.no_effect
        np.testing.assert_allclose(other.matrix, base.matrix, rtol=1e-9, atol=1e-9)


def test_known_parameters_are_left_out() -> None:
    robot = robot_of(wrist_arm())
    base = base_parameters(robot, terms=USUAL_TERMS, known=["axis1.inertia_zz", "axis6.mass_y"])
    assert not base.matrix[:, base.model.names.index("axis1.inertia_zz")].any()
    # The next in order stands for the first axis' inertia.
    assert base.names[0] == "axis2.mass"
    assert "axis6.mass_y" not in base.names
    assert "axis1.motor_inertia" in base.combinations[0]


def test_misuse_names_the_field() -> None:
    robot = robot_of(planar([0.0, 0.0, -9.81]))
    model = TorqueModel(robot)
    base = base_parameters(robot)
    for call, message in [
        (lambda: base_parameters(robot, known=["axis9.mass"]), "known: expected names"),
        (lambda: base_parameters(robot, known=model.names), "known: expected at least one"),
        (lambda: base_parameters(robot, seed=-1), "seed: expected an integer"),
        (lambda: base_parameters(model, side="motor"), "expected none of them"),
        (lambda: base_parameters("robot"), "robot: expected a Robot"),
        (lambda: base.from_standard([1.0]), "parameters: expected 20 finite numbers"),
        (lambda: base.to_standard(np.full(4, np.nan)), "base: expected 4 finite numbers"),
        (lambda: base.to_standard(np.ones(4), prior="x"), "prior: expected 20 numbers"),
    ]:
        with pytest.raises(InputError, match=message):
            call()

"""The code for Isaac Lab calls functions with arguments that exist, by the table of Isaac Lab 2.3."""

import ast
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from fake_torch import installed, tensor
from isaac_lab_names import (
    ACTUATOR,
    ATTRIBUTES,
    DATA,
    DISTRIBUTIONS,
    EVENTS,
    METHODS,
    MODES,
    OPERATIONS,
    VIEW,
    bound,
    used,
)

from axisight.posterior import PosteriorHypothesis, PosteriorParameter, randomization
from axisight.posterior.parameter import Prior
from posterior_data import one_hypothesis, two_hypotheses

NUMBER = 6


def term(func=None, params=None, mode="", **others):
    assert not others
    return SimpleNamespace(func=func, params=params or {}, mode=mode)


def entity(name, joint_names=None, body_names=None):
    return SimpleNamespace(name=name, joint_names=joint_names, body_names=body_names)


def servo():
    """Return a posterior of two gains of a servo, which correlate."""
    names = ("axis1.kp", "axis1.kd")
    quantities = ("relative_proportional", "relative_integral")
    parameters = tuple(
        PosteriorParameter(
            name, "1", "own", 1, "controller_gain", q, 0.0, -0.5, 0.5, Prior("normal", 0.0, 0.1)
        )
        for name, q in zip(names, quantities, strict=True)
    )
    one = PosteriorHypothesis((), 1.0, names, np.array([0.1, 0.2]), np.eye(2) * 1e-4, np.zeros(2))
    base = replace(one_hypothesis(), parameters=parameters, hypotheses=(one,), between_runs=())
    return replace(base, simulated=replace(base.simulated, controller="pd_position"))


POSTERIORS = {
    "ranges": one_hypothesis,
    "joint draw": lambda: replace(one_hypothesis(), between_runs=()),
    "rivals": two_hypotheses,
    "servo": servo,
}


@pytest.fixture(params=POSTERIORS)
def written(request, monkeypatch):
    """Return the source, and its scope beside stand-ins."""
    installed(
        monkeypatch,
        {
            "isaaclab.envs": {"mdp": SimpleNamespace(**{name: name for name in EVENTS})},
            "isaaclab.managers": {"EventTermCfg": term, "SceneEntityCfg": entity},
            "isaaclab.utils": {"configclass": lambda kind: kind},
        },
    )
    text = randomization(POSTERIORS[request.param](), "isaaclab").text
    scope: dict = {}
    exec(compile(text, "code", "exec"), scope)
    return text, scope


def test_events_have_functions_and_arguments_that_exist(written):
    _, scope = written
    terms = [x for x in vars(scope["AxisightEvents"]).values() if isinstance(x, SimpleNamespace)]
    assert terms
    for one in terms:
        assert one.mode in MODES
        if callable(one.func):
            assert set(one.params) == {"asset_cfg"}
            continue
        assert set(one.params) <= set(EVENTS[one.func])
        assert one.params["operation"] in OPERATIONS
        assert one.params["distribution"] in DISTRIBUTIONS
        # Isaac Lab refuses a factor that is not positive.
        low, high = next(x for name, x in one.params.items() if name.endswith("_params"))
        assert 0 < low <= high


def test_code_uses_attributes_that_exist(written):
    text, _ = written
    found = used(text)
    gains = {f"write_joint_{gain}_to_sim" for gain in ("stiffness", "damping")}
    assert found["asset"] <= ATTRIBUTES and gains <= set(METHODS)
    assert found["data"] <= DATA and found["view"] <= set(VIEW)
    assert found["actuator"] <= ACTUATOR
    # Names of data and methods that the code puts together from a gain.
    built = {
        node.values[0].value
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.JoinedStr) and isinstance(node.values[0], ast.Constant)
    }
    assert built <= {"default_joint_", "write_joint_"}


class Articulation:
    """An articulation of one joint that checks every call against the table."""

    device = "cpu"

    def __init__(self):
        self.calls = []
        ones = tensor(np.ones((NUMBER, 1)))
        self.data = SimpleNamespace(
            default_mass=500 * ones,
            default_joint_stiffness=100 * ones,
            default_joint_damping=10 * ones,
        )
        actuator = SimpleNamespace(
            joint_indices=slice(None),
            is_implicit_model=True,
            stiffness=ones.copy(),
            damping=ones.copy(),
        )
        self.actuators = {"legs": actuator}
        self.root_physx_view = SimpleNamespace(
            get_masses=lambda: tensor(np.zeros((NUMBER, 1))),
            set_masses=lambda data, indices: self.calls.append("set_masses"),
        )

    def __getattr__(self, name):
        if name not in METHODS:
            raise AttributeError(name)

        def call(*arguments, **given):
            bound(name, arguments, given)
            self.calls.append(name)
            return [0], list(arguments)

        return call


class Scene(dict):
    num_envs = NUMBER


def test_calls_bind_to_the_signatures(written):
    _, scope = written
    if "draw_together" not in scope:
        pytest.skip("every number has a range of its own")
    asset = Articulation()
    scope["draw_together"](SimpleNamespace(scene=Scene(robot=asset)), None)
    assert {name for name in asset.calls if name.startswith("write") or name == "set_masses"}


def test_the_table_refuses_other_arguments():
    with pytest.raises(TypeError):
        bound("write_joint_armature_to_sim", (), {"joint_ids": [0]})
    with pytest.raises(TypeError):
        bound("write_joint_armature_to_sim", (1.0,), {"joints": [0]})
    with pytest.raises(AttributeError):
        Articulation().write_joint_spring_to_sim(1.0)

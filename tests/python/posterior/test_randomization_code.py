"""The code for each project runs: in MJX itself, and beside stand-ins for mjlab and Isaac Lab."""

from dataclasses import replace
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from fake_torch import Tensor, installed, tensor

from axisight.posterior import randomization
from posterior_data import one_hypothesis, two_hypotheses

MODEL = """
<mujoco>
  <worldbody>
    <body name="link of axis1">
      <joint name="{joint}" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="500" diaginertia="9 9 9"/>
    </body>
  </worldbody>
  <actuator><motor name="axis1" joint="{joint}"/></actuator>
</mujoco>
"""
NUMBER = 2000


def still():
    """Return a posterior whose two frictions are drawn together."""
    return replace(one_hypothesis(), between_runs=())


def run(text: str) -> dict:
    scope: dict = {}
    exec(compile(text, "code", "exec"), scope)
    return scope


def check_frictions(damping, friction):
    """Moments of the joint draw, within four standard errors; three deviations are cut off."""
    assert damping.mean() == pytest.approx(130, abs=4 * 3 / NUMBER**0.5)
    assert friction.mean() == pytest.approx(50, abs=4 * 2.06 / NUMBER**0.5)
    assert friction.std() == pytest.approx(np.hypot(2, 0.5), rel=4 / (2 * NUMBER) ** 0.5 + 0.03)
    assert np.corrcoef(damping, friction)[0, 1] == pytest.approx(-0.776, abs=4 / NUMBER**0.5)


def test_playground_in_mjx():
    jax = pytest.importorskip("jax")
    mjx = pytest.importorskip("mujoco.mjx", exc_type=ImportError)
    model = mujoco.MjModel.from_xml_string(MODEL.format(joint="axis1"))
    code = run(randomization(still(), "playground").text)
    keys = jax.random.split(jax.random.PRNGKey(0), NUMBER)
    drawn, in_axes = code["make_domain_randomize"](model)(mjx.put_model(model), keys)
    check_frictions(np.asarray(drawn.dof_damping)[:, 0], np.asarray(drawn.dof_frictionloss)[:, 0])
    assert drawn.body_mass.shape == (NUMBER, model.nbody)
    assert in_axes.dof_armature == 0 and in_axes.geom_friction is None
    armature = np.asarray(drawn.dof_armature)[:, 0]
    assert 117 < armature.min() < 118 and 124 < armature.max() < 125


class Asset:
    """An entity of one joint, one body and one actuator, or an articulation of Isaac Lab."""

    def __init__(self):
        self.device, self.written = "cpu", {}
        self.indexing = SimpleNamespace(
            joint_v_adr=tensor([0]),
            joint_ids=tensor([0]),
            body_ids=tensor([1]),
            ctrl_ids=tensor([0]),
        )
        self.data = SimpleNamespace(default_mass=tensor(np.full((NUMBER, 1), 500.0)))
        self.root_physx_view = SimpleNamespace(
            get_masses=lambda: tensor(np.zeros((NUMBER, 1))),
            set_masses=lambda masses, _ids: self.written.update(mass=masses),
        )

    def find_joints(self, pattern):
        assert pattern in ("axis1", r"motor\ of\ axis1")
        return [0], [pattern]

    def find_bodies(self, pattern):
        assert pattern == r"link\ of\ axis1"
        return [0], [pattern]

    def write_joint_armature_to_sim(self, values, joint_ids, env_ids):
        self._wrote("armature", values, joint_ids, env_ids)

    def write_joint_friction_coefficient_to_sim(
        self, values, joint_dynamic_friction_coeff, joint_ids, env_ids
    ):
        assert values is joint_dynamic_friction_coeff
        self._wrote("friction", values, joint_ids, env_ids)

    def write_joint_viscous_friction_coefficient_to_sim(self, values, joint_ids, env_ids):
        self._wrote("viscous", values, joint_ids, env_ids)

    def _wrote(self, name, values, joint_ids, env_ids):
        assert values.shape == (len(env_ids), len(joint_ids))
        self.written[name] = values


def term(**given):
    return SimpleNamespace(**given)


def named(name, **given):
    return SimpleNamespace(name=name, **given)


def mjlab_scope(monkeypatch, found, **options):
    def marked(*fields, recompute):
        return lambda function: setattr(function, "fields", fields) or function

    levels = SimpleNamespace(none=0, set_const_0=2, set_const=3)
    functions = {f"joint_{k}": k for k in ("armature", "damping", "friction", "stiffness")}
    installed(
        monkeypatch,
        {
            "mjlab.envs.mdp": {"dr": SimpleNamespace(**functions, body_mass="mass")},
            "mjlab.managers.event_manager": {
                "EventTermCfg": term, "RecomputeLevel": levels, "requires_model_fields": marked,
            },
            "mjlab.managers.scene_entity_config": {"SceneEntityCfg": named},
        },
    )  # fmt: skip
    return run(randomization(found, "mjlab", **options).text)


def test_mjlab_writes_the_draws_into_the_model(monkeypatch):
    code = mjlab_scope(monkeypatch, still())
    model = SimpleNamespace(
        dof_damping=np.zeros((NUMBER, 1)).view(Tensor),
        dof_frictionloss=np.zeros((NUMBER, 1)).view(Tensor),
    )
    sim = SimpleNamespace(model=model, get_default_field=None)
    env = SimpleNamespace(scene={"robot": Asset()}, sim=sim, num_envs=NUMBER, device="cpu")
    code["draw_together"](env, None)
    assert code["draw_together"].fields == ("dof_damping", "dof_frictionloss")
    check_frictions(model.dof_damping[:, 0], model.dof_frictionloss[:, 0])
    before = model.dof_damping.copy()
    code["draw_together"](env, tensor([3, 5]))
    assert np.flatnonzero((model.dof_damping != before)[:, 0]).tolist() == [3, 5]
    ranges = code["EVENTS"]["axisight_armature_startup"].params["ranges"]
    assert ranges == {"axis1": (117.08, 124.92)}


def test_mjlab_scales_bodies_and_writes_springs_of_gears(monkeypatch):
    found = two_hypotheses()
    code = mjlab_scope(monkeypatch, found, elastic_gears=True)
    names = ("dof_damping", "dof_frictionloss", "dof_armature", "jnt_stiffness")
    model = SimpleNamespace(**{n: np.zeros((NUMBER, 1)).view(Tensor) for n in names})
    model.body_mass = np.zeros((NUMBER, 2)).view(Tensor)
    nominal = {"body_mass": tensor([0.0, 480.0])}
    sim = SimpleNamespace(model=model, get_default_field=nominal.get)
    env = SimpleNamespace(scene={"robot": Asset()}, sim=sim, num_envs=NUMBER, device="cpu")
    code["draw_together"](env, None)
    # A factor on the mass of the user's model; the rival keeps the nominal mass.
    assert model.body_mass[:, 1].mean() == pytest.approx(480, rel=4 * 0.004 / NUMBER**0.5)
    assert np.all(model.body_mass[:, 0] == 0)
    assert model.jnt_stiffness.mean() == pytest.approx(1.46e6, rel=0.01)
    rival = model.dof_frictionloss[:, 0] == 0
    assert rival.mean() == pytest.approx(0.25, abs=4 * (0.1875 / NUMBER) ** 0.5)
    assert model.dof_damping[rival, 0].mean() == pytest.approx(140, rel=0.01)


def test_isaac_lab_writes_the_draws(monkeypatch):
    functions = ("randomize_rigid_body_mass", "randomize_joint_parameters")
    installed(
        monkeypatch,
        {
            "isaaclab.envs": {"mdp": SimpleNamespace(**{n: n for n in functions})},
            "isaaclab.managers": {"EventTermCfg": term, "SceneEntityCfg": named},
            "isaaclab.utils": {"configclass": lambda kind: kind},
        },
    )
    code = run(randomization(still(), "isaaclab").text)
    asset = Asset()
    env = SimpleNamespace(scene=Scene(asset), num_envs=NUMBER)
    code["draw_together"](env, None)
    check_frictions(asset.written["viscous"][:, 0], asset.written["friction"][:, 0])
    events = code["AxisightEvents"]
    assert events.mass_2.params["mass_distribution_params"] == (0.99216, 1.00784)
    assert events.mass_2.params["recompute_inertia"] is False
    assert events.together.mode == "startup"
    # With open rivals everything is drawn together, masses and rotors too.
    code = run(randomization(two_hypotheses(), "isaaclab").text)
    code["draw_together"](env, None)
    assert asset.written["mass"].mean() == pytest.approx(500, rel=1e-3)
    assert asset.written["armature"].mean() == pytest.approx(121, rel=5e-3)


class Scene(dict):
    """A scene with one asset."""

    num_envs = NUMBER

    def __init__(self, asset):
        super().__init__(robot=asset)

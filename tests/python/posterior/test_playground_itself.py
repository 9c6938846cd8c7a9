"""The code for MuJoCo Playground in its own wrapper for training, on the CPU.

Playground has an environment of its own: `docs/posterior.md` says how to run this.
"""

import functools
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from axisight.posterior import randomization
from posterior_data import one_hypothesis

pytest.importorskip("mujoco_playground")

import jax
import jax.numpy as jp
from ml_collections import config_dict
from mujoco import mjx
from mujoco_playground import MjxEnv, State
from mujoco_playground._src import mjx_env
from mujoco_playground._src.wrapper import wrap_for_brax_training

NUMBER = 8
MODEL = """
<mujoco>
  <option timestep="0.002" iterations="2" ls_iterations="2"/>
  <worldbody>
    <body name="link of axis1">
      <joint name="axis1" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="500" diaginertia="9 9 9"/>
    </body>
  </worldbody>
  <actuator><motor name="axis1" joint="axis1"/></actuator>
</mujoco>
"""


class Axis(MjxEnv):
    """One joint with a motor: the observation is its speed [rad/s]."""

    def __init__(self):
        super().__init__(config_dict.create(ctrl_dt=0.002, sim_dt=0.002))
        self._mj_model = mujoco.MjModel.from_xml_string(MODEL)
        self._mjx_model = mjx.put_model(self._mj_model)

    def reset(self, rng):
        del rng
        data = mjx.make_data(self._mjx_model)
        return State(data, data.qvel, jp.zeros(()), jp.zeros(()), {}, {})

    def step(self, state, action):
        data = mjx_env.step(self._mjx_model, state.data, action, 1)
        return state.replace(data=data, obs=data.qvel)

    xml_path = property(lambda self: "")
    action_size = property(lambda self: 1)
    mj_model = property(lambda self: self._mj_model)
    mjx_model = property(lambda self: self._mjx_model)


def test_every_environment_moves_with_its_own_inertia():
    env = Axis()
    scope: dict = {}
    still = replace(one_hypothesis(), between_runs=())
    exec(compile(randomization(still, "playground").text, "code", "exec"), scope)
    draw = scope["make_domain_randomize"](env.mj_model)
    keys = jax.random.split(jax.random.PRNGKey(0), NUMBER)
    wrapped = wrap_for_brax_training(
        env, episode_length=10, randomization_fn=functools.partial(draw, rng=keys)
    )
    state = jax.jit(wrapped.reset)(keys)
    state = jax.jit(wrapped.step)(state, jp.full((NUMBER, 1), 1000.0))
    drawn, _ = draw(env.mjx_model, keys)
    # The first step from rest: torque less dry friction over inertia. Dry friction is a soft constraint.
    armature = np.asarray(drawn.dof_armature)[:, 0]
    most = 0.002 * 1000.0 / (9.0 + armature)
    least = 0.002 * (1000.0 - 60.0) / (9.0 + armature)
    speed = np.asarray(state.obs)[:, 0]
    assert np.ptp(armature) > 1.0
    assert np.all((speed > 0.99 * least) & (speed < 1.01 * most))
    assert np.corrcoef(speed, 1 / (9.0 + armature))[0, 1] > 0.8

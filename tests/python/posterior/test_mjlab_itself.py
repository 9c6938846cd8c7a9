"""The code for mjlab in mjlab itself, on the CPU: startup and reset events, and every kind of servo.

mjlab 1.6 needs MuJoCo 3.11, so it has an environment of its own: `docs/posterior.md` says how to run this.
"""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from axisight.posterior import Posterior, PosteriorHypothesis, PosteriorParameter, randomization
from axisight.posterior.parameter import Prior
from posterior_data import RATIO, one_hypothesis, two_hypotheses

pytest.importorskip("mjlab")

import mjlab.actuator as actuators
import torch
from mjlab.entity import EntityArticulationInfoCfg, EntityCfg
from mjlab.envs import ManagerBasedRlEnv, ManagerBasedRlEnvCfg
from mjlab.scene import SceneCfg

NUMBER = 400
MODEL = """
<mujoco>
  <worldbody>
    <body name="base"><geom type="sphere" size="0.1" mass="1"/>
      <body name="link of axis1">
        <joint name="axis1" axis="0 0 1"/>
        <inertial pos="0 0 0" mass="480" diaginertia="9 9 9"/>
      </body>
    </body>
  </worldbody>
  {actuator}
</mujoco>
"""
ELASTIC = """
<mujoco>
  <worldbody>
    <body name="base"><geom type="sphere" size="0.1" mass="1"/>
      <body name="rotor"><joint name="motor of axis1" axis="0 0 1"/>
        <inertial pos="0 0 0" mass="1" diaginertia="9 9 9"/>
        <body name="link of axis1">
          <joint name="axis1" axis="0 0 1"/>
          <inertial pos="0 0 0" mass="480" diaginertia="9 9 9"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
MOTOR = '<actuator><motor name="axis1" joint="axis1"/></actuator>'
EVERY = (".*",)


def environment(text: str, model: str, *servos: object) -> ManagerBasedRlEnv:
    """Return an environment with the events of a file; its startup events are over."""
    scope: dict = {}
    exec(compile(text, "randomization.py", "exec"), scope)
    entity = EntityCfg(
        spec_fn=lambda: mujoco.MjSpec.from_string(model),
        articulation=EntityArticulationInfoCfg(actuators=servos),
    )
    scene = SceneCfg(num_envs=NUMBER, entities={"robot": entity})
    given = ManagerBasedRlEnvCfg(
        decimation=1, scene=scene, events=scope["EVENTS"], episode_length_s=1.0, seed=1
    )
    return ManagerBasedRlEnv(given, device="cpu")


def values(env: ManagerBasedRlEnv, field: str) -> np.ndarray:
    return np.asarray(getattr(env.sim.model, field)[:].cpu()).copy()


def reset(env: ManagerBasedRlEnv, those: list[int]) -> None:
    env.event_manager.apply("reset", torch.tensor(those), global_env_step_count=1)


def test_joint_draws_and_ranges():
    motor = actuators.XmlActuatorCfg(target_names_expr=EVERY)
    still = replace(one_hypothesis(), between_runs=())
    env = environment(randomization(still, "mjlab").text, MODEL.format(actuator=MOTOR), motor)
    damping, friction = values(env, "dof_damping")[:, 0], values(env, "dof_frictionloss")[:, 0]
    # Four standard errors of each moment; three deviations are cut off.
    assert damping.mean() == pytest.approx(130, abs=4 * 3 / NUMBER**0.5)
    assert friction.mean() == pytest.approx(50, abs=4 * 2.06 / NUMBER**0.5)
    assert friction.std() == pytest.approx(2.06, rel=4 / (2 * NUMBER) ** 0.5 + 0.03)
    assert np.corrcoef(damping, friction)[0, 1] == pytest.approx(-0.776, abs=4 / NUMBER**0.5)
    armature, mass = values(env, "dof_armature")[:, 0], values(env, "body_mass")
    assert 117.0 < armature.min() < 118 and 124 < armature.max() < 125
    # A factor on the mass of the user's model; all other bodies stay.
    robot = env.scene["robot"]
    link = int(robot.indexing.body_ids[robot.find_bodies("link of axis1")[0][0]])
    assert mass[:, link].min() / 480 == pytest.approx(0.992, abs=1e-3)
    assert np.flatnonzero(np.ptp(mass, axis=0)).tolist() == [link]


def test_what_varies_between_runs_changes_with_a_reset():
    motor = actuators.XmlActuatorCfg(target_names_expr=EVERY)
    env = environment(
        randomization(one_hypothesis(), "mjlab").text, MODEL.format(actuator=MOTOR), motor
    )
    reset(env, list(range(NUMBER)))
    fields = ("dof_frictionloss", "dof_damping", "dof_armature")
    before = {field: values(env, field) for field in fields}
    reset(env, [3, 5])
    moved = {f: np.flatnonzero(values(env, f) != before[f]).tolist() for f in fields}
    assert moved == {"dof_frictionloss": [3, 5], "dof_damping": [], "dof_armature": []}


def test_elastic_gears_with_open_rivals():
    servo = actuators.BuiltinMotorActuatorCfg(
        target_names_expr=("motor of axis1",), effort_limit=1e4
    )
    text = randomization(two_hypotheses(), "mjlab", elastic_gears=True).text
    env = environment(text, ELASTIC, servo)
    # Friction varies between runs, and every number is drawn together with it.
    reset(env, list(range(NUMBER)))
    # Joints in the order of the model: the rotor, then the gear.
    friction, stiffness = values(env, "dof_frictionloss"), values(env, "jnt_stiffness")
    assert np.all(friction[:, 1] == 0) and np.all(stiffness[:, 0] == 0)
    rival = friction[:, 0] == 0
    assert rival.mean() == pytest.approx(0.25, abs=4 * (0.1875 / NUMBER) ** 0.5)
    assert stiffness[:, 1].mean() == pytest.approx(1.46e6, rel=0.01)


SERVO = {"target_names_expr": EVERY, "stiffness": 100.0, "damping": 10.0, "effort_limit": 50.0}
KINDS = {
    "position": actuators.BuiltinPositionActuatorCfg(**SERVO),
    "pair": actuators.BuiltinPdActuatorCfg(**SERVO),
    "outside": actuators.IdealPdActuatorCfg(**SERVO),
}


def servo_posterior() -> Posterior:
    """Return gains 10 % and 20 % above the nominal ones, a torque constant 30 % above, and a limit of 40 Nm."""
    rows = (
        ("axis1.kp", "own", "controller_gain", "relative_proportional", 0.1),
        ("axis1.kd", "own", "controller_gain", "relative_integral", 0.2),
        ("torque_constant@1.relative_error", "cause", "torque_constant", "relative_error", 0.3),
        ("torque_saturation@1.limit_nm", "cause", "torque_saturation", "limit_nm", 40.0 * RATIO),
    )
    parameters = tuple(
        PosteriorParameter(
            name, "1", kind, 1, effect, quantity, 0.0, -0.9, 100.0, Prior("normal", 0.0, 0.1)
        )
        for name, kind, effect, quantity, _ in rows
    )
    mean = np.array([row[-1] for row in rows])
    one = PosteriorHypothesis(
        (), 1.0, tuple(p.name for p in parameters), mean, np.eye(4) * 1e-12, np.zeros(4)
    )
    base = replace(one_hypothesis(), parameters=parameters, hypotheses=(one,), between_runs=())
    return replace(base, simulated=replace(base.simulated, controller="pd_position"))


@pytest.mark.parametrize("kind", KINDS)
def test_servos(kind):
    """Torque of the servo at rest and in motion, from the numbers that mjlab and the model use."""
    made = randomization(servo_posterior(), "mjlab")
    assert {f.kind for f in made.fields} == {"kp", "kd", "torque", "force_limit"}
    env = environment(made.text, MODEL.format(actuator=""), KINDS[kind])
    servo = env.scene["robot"].actuators[0]
    gain, bias = values(env, "actuator_gainprm")[0], values(env, "actuator_biasprm")[0]
    if kind == "outside":
        assert servo.stiffness[0, 0] == pytest.approx(110, rel=1e-4)
        assert servo.damping[0, 0] == pytest.approx(12, rel=1e-4)
        assert gain[0, 0] == pytest.approx(1.3, rel=1e-4)
        assert servo.force_limit[0, 0] == pytest.approx(40, rel=1e-4)
        return
    # Sums over the actuators of the joint: gain on the command, on the position, on the speed.
    position = gain[0, 0], bias[0, 1]
    assert position == pytest.approx((143, -143), rel=1e-4)
    assert bias[:, 2].sum() == pytest.approx(-15.6, rel=1e-4)
    if kind == "pair":
        assert gain[1, 0] == pytest.approx(15.6, rel=1e-4)
        limits = values(env, "jnt_actfrcrange")[0, 0]
    else:
        limits = values(env, "actuator_forcerange")[0, 0]
    assert limits.tolist() == pytest.approx([-40, 40], rel=1e-4)

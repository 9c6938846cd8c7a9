"""Axes by number or joint name, wherever Python asks for one."""

import numpy as np
import pytest

from axisight import Effect, load_robot, plot_overlay, simulate, to_mujoco
from axisight.errors import InputError, StudyError
from axisight.montecarlo import EffectEntry
from axisight.montecarlo.design import freeze
from axisight.mujoco import apply
from axisight.robot.axis_names import axis_number
from diagnosis_data import explained
from montecarlo_data import small_study

JOINTS = ("shoulder", "elbow", "wrist")
ROBOT = load_robot("irb6600_like")


@pytest.mark.parametrize(
    ("given", "number"), [(2, 2), (np.int64(3), 3), ("elbow", 2), ("shoulder", 1)]
)
def test_number_and_name_stand_for_an_axis(given, number):
    assert axis_number(given, JOINTS) == number


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            "axis2",
            "axis: expected 1 to 3 or a joint name (shoulder, elbow, wrist), got 'axis2'. Did you mean 2?",
        ),
        ("2", "got '2'. Did you mean 2?"),
        ("joint_03", "Did you mean 3?"),
        ("elbw", "Did you mean 'elbow'?"),
        ("Elbow", "Did you mean 'elbow'?"),
        ("axis9", "got 'axis9'"),
        (0, "got 0"),
        (4, "got 4"),
        (True, "got True"),
        (2.0, "got 2.0"),
        (None, "got None"),
    ],
)
def test_another_name_is_refused_with_the_nearest(given, said):
    with pytest.raises(InputError) as caught:
        axis_number(given, JOINTS)
    assert str(caught.value).endswith(said)


def test_without_names_only_numbers_are_expected():
    assert axis_number(2, 3) == 2
    with pytest.raises(InputError, match=r"^axis: expected 1 to 3, got 'elbow'$"):
        axis_number("elbow", 3)


def test_an_effect_by_joint_is_the_effect_by_number():
    reference = np.ones((40, 3))
    named, numbered = (
        Effect("coulomb_friction", axis, {"coulomb_nm": 0.4}) for axis in ("axis2", 2)
    )
    assert named.label == "coulomb_friction@axis2"
    assert ROBOT.placed([named]) == [numbered]
    one, other = (
        simulate(ROBOT, reference, effects=[effect]).torque_cmd_nm.values
        for effect in (named, numbered)
    )
    np.testing.assert_array_equal(one, other)
    assert ROBOT.with_effects([named]).effects == ROBOT.with_effects([numbered]).effects
    changed = named.with_values({"coulomb_nm": 0.5})
    assert ROBOT.placed([changed])[0].parameters == {"coulomb_nm": 0.5}


def test_an_effect_between_two_joints():
    (effect,) = ROBOT.placed([Effect("axis_coupling", axes=("axis3", 1))])
    assert effect.axes == (3, 1)
    with pytest.raises(InputError, match="axes: expected two different axes"):
        Effect("axis_coupling", axes=("axis3",))


def test_a_joint_that_is_not_there_is_refused_where_the_robot_is_known():
    effect = Effect("coulomb_friction", "axsi2")
    with pytest.raises(
        InputError, match=r"effect 'coulomb_friction': axis: .*Did you mean 'axis2'"
    ):
        simulate(ROBOT, np.ones((5, 3)), effects=[effect])
    with pytest.raises(InputError, match=r"robot\.placed\(\[effect\]\)"):
        _ = effect.place
    with pytest.raises(InputError, match="effects: expected Effect, got str"):
        simulate(ROBOT, np.ones((5, 3)), effects=["backlash"])


def test_plots_and_verdicts_take_joint_names():
    found = explained()
    assert found.axis("axis2") == found.axis(2)
    assert found.axis(2).verdict == "explained"
    assert "axis 3" in plot_overlay(found, axis="axis3").get_suptitle()
    for wrong in (lambda: found.axis("axsi2"), lambda: plot_overlay(found, axis="axsi2")):
        with pytest.raises(InputError, match="Did you mean 'axis2'"):
            wrong()


def test_a_study_names_joints_and_is_the_same_study():
    named, numbered = (
        small_study(effect=[EffectEntry(name="backlash", axis=axis, parameters={"damped": 0.1})])
        for axis in ("axis2", 2)
    )
    assert freeze(named) == freeze(numbered)
    wrong = small_study(effect=[EffectEntry(name="backlash", axis="axsi2")])
    with pytest.raises(StudyError, match="Did you mean 'axis2'"):
        freeze(wrong)


def test_effects_in_mujoco_take_the_names_of_its_joints():
    mujoco = pytest.importorskip("mujoco")
    model = to_mujoco(ROBOT)
    data = mujoco.MjData(model)
    data.qvel[:] = 0.5
    mujoco.mj_forward(model, data)
    joints = [model.joint(i).name for i in range(model.njnt)]
    torques = [
        apply(model, data, [Effect("viscous_friction", place, {"viscous_nm_s_rad": 1.0})])
        for place in (joints[1], 2)
    ]
    np.testing.assert_array_equal(*torques)
    assert torques[0][1] < 0
    with pytest.raises(InputError, match="effect 'viscous_friction': axis: expected 1 to"):
        apply(model, data, [Effect("viscous_friction", "axis77")])

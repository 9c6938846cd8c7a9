"""Laws of friction that add nothing to dry friction are held to it."""

from types import SimpleNamespace

import numpy as np
import pytest

from axisight import Effect
from axisight.effects.friction_curves import CURVES, rise_over_high_speed
from axisight.gap.facts.simulator_variant import AS_GIVEN
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.hypotheses.candidates import on_the_motor, one_sided
from axisight.gap.ranking.plainer_law import held_to_plainer
from axisight.gap.search.state import alike
from axisight.gap.simulator.rigid_torque import predicted_torque
from axisight.robot import load_robot
from gap_data import bare_axis

# A level of 0.5 Nm, and one Nm more at standstill that falls over 2 rad/s.
FALLS = {"coulomb_nm": 0.5, "excess_nm": 1.0, "stribeck_speed_rad_s": 2.0}


def stribeck(corner_rad_s: float, **others: float) -> Effect:
    return Effect("stribeck_friction", 1, {**FALLS, "smoothing_rad_s": corner_rad_s, **others})


def held(law: Effect, logp: list[float]) -> np.ndarray:
    """Log-probabilities of dry friction on two axes, a law on the first, and none."""
    effects = [Effect("coulomb_friction", axis, {"coulomb_nm": 0.5}) for axis in (2, 1)]
    tried = [*effects, law]
    fits = [SimpleNamespace(effects=[one]) for one in tried]
    return held_to_plainer(tried, fits, np.array(logp), np.zeros(1, int))


def test_an_excess_shows_as_the_sign_turns():
    # At three corners the sign lacks 5e-3, and the hump a thousandth: of three times the level no more than 0.02.
    assert 1.98 < rise_over_high_speed(stribeck(0.02)) < 2.0
    assert rise_over_high_speed(stribeck(0.02, excess_nm=0.0)) == pytest.approx(0.0, abs=1e-12)
    # The excess is gone where a wide sign has turned: friction only rises with speed.
    assert rise_over_high_speed(stribeck(4.0, excess_nm=0.5)) < 1e-6
    assert rise_over_high_speed(stribeck(0.02, coulomb_nm=0.0)) == float("inf")


def test_the_curve_is_the_law_of_the_core():
    """Oracle: what the motor of an axis without a gear needs more at constant speeds."""
    speed = np.linspace(-5.0, 5.0, 41)[:, None]
    still = np.zeros_like(speed)
    law = stribeck(0.3)
    bare, held_back = (
        predicted_torque(bare_axis().with_effects(effects), AS_GIVEN, (still, speed, still, still))
        for effects in ([], [law])
    )
    curve = CURVES[law.name](speed, law.parameters)
    np.testing.assert_allclose(held_back - bare, curve, rtol=0, atol=1e-12)


@pytest.mark.parametrize(("corner", "likelier"), [(0.02, True), (4.0, False)])
def test_stribeck_friction_that_never_falls_is_dry_friction(corner, likelier):
    """It may fit better by its corner: a tenth as likely as dry friction of its own axis is what is left."""
    found = held(stribeck(corner, excess_nm=0.5), [7.0, -3.0, 2.0, -5.0])
    assert found[[0, 1, 3]] == pytest.approx([7.0, -3.0, -5.0])
    assert found[2] == pytest.approx(2.0 if likelier else -3.0 - np.log(10.0))


def test_what_is_less_likely_stays_as_it_is():
    assert held(stribeck(4.0, excess_nm=0.5), [0.0, 0.0, -9.0, 0.0])[2] == -9.0


@pytest.mark.parametrize(
    ("arm", "light"), [("irb6600_like", []), ("scara_like", []), ("cobot_like", [4, 5, 6])]
)
def test_on_which_side_is_asked_where_the_arm_is_no_light_one(arm: str, light: list[int]):
    """Axes of a wrist move a tenth of their rotors and less, the others three quarters and more."""
    robot = load_robot(arm)
    assert one_sided(robot) == light
    both = Hypothesis(
        Effect(
            "coulomb_friction", 1, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.1, "arm_share": 0.5}
        ),
        ("coulomb_nm", "smoothing_rad_s", "arm_share"),
    )
    motor = on_the_motor(both)
    assert motor.free == ("coulomb_nm", "smoothing_rad_s")
    assert motor.effect.parameters["arm_share"] == 0.0
    # What has no side is left as it is.
    plain = Hypothesis(Effect("viscous_friction", 1), ("viscous_nm_s_rad",))
    assert on_the_motor(plain) is plain


def test_a_second_law_of_one_dry_friction_mends_the_first():
    assert alike(stribeck(0.1), Effect("position_dependent_friction", 1))
    assert alike(Effect("backlash", 1), Effect("nonlinear_stiffness", 1))
    # Friction that grows with speed is another friction.
    assert not alike(stribeck(0.1), Effect("viscous_friction", 1))
    assert not alike(stribeck(0.1), Effect("backlash", 1))


@pytest.mark.parametrize("slack", [True, False])
def test_a_cable_that_does_not_stretch_is_a_constant_torque(slack, monkeypatch):
    """Its stiffness at its bound of zero is not known: a fiftieth of the constant's likelihood is left."""
    tried = [Effect("torque_offset", 1, {"offset_nm": 0.3})]
    tried.append(
        Effect("cable_stiffness", 1, {"stiffness_nm_rad": 5.0 * (not slack), "at_zero_nm": 30.0})
    )
    stiffness = (0, "stiffness_nm_rad")
    fits = [
        SimpleNamespace(
            effects=[e], parameters=(stiffness,), at_bound=(stiffness,) if slack else ()
        )
        for e in tried
    ]
    # A stretch left out takes a hundredth of the stiffness along.
    monkeypatch.setattr(
        "axisight.gap.ranking.plainer_law.steps_without_each",
        lambda *_: np.array([[0.05], [0.05]]),
    )
    found = held_to_plainer(tried, fits, np.array([0.0, 1.0, -9.0]), np.array([0, 0, 1]))
    assert found == pytest.approx([0.0, -np.log(50.0) if slack else 1.0, -9.0])


@pytest.mark.parametrize("unsure", [None, "step", "knee_rad"])
def test_a_knee_that_is_not_known_is_another_stiffness(unsure, monkeypatch):
    """Not by how much the gear changes there, or not where that is."""
    monkeypatch.setattr(
        "axisight.gap.ranking.plainer_law.own_error",
        lambda _fit, name, _at: 2.0 if name == unsure else 0.1,
    )
    softer = Effect("joint_stiffness", 1, {"relative_change": -0.15})
    knee = Effect("piecewise_stiffness", 1, {"step": -0.07, "within": -0.07, "knee_rad": 3e-6})
    fits = [SimpleNamespace(effects=[one]) for one in (softer, knee)]
    found = held_to_plainer([softer, knee], fits, np.array([-3.0, 2.0, -5.0]), np.zeros(1, int))
    assert found[1] == pytest.approx(2.0 if unsure is None else -3.0 - np.log(10.0))


@pytest.mark.parametrize("known", [(), ("cosine_nm",), ("sine_nm",), ("cosine_nm", "sine_nm")])
def test_a_wave_that_is_not_known_is_even_friction(known, monkeypatch):
    """One side of the wave is enough: its phase decides which."""
    monkeypatch.setattr(
        "axisight.gap.ranking.plainer_law.own_error",
        lambda _fit, name, _at: 0.1 if name in known else 2.0,
    )
    even = Effect("coulomb_friction", 1, {"coulomb_nm": 0.5})
    uneven = Effect("position_dependent_friction", 1, {"mean_nm": 0.5, "sine_nm": 1e-3})
    fits = [SimpleNamespace(effects=[one]) for one in (even, uneven)]
    found = held_to_plainer([even, uneven], fits, np.array([-3.0, 2.0, -5.0]), np.zeros(1, int))
    assert found[1] == pytest.approx(2.0 if known else -3.0 - np.log(10.0))

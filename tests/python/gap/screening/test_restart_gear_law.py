"""Laws of a gear held against one that leads: begun where their curves come closest to its."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from axisight import Effect, simulate
from axisight.effects.gear_curves import CURVES
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.ranking.posterior import AxisPosterior
from axisight.gap.screening.restart_gear_law import (
    begun_on_curves,
    best_law,
    on_the_curve,
    others_of_its_gear,
)
from gap_data import bare_axis, reference

STIFFNESS = 1.46e6
VALUES = {
    "backlash": {"half_width_rad": 1e-4, "damped": 0.0},
    "lost_motion": {"softness": 0.6, "half_width_rad": 1e-4, "rounding": 0.3},
    "piecewise_stiffness": {"step": 0.8, "within": -0.3, "knee_rad": 1.5e-4},
    "nonlinear_stiffness": {"cubic_nm_rad3": 2e13},
    "joint_stiffness": {"relative_change": -0.4},
}
FREE = {name: tuple(v for v in values if v != "damped") for name, values in VALUES.items()}
ABOUT_NOTHING = (-3e-4, 3e-4)


def option(name: str, begin: dict, reach: tuple[float, float] = ABOUT_NOTHING, axis: int = 1):
    return Hypothesis(Effect(name, axis, begin), FREE[name], deflections_rad=reach)


@pytest.mark.parametrize("name", CURVES)
def test_laws_are_those_of_simulations(name: str):
    """Newton's law for the driven side, by second differences: 2e-3 at 40 Hz, more where corners are passed."""
    # Hardly damped: what the gear does is what it does at rest.
    robot = bare_axis().with_parameters({"axis1.damping": 5.0})
    step = robot.sample_time_s
    motion = 0.5 * reference("multisine", 3, 6000, step)

    def of(effects: list[Effect]) -> tuple[np.ndarray, np.ndarray]:
        data = simulate(robot, motion, effects=effects)
        assert data.attrs["status"] == "completed"
        joint = data.joint_position_rad.values[:, 0]
        delta = robot.gear_ratio[0] * data.motor_position_rad.values[:, 0] - joint
        return delta[1:-1], np.diff(joint, 2) / step**2

    delta, acceleration = of([])
    inertia = STIFFNESS * (delta @ acceleration) / (acceleration @ acceleration)
    delta, acceleration = of([Effect(name, 1, VALUES[name])])
    torque = STIFFNESS * CURVES[name](delta, VALUES[name], STIFFNESS)
    off = np.std(torque - inertia * acceleration) / np.std(torque)
    assert off < 0.02
    assert np.std(torque - STIFFNESS * delta) > 0.1 * np.std(torque)


@pytest.mark.parametrize("name", CURVES)
def test_a_law_is_found_on_its_own_curve(name: str):
    """From half the sizes; curves are made of some thousand points, of which sixty are compared."""
    begin = {k: v * (0.6 if k in FREE[name] else 1.0) for k, v in VALUES[name].items()}
    found, share = on_the_curve(Effect(name, 1, VALUES[name]), option(name, begin), STIFFNESS)
    assert found.effect.parameters == pytest.approx(VALUES[name], rel=0.05)
    assert share == pytest.approx(1.0, rel=0.01)


def test_a_middle_without_stiffness_is_play():
    soft = {"softness": 0.98, "half_width_rad": 2e-4, "rounding": 0.02}
    begin = option("backlash", {"half_width_rad": 5e-5, "damped": 0.0})
    found, _ = on_the_curve(Effect("lost_motion", 1, soft), begin, STIFFNESS)
    assert found.effect.parameters["half_width_rad"] == pytest.approx(2e-4, rel=0.05)


@pytest.mark.parametrize("width", [2e-5, 1e-4, 3e-4])
def test_a_knee_that_gives_back_what_is_lost_within_is_a_soft_middle(width: float):
    """Even where it is a hundredth of the deflections: of a knee the width is known."""
    knee = Effect("piecewise_stiffness", 1, {"step": 0.6, "within": -0.6, "knee_rad": width})
    soft = {"softness": 0.0, "half_width_rad": 6e-5, "rounding": 0.5}
    found, _ = on_the_curve(knee, option("lost_motion", soft, (-1.1e-3, 1e-3)), STIFFNESS)
    # A corner cannot be sharper than two hundredths of the width.
    assert found.effect.values() == pytest.approx([0.6, width, 0.02], rel=0.01)


def test_about_a_load_a_stiffer_spring_is_a_cube_by_its_slope():
    """Gravity holds the gear where the cube is as stiff; how far it is turned there no motor angle shows."""
    stiffer = Effect("joint_stiffness", 1, {"relative_change": 1.5})
    begin = option("nonlinear_stiffness", {"cubic_nm_rad3": 0.0}, (0.9e-3, 1.1e-3))
    starts = tuple({"cubic_nm_rad3": share * STIFFNESS / 1e-6} for share in (1.0, 10.0))
    found, _ = on_the_curve(stiffer, replace(begin, starts=starts), STIFFNESS)
    cube = found.effect.parameters["cubic_nm_rad3"] / STIFFNESS
    x = next(r.real for r in np.roots([cube, 0, 1, -1e-3]) if abs(r.imag) < 1e-9)
    # The slope changes by twice the share that the torque does within the range, to both sides.
    assert 1 + 3 * cube * x**2 == pytest.approx(2.5, rel=0.03)


def test_what_cannot_bend_as_the_leader_does_is_no_rival():
    """Play and a middle without stiffness bend alike; a spring hardly bends, a cube not at one place."""
    play = Effect("backlash", 1, VALUES["backlash"])
    kept = [o.effect.name for o in OPTIONS[:5] if on_the_curve(play, o, STIFFNESS) is not None]
    assert kept == ["backlash", "lost_motion", "piecewise_stiffness"]
    # Of what is as good as straight nobody can say how it bends.
    tiny = Effect("backlash", 1, {"half_width_rad": 2e-6, "damped": 0.0})
    assert all(on_the_curve(tiny, o, STIFFNESS) is not None for o in OPTIONS[:5])


def test_what_is_no_law_of_a_gear_has_no_curve():
    friction = Effect("viscous_friction", 1)
    spring = option("joint_stiffness", {"relative_change": 0.0})
    assert on_the_curve(friction, spring, STIFFNESS) is None
    leader = Effect("backlash", 1, VALUES["backlash"])
    assert on_the_curve(leader, Hypothesis(friction, ("viscous_nm_s_rad",)), STIFFNESS) is None
    still = option("joint_stiffness", {"relative_change": 0.0}, (0.0, 0.0))
    assert on_the_curve(leader, still, STIFFNESS) is None


def ranked(name: str, score: float, *, renewed: bool = True, beside: tuple = (), free=None):
    effect = Effect(name, 1, VALUES[name])
    fitted = SimpleNamespace(effects=(*beside, effect), robot_values={}, renewed=renewed)
    candidate = SimpleNamespace(effect=effect, free=free or FREE[name])
    trial = SimpleNamespace(label=effect.label, hypothesis=candidate, fitted=fitted)
    return SimpleNamespace(trial=trial, score=score)


VISCOUS = Effect("viscous_friction", 1)
FRICTION = SimpleNamespace(
    trial=SimpleNamespace(hypothesis=SimpleNamespace(effect=VISCOUS)), score=0.95
)
OPTIONS = [option(name, VALUES[name]) for name in CURVES] + [
    option("joint_stiffness", VALUES["joint_stiffness"], axis=2)
]


def others(*standing, options=OPTIONS) -> list[str]:
    return [o.effect.label for o, _ in begun(*standing, options=options)]


def begun(*standing, options=OPTIONS) -> list[tuple[Hypothesis, dict[str, float]]]:
    stood = AxisPosterior(0, standing, 0.0, 0.0)
    return others_of_its_gear(best_law(stood), stood, options, bare_axis())


def test_the_law_that_explains_most_is_the_one_that_others_begin_on():
    """Play leads for a middle without stiffness, which has the better curve; elsewhere friction leads."""
    play, soft, friction = ranked("backlash", 0.8), ranked("lost_motion", 0.9), FRICTION
    assert best_law(AxisPosterior(0, (play, soft), 0.0, 0.0)) is soft
    assert best_law(AxisPosterior(0, (friction, soft), 0.0, 0.0)) is None
    assert best_law(AxisPosterior(1, (soft, play), 0.0, 0.0)) is None


def test_laws_that_stay_behind_begin_again_on_the_curve_of_the_leader():
    leader, near = ranked("piecewise_stiffness", 0.99), ranked("lost_motion", 0.9899)
    far, borrowed = ranked("joint_stiffness", 0.5), ranked("lost_motion", 0.9899, renewed=False)
    # Play cannot bend like this knee: it is no law that is left to try.
    assert others(leader, near, far) == ["nonlinear_stiffness@1"]
    # With sensitivities of another, as good is not good enough.
    assert "lost_motion@1" in others(leader, borrowed)


def test_play_begins_again_with_what_is_damped_in_the_gap_before_others_do():
    play = ranked("backlash", 0.99)
    ((again, _),) = begun(play)
    assert again.free == ("half_width_rad", "damped")
    whole = ranked("backlash", 0.99, free=again.free)
    assert others(whole) == ["lost_motion@1", "piecewise_stiffness@1"]
    # Those would have to become play to be as good.
    assert others(ranked("backlash", 0.999, free=again.free)) == []


def test_play_that_leads_once_more_is_looked_at_once_more():
    led: set[str] = set()

    def standing(**kwargs) -> list[AxisPosterior]:
        return [AxisPosterior(0, (ranked("backlash", 0.99, **kwargs),), 0.0, 0.0)]

    assert len(begun_on_curves(standing(), led, OPTIONS, bare_axis())) == 1
    assert begun_on_curves(standing(), led, OPTIONS, bare_axis()) == []
    whole = standing(free=("half_width_rad", "damped"))
    assert len(begun_on_curves(whole, led, OPTIONS, bare_axis())) == 2


def test_a_second_law_of_a_gear_brings_no_others():
    play = Effect("backlash", 1, VALUES["backlash"])
    assert others(ranked("lost_motion", 0.5, beside=(play,))) == []
    elsewhere = Effect("backlash", 2, VALUES["backlash"])
    assert others(ranked("lost_motion", 0.5, beside=(elsewhere,))) != []

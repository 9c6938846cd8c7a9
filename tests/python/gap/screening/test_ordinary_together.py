"""What every machine has is found on all axes at once, whatever the bodies of the arm."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import rigid_arm
from axisight import Effect, Log, Robot, Settings
from axisight.gap.fit.data_blocks import layout_of
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.ranking.ordinary_first import unsaid
from axisight.gap.screening.free_bodies import FreeBodies
from axisight.gap.screening.ordinary_together import Found, OrdinaryTogether
from axisight.gap.screening.search_round import fresh
from axisight.gap.views.inverse_dynamics import InverseView

AXES = range(1, 7)
SECONDS = 30.0
# Rotors of the machine, and those of every log of the arm.
OWN_ROTORS = np.array([rigid_arm.motor_inertia(mass) for mass in rigid_arm.MASSES])
ROTORS = 2.0 * OWN_ROTORS
# Bodies of a model file that are not those of the machine, as with another tool and other cables.
OTHER_BODIES = {"j4.mass": 4.5, "j5.mass": 1.2, "j6.mass": 2.2, "j3.inertia_scale": 1.3}


def bare(viscous: float = 0.0) -> Robot:
    """Return a simulator without rotors, with the same viscous friction on every axis [Nm s/rad]."""
    text = "\n".join(
        "motor_inertia = 0.0"
        if line.startswith("motor_inertia")
        else f"viscous_friction = {viscous}"
        if line.startswith("viscous_friction")
        else line
        for line in rigid_arm.arm_toml().splitlines()
    )
    return Robot.from_toml(text)


def logged(*, friction: float = 1.0, rotors: float = 1.0) -> Log:
    """A log of the arm with shares of its friction and of its rotors [1]."""
    log = rigid_arm.log_of(bare(), 1, seconds=SECONDS)
    _, speed, acceleration = rigid_arm.motion(1, SECONDS)
    own = rigid_arm.friction_torque(
        speed, np.array(rigid_arm.COULOMB_NM), np.array(rigid_arm.VISCOUS)
    )
    torque = log.torque_nm + (rotors * ROTORS - OWN_ROTORS) * acceleration - (1 - friction) * own
    return replace(log, torque_nm=torque)


def found_by(robot: Robot, log: Log) -> list[Found]:
    view = InverseView(robot, [log], Settings(threads=1))
    model = view.fitter.fit([])
    layout, offered = layout_of(model), view.candidates(model)
    floor = view.floor.expected[model.axis] * model.samples
    bodies = FreeBodies(view.fitter, layout, Settings(threads=1), FreeBodies.among(offered))
    return OrdinaryTogether(model, floor, bodies).found(offered)


def sure_values(found: list[Found]) -> dict[str, tuple[float, tuple[float, float]]]:
    """Return the value and the interval of each cause, by label."""
    out = {}
    for ranked, _ in found:
        fitted = ranked.trial.fitted
        ((name, interval),) = fitted.free[-1].sure.items()
        out[ranked.trial.label] = ((fitted.effects[-1].parameters or {})[name], interval)
    return out


def test_friction_and_rotors_are_found_beside_wrong_bodies():
    found = found_by(bare().with_parameters(OTHER_BODIES), logged())
    values = sure_values(found)
    # Of the rotors, those of the first two axes turn as the bodies behind them do.
    expected = {f"{name}@{k}" for name in ("coulomb_friction", "viscous_friction") for k in AXES}
    assert set(values) == expected | {f"rotor_inertia@{k}" for k in AXES if k > 2}
    true = dict(zip(AXES, rigid_arm.COULOMB_NM, strict=True))
    for label, (value, (low, high)) in values.items():
        assert low <= value <= high
        name, _, axis = label.partition("@")
        if name == "coulomb_friction":
            # The corner of the machine's formula differs from that of the library.
            assert value == pytest.approx(true[int(axis)], rel=0.1), label
    assert all(ranked.probability > 0.99 for ranked, _ in found)


def test_each_posterior_adds_up_to_its_odds():
    for ranked, standing in found_by(bare().with_parameters(OTHER_BODIES), logged()):
        mine = sum(x.nats for x in standing.ledger if x.hypothesis == ranked.trial.label)
        unknown = sum(x.nats for x in standing.ledger if x.hypothesis == "unknown")
        odds = np.log(ranked.probability / standing.p_unknown)
        assert mine - unknown == pytest.approx(odds, abs=1e-6)


def test_a_placeholder_goes_down_to_none_and_not_below():
    """The machine has no friction, and the model file the same on every axis."""
    stated = 40.0
    values = sure_values(found_by(bare(stated), logged(friction=0.0)))
    viscous = {label: x for label, x in values.items() if label.startswith("viscous_friction")}
    assert set(viscous) == {f"viscous_friction@{k}" for k in AXES}
    for value, (low, _) in viscous.values():
        assert low >= -stated
        assert value == pytest.approx(-stated, abs=0.05 * stated)


def test_nothing_is_found_where_nothing_lacks():
    assert found_by(bare(), logged(friction=0.0, rotors=0.0)) == []


def test_a_simulator_with_values_for_each_axis_is_trusted():
    stated = [
        Effect("coulomb_friction", k, {"coulomb_nm": x})
        for k, x in zip(AXES, rigid_arm.COULOMB_NM, strict=True)
    ]
    robot = rigid_arm.arm().with_parameters(
        {f"j{k}.viscous_friction": x for k, x in zip(AXES, rigid_arm.VISCOUS, strict=True)}
    )
    view = InverseView(robot.with_effects(stated), [logged()], Settings(threads=1))
    assert unsaid(view.fitter) == frozenset()
    # Without friction, of which the arm states none.
    view = InverseView(rigid_arm.arm(), [logged()], Settings(threads=1))
    assert unsaid(view.fitter) == {"coulomb_friction", "viscous_friction"}


def test_no_friction_is_negative_in_total():
    """In any comparison, a cause takes away no more than the simulator has."""
    stated = 40.0
    view = InverseView(bare(stated), [logged()], Settings(threads=1))
    offered = view.candidates(view.fitter.fit([]), axes=[2])
    viscous = next(h for h in offered if h.effect.name == "viscous_friction")
    assert viscous.limits("viscous_nm_s_rad")[0] == -stated


def test_a_sure_cause_keeps_its_interval_and_its_place():
    """Of the laws that contain a cause that holds for any bodies, only those that add to it may take its place."""
    sure = Hypothesis(
        Effect("coulomb_friction", 2), ("coulomb_nm",), sure={"coulomb_nm": (1.0, 2.0)}
    )
    model = SimpleNamespace(effects=(sure.effect,), free=(sure,))
    other = [Hypothesis(Effect("asymmetric_friction", axis), ()) for axis in (2, 3)]
    richer = [Hypothesis(Effect("stribeck_friction", axis), ()) for axis in (2, 3)]
    assert sure.limits("coulomb_nm") == (1.0, 2.0)
    assert [h.effect.axis for h in fresh(other, model, set())] == [3]
    assert [h.effect.axis for h in fresh(richer, model, set())] == [2, 3]
    plain = SimpleNamespace(effects=(sure.effect,), free=(replace(sure, sure={}),))
    assert [h.effect.axis for h in fresh(richer, plain, set())] == [2, 3]

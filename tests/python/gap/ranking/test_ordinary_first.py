"""What every machine has comes before what few have: friction and rotors before another arm."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import rigid_arm
from axisight import Effect, Log, Robot, Settings, diagnose
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.ranking.ordinary_first import is_lacked, ordinary_first
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis

AXES = range(1, 7)
# Inertia of a rotor behind its gear, of which the simulator has none.
BARE = Robot.from_toml(
    "\n".join(
        "motor_inertia = 0.0" if line.startswith("motor_inertia") else line
        for line in rigid_arm.arm_toml().splitlines()
    )
)


def standing(axis: int, *labels: str) -> AxisPosterior:
    ranked = tuple(ranked_as(label, 0.5**k) for k, label in enumerate(labels, start=1))
    return AxisPosterior(axis - 1, ranked, 0.0, 0.0)


def ranked_as(label: str, probability: float):
    name, _, axis = label.partition("@")
    hypothesis = Hypothesis(Effect(name, int(axis) if axis else None), ())
    trial = SimpleNamespace(hypothesis=hypothesis, label=label, fitted=None)
    return RankedHypothesis(trial, 0.9, 1.0, 9.0, probability)


def fitter(robot: Robot, *, adds_up: bool = True):
    return SimpleNamespace(robot=robot, adds_up=adds_up)


def test_an_arm_gives_way_to_what_its_axis_lacks():
    before = standing(4, "link_geometry@5", "torque_constant@4", "rotor_inertia@4", "payload")
    after = ordinary_first(before, fitter(BARE), lambda _: True)
    # Effects of the axis itself stay rivals, as do those of the arm behind it.
    labels = [r.trial.label for r in after.ranked]
    assert labels == ["torque_constant@4", "rotor_inertia@4", "payload"]
    assert {a.rule for a in after.ledger} == {"not_a_cause"}


def test_a_rarer_friction_gives_way_too():
    """It may be added beside the ordinary one, as may the other part of a composite."""
    before = standing(4, "quadratic_drag@4", "asymmetric_friction@4", "viscous_friction@4")
    after = ordinary_first(before, fitter(BARE), lambda _: True)
    assert [r.trial.label for r in after.ranked] == ["viscous_friction@4"]


def test_a_composite_whose_ordinary_part_is_found_displaces_no_other_friction():
    """Beside dry and viscous friction an offset is as good a cause as another friction, not a better one."""
    before = standing(4, "viscous_asymmetry@4", "asymmetric_friction@4", "torque_offset@4")
    assert ordinary_first(before, fitter(BARE), lambda _: True) is before


@pytest.mark.parametrize(
    ("labels", "robot", "adds_up", "is_cause"),
    [
        # In closed loop the error of one axis shows on all.
        (("payload", "rotor_inertia@4"), BARE, False, True),
        # What is lacked is no cause.
        (("payload", "rotor_inertia@4"), BARE, True, False),
        # Another axis' own.
        (("payload", "rotor_inertia@5"), BARE, True, True),
        # An effect of the axis itself leads.
        (("torque_constant@4", "rotor_inertia@4"), BARE, True, True),
        # The simulator has it.
        (("payload", "rotor_inertia@4"), rigid_arm.arm(), True, True),
        (
            ("payload", "coulomb_friction@4"),
            BARE.with_effects([Effect("coulomb_friction", 4, {"coulomb_nm": 1.0})]),
            True,
            True,
        ),
    ],
)
def test_elsewhere_nothing_changes(labels, robot, adds_up, is_cause):
    before = standing(4, *labels)
    assert ordinary_first(before, fitter(robot, adds_up=adds_up), lambda _: is_cause) is before


@pytest.mark.parametrize(
    ("label", "lacked"),
    [
        ("coulomb_friction@4", True),
        ("viscous_friction@4", True),
        ("rotor_inertia@4", True),
        # Of its two parts, Coulomb friction is one that every machine has.
        ("asymmetric_friction@4", True),
        ("torque_offset@4", False),
        ("stribeck_friction@4", False),
        ("payload", False),
    ],
)
def test_what_every_machine_has(label, lacked):
    assert is_lacked(ranked_as(label, 1.0), 3, fitter(BARE)) is lacked


# Large rotors behind gears of high ratio, as in cobots: the motion is slow.
ROTORS = 2.0 * np.array(rigid_arm.MASSES)


def logged(seed: int, seconds: float) -> Log:
    """A log of the arm with friction and rotors."""
    log = rigid_arm.log_of(BARE, seed, seconds=seconds)
    _, _, acceleration = rigid_arm.motion(seed, seconds)
    own = np.array([rigid_arm.motor_inertia(mass) for mass in rigid_arm.MASSES])
    return replace(log, torque_nm=log.torque_nm + (ROTORS - own) * acceleration)


@pytest.mark.parametrize("seconds", [12.0, 40.0])
def test_friction_and_rotors_of_all_axes_are_named(seconds):
    """On a short log, too, where the significance of each alone is low."""
    logs = [logged(seed, seconds) for seed in (1, 2)]
    found = diagnose(BARE, logs[:1], validation=logs[1:], settings=Settings(threads=1))
    ordinary = ("coulomb_friction", "viscous_friction", "rotor_inertia")
    assert {c.label for c in found.causes} == {f"{n}@{axis}" for n in ordinary for axis in AXES}
    for c in found.causes:
        if c.effect == "rotor_inertia":
            value = c.parameters["inertia_kg_m2"]
            assert value.low <= ROTORS[c.axis - 1] <= value.high, c.label

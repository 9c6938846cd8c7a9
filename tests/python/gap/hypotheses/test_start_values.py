"""Where a step from nothing promises little, candidates begin where they may be."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from axisight import Effect, Robot, Settings
from axisight.effects import effect_info
from axisight.effects.stated import LEAD
from axisight.gap.hypotheses.ripple_orders import Turning
from axisight.gap.hypotheses.start_context import StartContext, StartData
from axisight.gap.hypotheses.start_values import STARTS, TARGET_STARTS
from axisight.gap.screening.screening import Screening, ScreeningModel
from axisight.gap.views.closed_loop import ClosedLoopView
from axisight.robot_import import import_robot
from gap_data import bare_axis, logs_of

PLAN = {"multisine": ("multisine", 1)}


def screened(effect: Effect):
    """The candidate of an effect that is withheld, the screen, and what there is to explain."""
    view = ClosedLoopView(bare_axis(), logs_of(bare_axis(), [effect], PLAN), Settings())
    model = view.fitter.fit([], refreshes=1)
    (option,) = [o for o in view.candidates(model) if o.effect.label == effect.label]
    noise = float((view.floor.expected[model.axis] * model.samples).sum())
    bench = ScreeningModel(view.fitter, model)
    bench.begin_nominal()
    return option, Screening(bench), model.total - noise


def test_a_cube_that_is_most_of_its_spring_is_found():
    """Ten times as stiff at the deflection of the largest torque: a step from none says little."""
    robot = bare_axis()
    stiffness = robot.parameters()[f"{robot.axis_names[0]}.stiffness"]
    log = logs_of(robot, [], PLAN)[0]
    ratio = abs(float(robot.gear_ratio[0]))
    deflection = float(np.std(log.torque_nm)) / ratio / stiffness
    cubic = 10.0 * stiffness / deflection**2
    option, screen, explainable = screened(
        Effect("nonlinear_stiffness", 1, {"cubic_nm_rad3": cubic})
    )
    start = screen.best_of_starts(option)
    assert start.gain > 0.95 * explainable
    assert (start.option.effect.parameters or {})["cubic_nm_rad3"] == pytest.approx(cubic, rel=0.2)
    (promise,) = screen.starts([option.at({"cubic_nm_rad3": 0.0})])
    assert promise.gain == pytest.approx(start.gain)


def test_a_cube_is_looked_for_where_weight_bends_the_spring():
    """Held by a torque three times as large as what moves it, a spring ten times softer does as much."""
    robot = bare_axis()
    log = logs_of(robot, [], PLAN)[0]
    most = float(np.std(log.torque_nm))
    raised = replace(log, torque_nm=log.torque_nm - log.torque_nm.mean() + 3.0 * most)
    turn = Turning(np.ones(8), np.zeros(8), np.zeros(8), 1e-3)
    at = StartData([[turn]], lambda *_: np.zeros(0), np.zeros(1))

    def first(one):
        trial = StartContext(effect_info("nonlinear_stiffness"), 1, robot, [one], at)
        return STARTS["nonlinear_stiffness"](trial).starts[0]["cubic_nm_rad3"]

    level = replace(log, torque_nm=log.torque_nm - log.torque_nm.mean())
    assert first(level) / first(raised) == pytest.approx(1 + 3.0**2, rel=1e-6)


def test_play_is_looked_for_up_to_that_of_a_gear_which_bends_less():
    option, _, _ = screened(Effect("backlash", 1, {"half_width_rad": 2e-4}))
    for damped, step in ((0.0, 1.26), (1.0, 1.26**2)):
        widths = np.array([s["half_width_rad"] for s in option.starts if s["damped"] == damped])
        assert widths[-1] >= 9e-4 / step
        # Impacts stay in phase from one width to the next; where teeth do not rebound, there are fewer.
        assert np.all(widths[1:] / widths[:-1] < step)


@pytest.mark.parametrize("damped", [0.0, 1.0])
def test_play_is_looked_for_with_teeth_that_rebound_and_such_that_do_not(damped: float):
    true = {"half_width_rad": 2e-4, "damped": damped}
    option, screen, explainable = screened(Effect("backlash", 1, true))
    found = screen.best_of_starts(option)
    assert found.gain > 0.9 * explainable
    values = found.option.effect.parameters or {}
    assert values["damped"] == damped
    assert values["half_width_rad"] == pytest.approx(2e-4, rel=0.1)
    others = tuple(s for s in option.starts if s["damped"] != damped)
    assert screen.best_of_starts(replace(option, starts=others)).gain < found.gain


def test_uneven_friction_is_looked_for_at_its_wave():
    """As much of the residual is promised from there as from the true order, but for a tenth; from a far one not.

    Where the friction is known to be the motor's.
    """
    order = 0.9
    uneven = {"mean_nm": 0.4, "cosine_nm": 0.2, "sine_nm": -0.2, "order": order}
    option, screen, explainable = screened(Effect("position_dependent_friction", 1, uneven))
    found = (option.effect.parameters or {})["order"]
    low, high = option.limits("order")
    assert low < order < high
    orders = [option.at({"order": n, "arm_share": 0.0}) for n in (found, order, 0.3 * order)]
    gains = [screen.starts([one])[0].gain for one in orders]
    assert gains[0] > 0.9 * gains[1] > 0.85 * explainable
    assert gains[2] < gains[0]


@pytest.mark.parametrize("table", [STARTS, {**STARTS, **TARGET_STARTS}])
def test_no_law_of_dry_friction_may_turn_more_sharply_than_another(table):
    """Else a richer law wins by a sharper reversal alone, whatever it adds."""
    turn = Turning(np.ones(8), np.zeros(8), np.full(8, 50.0), 1e-3)
    at = StartData([[turn]], lambda *_: np.zeros(0), np.zeros(1))
    robot = bare_axis()
    log = logs_of(robot, [], PLAN)[0]
    least = set()
    for law in ("coulomb_friction", "asymmetric_friction", "stribeck_friction"):
        start = table[law](StartContext(effect_info(law), 1, robot, [log], at))
        least.add(start.bounds["smoothing_rad_s"][0])
    assert len(least) == 1


SERVO = """<mujoco><worldbody><body><joint name="hinge" axis="0 1 0" armature="0.02"/>
<inertial pos="0 0 -0.1" mass="0.3" diaginertia="5e-4 5e-4 1e-4"/></body></worldbody>
<actuator><position joint="hinge" kp="40" kv="0.6"/></actuator></mujoco>"""


def test_friction_ahead_of_the_speed_is_tried_where_the_simulator_moves_in_steps(tmp_path: Path):
    (tmp_path / "arm.xml").write_text(SERVO)
    turn = Turning(np.ones(8), np.zeros(8), np.full(8, 50.0), 1e-3)
    at = StartData([[turn]], lambda *_: np.zeros(0), np.zeros(1))
    log = logs_of(bare_axis(), [], PLAN)[0]

    def leads(robot: Robot) -> list[float]:
        trial = StartContext(effect_info("coulomb_friction"), 1, robot, [log], at)
        start = TARGET_STARTS["coulomb_friction"](trial)
        assert LEAD not in start.free
        return [begin[LEAD] for begin in start.starts if LEAD in begin]

    assert leads(bare_axis()) == []
    assert leads(import_robot(tmp_path / "arm.xml")) == [0.0, 9.5e-3]

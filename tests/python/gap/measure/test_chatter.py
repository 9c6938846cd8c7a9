"""A machine that chatters leaves to chance what no simulator can follow."""

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest

from axisight import Effect, Settings
from axisight.gap.facts.simulator_variant import AS_GIVEN, Variant
from axisight.gap.fit.data_blocks import layout_of
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.measure.chatter import chance_check, with_chance
from axisight.gap.measure.gap_figures import Stage, Stages
from axisight.gap.search.state import SearchState
from axisight.gap.views.closed_loop import ClosedLoopView
from gap_data import HELD, PLAN, bare_axis, logs_of

PLAY = Variant({}, (Effect("backlash", 1, {"half_width_rad": 1e-4}),))


def of(square: float) -> Stage:
    return Stage((np.full((4, 1), square),), float(np.sqrt(square)))


# Squares: 0.25 before, 0.01 of noise.
def reached(after: float) -> Stages:
    return Stages(of(0.25), of(0.2), of(after), of(0.01))


def judged(
    after: float,
    *,
    runs: float = 0.06,
    followed: float = 0.99,
    causes: Variant = PLAY,
    torque: Callable[[Variant], float] = lambda _: 0.0,
) -> tuple[Stages, Stages]:
    view = SimpleNamespace(
        logs=[],
        settings=Settings(),
        noises=lambda *_: [runs],
        followed=lambda *_: followed,
        torques=lambda variant, _: [torque(variant)],
    )
    stages = reached(after)
    found = SimpleNamespace()
    return stages, with_chance(view, found, [], stages, causes, lambda x: of(abs(x[0])))


def test_the_floor_is_what_two_runs_of_the_machine_differ_by():
    stages, seen = judged(0.06)
    assert seen.floor.mean() == pytest.approx(0.06)
    assert (seen.given, seen.after) == (stages.given, stages.after)
    (said,) = chance_check(stages, seen)
    assert "24.5 % of the torque" in said


def two_courses(variant: Variant) -> float:
    """Take another course where the play is wider than stated: 0.05 of squared torque away."""
    (effect,) = variant.effects
    return 0.05 if effect.parameters["half_width_rad"] > 1e-4 else 0.0


def test_a_thousandth_of_a_number_makes_another_run():
    """Draws on either side of a bifurcation: noise alone shows nothing."""
    stages, seen = judged(0.055, runs=0.01, torque=two_courses)
    assert seen.floor.mean() == pytest.approx(0.01 + 0.05)
    again = judged(0.055, runs=0.01, torque=two_courses)[1]
    assert np.array_equal(again.floor.blocks, seen.floor.blocks)
    # A simulator that is closer than two runs are is on no other course, whatever its numbers make of the torque.
    stages, seen = judged(0.03, runs=0.01, torque=two_courses)
    assert seen is stages
    # A thousandth of the order of a ripple is a turn over many waves: shapes stay.
    ripple = Variant({}, (Effect("torque_ripple", 1, {"order_1": 12.0, "cosine_1_nm": 0.5}),))
    stages, seen = judged(
        0.055,
        runs=0.01,
        causes=ripple,
        torque=lambda v: 0.05 if v.effects[0].parameters["order_1"] != 12.0 else 0.0,
    )
    assert seen is stages
    # A torque in proportion to the number is no chaos.
    stages, seen = judged(
        0.055, runs=0.01, torque=lambda v: 1e-4 * v.effects[0].parameters["half_width_rad"] / 1e-4
    )
    assert seen is stages
    # Nor is another course an excuse for causes that do not explain the logs it is kept on.
    stages, seen = judged(0.055, runs=0.01, torque=two_courses, followed=0.9)
    assert seen is stages


@pytest.mark.parametrize(
    "other",
    [
        # At the floor as it is.
        {"after": 0.0105},
        # Noise makes no more of itself on the machine with its causes.
        {"after": 0.06, "runs": 0.0105},
        {"after": 0.06, "runs": np.nan},
        # By chance alone it would be off by more than it is without causes: nothing is shown.
        {"after": 0.06, "runs": 0.21},
        # Kept on the logs, they do not explain them.
        {"after": 0.06, "followed": 0.9},
        {"after": 0.06, "causes": AS_GIVEN},
    ],
)
def test_elsewhere_the_floor_stays(other: dict):
    stages, seen = judged(**other)
    assert seen is stages
    assert chance_check(stages, seen) == ()


@pytest.fixture(scope="module")
def view() -> ClosedLoopView:
    return ClosedLoopView(bare_axis(), logs_of(bare_axis(), [FRICTION], PLAN), Settings())


FRICTION = Effect("coulomb_friction", 1, {"coulomb_nm": 0.4, "smoothing_rad_s": 0.1})


def test_causes_are_followed_along_other_logs_where_they_are_right(view: ClosedLoopView):
    """All of it with the friction that is there, most of it with half: a quarter is left."""
    baseline = view.fitter.fit([])
    layout = layout_of(baseline)

    def followed(share: float) -> float:
        effect = Effect("coulomb_friction", 1, {"coulomb_nm": share * 0.4, "smoothing_rad_s": 0.1})
        model = view.fitter.fit([Hypothesis(effect, ())], max_iterations=0)
        found = SearchState(baseline, model, np.zeros(1), layout)
        return view.followed(found, logs_of(bare_axis(), [FRICTION], HELD))

    assert followed(1.0) == pytest.approx(1.0, abs=0.01)
    assert followed(0.5) < 0.9


def test_noise_acts_on_the_machine_with_its_causes(view: ClosedLoopView):
    """With play in the gear the same noise makes another torque."""
    logs = view.logs[:1]
    (plain,) = view.noises(logs, 0)
    (same,) = view.noises(logs, 0, AS_GIVEN)
    (other,) = view.noises(logs, 0, PLAY)
    assert np.array_equal(plain, same)
    assert not np.allclose(plain, other)

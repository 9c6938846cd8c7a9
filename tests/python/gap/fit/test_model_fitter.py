"""Models under trial: many candidates in one evaluation, models near runs, groups, best starts."""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, Settings
from axisight.effects import effect_info
from axisight.fitting.divergence import Diverged
from axisight.gap.fit.data_blocks import Layout, layout_of
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis, NormalEquations
from axisight.gap.fit.held_out import linear_gain, linear_step
from axisight.gap.screening.screening import (
    Screening,
    ScreeningModel,
    _first_halves,
    _halves_suffice,
    loudest_logs,
    thinned,
)
from axisight.gap.views.closed_loop import ClosedLoopFitter, ClosedLoopView
from gap_data import bare_axis, linear_evidence, logs_of, scattered

PLAN = {"multisine": ("multisine", 1), "moves": ("moves", 0)}
FRICTION = Effect("coulomb_friction", 1, {"coulomb_nm": 0.4, "smoothing_rad_s": 0.3})
SPRING = Effect("joint_stiffness", 1, {"relative_change": 0.03})


@pytest.fixture(scope="module")
def view() -> ClosedLoopView:
    machine = scattered(bare_axis(), 4)
    logs = logs_of(machine, [Effect("torque_offset", 1, {"offset_nm": 0.4})], PLAN, seconds=1.5)
    return ClosedLoopView(bare_axis(), logs, Settings(block_s=0.25))


@pytest.fixture(scope="module")
def fitter(view: ClosedLoopView) -> ClosedLoopFitter:
    return view.fitter


def model(fitter: ClosedLoopFitter, *effects: Effect, steps: int = 2) -> FittedModel:
    """A fit of the simulator with effects, some steps from its nominal values."""
    free = [Hypothesis(e, (next(iter(e.parameters or {})),)) for e in effects]
    return fitter.fit(free, max_iterations=steps)


def idle(view: ClosedLoopView, at: FittedModel) -> list[Hypothesis]:
    """All candidates that do nothing as they are."""
    present = {e.label for e in at.effects}
    return [o for o in view.candidates(at) if not o.effect.acts and o.effect.label not in present]


def differ(a: NormalEquations, b: NormalEquations) -> float:
    """Largest difference of two evaluations, by the sizes of columns and residual."""
    assert (a.parameters, a.at_bound) == (b.parameters, b.at_bound)
    np.testing.assert_array_equal(a.prior_matrix, b.prior_matrix)
    np.testing.assert_allclose(a.prior_gradient, b.prior_gradient, rtol=1e-12)
    size = np.sqrt(np.diag(b.matrix.sum(axis=0)))
    # Smoothing of a friction that is not there does nothing.
    nothing = size == 0
    assert not a.matrix[:, nothing].any()
    size[nothing] = 1.0
    root = np.sqrt(b.total)
    return max(
        float(np.abs((a.matrix - b.matrix) / np.outer(size, size)).max()),
        float(np.abs((a.gradient - b.gradient) / size).max() / root),
        float(np.abs(a.loss - b.loss).max() / root**2),
    )


# Columns are weighted in pairs, each at the size of the other: a column whose partner is another
# differs by roundings of its largest entry, 1e-15, of which a ten-thousandth may be a typical one: of an
# encoder off centre one wave grows with the angle, the other with its square.
ROUNDING = 1e-11
# With many columns the arm is linear along the run between nodes, alone it is exact: what changes a
# link differs by the curvature of its forces between them.
LINEAR_ARM = 1e-3


@pytest.mark.parametrize("near", [False, True], ids=["exact", "near"])
@pytest.mark.parametrize("effects", [(), (FRICTION,), (SPRING, FRICTION)], ids=len)
def test_candidates_evaluated_together_are_as_alone(view, fitter, effects, near: bool):
    # Where the simulator is as given: it is so for candidates that stand in for parameters of it.
    start = model(fitter, *effects, steps=0)
    runs = fitter.runs(start) if near else None
    options = idle(view, start)
    assert len(options) > 15
    together = fitter.evaluate_each(options, start, runs)
    for option, found in zip(options, together, strict=True):
        alone = fitter.evaluate([*start.free, option], start, near=runs)
        of_the_arm = effect_info(option.effect.name).acts == "arm"
        most = LINEAR_ARM if of_the_arm and not near else ROUNDING
        assert differ(found, alone) < most, option.effect.label


def test_what_stands_in_for_a_fitted_parameter_leaves_it_where_it_is(view, fitter):
    start = model(fitter)
    assert abs(start.robot_values["axis1.stiffness"] / 1.5e6 - 1) > 1e-4
    options = idle(view, start)
    for option, found in zip(options, fitter.evaluate_each(options, start), strict=True):
        # In tandem with a column, and its rounding; nothing has moved.
        assert found.total == pytest.approx(start.total, rel=1e-9)
        stands_for = effect_info(option.effect.name).stands_for
        own = {name for place, name in found.parameters if place is None}
        assert (f"axis1.{stands_for[0]}" if stands_for else "") not in own
        if stands_for is None:
            alone = fitter.evaluate([option], start)
            assert differ(found, alone) < ROUNDING, option.effect.label


def numbered() -> NormalEquations:
    """Entries that say where they come from: two effects of a model, three candidates."""
    names = ["mass", "stiffness", "damping"]
    places: list[tuple[int | None, str]] = [(None, n) for n in names]
    places += [(0, "a"), (1, "b"), (2, "c"), (3, "d"), (3, "e"), (4, "f")]
    row = np.arange(9.0)
    entries = 10 * row[:, None] + row
    return NormalEquations(
        parameters=tuple(places),
        at_bound=((None, "stiffness"), (1, "b"), (3, "e"), (4, "f")),
        matrix=np.stack([entries, 100 + entries]),
        gradient=np.stack([row, 100 + row]),
        loss=np.array([3.0, 4.0]),
        prior_matrix=-entries,
        prior_gradient=-row,
        room={(2, "c"): (-1.0, 2.0), (3, "d"): (-3.0, 4.0), (4, "f"): (-5.0, 6.0)},
    )


@pytest.mark.parametrize(
    ("kept", "fixed", "columns", "bound"),
    [
        (2, set(), [0, 1, 2, 3, 4, 5], [(None, "stiffness"), (1, "b")]),
        (3, set(), [0, 1, 2, 3, 4, 6, 7], [(None, "stiffness"), (1, "b"), (2, "e")]),
        # One that stands in for the stiffness.
        (4, {"stiffness"}, [0, 2, 3, 4, 8], [(1, "b"), (2, "f")]),
    ],
)
def test_one_candidate_of_several_keeps_its_own_columns(kept, fixed, columns, bound):
    every = numbered()
    one = every.without(kept, among=range(2, 5), fixed=fixed)
    wanted = [every.parameters[i] for i in columns]
    # It comes first among the candidates, after the effects of the model.
    assert one.parameters == tuple((2 if p == kept else p, name) for p, name in wanted)
    assert one.at_bound == tuple(bound)
    entries = 10.0 * np.array(columns)[:, None] + columns
    np.testing.assert_array_equal(one.matrix, np.stack([entries, 100 + entries]))
    np.testing.assert_array_equal(one.gradient, [columns, 100.0 + np.array(columns)])
    np.testing.assert_array_equal(one.prior_matrix, -entries)
    np.testing.assert_array_equal(one.prior_gradient, -np.array(columns, float))
    assert one.total == every.total
    names = {2: (2, "c"), 3: (3, "d"), 4: (4, "f")}
    assert one.room == {(2, names[kept][1]): every.room[names[kept]]}


def test_a_step_takes_no_effect_beyond_what_it_can_be():
    """Two columns nearly alike promise most with opposite signs; one of them cannot be negative."""
    rng = np.random.default_rng(2)
    x = rng.normal(size=(400, 2))
    x[:, 1] = x[:, 0] + 0.1 * x[:, 1]
    y = x @ [1.0, -0.4] + 0.01 * rng.normal(size=400)
    found = replace(linear_evidence(x, y, np.repeat([0, 1], 200)), parameters=((0, "a"), (0, "b")))
    # From nothing: the residual is what is missing.
    starts = found.start
    gradient = np.array([-(x[s : s + 20].T @ y[s : s + 20]) for s in starts])
    loss = np.array([(y[s : s + 20] ** 2).sum() for s in starts])
    found = replace(found, gradient=gradient, loss=loss)
    np.testing.assert_allclose(linear_step(found), [1.0, -0.4], atol=0.05)
    bounded = replace(found, room={(0, "b"): (0.0, 5.0)})
    alone = float(x[:, 0] @ y / (x[:, 0] @ x[:, 0]))
    np.testing.assert_allclose(linear_step(bounded), [alone, 0.0], atol=1e-6)
    assert linear_gain(bounded) < linear_gain(found)
    # A bound that it does not meet is none.
    far = replace(found, room={(0, "b"): (-1.0, 5.0)})
    np.testing.assert_array_equal(linear_step(far), linear_step(found))


@pytest.mark.parametrize("near", [False, True], ids=["exact", "near"])
def test_a_loss_is_that_of_the_evaluation(fitter, near: bool):
    start = model(fitter, FRICTION)
    runs = fitter.runs(start) if near else None
    offset = Hypothesis(Effect("torque_offset", 1, {"offset_nm": 0.3}), ("offset_nm",))
    for values in (None, {}):
        free = [*start.free, offset]
        loss = fitter.loss(free, start, robot_values=values, near=runs)
        found = fitter.evaluate(free, start, robot_values=values, near=runs)
        # Weighted with a column or without.
        assert loss == pytest.approx(found.total, rel=1e-9)
        assert loss < 0.9 * start.total or values == {}


def test_around_its_own_runs_a_model_is_as_exact(fitter):
    start = model(fitter, FRICTION)
    runs = fitter.runs(start)
    exact = fitter.loss(start.free, start)
    assert exact == pytest.approx(start.total, rel=1e-9)
    # What the linearised arm leaves out is put back: rounding alone.
    assert fitter.loss(start.free, start, near=runs) == pytest.approx(exact, rel=1e-9)
    # And is not there by itself: another model's runs are another thing.
    nominal = fitter.runs(start, {})
    assert fitter.loss(start.free, start, near=nominal) != pytest.approx(exact, rel=1e-9)
    assert fitter.loss(start.free, start, near=nominal) == pytest.approx(exact, rel=1e-3)


def fitted(*effects: Effect) -> FittedModel:
    """A fit of nothing, with effects in the model."""
    rng = np.random.default_rng(0)
    x, y = rng.normal(size=(200, 2)), rng.normal(size=200)
    fitted = linear_evidence(x, y, np.repeat([0, 1], 100))
    return replace(fitted, effects=effects, free=tuple(Hypothesis(e, ()) for e in effects))


class Valley:
    """A fitter whose loss depends on one number; the simulation fails where ``fails`` says so.

    ``given``: loss with the simulator as given, where that differs from the re-fitted one.
    """

    def __init__(
        self,
        loss: Callable[[float], float],
        fails: float = np.inf,
        given: float | None = None,
    ) -> None:
        self.curve, self.fails, self.given = loss, fails, given
        self.asked: list[float] = []

    def runs(self, *_: object) -> None:
        return None

    def loss(
        self, free: Sequence[Hypothesis], *_: object, robot_values: object = None, **__: object
    ) -> float | Diverged:
        value = (free[-1].effect.parameters or {})["half_width_rad"]
        self.asked.append(value)
        if value > self.fails:
            return Diverged("diverged at sample 5")
        return self.curve(value) if self.given is None or robot_values else self.given


def screen(model: FittedModel, fitter: object = None) -> Screening:
    return Screening(ScreeningModel(fitter or Valley(float), model))  # type: ignore[arg-type]


def candidate(name: str, n_free: int, *, acts: bool = False, axis: int = 1) -> Hypothesis:
    parameters = effect_info(name).parameters
    values = {p.name: p.neutral for p in parameters}
    if acts:
        values[parameters[0].name] = parameters[0].typical
    return Hypothesis(Effect(name, axis, values), tuple(values)[:n_free])


def test_candidates_share_evaluations_of_no_more_parameters_than_the_core_takes():
    options = [
        candidate("viscous_friction", 1),
        candidate("asymmetric_friction", 3),
        candidate("torque_offset", 1),
        candidate("torque_ripple", 6),
        candidate("torque_saturation", 1, acts=True),
        candidate("gravity_compensation", 2),
        candidate("torque_constant", 1, acts=True),
        candidate("stribeck_friction", 4),
        candidate("input_delay", 1),
        candidate("load_dependent_friction", 2, axis=2),
    ]
    screening = screen(fitted())
    groups = screening.groups(options)
    assert sorted(o.effect.label for g in groups for o in g) == sorted(
        o.effect.label for o in options
    )
    by_name = {o.effect.name: [p.effect.name for p in g] for g in groups for o in g}
    for name in ("torque_saturation", "torque_constant"):
        assert by_name[name] == [name]
    # The shape of what is not there changes nothing, and is not evaluated.
    felt = {o.effect.name: len(screening.felt(o).free) for o in options}
    assert (felt["asymmetric_friction"], felt["torque_ripple"], felt["stribeck_friction"]) == (
        2,
        4,
        2,
    )
    assert all(sum(felt[o.effect.name] for o in g) <= 4 for g in groups)
    # 4 + (2 + 2) + (2 + 1 + 1) + (1 + 1): none could be saved.
    assert len(groups) == 2 + 4


def test_what_takes_the_place_of_an_effect_is_evaluated_alone():
    # Stribeck friction contains the Coulomb friction of the model; on another axis it does not.
    here, there = candidate("stribeck_friction", 2), candidate("stribeck_friction", 2, axis=2)
    others = [candidate("torque_offset", 1), candidate("input_delay", 1)]
    groups = screen(fitted(FRICTION)).groups([here, there, *others])
    assert [[o.effect.label for o in g] for g in groups] == [
        ["stribeck_friction@1"],
        ["stribeck_friction@2", "torque_offset@1", "input_delay@1"],
    ]


STARTS = np.geomspace(1e-5, 1e-3, 12)


def play(starts: Sequence[float] = tuple(STARTS)) -> Hypothesis:
    effect = Effect("backlash", 1, {"half_width_rad": 0.0})
    values = tuple({"half_width_rad": float(s)} for s in starts)
    return Hypothesis(effect, ("half_width_rad",), starts=values)


def narrow(width: float, true: float) -> float:
    """Return a loss with a narrow valley. Outside, it rises a little: a wider gap never moves in the same way."""
    return float(2 * (1 + 10 * width) * (1 - np.exp(-((width / true - 1) ** 2) / 0.06)))


@pytest.mark.parametrize("true", [1.1e-5, 7e-5, 1.7e-4, 9.3e-4])
def test_the_bottom_of_a_valley_narrower_than_the_steps_between_starts_is_found(true: float):
    model = fitted()
    # Starts lie a factor of 1.5 apart; the valley falls to half its depth within a fifth.
    fitter = Valley(lambda v: narrow(v, true) * model.total)
    start = screen(model, fitter).best_of_starts(play(STARTS[::-1]))
    found = (start.option.effect.parameters or {})["half_width_rad"]
    # The scan stops within 0.003 of the value; the loss there is 2e-4 of the depth.
    assert found == pytest.approx(true, rel=0.01)
    assert start.gain == pytest.approx(model.total, rel=1e-2)
    assert start.gain == pytest.approx(model.total - fitter.curve(found))


def test_where_no_start_is_better_none_is_looked_at_closer():
    model = fitted()
    fitter = Valley(lambda v: model.total * (1 + 10 * v))
    start = screen(model, fitter).best_of_starts(play())
    assert (start.option.effect.parameters or {})["half_width_rad"] == STARTS[0]
    assert start.gain == pytest.approx(-10 * model.total * STARTS[0])
    # With the simulator as given, and as it was re-fitted.
    assert sorted(fitter.asked) == sorted([*STARTS, *STARTS])


def test_play_in_a_gear_that_is_always_loaded_is_tried_twice():
    """The narrowest and the widest gap leave the same loss: the teeth never part."""
    model = fitted()
    fitter = Valley(lambda v: 1.2 * model.total)
    start = screen(model, fitter).best_of_starts(play())
    assert start.gain == pytest.approx(-0.2 * model.total)
    # With the simulator as given, and as it was re-fitted.
    assert fitter.asked == [STARTS[0], STARTS[-1]] * 2


def test_a_valley_behind_starts_that_rise_is_found():
    """Small widths in a machine with play make it worse: impacts are out of step until the width is right."""
    model, true = fitted(), STARTS[-2]
    fitter = Valley(lambda v: model.total * (1 + 2e3 * v if v < STARTS[6] else (v / true - 1) ** 2))
    start = screen(model, fitter).best_of_starts(play())
    assert (start.option.effect.parameters or {})["half_width_rad"] == pytest.approx(true, rel=0.01)


def test_starts_that_cannot_be_simulated_are_passed_over():
    model, true = fitted(), 5e-5
    fitter = Valley(lambda v: model.total * (v / true - 1) ** 2, fails=3e-4)
    screened = screen(model, fitter)
    start = screened.best_of_starts(play())
    assert (start.option.effect.parameters or {})["half_width_rad"] == pytest.approx(true, rel=0.01)
    assert start.gain == pytest.approx(model.total, rel=1e-3)
    assert screened.bench.skipped == {"backlash@1": "the simulation failed: diverged at sample 5"}


def test_a_single_start_is_a_start():
    model = fitted()
    fitter = Valley(lambda v: model.total * (v / 1e-4 - 1) ** 2)
    start = screen(model, fitter).best_of_starts(play([1.2e-4]))
    assert (start.option.effect.parameters or {})["half_width_rad"] == pytest.approx(1.2e-4)
    assert start.gain == pytest.approx(0.96 * model.total)


def test_where_the_simulator_as_given_is_far_off_the_re_fitted_one_is_begun_from():
    """Play that bends the simulator is found with it as it was, play of a simulator that was off as re-fitted."""
    model = replace(fitted(), robot_values={"axis1.mass": 2.0})
    fitter = Valley(lambda v: 0.1 * model.total, given=3 * model.total)
    start = screen(model, fitter).best_of_starts(play())
    assert start.robot_values == model.robot_values
    assert start.gain == pytest.approx(0.9 * model.total)
    given = screen(model, Valley(lambda v: 0.1 * model.total)).best_of_starts(play())
    assert given.robot_values == {}


def test_each_kind_of_start_has_a_valley_of_its_own():
    """Between two starts that differ in more than the one number there is nothing to look for."""
    model, true = fitted(), 1.7e-4

    class TwoKinds(Valley):
        def loss(self, free: Sequence[Hypothesis], *more: object, **others: object) -> float:
            rebounds = (free[-1].effect.parameters or {})["damped"] == 0.0
            return super().loss(free, *more, **others) + (model.total if rebounds else 0.0)

    fitter = TwoKinds(lambda v: narrow(v, true) * model.total)
    option = play()
    starts = tuple({**s, "damped": d} for d in (0.0, 1.0) for s in option.starts)
    found = screen(model, fitter).best_of_starts(replace(option, starts=starts))
    values = found.option.effect.parameters or {}
    assert values["damped"] == 1.0
    assert values["half_width_rad"] == pytest.approx(true, rel=0.01)
    assert found.gain == pytest.approx(model.total, rel=1e-2)


def test_part_of_the_logs_is_what_they_are_alone(view: ClosedLoopView, fitter: ClosedLoopFitter):
    start = model(fitter, FRICTION)
    kept = start.part([1])
    alone = fitter.part([1])
    # The same columns are warm, so that both see the same sensitivities.
    found = alone.evaluate(kept.free, kept)
    np.testing.assert_allclose(found.loss, kept.loss, rtol=1e-9)
    assert kept.total == pytest.approx(start.loss[start.log == 1].sum())
    np.testing.assert_array_equal(
        kept.residual[: kept.size[0]], start.residual[-kept.size.sum() :][: kept.size[0]]
    )
    option = idle(view, start)[0]
    of_all = fitter.evaluate([*start.free, option], start)
    of_part = alone.evaluate([*kept.free, option], kept)
    np.testing.assert_allclose(
        of_part.gradient, of_all.gradient[start.log == 1], rtol=1e-8, atol=1e-8
    )


def test_the_screen_takes_the_logs_with_most_to_explain_on_every_axis():
    n_logs, n_axes = 6, 2
    log, axis = (x.ravel() for x in np.meshgrid(range(n_logs), range(n_axes), indexing="ij"))
    size = np.ones(len(log), dtype=np.int64)
    layout = Layout(axis, log, log, size)
    above = np.zeros(len(log))
    # Axis 1 errs a thousand times as much as axis 2, which has its error in the last log alone.
    above[axis == 0] = [1e3, 2e3, 3e3, 4e3, 5e3, 0.0]
    above[(axis == 1) & (log == 5)] = 1.0
    # Half of six logs is three; four cost as much.
    assert loudest_logs(above, layout) == [2, 3, 4, 5]
    few = log < 4
    layout = Layout(axis[few], log[few], log[few], size[few])
    assert loudest_logs(above[few], layout) == [0, 1, 2, 3]


def test_the_beginnings_of_logs_screen_as_the_whole():
    true = Effect("coulomb_friction", 1, {"coulomb_nm": 0.4, "smoothing_rad_s": 0.3})
    logs = logs_of(scattered(bare_axis(), 4), [true], PLAN, seconds=8.2)
    view = ClosedLoopView(bare_axis(), logs, Settings())
    whole = model(view.fitter, steps=4)
    above = whole.loss - view.floor.expected[whole.axis] * whole.samples
    screen = thinned(ScreeningModel(view.fitter, whole), above, layout_of(whole))
    half = screen.model
    assert [len(p) for p, *_ in screen.fitter.records] == [len(log.time_s) // 2 for log in logs]
    # Blocks before the cut are those of the whole, but for what the weights smear over it.
    places = list(zip(whole.log.tolist(), whole.axis.tolist(), strict=True))
    for log in range(len(logs)):
        mine, all_of_it = half.loss[half.log == log], whole.loss[whole.log == log]
        np.testing.assert_allclose(mine[:-1], all_of_it[: len(mine) - 1], rtol=0.05)
        assert len(mine) == -(-places.count((log, 0)) // 2)
    # Gains are those of the whole, up to where on the logs the friction shows.
    option = next(o for o in idle(view, whole) if o.effect.label == true.label)
    (of_half,) = screen.starts([option])
    (of_all,) = Screening(ScreeningModel(view.fitter, whole)).starts([option])
    assert of_half.gain == pytest.approx(of_all.gain, rel=0.3)
    # A fit from there takes the sensitivities of the whole model, and none of its own.
    assert of_half.robot_values is whole.robot_values
    # Short logs are not cut.
    assert view.fitter.part([0]).begun(whole.part([0])) is not None
    cut = [(p[:8000], t[:8000], c[:8000], *begun) for p, t, c, *begun in view.fitter.records]
    short = view.fitter.along(cut)
    assert short.begun(whole) is None


def test_beginnings_do_only_where_they_have_their_part_of_every_axis():
    """A play that gravity closes until the last moves is not in the first halves of the logs."""
    log, axis, block = (
        x.ravel() for x in np.meshgrid(range(4), range(2), range(10), indexing="ij")
    )
    layout = Layout(axis, block, log, np.full(len(log), 1000))
    here = np.isin(log, [0, 1, 2, 3])
    first = _first_halves(layout)
    np.testing.assert_array_equal(first, block < 5)
    even = np.full(len(log), 1e4)
    assert _halves_suffice(even, here, first, layout)
    late = np.where((axis == 1) & (block < 8), 100.0, even)
    assert not _halves_suffice(late, here, first, layout)
    # An axis that has nothing has no say.
    nothing = np.where(axis == 1, np.where(block < 8, 0.0, 10.0), even)
    assert _halves_suffice(nothing, here, first, layout)


def turns_of(losses: Sequence[float]) -> int:
    """How often a curve turns between falling and rising."""
    slope = np.sign(np.diff(losses))
    return int(np.sum(slope[1:] != slope[:-1]))


def test_the_loss_over_the_width_of_a_play_is_smooth():
    true = 5e-4
    play_of_machine = Effect("backlash", 1, {"half_width_rad": true})
    logs = logs_of(scattered(bare_axis(), 4), [play_of_machine], PLAN, seconds=4.0)
    view = ClosedLoopView(bare_axis(), logs, Settings())
    tight = copy(view.fitter)
    tight.robot = view.robot
    tight = tight.along(tight.records)
    widths = true * np.linspace(0.9, 1.1, 41)

    def losses(fitter: ClosedLoopFitter) -> list[float]:
        start = fitter.fit([], max_iterations=0)
        return [fitter.loss([play().at({"half_width_rad": float(w)})], start) for w in widths]

    found = losses(view.fitter)
    # The simulator's own parameters are one per cent off.
    assert widths[int(np.argmin(found))] == pytest.approx(true, rel=0.01)
    # A loop as fast as the machine's goes up and down.
    assert turns_of(found) < turns_of(losses(tight)) / 4

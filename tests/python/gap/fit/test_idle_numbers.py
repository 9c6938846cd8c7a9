"""Numbers of an effect that a fit does not need are no cost of it."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.idle_numbers import idle_numbers
from axisight.gap.ranking.fitted_hypothesis import trial
from gap_data import linear_evidence

NAMES = ("cosine_1_rad", "sine_1_rad", "cosine_2_rad", "sine_2_rad")
ORDERS = {"order_1": 2.0, "order_2": 5.0}


def series(sizes: tuple[float, float]) -> FittedModel:
    """A fit of two orders to a residual that has them in these sizes, and noise of one."""
    rng = np.random.default_rng(7)
    angle = rng.uniform(0, 2 * np.pi, 4000)
    x = np.column_stack([f(n * angle) for n in ORDERS.values() for f in (np.cos, np.sin)])
    truth = np.array([sizes[0], 0.0, 0.0, sizes[1]])
    y = x @ truth + rng.standard_normal(len(angle))
    log = np.repeat([0, 1], 2000)
    found = linear_evidence(x, y, log)
    theta = np.linalg.lstsq(x, y, rcond=None)[0]
    effect = Effect("resolver_ripple", 1, {**ORDERS, **dict(zip(NAMES, theta, strict=True))})
    return replace(
        found,
        effects=(effect,),
        free=(Hypothesis(effect, NAMES),),
        parameters=tuple((0, n) for n in NAMES),
    )


def by_a_twentieth(loss: float, without: float, count: float) -> bool:
    return without > (1 + 0.05 / 3 * count) * loss


@pytest.mark.parametrize(
    ("sizes", "idle"), [((1.0, 1.0), 0), ((1.0, 0.02), 3), ((0.02, 1.0), 3), ((0.0, 0.0), 3)]
)
def test_a_term_that_is_not_there_is_idle_and_one_stays(sizes, idle):
    assert idle_numbers(series(sizes), by_a_twentieth) == idle


def test_without_a_term_the_loss_grows_by_what_a_fit_without_it_leaves():
    """Closed form: the least squares of the other columns."""
    found = series((0.4, 0.3))
    asked = []

    def pays(loss: float, without: float, count: float) -> bool:
        asked.append((loss, without))
        assert count == 3.0
        return True

    idle_numbers(found, pays)
    rng = np.random.default_rng(7)
    angle = rng.uniform(0, 2 * np.pi, 4000)
    x = np.column_stack([f(n * angle) for n in ORDERS.values() for f in (np.cos, np.sin)])
    y = x @ np.array([0.4, 0.0, 0.0, 0.3]) + rng.standard_normal(len(angle))
    # The one that costs less is asked for.
    columns = [0, 1]
    left = y - x[:, columns] @ np.linalg.lstsq(x[:, columns], y, rcond=None)[0]
    ((loss, without),) = asked
    assert loss == pytest.approx(found.total)
    assert without == pytest.approx(left @ left, rel=1e-6)


def test_an_effect_does_not_pay_for_it():
    free = Hypothesis(series((1.0, 0.0)).effects[0], NAMES)
    assert trial(free, series((1.0, 1.0))).cost == 6.0
    assert trial(free, series((1.0, 0.0))).cost == 3.0


def load(size: tuple[float, ...], alike: float = 0.0) -> FittedModel:
    """A fit of a load whose coordinates show as three columns, the first two of them ``alike``."""
    rng = np.random.default_rng(11)
    x = rng.standard_normal((4000, 4))
    x[:, 2] += alike * x[:, 1]
    y = x @ np.array(size) + rng.standard_normal(len(x))
    found = linear_evidence(x, y, np.repeat([0, 1], 2000))
    theta = np.linalg.lstsq(x, y, rcond=None)[0]
    names = ("mass_kg", "x_m", "y_m", "z_m")
    effect = Effect("payload", None, dict(zip(names, theta, strict=True)))
    return replace(
        found,
        effects=(effect,),
        free=(Hypothesis(effect, names),),
        parameters=tuple((0, n) for n in names),
    )


def test_coordinates_that_nothing_shows_are_idle():
    def cost(size: tuple[float, ...], alike: float = 0.0) -> float:
        found = load(size, alike)
        return trial(found.free[0], found).cost

    assert cost((2.0, 0.0, 0.0, 0.0)) == 1.0
    assert cost((2.0, 1.0, 0.0, 0.0)) == 2.0
    assert cost((2.0, 1.0, 1.0, 1.0)) == 4.0
    # Either of two that show alike would do, one of them is needed.
    assert cost((2.0, 1.0, 1.0, 0.0), alike=20.0) == 2.0


def cost_of_two(name: str, axis: int | None, values: dict[str, float]) -> float:
    found = load((0.0, 0.0, *values.values()))
    effect = Effect(name, axis, values)
    free = Hypothesis(effect, tuple(values))
    names = ((None, "p"), (None, "q"), *((0, n) for n in values))
    return trial(free, replace(found, effects=(effect,), free=(free,), parameters=names)).cost


def test_a_balancer_that_stands_upright_has_one_number():
    """One that does not, but where its torque is largest, has two: else every constant would be one."""

    def cost(sine: float, cosine: float) -> float:
        return cost_of_two("gravity_compensation", 1, {"sine_nm": sine, "cosine_nm": cosine})

    assert cost(1.0, 1e-3) == 1.0
    assert cost(1e-3, 1.0) == cost(1.0, 1.0) == 2.0


def test_a_base_that_is_tilted_one_way_has_one_number():
    """Of a single axis there is no other way."""

    def cost(x: float, y: float) -> float:
        return cost_of_two("base_tilt", None, {"about_x_rad": x, "about_y_rad": y})

    assert cost(1.0, 1e-3) == cost(0.0, 1.0) == 1.0
    assert cost(1.0, 1.0) == 2.0


def test_of_a_centre_of_mass_one_coordinate_stays():
    found = load((0.0, 0.0, 0.0, 0.0))
    names = ("x_m", "y_m", "z_m")
    effect = Effect("link_com", 1, dict.fromkeys(names, 1e-3))
    three = replace(
        found,
        effects=(effect,),
        free=(Hypothesis(effect, names),),
        parameters=((None, "p"), *((0, n) for n in names)),
    )
    assert trial(three.free[0], three).cost == 1.0

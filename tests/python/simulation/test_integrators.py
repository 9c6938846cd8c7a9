"""Integrators against each other, against SciPy and against closed forms.

The trajectories of an independent implementation are in `test_reference.py`.
"""

from dataclasses import asdict, replace
from itertools import pairwise

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

import axisight
from axisight import Effect, FitOptions, InputError, Robot, _core, effect_info, load_robot
from axisight.simulation import Integrator
from lugre_model import (
    KP,
    LINK_INERTIA,
    MOTOR_INERTIA,
    RATIO,
    SAMPLE_TIME_S,
    VISCOUS,
    Lugre,
    closed_loop,
    jacobian,
    slope,
)

Array = NDArray[np.float64]
CONTROLLED = ("dopri5", "radau5", "rodas4", "auto")
IMPLICIT = ("radau5", "rodas4", "auto")
ARM = load_robot("irb6600_like")
# Without the effects the preset comes with.
TWO_MASSES = load_robot("two_mass_axis").with_effects([])


def positions(run: xr.Dataset) -> Array:
    assert run.attrs["status"] == "completed", (run.attrs["status"], run.attrs["stopped_at"])
    return np.hstack([run["motor_position_rad"].values, run["joint_position_rad"].values])


def sines(n: int, amplitude: float, n_axes: int = 3) -> Array:
    """Velocity references of 5, 6, 7 Hz."""
    t = np.arange(n) * SAMPLE_TIME_S
    return amplitude * np.sin(2 * np.pi * (5 + np.arange(n_axes)) * t[:, None])


# --- the value object --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"method": "euler"}, r"method: expected one of .*rk4, .* auto, got 'euler'"),
        ({"tolerance": 1.0}, r"tolerance: expected between 1e-14 and 1, got 1"),
        ({"method": "auto", "tolerance": np.nan}, r"tolerance: .*NaN"),
        ({"method": "rkn4", "substeps": 0}, r"substeps: expected at least 1, got 0"),
        ({"substeps": -1}, r"substeps: expected at least 1, got -1"),
    ],
)
def test_an_integrator_is_checked_when_made(given: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Integrator(**given)  # type: ignore[arg-type]


def test_integrators_of_fits_and_what_does_not_count() -> None:
    assert FitOptions(substeps=3).integrator == Integrator("rk4", 1e-7, 3)
    # Fixed steps have no tolerance.
    assert Integrator("rk4", tolerance=0.0).tolerance == 0.0
    with pytest.raises(InputError, match="method"):
        _ = FitOptions(method="euler").integrator  # type: ignore[arg-type]


# --- tolerance ---------------------------------------------------------------------------


def fall(method: str, tolerance: float) -> xr.Dataset:
    """The arm let go, sampled so rarely that steps end where the tolerance says."""
    text = ARM.toml
    assert "sample_time = 5.0e-4" in text
    rarely = _core.Robot.from_toml(text.replace("sample_time = 5.0e-4", "sample_time = 2.0e-2"))
    return axisight.simulate(
        Robot(rarely),
        torque_nm=np.zeros((25, 3)),
        start_rad=(0.4, 0.3, -0.5),
        method=method,
        tolerance=tolerance,
    )


@pytest.fixture(scope="module")
def exact() -> Array:
    return positions(fall("dopri5", 1e-13))


@pytest.mark.parametrize("method", CONTROLLED)
def test_error_follows_the_tolerance(method: str, exact: Array) -> None:
    """Errors stay below what the steps may add up to, fall with the tolerance, and cost.

    Below 1e-9 the rounding of positions of 100 rad over thousands of steps shows, 1e-12.
    """
    tolerances = [1e-3, 1e-5, 1e-7, 1e-9]
    runs = [fall(method, tolerance) for tolerance in tolerances]
    size = np.abs(exact).max(axis=0).clip(1e-3)
    errors = [float((np.abs(positions(run) - exact) / size).max()) for run in runs]
    for error, run, tolerance in zip(errors, runs, tolerances, strict=True):
        # The plant damps its errors: each step adds at most its own.
        assert error < run.attrs["steps"] * tolerance
    for loose, tight in pairwise(errors):
        # A hundred times the tolerance. Halved steps overshoot it by up to 2^5.
        assert 100 / 32 < loose / tight < 100 * 32, errors
    for counter in ("right_hand_sides", "steps"):
        counts = [run.attrs[counter] for run in runs]
        assert all(a < b for a, b in pairwise(counts)), (counter, counts)
    implicit = method in ("radau5", "rodas4")
    for run in runs:
        assert (run.attrs["jacobians"] > 0) == (run.attrs["factorizations"] > 0) == implicit
        assert run.attrs["implicit_samples"] == (25 if implicit else 0)


def test_cost_per_step() -> None:
    """What each method evaluates per step; where it starts afresh, one more."""
    run = fall("dopri5", 1e-5)
    # Seven stages, the last of a step being the first of the next; rejected ones are counted.
    afresh = 1 + run.attrs["rejected_steps"]
    assert run.attrs["right_hand_sides"] == 6 * run.attrs["steps"] + afresh
    run = fall("rodas4", 1e-5)
    attempts = run.attrs["steps"] + run.attrs["rejected_steps"]
    assert run.attrs["right_hand_sides"] == 6 * attempts
    assert run.attrs["jacobians"] == run.attrs["factorizations"] == attempts
    run = fall("radau5", 1e-5)
    # Simplified Newton keeps its Jacobian over many steps.
    assert run.attrs["jacobians"] < run.attrs["steps"] / 5
    run = axisight.simulate(ARM, sines(50, 1.0), method="rk4", substeps=3)
    assert (run.attrs["right_hand_sides"], run.attrs["steps"]) == (4 * 3 * 50, 3 * 50)


# --- linear model ------------------------------------------------------------------------


def table_8_1(share: float) -> list[Effect]:
    """Torque and resolver ripple of thesis Table 8.1 on every axis, scaled."""
    torque = [(3, 0.06, 1.45), (36, 0.11, 0.90), (72, 0.08, 0.20), (18, 0.04, 0.0)]
    resolver = [(2, 0.4e-3, -1.84), (10, 0.2e-3, 0.81), (12, 0.22e-3, 2.94), (48, 0.18e-3, 2.94)]
    out = []
    for name, waves in (("torque_ripple", torque), ("resolver_ripple", resolver)):
        terms = [x for n, a, p in waves for x in (n, share * a * np.sin(p), share * a * np.cos(p))]
        names = [p.name for p in effect_info(name).parameters]
        out += [Effect(name, axis, dict(zip(names, terms, strict=False))) for axis in (1, 2, 3)]
    return out


@pytest.mark.parametrize("ripple", [False, True], ids=["smooth", "ripple"])
def test_linear_model_is_the_limit_of_small_motion(ripple: bool) -> None:
    """All that moves the arm scaled down, what the line misses falls with its square."""

    def missed(share: float) -> Array:
        options = {"method": "rk4", "substeps": 8, "effects": table_8_1(share) if ripple else []}
        runs = [
            axisight.simulate(ARM, sines(600, 4 * share), model=model, **options)
            for model in ("linear", "nonlinear")
        ]
        names = ("motor_position_rad", "joint_position_rad", "torque_cmd_nm")
        return np.array([float(np.abs(runs[0][n] - runs[1][n]).max()) for n in names])

    whole, half, quarter, eighth = (missed(0.5**i) for i in range(4))
    # Terms of third order are a tenth of those of second at the full size: orders off by as much.
    assert np.all((np.log2(whole / half) > 1.7) & (np.log2(whole / half) < 2.3))
    for larger, smaller in ((half, quarter), (quarter, eighth)):
        order = np.log2(larger / smaller)
        assert np.all(np.abs(order - 2) < 0.2), order
    # Above rounding, so that the orders mean something.
    assert np.all(eighth > 1e-9)


def test_linear_model_is_the_same_for_every_integrator() -> None:
    """Without ripple it is exact: sub-steps change rounding only, methods nothing at all."""
    reference = sines(200, 4.0)
    runs = [axisight.simulate(ARM, reference, model="linear", method=m) for m in CONTROLLED]
    for run in runs[1:]:
        assert np.array_equal(run["torque_cmd_nm"], runs[0]["torque_cmd_nm"])
        assert run.attrs["right_hand_sides"] == 0
    fine = axisight.simulate(ARM, reference, model="linear", method="rk4", substeps=7)
    # Rounding of positions of 100 rad, 1e-14, through kp / T of 1e4 Nm/rad, over the loop's memory.
    assert np.abs(fine["torque_cmd_nm"] - runs[0]["torque_cmd_nm"]).max() < 1e-7


# --- stiff friction ----------------------------------------------------------------------

# A start and a turn, motor side [rad/s].
TURNING = 4 * np.sin(2 * np.pi * 10 * np.arange(150) * SAMPLE_TIME_S)
# Bristles so stiff that sliding settles at 1e8 / s; and some that every method follows.
STIFF = Lugre(0.5, 1.5, 3.0, 1e-7, 1e-5)
SOFT = Lugre(0.5, 1.5, 3.0, 1e-3, 1e-4)


def friction(parameters: Lugre, n_axes: int = 1) -> list[Effect]:
    return [Effect("presliding_friction", a + 1, asdict(parameters)) for a in range(n_axes)]


def torque_bound(tolerance: float, speed: float) -> float:
    """Steps may be wrong in speed by `tolerance` of it; kp makes a torque of that.

    A motor on its controller forgets it over J / (kp T) = 3.5 samples; as much again for
    the two sides.
    """
    return tolerance * speed * KP * 2 * MOTOR_INERTIA / (KP * SAMPLE_TIME_S)


@pytest.fixture(scope="module")
def oracle() -> dict[Lugre, tuple[Array, Array]]:
    """SciPy's Radau at 1e-9 over a start and a reversal."""
    return {f: closed_loop(TURNING, f, 1e-9) for f in (STIFF, SOFT)}


CASES = [(STIFF, m, 1e-5) for m in IMPLICIT] + [
    (SOFT, m, 1e-7) for m in (*CONTROLLED, "rk4", "rkn4")
]


@pytest.mark.parametrize(("parameters", "method", "tolerance"), CASES)
def test_presliding_friction_as_by_scipy(
    parameters: Lugre,
    method: str,
    tolerance: float,
    oracle: dict[Lugre, tuple[Array, Array]],
) -> None:
    run = axisight.simulate(
        TWO_MASSES,
        TURNING,
        effects=friction(parameters),
        method=method,
        tolerance=tolerance,
        substeps=64,
    )
    states, commands = oracle[parameters]
    bound = torque_bound(tolerance, 4.0)
    assert run.attrs["status"] == "completed"
    assert np.abs(run["torque_cmd_nm"].values[:, 0] - commands).max() < bound
    # A torque held for one sample turns the motor by u T^2 / J.
    angle = bound * SAMPLE_TIME_S**2 / MOTOR_INERTIA * 10
    assert np.abs(run["motor_position_rad"].values[:, 0] - states[:, 0]).max() < angle
    # But for the few samples in which bristles bend, at start and turn: an angle missed by e
    # is F_c e / delta of friction there.
    want = [-parameters.torque(x[2], x[4]) for x in states]
    off = np.abs(run["torque_disturbance_nm"].values[:, 0] - want)
    bending = 1 if parameters is STIFF else 5
    assert np.sort(off)[-2 * bending - 1] < bound


@pytest.mark.parametrize(
    "changes", [{"static_ratio": 1.49}, {"bristle_time_s": 0.0}, {"presliding_rad": 1.01e-3}]
)
def test_a_hundredth_of_a_parameter_shows(
    changes: dict[str, float], oracle: dict[Lugre, tuple[Array, Array]]
) -> None:
    run = axisight.simulate(TWO_MASSES, TURNING, effects=friction(replace(SOFT, **changes)))
    off = np.abs(run["torque_cmd_nm"].values[:, 0] - oracle[SOFT][1]).max()
    assert off > 10 * torque_bound(1e-7, 4.0)


def test_the_model_written_out_has_its_jacobian() -> None:
    x = np.array([0.1, 1e-4, 0.7, 2e-3, 0.4])
    steps = np.diag([1e-6, 1e-9, 1e-5, 1e-8, 1e-6])
    columns = [(slope(x + h, 0.3, SOFT) - slope(x - h, 0.3, SOFT)) / (2 * h.max()) for h in steps]
    want = np.array(columns).T
    # Central differences with these steps are good to 1e-7 of each row.
    assert np.all(np.abs(jacobian(x, SOFT) - want) < 1e-6 * np.abs(want).max(axis=1)[:, None])


@pytest.fixture(scope="module")
def stiff_arm() -> dict[str, xr.Dataset]:
    """The arm with stiff bristles on every axis, reversing."""
    effects = friction(STIFF, 3)
    reference = sines(300, 8.0)
    return {
        m: axisight.simulate(ARM, reference, effects=effects, method=m, tolerance=1e-4)
        for m in CONTROLLED
    }


def test_implicit_methods_complete_on_stiff_friction_and_agree(
    stiff_arm: dict[str, xr.Dataset],
) -> None:
    base = stiff_arm["radau5"]
    for method in IMPLICIT:
        run = stiff_arm[method]
        assert run.attrs["status"] == "completed", method
        off = float(np.abs(run["torque_cmd_nm"] - base["torque_cmd_nm"]).max())
        assert off < torque_bound(1e-4, 8.0), method
    soft = axisight.simulate(ARM, sines(300, 8.0), effects=friction(SOFT, 3))
    assert np.abs(soft["torque_cmd_nm"] - base["torque_cmd_nm"]).max() > torque_bound(1e-4, 8.0)


def test_explicit_method_gives_up_where_implicit_ones_are_cheap(
    stiff_arm: dict[str, xr.Dataset],
) -> None:
    explicit, implicit = stiff_arm["dopri5"], stiff_arm["radau5"]
    assert explicit.attrs["status"] == "step_size_collapsed"
    assert explicit.attrs["stopped_at"] < 50
    per_sample = explicit.attrs["right_hand_sides"] / explicit.sizes["time"]
    assert per_sample > 100 * implicit.attrs["right_hand_sides"] / implicit.sizes["time"]
    # Up to there it was right.
    n = explicit.sizes["time"]
    off = np.abs(explicit["torque_cmd_nm"].values - implicit["torque_cmd_nm"].values[:n])
    assert off.max() < torque_bound(1e-4, 8.0)


def test_automatic_method_switches_on_the_stiff_plant_only(
    stiff_arm: dict[str, xr.Dataset],
) -> None:
    switched = stiff_arm["auto"].attrs
    # Explicit at first: some samples must point to stiffness before it goes over.
    assert 200 < switched["implicit_samples"] < 300
    assert switched["jacobians"] > 0
    smooth = [axisight.simulate(ARM, sines(300, 8.0), method=m) for m in ("auto", "dopri5")]
    assert smooth[0].attrs["implicit_samples"] == smooth[0].attrs["jacobians"] == 0
    assert np.array_equal(smooth[0]["torque_cmd_nm"], smooth[1]["torque_cmd_nm"])


# A reversal of stiff bristles takes a millionth of a sample.
@pytest.mark.parametrize("method", IMPLICIT)
def test_stiff_friction_at_the_default_tolerance(method: str) -> None:
    run = axisight.simulate(TWO_MASSES, TURNING, effects=friction(STIFF), method=method)
    assert run.attrs["status"] == "completed"


@pytest.mark.parametrize("method", IMPLICIT)
@pytest.mark.parametrize("speed", [0.5, -2.0, 5.0])
def test_steady_sliding_is_the_stribeck_curve(method: str, speed: float) -> None:
    """z = g(w) sign(w): the friction is F_c g(w), the command that and F_v w."""
    tolerance = 1e-5
    # A smooth start, over several periods of the elastic mode, which decays at 1.6 / s only.
    start = np.clip(np.arange(2000) / 1400, 0, 1)
    reference = speed * (start - np.sin(2 * np.pi * start) / (2 * np.pi))
    run = axisight.simulate(
        TWO_MASSES,
        reference,
        # Without bristle damping, which multiplies what is left of z by w T_b / delta.
        effects=friction(replace(STIFF, bristle_time_s=0.0)),
        method=method,
        tolerance=tolerance,
    )
    angle = positions(run)[:, 0]
    late = slice(-401, -1)
    got = (angle[2:] - angle[:-2])[-400:] / (2 * SAMPLE_TIME_S)
    # Nearly constant; the curve is read at the speed there is.
    assert got == pytest.approx(speed, rel=1e-2)
    level = STIFF.coulomb_nm * np.array([STIFF.level(w) for w in got]) * np.sign(got)
    friction_nm = run["torque_disturbance_nm"].values[late, 0]
    assert friction_nm == pytest.approx(-level, rel=10 * tolerance)
    # What is left of the torque changes the momentum of motor and link, whose mode still swings.
    left = run["torque_cmd_nm"].values[late, 0] - VISCOUS * got - level
    link = np.gradient(run["joint_position_rad"].values[:, 0], SAMPLE_TIME_S)[late]
    momentum = MOTOR_INERTIA * got + RATIO * LINK_INERTIA * link
    gained = (momentum[-1] - momentum[0]) / (399 * SAMPLE_TIME_S)
    # Torques are held from one sample to the next: the ends are half a sample in doubt.
    assert left.mean() == pytest.approx(gained, abs=np.ptp(left) / 400 + 1e-4 * abs(level[0]))


@pytest.mark.parametrize("method", ["dopri5", "radau5", "rodas4"])
@pytest.mark.parametrize("torque_nm", [1e-4, 1e-2, 0.2])
def test_bristles_bend_before_they_slip(method: str, torque_nm: float) -> None:
    """Slow one-way motion: z' = (1 - z / s) phi' / delta, a spring F_c / delta at first."""
    n = 2000
    torque = torque_nm * (1 - np.cos(np.pi * np.arange(n) / (n - 1))) / 2
    parameters = replace(SOFT, bristle_time_s=0.0)
    run = axisight.simulate(
        TWO_MASSES,
        torque_nm=torque,
        effects=friction(parameters),
        method=method,
        tolerance=1e-8,
    )
    angle = positions(run)[:, 0]
    # Rounding apart, the motor never turns back.
    assert np.diff(angle).min() > -1e-15
    friction_nm = run["torque_disturbance_nm"].values[:, 0]
    slip = parameters.static_ratio * parameters.presliding_rad
    level = parameters.coulomb_nm * parameters.static_ratio
    # So slow that the Stribeck hump is full: (w / v_s)^2 is its loss.
    fastest = np.diff(angle).max() / SAMPLE_TIME_S
    share = (fastest / parameters.stribeck_speed_rad_s) ** 2
    # States below 1e-3 are held to 1e-8 of that, 1e-11 rad of angle on the spring, per step.
    floor = 1e-11 * parameters.coulomb_nm / parameters.presliding_rad
    bound = floor + (share + 1e-8) * torque_nm
    assert np.abs(friction_nm + level * (1 - np.exp(-angle / slip))).max() < bound
    stiffness = -friction_nm[-1] / angle[-1]
    bent = angle[-1] / slip
    spring = parameters.coulomb_nm / parameters.presliding_rad
    # (1 - e^-x) / x to second order in x.
    want = spring * (1 - bent / 2 + bent**2 / 6)
    assert stiffness == pytest.approx(want, abs=spring * (bent**3 / 24 + 1e-6))


@pytest.mark.parametrize("method", ["radau5", "rodas4"])
@pytest.mark.parametrize(
    "effect",
    [
        Effect("backlash", 1, {"half_width_rad": 3e-4}),
        Effect("coulomb_friction", 1, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.01}),
    ],
    ids=lambda e: e.name,
)
def test_implicit_methods_keep_the_tolerance_behind_corners(method: str, effect: Effect) -> None:
    """The Jacobian changes at once there; an iteration that trusts the old one is far off.

    The local error is held in each step and the damped loop forgets: the run's error is of
    the size of the tolerance. Some 20 corners a second stand for the factor.
    """
    reference = 40.0 * np.sin(2 * np.pi * 3 * np.arange(1000) * TWO_MASSES.sample_time_s)

    def position(**options: object) -> np.ndarray:
        run = axisight.simulate(TWO_MASSES, reference, effects=[effect], **options)
        assert run.attrs["status"] == "completed"
        return np.asarray(run["motor_position_rad"])

    exact = position(method="rk4", substeps=512)
    for tolerance in (1e-5, 1e-7):
        off = position(method=method, tolerance=tolerance) - exact
        assert np.sqrt(np.mean(off**2)) < 20 * tolerance * np.std(exact)

"""The chain of masses against other integrators and its derivatives against differences."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import axisight
from axis_data import RATIO, SAMPLE_S, TRUTH, TWO, torque
from axisight import _core
from axisight.errors import InputError
from axisight.graybox import AxisData, AxisModel


def rate(x, u, p, sign):
    """Thesis (9.9), written from the paper."""
    x1, x2, x3 = x
    slide = RATIO * x2 - x3
    spring = p["k1"] * x1 + p["k3"] * x1**3
    motor = u - p["F_v"] * x2 - p["F_c"] * sign - RATIO * (p["d"] * slide + spring)
    return np.array([slide, motor / p["J_m"], (p["d"] * slide + spring) / p["J_a"]])


def drive(x, u, p):
    """Torque on a motor at rest but for its friction."""
    return u - RATIO * (p["d"] * -x[2] + p["k1"] * x[0] + p["k3"] * x[0] ** 3)


def held(fun, x, span, **options):
    return solve_ivp(fun, span, x, method="DOP853", rtol=1e-11, atol=1e-14, **options)


def stick_slip(u, p):
    """Motor speed at the samples by SciPy with its event search; the sign is exact."""
    x, out = np.zeros(3), []
    for torque_nm in u:
        out.append(x[1])
        t, rest = 0.0, SAMPLE_S
        while t < rest:
            force = drive(x, torque_nm, p)
            if x[1] == 0 and abs(force) <= p["F_c"]:

                def fun(_, y, u=torque_nm):
                    return rate(y, u, p, 0.0) * [1, 0, 1]

                def event(_, y, u=torque_nm):
                    return p["F_c"] - abs(drive(y, u, p))
            else:
                sign = np.sign(x[1]) if x[1] != 0 else np.sign(force)

                def fun(_, y, u=torque_nm, s=sign):
                    return rate(y, u, p, s)

                def event(t, y, s=sign, begin=t):
                    return y[1] * s if t > begin else 1.0

            event.terminal, event.direction = True, -1
            found = held(fun, x, (t, rest), events=event)
            slips = fun.__defaults__ is not None and len(fun.__defaults__) == 2
            t, x = found.t[-1], found.y[:, -1]
            if found.status == 1 and slips:
                x[1] = 0.0
            elif found.status == 1:
                # Just beyond the friction, so that the next part slips.
                x[1] = 1e-12 * np.sign(drive(x, torque_nm, p))
    return np.array(out)


def test_smooth_friction_agrees_with_scipy():
    # One step of 0.5 ms errs by (h w)^5 / 120 per step, w = 130 rad/s the fastest mode (the
    # motor on the spring): 1e-8 of the speed, over 300 steps below 3e-6; friction smoothed over
    # 1 rad/s has a rate of 53/s, which is slower.
    model = AxisModel(gear_ratio=RATIO, friction_smoothing_rad_s=1.0)
    u, x, wanted = torque(300, 1), np.zeros(3), []
    for value in u:
        wanted.append(x)
        fun = lambda _, y, u=value: rate(y, u, TRUTH, np.tanh(y[1]))  # noqa: E731
        x = held(fun, x, (0, SAMPLE_S)).y[:, -1]
    wanted = np.array(wanted)
    states = model.simulate(TRUTH, u, SAMPLE_S).states
    for place, name in enumerate(("deflection", "speed_m", "speed_a")):
        error = states.sel(state=name).values - wanted[:, place]
        assert np.abs(error).max() < 3e-6 * np.abs(wanted[:, place]).max(), name


def test_sign_of_friction_agrees_with_event_search_of_scipy():
    # Gentle steps: the motor sticks, breaks loose and turns back several times.
    u = torque(400, 3, size=1.2)
    speed = TWO.simulate(TRUTH, u, SAMPLE_S).output.values
    wanted = stick_slip(u, TRUTH)
    assert 50 < np.count_nonzero(wanted == 0) < 350
    assert np.count_nonzero(np.diff(np.sign(wanted[wanted != 0]))) >= 2
    # As above; SciPy's instants are good to 4 eps of the time, nothing in comparison.
    assert np.abs(speed - wanted).max() < 3e-6 * np.abs(wanted).max()


@pytest.mark.parametrize("friction", [0.0, 1.0])
def test_ramps_of_torque_are_those_of_fine_steps(friction):
    """Held in 100 steps at their middles, the torque errs by (1 / 100)^2 / 24 of its change in a
    sample, 6e-6; friction by sign changes regime within samples."""
    model = AxisModel(gear_ratio=RATIO, hold="first", friction_smoothing_rad_s=friction)
    u = 1.2 * np.convolve(torque(440, 3, size=1.0), np.ones(41) / 41, "valid")
    speed = model.simulate(TRUTH, u, SAMPLE_S).output.values
    middles = (np.arange(100) + 0.5) / 100
    fine = (u[:-1, None] + np.diff(u)[:, None] * middles).ravel()
    held_model = AxisModel(gear_ratio=RATIO, friction_smoothing_rad_s=friction)
    wanted = held_model.simulate(TRUTH, fine, SAMPLE_S / 100).output.values[::100]
    assert np.count_nonzero(np.diff(np.sign(wanted[wanted != 0]))) >= 1
    assert np.abs(speed[:-1] - wanted).max() < 1e-5 * np.abs(wanted).max()


def test_backlash_is_that_of_the_effect():
    # The gap with its rounded edge, by the general simulator. Steps of 1/16 sample follow the edge.
    robot = axisight.load_robot("two_mass_axis")
    u = torque(600, 5)
    gap = axisight.Effect("backlash", 1, {"half_width_rad": 2e-4})
    general = axisight.simulate(robot, torque_nm=u[:, None], effects=[gap], tolerance=1e-10)
    model = AxisModel(
        gear_ratio=0.004458314757021846,
        backlash=True,
        friction_smoothing_rad_s=0.01,
        output="position",
        substeps=16,
    )
    found = model.simulate({**TRUTH, "b": 2e-4}, u, SAMPLE_S).output.values
    motor = general.motor_position_rad.values[:, 0]
    without = model.simulate({**TRUTH, "b": 0.0}, u, SAMPLE_S).output.values
    error = np.abs(found - motor).max()
    assert error < 1e-5 * np.abs(motor).max()
    assert error < 1e-2 * np.abs(without - motor).max()


def test_agrees_with_the_general_simulator_on_the_preset():
    robot = axisight.load_robot("two_mass_axis")
    u = torque(2000, 5)
    general = axisight.simulate(robot, torque_nm=u[:, None], tolerance=1e-10)
    # Smoothing over 0.01 rad/s has a rate of 5,300/s, which asks for short steps.
    model = AxisModel(
        gear_ratio=0.004458314757021846,
        friction_smoothing_rad_s=0.01,
        output="position",
        substeps=16,
    )
    states = model.simulate(TRUTH, u, SAMPLE_S).states
    motor = general.motor_position_rad.values[:, 0]
    assert np.abs(motor).max() > 1
    assert np.abs(states.sel(state="angle_m").values - motor).max() < 1e-5 * np.abs(motor).max()
    joint = general.joint_position_rad.values[:, 0]
    angle = model.gear_ratio * states.sel(state="angle_m") - states.sel(state="deflection")
    assert np.abs(angle.values - joint).max() < 1e-5 * np.abs(joint).max()


def test_energy_of_three_masses_is_conserved():
    model = AxisModel(n_masses=3, gear_ratio=0.01, cubic=(True, True))
    p = {"J_m": 0.01, "J_a": 60.0, "J_a2": 40.0, "k1": 2e5, "k3": 3e8, "k1_2": 1e5, "k3_2": 2e8}
    start = [0.0, 0.02, -0.01, 20.0, 0.1, -0.2]
    states = model.simulate(p, np.zeros(4000), SAMPLE_S, start=start).states.values
    _, x1, x2, w, v1, v2 = states.T
    energy = 0.5 * (p["J_m"] * w**2 + p["J_a"] * v1**2 + p["J_a2"] * v2**2)
    energy += 0.5 * p["k1"] * x1**2 + 0.25 * p["k3"] * x1**4
    energy += 0.5 * p["k1_2"] * x2**2 + 0.25 * p["k3_2"] * x2**4
    # Fastest mode 122 rad/s with the cubic term at its largest deflection: Runge-Kutta loses
    # (h w)^6 / 72 per step, 7e-10, in 4,000 steps at most 3e-6.
    assert np.abs(energy / energy[0] - 1).max() < 3e-6
    momentum = p["J_m"] * w / model.gear_ratio + p["J_a"] * v1 + p["J_a2"] * v2
    assert np.abs(momentum - momentum[0]).max() < 1e-11 * np.abs(p["J_a"] * v1).max()


EXTRA = {"b": 2e-4, "F_s": 0.3, "v_s": 4.0, "F_a": 0.002, "u_0": 0.1, "a_6": 0.2, "b_6": -0.1}
STRUCTURES = {
    "two masses": (TWO, TRUTH),
    "smoothed": (AxisModel(gear_ratio=RATIO, friction_smoothing_rad_s=0.5), TRUTH),
    "everything": (
        AxisModel(
            gear_ratio=RATIO,
            stribeck=True,
            viscous_asymmetry=True,
            torque_offset=True,
            backlash=True,
            ripple_orders=(6,),
            output="position",
            hold="first",
            substeps=2,
        ),
        {**TRUTH, **EXTRA},
    ),
    "three masses": (
        AxisModel(n_masses=3, gear_ratio=RATIO, output="velocity_difference"),
        {**TRUTH, "J_a": 700.0, "J_a2": 430.0, "k1_2": 3e6, "d_2": 1e3},
    ),
    "four masses": (
        AxisModel(n_masses=4, gear_ratio=RATIO, cubic=(True, False, True)),
        {**TRUTH, "J_a2": 430.0, "k1_2": 3e6, "J_a3": 100.0, "k1_3": 9e5, "k3_3": 1e9},
    ),
}


@pytest.mark.parametrize("predicts", [False, True])
@pytest.mark.parametrize("name", STRUCTURES)
def test_derivatives_agree_with_differences(name, predicts):
    model, values = STRUCTURES[name]
    n, springs = model.n_masses, model.n_masses - 1
    u = torque(600, 2)
    gains = [*[-1e-6] * springs, 0.02, *[1e-4] * springs]
    start = [0.3, *[1e-4] * springs, 2.0, *[0.01] * springs]
    theta = np.array([*model.vector(model.complete(values), gains), *start])
    data = AxisData(u, np.cos(np.arange(600) / 50), np.zeros(600), sample_time_s=SAMPLE_S)
    shared = len(theta) - 2 * n
    used = [*model.places().values(), *range(shared, len(theta))]
    if predicts:
        used += range(shared - model.n_gains(), shared)

    def residual(vector, free=()):
        return _core.axis_linearize(
            model.core(),
            [data.core(model)],
            vector.tolist(),
            list(free),
            whitening=[0.3, -0.2],
            predicts=predicts,
        )

    # Where a parameter is zero, what a natural size is.
    natural = {"d": 1e3, "d_2": 1e3, "d_3": 1e3, "k3": 1e10}
    size = np.abs(theta)
    for parameter, place in model.places().items():
        size[place] = max(size[place], natural.get(parameter, 0.0))
    _, jacobian = residual(theta, used)
    for place, row in zip(used, jacobian, strict=True):
        # The best step of a central difference is the cube root of the rounding; its error is
        # the square of the step. An instant at which the sign changes moves by the order of the
        # step, from one side of a stage of the integrator to the other: 1e-4.
        step = np.zeros_like(theta)
        step[place] = 3e-6 * size[place]
        difference = (residual(theta + step)[0] - residual(theta - step)[0]) / (2 * step[place])
        assert np.abs(row - difference).max() < 2e-4 * np.abs(difference).max() + 1e-12, place


def test_ripple_and_offset_move_an_axis_as_torque_does():
    # Identity: a torque offset is the same as adding it to the torque; ripple of a motor that
    # does not move is the offset of its phase.
    model = AxisModel(gear_ratio=RATIO, torque_offset=True, ripple_orders=(2,))
    u = torque(500, 4)
    plain = TWO.simulate(TRUTH, u + 0.4, SAMPLE_S).output.values
    same = model.simulate({**TRUTH, "u_0": 0.4}, u, SAMPLE_S).output.values
    assert np.abs(plain - same).max() < 1e-12 * np.abs(plain).max()
    quiet = np.full(20, 0.1)
    start = [np.pi / 4, 0, 0, 0, 0]
    rest = {**TRUTH, "F_c": 5.0, "a_2": 3.0, "b_2": 4.5}
    stuck = model.simulate(rest, quiet, SAMPLE_S, start=[*start[:1], 0, 0, 0]).output.values
    assert np.all(stuck == 0)
    loose = model.simulate({**rest, "b_2": 5.5}, quiet, SAMPLE_S, start=[*start[:1], 0, 0, 0])
    assert loose.output.values[-1] > 0


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"n_masses": 1}, "n_masses: expected a whole number from 2 to 4, got 1"),
        ({"n_masses": 2.0}, "n_masses: expected a whole number"),
        ({"gear_ratio": -RATIO}, "gear_ratio: expected a positive number"),
        ({"gear_ratio": np.nan}, "gear_ratio"),
        ({"cubic": (True, False)}, "cubic: expected 1 flags"),
        ({"friction_smoothing_rad_s": -1.0}, "friction_smoothing_rad_s"),
        ({"ripple_orders": (3, 3)}, "ripple_orders: expected different positive orders"),
        ({"output": "speed"}, "output: expected one of velocity"),
        ({"substeps": 0}, "substeps"),
    ],
)
def test_structures_that_make_no_sense(options, text):
    with pytest.raises(InputError, match=text):
        AxisModel(**options)


def test_simulation_refuses_what_it_cannot_do():
    u = np.zeros(10)
    for values, text in (
        ({**TRUTH, "K": 1.0}, "got K"),
        ({"J_m": 0.01}, "expected a value of J_a"),
        ({**TRUTH, "J_m": -0.01}, "J_m .inertia of mass 1.: expected a positive number"),
        ({**TRUTH, "d": -1.0}, "d .damping of spring 1.: expected at least 0"),
        ({**TRUTH, "k1": np.inf}, "k1: expected a finite number"),
        ({**TRUTH, "k1": "stiff"}, "k1: expected a number"),
    ):
        with pytest.raises(InputError, match=text):
            TWO.simulate(values, u, SAMPLE_S)
    with pytest.raises(InputError, match="torque_nm: expected finite numbers, got nan at sample 3"):
        TWO.simulate(TRUTH, np.where(np.arange(10) == 3, np.nan, 0.0), SAMPLE_S)
    with pytest.raises(InputError, match="start: expected 4 numbers"):
        TWO.simulate(TRUTH, u, SAMPLE_S, start=[0.0])
    with pytest.raises(InputError, match="diverges at sample"):
        TWO.simulate({**TRUTH, "k3": -1e15}, torque(2000, 1), SAMPLE_S)

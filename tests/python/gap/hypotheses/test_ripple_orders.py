"""Orders of the motor angle in residuals."""

import numpy as np
import pytest

from axisight import Effect, Settings, diagnose, load_robot, simulate
from axisight.gap.controller.feedback import controller_response, loop_responses, periodic_response
from axisight.gap.hypotheses.ripple_orders import Turning, strongest_orders, turning
from gap_data import bare_axis, log_of

T = 4e-3
N = 2500


def turned(residual, scale: float = 3.0) -> Turning:
    time = np.arange(N) * T
    angle = scale * time + 0.5 * np.sin(time)
    return Turning(residual, angle, np.gradient(angle, T), T)


def flat(log: Turning):
    return np.ones(len(log.frequency_hz), dtype=complex)


def test_orders_are_found_in_a_noisy_ripple_strongest_first():
    rng = np.random.default_rng(7)
    angle = turned(np.zeros(N)).angle_rad
    ripple = 0.2 * np.cos(7 * angle + 1) + 0.1 * np.sin(18 * angle)
    log = turned(ripple + 0.2 * rng.normal(size=N))
    assert strongest_orders([log], [flat(log)], count=4) == [7, 18]
    assert strongest_orders([log], [flat(log)], count=1) == [7]


def test_noise_alone_has_no_order():
    rng = np.random.default_rng(8)
    log = turned(rng.normal(size=N))
    assert strongest_orders([log], [flat(log)], count=3) == []


def swinging(turns: float, residual_of) -> Turning:
    """A motor that swings over a part of a turn."""
    time = np.arange(N) * T
    angle = np.pi * turns * np.sin(0.7 * time)
    return Turning(residual_of(angle), angle, np.gradient(angle, T), T)


def test_orders_that_the_travel_does_not_resolve_are_left_out():
    """Over a tenth of a turn, waves of order 1 may be a spring, and those of 40 and 45 differ by half a wave."""
    slow = swinging(0.1, lambda angle: np.cos(angle + 0.3))
    assert strongest_orders([slow], [flat(slow)], count=1)[0] < 10
    assert strongest_orders([slow], [flat(slow)], count=3, least_waves=1.0) == []
    both = swinging(0.1, lambda angle: np.cos(40 * angle) + 0.6 * np.sin(45 * angle))
    (first, *others) = strongest_orders([both], [flat(both)], count=3, least_waves=1.0)
    assert abs(first - 40) <= 5
    assert all(abs(other - first) >= 10 for other in others)


def test_a_ripple_is_found_beside_what_the_travel_does_not_resolve():
    mixed = swinging(0.3, lambda angle: np.cos(angle) + 0.2 * np.cos(24 * angle + 1.0))
    found = strongest_orders([mixed], [flat(mixed)], count=3, least_waves=1.0)
    assert 24 in found
    assert min(found) >= 4


@pytest.mark.parametrize(("order", "turns"), [(2, 0.9), (2, 0.6), (1, 1.5)])
def test_low_orders_on_a_travel_that_resolves_them_are_found(order: int, turns: float):
    rng = np.random.default_rng(4)
    log = swinging(turns, lambda angle: np.cos(order * angle + 0.4) + 0.02 * rng.normal(size=N))
    assert strongest_orders([log], [flat(log)], count=1, least_waves=1.0) == [order]


def test_logs_share_amplitude_and_phase():
    """What cancels over the logs is no ripple of the machine, however strong in each."""
    angle = turned(np.zeros(N)).angle_rad
    here, there = turned(np.cos(5 * angle)), turned(-np.cos(5 * angle))
    assert strongest_orders([here, there], [flat(here)] * 2, count=1) == []
    assert strongest_orders([here, here], [flat(here)] * 2, count=1) == [5]


def test_orders_are_seen_through_the_response():
    """A second late, at changing speed, a wave of the angle is none of the residual."""
    empty = turned(np.zeros(N))
    late = np.exp(-2j * np.pi * empty.frequency_hz * 1.0)
    log = turned(np.fft.irfft(late * (empty.spectra[23] + 0.5 * empty.spectra[4]), N))
    assert strongest_orders([log], [late], count=2) == [24, 5]
    assert strongest_orders([log], [flat(log)], count=2) != [24, 5]


def test_what_a_bent_parameter_took_up_does_not_hide_an_order():
    """A slow swing: the rate and the curve of the angle take up most of its ripple of order 6, and 5 seems stronger."""
    swing = swinging(0.8, lambda angle: np.cos(6 * angle + 0.3))
    own = np.stack([swing.speed_rad_s, np.gradient(swing.speed_rad_s, T), swing.angle_rad])
    took = np.linalg.lstsq(own.T, swing.residual, rcond=None)[0]
    # What a fit in closed loop takes up may be many times the least squares of this residual.
    bent = swing.leaving(swing.residual - 20.0 * took @ own)
    assert strongest_orders([bent], [flat(bent)], count=1) != [6]
    told = swing.leaving(bent.residual, own)
    assert strongest_orders([told], [flat(told)], count=1) == [6]


def test_a_slow_ripple_is_found_although_own_parameters_went_to_their_bounds():
    """It moves a light axis so slowly that masses, friction and gains all bend towards it."""
    robot = bare_axis()
    ripple = Effect("torque_ripple", 1, {"order_1": 6.0, "cosine_1_nm": 0.4, "sine_1_nm": 0.3})
    time = np.arange(int(6.0 / robot.sample_time_s)) * robot.sample_time_s
    logs = [
        log_of(
            robot,
            [ripple],
            (5.0 * np.sin(2 * np.pi * f * time) * np.minimum(time, 1.0))[:, None],
            run,
        )
        for run, f in enumerate((0.3, 0.4, 0.5, 0.35))
    ]
    said = diagnose(robot, logs[:3], validation=logs[3:], settings=Settings(threads=1))
    assert said.verdict == "explained"
    assert [c.label for c in said.causes] == ["torque_ripple@1"]
    assert said.causes[0].parameters["order_1"].value == 6.0


@pytest.mark.parametrize("n", [N, N - 1])
def test_products_of_waves_are_those_of_their_series(n: int):
    """Normal equations from spectra against the series themselves, which the response has passed."""
    rng = np.random.default_rng(11)
    whole = turned(np.zeros(N))
    log = Turning(rng.normal(size=n), whole.angle_rad[:n], whole.speed_rad_s[:n], T)
    response = 1.0 / (1.0 + 0.3j * log.frequency_hz)
    if n % 2 == 0:
        response[-1] = 0.0
    spectra = log.spectra * response
    spectra[:, 0] = 0.0
    series = np.fft.irfft(spectra, n)
    normal, along = series @ series.T, series @ log.residual
    assert log.normal(response) == pytest.approx(normal, abs=1e-12 * normal.max())
    assert log.along(response, log.residual) == pytest.approx(
        along, abs=1e-12 * np.abs(along).max()
    )


def test_what_is_known_of_waves_is_kept_for_another_residual():
    """It is taken once for all models of a search."""
    log = turned(np.zeros(N))
    known = log.normal(flat(log))
    assert log.leaving(np.ones(N)).normal(flat(log)) is known


def test_a_decimated_residual_stands_in_the_middle_of_its_samples():
    """Against the full log mirrored at its ends, order 30 keeps its phase only so."""
    full, factor = 5e-4, 8
    time = np.arange(N * factor) * full
    angle = 4 * time
    speed = np.full_like(angle, 4.0)
    centre = angle.reshape(-1, factor).mean(axis=1)
    log = turning(np.cos(30 * centre), angle, speed, full, factor)
    assert log.later_s == pytest.approx(3.5 * full)
    wave = np.fft.irfft(log.spectra[29], N)
    inside = slice(200, -200)  # where it does not fade
    np.testing.assert_allclose(wave[inside], log.residual[inside], atol=0.02)


@pytest.mark.parametrize("name", ["two_mass_axis", "irb6600_like"])
def test_the_controller_is_that_of_the_simulation(name):
    """A sine of the sensor on a motor at rest: what the controller answers is its response."""
    robot = load_robot(name).with_effects([])
    n, size = 8192, 1e-7
    line = 64
    f = line / (n * robot.sample_time_s)
    wave = np.zeros((n, robot.n_axes))
    wave[:, 0] = size * np.sin(2 * np.pi * line * np.arange(n) / n)
    out = simulate(robot, np.zeros((n, robot.n_axes)), noise=wave, method="rk4")
    command = out.torque_cmd_nm.values[:, 0]
    seen = out.position_rad.values[:, 0]
    half = slice(n // 2, n)
    u, y = (np.fft.fft(x[half])[line // 2] for x in (command, seen))
    (response,) = controller_response(robot, np.array([f]))[:, 0, 0]
    assert -u / y == pytest.approx(response, rel=2e-3)


EVEN = 2 * np.pi * 5.0
"""Speed of a motor that turns five times a second."""
AT_ONE_SPEED = {
    "torque_ripple": ("cosine_1_nm", "order_1", 1e-3),
    "resolver_ripple": ("cosine_1_rad", "order_1", 1e-6),
    "transmission_error": ("cosine_rad", "order", 1e-7),
}


@pytest.mark.parametrize("order", [1, 4])
@pytest.mark.parametrize("effect", AT_ONE_SPEED)
@pytest.mark.parametrize("name", ["two_mass_axis", "irb6600_like"])
def test_what_repeats_with_the_angle_shows_as_its_response_says(name: str, effect: str, order: int):
    """At one speed it is a sine: the command with it less that without, line by line, in a full simulation.

    Its size is small, so that the second order, which is left out, is below a thousandth.
    """
    robot = load_robot(name).with_effects([])
    n = round(8.0 / robot.sample_time_s)
    reference = np.zeros((n, robot.n_axes))
    time = np.arange(n) * robot.sample_time_s
    reference[:, 0] = EVEN * np.minimum(time, 1.0)
    wave, number, size = AT_ONE_SPEED[effect]
    ripple = Effect(effect, 1, {number: float(order), wave: size})
    runs = [simulate(robot, reference, effects=e, method="rk4") for e in ([], [ripple])]
    # Two whole seconds, once all has settled.
    half = slice(3 * n // 4, n)
    less, more = (run.torque_cmd_nm.values[half, 0] for run in runs)
    angle = runs[0].motor_position_rad.values[half, 0]
    line = round(2.0 * order * EVEN / (2 * np.pi))
    seen = np.fft.fft(more - less)[line] / np.fft.fft(size * np.cos(order * angle))[line]
    frequency_hz = np.array([0.5 * line])
    loops = loop_responses(robot, frequency_hz)
    (response,) = periodic_response(robot, effect, 0, loops, frequency_hz)
    # A torque on the motor is taken off by the controller; held commands come half a sample later.
    assert abs(seen) == pytest.approx(abs(response), rel=0.02)
    late = 2 * np.pi * frequency_hz[0] * robot.sample_time_s
    assert abs(np.angle(-seen / response)) < 2 * late + 0.03
